// Parts of the extension module, a file each, and what they share.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <optional>
#include <string>

#include "app/run_choice.hpp"

namespace trocar::python {

namespace py = pybind11;

void add_world(py::module_& module);       ///< topology, frames, materials
void add_detection(py::module_& module);   ///< detect, detectors one call at a time
void add_simulation(py::module_& module);  ///< runs, ticks, records
void add_methods(py::module_& module);     ///< methods written in Python
void add_program(py::module_& module);     ///< the command line

/// Python's own metaclass instead of pybind11's, which type stubs could not name.
inline py::metaclass plain_class() { return py::metaclass(reinterpret_cast<PyObject*>(&PyType_Type)); }

/// Releases the interpreter's lock during a computation. No method may be registered meanwhile.
class Computing {
public:
    Computing() { ++count_; }
    ~Computing() { --count_; }
    Computing(const Computing&) = delete;
    Computing& operator=(const Computing&) = delete;
    Computing(Computing&&) = delete;
    Computing& operator=(Computing&&) = delete;
    static bool is_any() { return count_ > 0; }

private:
    static inline std::atomic<int> count_ = 0;
    py::gil_scoped_release released_;
};

/// The folder given, else $TROCAR_DATA.
std::optional<std::filesystem::path> data_folder(const std::optional<std::filesystem::path>& given);

}  // namespace trocar::python
