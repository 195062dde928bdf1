#include "python/response_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "geometry/input_error.hpp"
#include "python/arrays.hpp"

namespace trocar::python {
namespace {

InputError wrong(const std::string& where, const std::string& expected, const py::object& found) {
    return {"respond", where, expected, fmt::format("a {}", Py_TYPE(found.ptr())->tp_name)};
}

/// The numbers as float64; null where there is none.
py::array_t<double, py::array::c_style | py::array::forcecast> doubles_from(const py::object& given) {
    auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given);
    PyErr_Clear();
    return array;
}

/// Copies a one-dimensional structured array.
template <typename Item>
std::vector<Item> items_from(const py::object& given, const py::dtype& type, const char* where, const char* expected) {
    const bool fits =
        py::isinstance<py::array>(given) && py::array(given).dtype().equal(type) && py::array(given).ndim() == 1;
    if (!fits) throw wrong(where, expected, given);
    const py::array array = py::array::ensure(given, py::array::c_style);
    std::vector<Item> items(static_cast<std::size_t>(array.size()));
    if (!items.empty()) std::memcpy(static_cast<void*>(items.data()), array.data(), items.size() * sizeof(Item));
    return items;
}

void take_laws(const py::object& given, ResponseOutput& output) {
    output.contacts = items_from<ContactForceLaw>(
        given, force_law_type(), "", "a one-dimensional array of trocar.FORCE_LAW (trocar.force_laws), or a dict");
    for (std::size_t i = 0; i < output.contacts.size(); ++i) {
        const auto role = static_cast<int>(output.contacts[i].role);
        if (role <= static_cast<int>(ContactRole::solved)) continue;
        throw InputError("respond", fmt::format("law {}", i), "a role from 0 to 4", fmt::format("{}", role));
    }
}

void take_held_force(const py::object& given, Eigen::Index vertex_count, ResponseOutput& output) {
    output.held_force = points_from(given, "respond: held_force");
    if (output.held_force.cols() == vertex_count) return;
    throw InputError("respond", "held_force", fmt::format("a row for each of {} vertices", vertex_count),
                     fmt::format("{}", output.held_force.cols()));
}

/// Array of shape (bodies, 6): force (N) and moment (N m) about the world's origin.
void take_wrench(const py::object& given, std::size_t body_count, ResponseOutput& output) {
    const auto array = doubles_from(given);
    const auto bodies = static_cast<py::ssize_t>(body_count);
    if (!array || array.ndim() != 2 || array.shape(0) != bodies || array.shape(1) != 6)
        throw wrong("wrench", fmt::format("an array of shape ({}, 6) of float64", body_count), given);
    output.wrench.resize(body_count);
    for (py::ssize_t body = 0; body < bodies; ++body) {
        const double* row = array.data(body, 0);
        output.wrench[static_cast<std::size_t>(body)] = {.force = {row[0], row[1], row[2]},
                                                         .moment = {row[3], row[4], row[5]}};
    }
}

/// Value of an enum by its word.
template <typename Value, std::size_t N>
Value value_of(const py::object& given, const char* where, const std::array<std::pair<const char*, Value>, N>& words) {
    const std::string word = py::isinstance<py::str>(given) ? std::string(py::str(given)) : "";
    std::string expected;
    for (const auto& [name, value] : words) {
        if (word == name) return value;
        expected += (expected.empty() ? "" : ", ") + std::string(name);
    }
    throw InputError("respond", where, "one of " + expected,
                     word.empty() ? fmt::format("a {}", Py_TYPE(given.ptr())->tp_name) : word);
}

constexpr std::array contact_timings{std::pair{"implicit", ContactTiming::implicit},
                                     std::pair{"at_tick_start", ContactTiming::at_tick_start},
                                     std::pair{"at_substep_start", ContactTiming::at_substep_start}};
constexpr std::array solver_timings{std::pair{"substep", SolverTiming::substep}, std::pair{"held", SolverTiming::held}};

/// Sub-step as Python sees it. The C++ object lives for the time of one call.
class Step {
public:
    explicit Step(PredictedStep& step) : step_(&step) {}
    void end() { step_ = nullptr; }

    [[nodiscard]] PredictedStep& get() const {
        if (step_ == nullptr) throw InputError("a step", "", "its use within the call of solve", "one afterwards");
        return *step_;
    }
    [[nodiscard]] const SolvedContact& contact(py::ssize_t i) const {
        const auto contacts = get().contacts();
        if (i < 0 || i >= static_cast<py::ssize_t>(contacts.size()))
            throw InputError("contact", "", fmt::format("a number from 0, below {}", contacts.size()),
                             fmt::format("{}", i));
        return contacts[static_cast<std::size_t>(i)];
    }

private:
    PredictedStep* step_;
};

py::array_t<double> array_of(const Vector3& vector) { return py::array_t<double>(3, vector.data()); }

Vector3 vector_from(const py::object& given, const char* name) {
    const auto array = doubles_from(given);
    if (!array || array.ndim() != 1 || array.shape(0) != 3)
        throw InputError(name, "", "an array of shape (3,) of float64",
                         fmt::format("a {}", Py_TYPE(given.ptr())->tp_name));
    return Eigen::Map<const Vector3>(array.data());
}

py::array_t<double> velocities_of(const PredictedStep& step) {
    py::array_t<double> all({static_cast<py::ssize_t>(step.columns()), py::ssize_t{3}});
    for (std::size_t i = 0; i < step.columns(); ++i) {
        const Vector3& velocity = step.velocity(static_cast<Index>(i));
        std::copy_n(velocity.data(), 3, all.mutable_data(static_cast<py::ssize_t>(i), 0));
    }
    return all;
}

py::array_t<double> inverse_masses_of(const PredictedStep& step) {
    py::array_t<double> all(static_cast<py::ssize_t>(step.columns()));
    for (std::size_t i = 0; i < step.columns(); ++i)
        all.mutable_at(static_cast<py::ssize_t>(i)) = step.inverse_mass(static_cast<Index>(i));
    return all;
}

}  // namespace

void take_answer(const py::object& answer, Eigen::Index vertex_count, std::size_t body_count, ResponseOutput& output) {
    if (!py::isinstance<py::dict>(answer)) return take_laws(answer, output);
    for (const auto& [key, item] : py::reinterpret_borrow<py::dict>(answer)) {
        const std::string name = py::str(key);
        const auto given = py::reinterpret_borrow<py::object>(item);
        if (name == "contacts") {
            take_laws(given, output);
        } else if (name == "held_force") {
            take_held_force(given, vertex_count, output);
        } else if (name == "position_corrections") {
            output.position_corrections =
                items_from<PositionCorrection>(given, position_correction_type(), "position_corrections",
                                               "a one-dimensional array of trocar.POSITION_CORRECTION");
        } else if (name == "wrench") {
            take_wrench(given, body_count, output);
        } else if (name == "contact_timing") {
            output.contact_timing = value_of(given, "contact_timing", contact_timings);
        } else if (name == "solver_timing") {
            output.solver_timing = value_of(given, "solver_timing", solver_timings);
        } else {
            throw InputError("respond", "",
                             "the keys contacts, held_force, position_corrections, wrench, contact_timing and "
                             "solver_timing",
                             name);
        }
    }
}

void call_solve(const py::object& response, PredictedStep& step) {
    const auto seen = std::make_shared<Step>(step);
    // Python may keep the object for longer than the step lives.
    const struct Ended {
        Step& step;
        explicit Ended(Step& one) : step(one) {}
        ~Ended() { step.end(); }
        Ended(const Ended&) = delete;
        Ended& operator=(const Ended&) = delete;
        Ended(Ended&&) = delete;
        Ended& operator=(Ended&&) = delete;
    } ended(*seen);
    response.attr("solve")(seen);
}

void add_step(py::module_& module) {
    module.attr("POSITION_CORRECTION") = position_correction_type();
    module.attr("SOLVED_CONTACT") = solved_contact_type();
    const char* lifetime = "\n\nRaises InputError after the call of solve.";
    py::class_<Step, std::shared_ptr<Step>>(module, "PredictedStep", R"(A sub-step, for Response.solve.

A column is a movable vertex, with the velocity (m/s) predicted for the end of the sub-step. Point P of a contact is the
weighted sum of its columns. After solve a column's position changes by time * velocity + shift.)")
        .def_property_readonly(
            "time", [](const Step& step) { return step.get().time(); },
            (std::string("s, over which the impulses act.") + lifetime).c_str())
        .def_property_readonly(
            "contacts",
            [](const Step& step) {
                const auto contacts = step.get().contacts();
                return py::array(solved_contact_type(), contacts.size(), contacts.data());  // without a base: a copy
            },
            "(n,) array of trocar.SOLVED_CONTACT, a copy: depth (m) at the start of the sub-step, mobility (1/kg) of P "
            "along any direction, surface (m/s) of a scripted other side, source: number of its law.")
        .def_property_readonly(
            "velocities", [](const Step& step) { return velocities_of(step.get()); },
            "(columns, 3) float64, m/s, a copy.")
        .def_property_readonly(
            "inverse_masses", [](const Step& step) { return inverse_masses_of(step.get()); },
            "(columns,) float64, 1/kg, a copy.")
        .def(
            "velocity", [](const Step& step, py::ssize_t i) { return array_of(step.get().velocity(step.contact(i))); },
            py::arg("contact"), "(3,), m/s, of P relative to the other side, with the impulses so far.")
        .def(
            "rate", [](const Step& step, py::ssize_t i) { return step.get().rate(step.contact(i)); },
            py::arg("contact"), "m/s, opening rate of the gap, with the impulses so far.")
        .def(
            "depth_after", [](const Step& step, py::ssize_t i) { return step.get().depth_after(step.contact(i)); },
            py::arg("contact"), "m, at the end of the step, with the impulses and shifts so far.")
        .def(
            "push",
            [](const Step& step, py::ssize_t i, const py::object& impulse) {
                step.get().push(step.contact(i), vector_from(impulse, "impulse"));
            },
            py::arg("contact"), py::arg("impulse"), "Applies an impulse (N s) to P and its opposite to the other side.")
        .def(
            "shift",
            [](const Step& step, py::ssize_t i, const py::object& by) {
                step.get().shift(step.contact(i), vector_from(by, "by"));
            },
            py::arg("contact"), py::arg("by"),
            "Moves P by mobility * by (kg m). Velocities and contact forces do not change.");
}

}  // namespace trocar::python
