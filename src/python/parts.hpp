// Parts of the extension module, a file each, and what they share.
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <optional>
#include <string>

namespace trocar::python {

namespace py = pybind11;

void add_world(py::module_& module);       ///< topology, frames, materials
void add_detection(py::module_& module);   ///< detect, detectors one call at a time
void add_simulation(py::module_& module);  ///< runs, ticks, records
void add_methods(py::module_& module);     ///< methods written in Python
void add_program(py::module_& module);     ///< the command line

/// Releases the interpreter's lock during a computation. No method may be registered meanwhile.
class Computing {
public:
    static bool is_any() { return Counted::count > 0; }

private:
    struct Counted {
        Counted() { ++count; }
        ~Counted() { --count; }
        Counted(const Counted&) = delete;
        Counted& operator=(const Counted&) = delete;
        Counted(Counted&&) = delete;
        Counted& operator=(Counted&&) = delete;
        static inline int count = 0;
    };
    Counted counted_;  ///< first, so that it changes under the lock
    py::gil_scoped_release released_;
};

/// The folder given, else $TROCAR_DATA.
std::optional<std::filesystem::path> data_folder(const std::optional<std::filesystem::path>& given);

}  // namespace trocar::python
