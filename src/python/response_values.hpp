// Answer and solver of a response written in Python: conversion to a ResponseOutput, and the sub-step that solve gets.
#pragma once

#include <pybind11/pybind11.h>

#include "contact/response_output.hpp"
#include "geometry/types.hpp"

namespace trocar::python {

namespace py = pybind11;

/// Fills `output` from the answer of respond: an array of trocar.FORCE_LAW, or a dict with members of ResponseOutput
/// by name. `output` comes cleared and gets no solver. Throws InputError that names the member.
void take_answer(const py::object& answer, Eigen::Index vertex_count, std::size_t body_count, ResponseOutput& output);

/// Calls `solve` of the response with the step, which Python can use until the call returns.
void call_solve(const py::object& response, PredictedStep& step);

void add_step(py::module_& module);

}  // namespace trocar::python
