// NumPy arrays: checked input, and read-only views on the project's arrays that copy nothing.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "geometry/types.hpp"

namespace trocar::python {

namespace py = pybind11;

/// Copy of an (N, 3) array of numbers as 3×N. Floating-point and integer types are converted, in any memory layout.
/// Throws InputError that names `name` for another type or shape and for a number that is not finite.
Matrix3X points_from(const py::object& array, const std::string& name);
/// Copy of a (T, 3) array of integers as 3×T. Throws InputError likewise, and for a number that no vertex has.
Triangles triangles_from(const py::object& array, const std::string& name, Eigen::Index vertex_count);
/// Copy of an (n, 2) array of integers. Throws InputError likewise, and for a number that no triangle has.
std::vector<TrianglePair> pairs_from(const py::object& array, const std::string& name, Index triangle_count);

/// Read-only array on memory that `base` keeps alive; no copy. Strides in bytes; empty: C order.
py::array view_of(const py::dtype& type, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                  const void* data, const py::handle& base);
/// 3×N as (N, 3).
py::array view_of(const Matrix3X& points, const py::handle& base);
py::array view_of(const Triangles& triangles, const py::handle& base);
/// (n, 2).
py::array view_of(const std::vector<TrianglePair>& pairs, const py::handle& base);
py::array view_of(const std::vector<Contact>& contacts, const py::handle& base);
py::array view_of(const std::vector<double>& numbers, const py::handle& base);

/// The vector's memory in the array's ownership; no copy.
template <typename T>
py::array array_of(std::vector<T>&& items) {
    auto* kept = new std::vector<T>(std::move(items));
    const py::capsule owner(kept, [](void* pointer) { delete static_cast<std::vector<T>*>(pointer); });
    return view_of(*kept, owner);
}

/// Structured types on the structs of these names: the members by name, Vector3 as (3,) float64.
const py::dtype& contact_type();
const py::dtype& force_law_type();
const py::dtype& contact_force_type();
const py::dtype& position_correction_type();
const py::dtype& solved_contact_type();

/// Type code of a member in NumPy's notation.
inline std::string code_of(const double&) { return "f8"; }
inline std::string code_of(const bool&) { return "?"; }
inline std::string code_of(const std::int32_t&) { return "i4"; }
inline std::string code_of(const std::int64_t&) { return "i8"; }
inline std::string code_of(const std::uint64_t&) { return "u8"; }
inline std::string code_of(const Vector3&) { return "(3,)f8"; }
template <typename Number, std::size_t N>
std::string code_of(const std::array<Number, N>& numbers) {
    return "(" + std::to_string(N) + ",)" + code_of(numbers[0]);
}
template <typename Word, typename = std::enable_if_t<std::is_enum_v<Word> && sizeof(Word) == 1>>
std::string code_of(const Word&) {
    return "u1";
}
/// Bytes from the start of `whole` to its member.
template <typename Whole, typename Member>
std::ptrdiff_t offset_in(const Whole& whole, const Member& member) {
    return reinterpret_cast<const char*>(&member) - reinterpret_cast<const char*>(&whole);
}

}  // namespace trocar::python
