// Responses that find impulses instead of forces: from the velocities that a stepper predicts for the end of a
// sub-step, when contacts with force laws have acted and nothing has moved yet (CONTACT §2, "Solved contacts").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// When a SubstepSolver is asked, and for how long what it finds acts.
enum class SolverTiming : std::uint8_t {
    substep,  ///< in every sub-step, for that sub-step
    tick,     ///< in the first sub-step, for the whole tick: its impulses act at once
    held      ///< in the first sub-step, for the whole tick: its impulses are spread evenly over the sub-steps
};

/// A contact of role `solved` in a sub-step: its point P = Σ weight_i x_i over the columns of the step, against the
/// other side.
struct SolvedContact {
    std::size_t source = 0;            ///< number in ResponseOutput::contacts
    Vector3 normal = Vector3::Zero();  ///< unit, direction in which P is pushed
    double depth = 0.0;                ///< m, as the sub-step begins, negative: open
    int count = 0;
    std::array<Index, 6> column{};
    std::array<double, 6> weight{};
    Vector3 surface = Vector3::Zero();  ///< m/s, of the other side, from what no column moves
    double mobility = 0.0;              ///< 1/kg, velocity of P per impulse; > 0, TickContacts::least_weight
};

/// What a SubstepSolver sees and changes. Each column is one vertex that moves; its place changes by `time` times its
/// velocity after the solver, and by its shift. A contact that is handed back is one of `contacts()`, not a copy.
class PredictedStep {
public:
    /// s, for which the impulses act: a sub-step, or the tick (SolverTiming).
    [[nodiscard]] double time() const { return time_; }
    [[nodiscard]] std::span<const SolvedContact> contacts() const { return contacts_; }
    [[nodiscard]] std::size_t columns() const { return columns_.size(); }
    [[nodiscard]] const Vector3& velocity(Index column) const { return at_column(column).velocity; }
    [[nodiscard]] double inverse_mass(Index column) const { return at_column(column).inverse_mass; }
    /// m/s, of P against the other side.
    [[nodiscard]] Vector3 velocity(const SolvedContact& contact) const {
        Vector3 sum = -contact.surface;
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            sum += contact.weight[i] * at_column(contact.column[i]).velocity;
        }
        return sum;
    }
    /// m/s, at which the gap opens.
    [[nodiscard]] double rate(const SolvedContact& contact) const { return velocity(contact).dot(contact.normal); }
    /// m, when the step is over.
    [[nodiscard]] double depth_after(const SolvedContact& contact) const {
        double depth = contact.depth - time_ * rate(contact);
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            depth -= contact.weight[i] * at_column(contact.column[i]).shift.dot(contact.normal);
        }
        return depth;
    }
    /// Impulse (N s) on P, its opposite on the other side.
    void push(const SolvedContact& contact, const Vector3& impulse) {
        impulse_[number_of(contact)] += impulse;
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            Column& column = at_column(contact.column[i]);
            column.velocity += contact.weight[i] * column.inverse_mass * impulse;
        }
    }
    /// Moves P by mobility × `by` (kg m) without changing a velocity; no force is felt of it.
    void shift(const SolvedContact& contact, const Vector3& by) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            Column& column = at_column(contact.column[i]);
            column.shift += contact.weight[i] * column.inverse_mass * by;
            column.shifted_by = number_of(contact);
        }
    }

    // For who asks the solver.
    void reserve(std::size_t contacts, std::size_t columns) {
        contacts_.reserve(contacts);
        impulse_.reserve(contacts);
        columns_.reserve(columns);
    }
    void begin(double time) {
        time_ = time;
        contacts_.clear();
        impulse_.clear();
        columns_.clear();
    }
    void add_column(const Vector3& velocity, double inverse_mass) {
        columns_.push_back({.velocity = velocity, .inverse_mass = inverse_mass});
    }
    void add(const SolvedContact& contact) {
        contacts_.push_back(contact);
        impulse_.push_back(Vector3::Zero());
    }
    [[nodiscard]] const Vector3& impulse(std::size_t number) const { return impulse_[number]; }
    [[nodiscard]] const Vector3& shift(Index column) const { return at_column(column).shift; }
    /// The last contact that has shifted a column.
    [[nodiscard]] const SolvedContact& shifted_by(Index column) const {
        return contacts_[at_column(column).shifted_by];
    }

private:
    struct Column {
        Vector3 velocity = Vector3::Zero();  ///< m/s
        Vector3 shift = Vector3::Zero();     ///< m
        double inverse_mass = 0.0;           ///< 1/kg
        std::size_t shifted_by = 0;
    };
    [[nodiscard]] const Column& at_column(Index column) const { return columns_[static_cast<std::size_t>(column)]; }
    [[nodiscard]] Column& at_column(Index column) { return columns_[static_cast<std::size_t>(column)]; }
    [[nodiscard]] std::size_t number_of(const SolvedContact& contact) const {
        return static_cast<std::size_t>(&contact - contacts_.data());
    }

    double time_ = 0.0;
    std::vector<SolvedContact> contacts_;
    std::vector<Vector3> impulse_;  ///< N s, per contact
    std::vector<Column> columns_;
};

/// Part of a response whose effect has contacts of role `solved`. Between two calls of Response::respond a stepper may
/// ask it in any number of sub-steps; `solve` answers from the step alone and remembers nothing of it.
class SubstepSolver {
public:
    SubstepSolver() = default;
    SubstepSolver(const SubstepSolver&) = delete;
    SubstepSolver& operator=(const SubstepSolver&) = delete;
    SubstepSolver(SubstepSolver&&) = delete;
    SubstepSolver& operator=(SubstepSolver&&) = delete;
    virtual ~SubstepSolver() = default;

    virtual void solve(PredictedStep& step) = 0;
};

}  // namespace trocar
