#include "python/arrays.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "geometry/input_error.hpp"

namespace trocar::python {
namespace {

/// The object as an array of `columns` numbers a row, of one of these kinds ('f' float, 'i' and 'u' integer).
py::array checked_array(const py::object& object, const std::string& name, py::ssize_t columns, std::string_view kinds,
                        const char* numbers) {
    py::array array =
        py::isinstance<py::array>(object) ? py::reinterpret_borrow<py::array>(object) : py::array::ensure(object);
    const auto fail = [&](const std::string& found) {
        PyErr_Clear();
        return InputError(name, "", fmt::format("an array of shape (n, {}) of {}", columns, numbers), found);
    };
    if (!array) throw fail(fmt::format("a {}", Py_TYPE(object.ptr())->tp_name));
    if (array.ndim() != 2 || array.shape(1) != columns) {
        throw fail("shape " + std::string(py::str(array.attr("shape"))));
    }
    if (kinds.find(array.dtype().kind()) == std::string_view::npos) {
        throw fail("type " + std::string(py::str(array.dtype())));
    }
    return array;
}

template <typename Number>
using Rows = py::array_t<Number, py::array::c_style | py::array::forcecast>;

/// The array itself where it has this type and layout, else a converted copy.
template <typename Number>
Rows<Number> rows_of(const py::array& array) {
    if (py::isinstance<Rows<Number>>(array)) return py::reinterpret_borrow<Rows<Number>>(array);
    auto rows = Rows<Number>::ensure(array);
    if (!rows) throw py::error_already_set();
    return rows;
}

/// Integers of a checked array within [0, count). `what`: thing that they number.
template <typename Number>
std::vector<Index> numbers_from(const Rows<Number>& given, const std::string& name, Eigen::Index count,
                                const char* what) {
    std::vector<Index> numbers(static_cast<std::size_t>(given.size()));
    const Number* data = given.data();
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (data[i] < 0 || data[i] >= count) {
            const py::ssize_t row = static_cast<py::ssize_t>(i) / given.shape(1);
            throw InputError(name, fmt::format("row {}", row), fmt::format("{} numbers from 0, below {}", what, count),
                             fmt::format("{}", data[i]));
        }
        numbers[i] = static_cast<Index>(data[i]);
    }
    return numbers;
}

std::vector<Index> numbers_from(const py::array& array, const std::string& name, Eigen::Index count, const char* what) {
    // The two usual types are read where they are.
    if (py::isinstance<Rows<Index>>(array)) return numbers_from(rows_of<Index>(array), name, count, what);
    return numbers_from(rows_of<std::int64_t>(array), name, count, what);
}

/// Structured type of the members that `visit` names on an example of the struct.
template <typename Struct, typename Visit>
py::dtype structured_type(Visit&& visit) {
    const Struct example;
    py::list names;
    py::list formats;
    py::list offsets;
    visit(example, [&](const char* name, const auto& member) {
        names.append(name);
        formats.append(code_of(member));
        offsets.append(offset_in(example, member));
    });
    return py::dtype(names, formats, offsets, sizeof(Struct));
}

}  // namespace

Matrix3X points_from(const py::object& object, const std::string& name) {
    const auto array = rows_of<double>(checked_array(object, name, 3, "fiu", "float64"));
    Matrix3X points = Eigen::Map<const Matrix3X>(array.data(), 3, array.shape(0));
    if (points.allFinite()) return points;
    for (Eigen::Index row = 0;; ++row) {
        for (const double number : points.col(row)) {
            if (std::isfinite(number)) continue;
            throw InputError(name, fmt::format("row {}", row), "finite numbers",
                             std::isnan(number) ? "nan" : fmt::format("{}", number));
        }
    }
}

Triangles triangles_from(const py::object& object, const std::string& name, Eigen::Index vertex_count) {
    const py::array array = checked_array(object, name, 3, "iu", "integers");
    const std::vector<Index> numbers = numbers_from(array, name, vertex_count, "vertex");
    return Eigen::Map<const Triangles>(numbers.data(), 3, array.shape(0));
}

std::vector<TrianglePair> pairs_from(const py::object& object, const std::string& name, Index triangle_count) {
    const py::array array = py::array::ensure(object);
    if (array && array.size() == 0) return {};  // no pair, whatever the type of an empty list
    const std::vector<Index> numbers =
        numbers_from(checked_array(object, name, 2, "iu", "integers"), name, triangle_count, "triangle");
    std::vector<TrianglePair> pairs(numbers.size() / 2);
    for (std::size_t k = 0; k < pairs.size(); ++k) pairs[k] = {numbers[2 * k], numbers[2 * k + 1]};
    return pairs;
}

py::array view_of(const py::dtype& type, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                  const void* data, const py::handle& base) {
    // Without elements there may be no memory, for which NumPy would make some.
    static const std::max_align_t nothing{};
    py::array view(type, std::move(shape), std::move(strides), data != nullptr ? data : &nothing, base);
    py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return view;
}

py::array view_of(const Matrix3X& points, const py::handle& base) {
    return view_of(py::dtype::of<double>(), {points.cols(), 3}, {}, points.data(), base);
}
py::array view_of(const Triangles& triangles, const py::handle& base) {
    return view_of(py::dtype::of<Index>(), {triangles.cols(), 3}, {}, triangles.data(), base);
}
py::array view_of(const std::vector<TrianglePair>& pairs, const py::handle& base) {
    static_assert(sizeof(TrianglePair) == 2 * sizeof(Index));
    return view_of(py::dtype::of<Index>(), {static_cast<py::ssize_t>(pairs.size()), 2}, {}, pairs.data(), base);
}
py::array view_of(const std::vector<Contact>& contacts, const py::handle& base) {
    return view_of(contact_type(), {static_cast<py::ssize_t>(contacts.size())}, {}, contacts.data(), base);
}
py::array view_of(const std::vector<double>& numbers, const py::handle& base) {
    return view_of(py::dtype::of<double>(), {static_cast<py::ssize_t>(numbers.size())}, {}, numbers.data(), base);
}

// The types live as long as the process: the interpreter is gone when static variables are destroyed.
const py::dtype& contact_type() {
    static const auto& type = *new py::dtype(structured_type<Contact>([](const Contact& one, auto&& visit) {
        visit("a", one.a);
        visit("b", one.b);
        visit("kind", one.kind);
        visit("point", one.point);
        visit("normal", one.normal);
        visit("depth", one.depth);
        visit("interval_length", one.interval_length);
        visit("interval_direction", one.interval_direction);
        visit("vertex_a", one.vertex_a);
        visit("vertex_b", one.vertex_b);
        visit("body_a", one.body_a);
        visit("body_b", one.body_b);
        visit("vertices_on_a", one.on_a.vertices);
        visit("weights_on_a", one.on_a.weights);
        visit("vertices_on_b", one.on_b.vertices);
        visit("weights_on_b", one.on_b.weights);
        visit("gap", one.gap);
        visit("approach", one.approach);
        visit("side", one.side);
        visit("id", one.id);
    }));
    return type;
}

const py::dtype& force_law_type() {
    static const auto& type = *new py::dtype(structured_type<ContactForceLaw>([](const auto& one, auto&& visit) {
        visit("role", one.role);
        visit("source_id", one.source_id);
        visit("vertices", one.vertices);
        visit("weights", one.weights);
        visit("normal", one.normal);
        visit("gap", one.gap);
        visit("k", one.k);
        visit("mu", one.mu);
        visit("face_velocity", one.face_velocity);
        visit("limit", one.limit);
        visit("adhesive", one.adhesive);
        visit("reaction_body", one.reaction_body);
        visit("reaction_point", one.reaction_point);
        visit("other_point", one.other_point);
        visit("reaction_vertices", one.reaction_vertices);
        visit("reaction_weights", one.reaction_weights);
        visit("friction", one.friction);
        visit("tangent_k", one.tangent_k);
        visit("surface_velocity", one.surface_velocity);
        visit("other_edge", one.other_edge);
        visit("slip_key", one.slip_key);
    }));
    return type;
}

const py::dtype& contact_force_type() {
    static const auto& type = *new py::dtype(structured_type<ContactForce>([](const auto& one, auto&& visit) {
        visit("normal", one.normal);
        visit("friction", one.friction);
        visit("slip", one.slip);
        visit("force", one.force);
        visit("work", one.work);
        visit("at_limit", one.at_limit);
    }));
    return type;
}

const py::dtype& position_correction_type() {
    static const auto& type = *new py::dtype(structured_type<PositionCorrection>([](const auto& one, auto&& visit) {
        visit("vertex", one.vertex);
        visit("position", one.position);
        visit("velocity", one.velocity);
        visit("held", one.held);
    }));
    return type;
}

const py::dtype& solved_contact_type() {
    static const auto& type = *new py::dtype(structured_type<SolvedContact>([](const auto& one, auto&& visit) {
        visit("source", one.source);
        visit("normal", one.normal);
        visit("depth", one.depth);
        visit("count", one.count);
        visit("column", one.column);
        visit("weight", one.weight);
        visit("surface", one.surface);
        visit("mobility", one.mobility);
    }));
    return type;
}

}  // namespace trocar::python
