// The extension module `_contract`: the contract tests on the methods that joined from Python.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "contract/contract_program.hpp"

namespace {

int run_contract_tests(std::vector<std::string> words, const std::filesystem::path& share) {
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    return trocar::test::run_contract_tests(static_cast<int>(words.size()), arguments.data(), share, {});
}

}  // namespace

PYBIND11_MODULE(_contract, module) {
    module.def("run_contract_tests", &run_contract_tests, pybind11::arg("words"), pybind11::arg("share"));
}
