// Interface of responses that compute impulses instead of forces, from the velocities predicted for the end of a
// sub-step. The prediction includes contacts with force laws; positions are still those of the start (CONTACT §2,
// "Solved contacts").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// When the solver runs, and for how long its impulses act.
enum class SolverTiming : std::uint8_t {
    substep,  ///< in every sub-step, for that sub-step
    held      ///< in the first sub-step; the impulses are spread evenly over the sub-steps
};

/// Contact of role `solved` in a sub-step: point P = Σ weight_i x_i over the step's columns, against the other side.
struct SolvedContact {
    std::size_t source = 0;            ///< index in ResponseOutput::contacts
    Vector3 normal = Vector3::Zero();  ///< unit, direction in which P is pushed
    double depth = 0.0;                ///< m, at the start of the sub-step; negative: open
    int count = 0;
    std::array<Index, 6> column{};
    std::array<double, 6> weight{};
    Vector3 surface = Vector3::Zero();  ///< m/s, part of the other side's velocity that no column carries
    double mobility = 0.0;              ///< 1/kg, velocity of P per unit impulse; > 0, TickContacts::least_weight
};

/// Velocities and shifts that a SubstepSolver reads and changes. Each column is one movable vertex. After the solver
/// its position changes by time() × velocity + shift. Contact arguments must be elements of contacts(), not copies.
class PredictedStep {
public:
    /// s, over which the impulses act: a sub-step, or the tick (SolverTiming).
    [[nodiscard]] double time() const { return time_; }
    [[nodiscard]] std::span<const SolvedContact> contacts() const { return contacts_; }
    [[nodiscard]] std::size_t columns() const { return columns_.size(); }
    [[nodiscard]] const Vector3& velocity(Index column) const { return at_column(column).velocity; }
    [[nodiscard]] double inverse_mass(Index column) const { return at_column(column).inverse_mass; }
    /// m/s, of P relative to the other side.
    [[nodiscard]] Vector3 velocity(const SolvedContact& contact) const {
        Vector3 sum = -contact.surface;
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            sum += contact.weight[i] * at_column(contact.column[i]).velocity;
        }
        return sum;
    }
    /// m/s, opening rate of the gap.
    [[nodiscard]] double rate(const SolvedContact& contact) const { return velocity(contact).dot(contact.normal); }
    /// m, at the end of the step.
    [[nodiscard]] double depth_after(const SolvedContact& contact) const {
        double depth = contact.depth - time_ * rate(contact);
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            depth -= contact.weight[i] * at_column(contact.column[i]).shift.dot(contact.normal);
        }
        return depth;
    }
    /// Applies an impulse (N s) to P and its opposite to the other side.
    void push(const SolvedContact& contact, const Vector3& impulse) {
        impulse_[number_of(contact)] += impulse;
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            Column& column = at_column(contact.column[i]);
            column.velocity += contact.weight[i] * column.inverse_mass * impulse;
        }
    }
    /// Moves P by mobility × `by` (kg m). Velocities and contact forces do not change.
    void shift(const SolvedContact& contact, const Vector3& by) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            Column& column = at_column(contact.column[i]);
            column.shift += contact.weight[i] * column.inverse_mass * by;
            column.shifted_by = number_of(contact);
        }
    }

    // For the caller of the solver.
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
    /// Last contact that shifted a column.
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

/// Computes the impulses of contacts of role `solved`. A stepper may call it in any number of sub-steps per tick.
/// `solve` depends on the step alone and keeps no state.
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
