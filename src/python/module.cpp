// The extension module `_trocar`. The Python package around it checks and documents; see docs/PYTHON.md.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "app/program.hpp"
#include "app/shipped.hpp"
#include "geometry/input_error.hpp"
#include "python/parts.hpp"

namespace trocar::python {
namespace {

/// Runs the command line with the interpreter's lock, which methods in Python take again. `command`: starts it again.
int run_program(std::vector<std::string> words, const std::filesystem::path& share,
                const std::vector<std::string>& command) {
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    return app::run_program(static_cast<int>(words.size()), arguments.data(), share, command);
}

}  // namespace

void add_program(py::module_& module) {
    module.def("run_program", &run_program, py::arg("words"), py::arg("share"), py::arg("command"));
    module.def("add_shipped_root", &app::add_shipped_root, py::arg("root"));
    module.def("find_study", &app::find_study, py::arg("name"));
}

}  // namespace trocar::python

PYBIND11_MODULE(_trocar, module) {
    using namespace trocar::python;
    py::register_exception<trocar::InputError>(module, "InputError", PyExc_ValueError);
    module.attr("__version__") = TROCAR_VERSION;
    add_world(module);
    add_detection(module);
    add_simulation(module);
    add_methods(module);
    add_program(module);
}
