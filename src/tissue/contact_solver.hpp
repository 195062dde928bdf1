// Contact solver of an explicit integrator for one tick. It solves all contacts of a sub-step together, implicitly
// (backward Euler on velocity and gap). Contacts on one vertex thus share the load, and their order does not matter.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/world.hpp"
#include "tissue/spring_kernels.hpp"
#include "tissue/tick_contacts.hpp"

namespace trocar {

class ContactSolver {
public:
    /// `vertex_count`: vertices of the frame. `moving`: free vertices of the tissue.
    ContactSolver(Index vertex_count, std::size_t moving);

    /// See TickContacts::collect.
    void collect(const ResponseOutput& output, const Frame& frame, const TissueState& state);
    [[nodiscard]] TickContacts& contacts() { return contacts_; }
    [[nodiscard]] const TickContacts& contacts() const { return contacts_; }

    /// Settings `explicit` and `zero_order_hold`: every contact exerts its prescribed force.
    void push_held(double h, TissueState& state);
    /// Finds the active contacts of this sub-step of h (s) and sets the new velocities of the touched vertices.
    void solve(double h, TissueState& state);
    /// Coulomb friction of the pressing contacts, given the normal forces of the sub-step.
    void rub(double h, TissueState& state);
    /// Passes over all contacts since `collect`: products with their matrix, and sweeps.
    [[nodiscard]] std::int64_t passes() const { return passes_; }

private:
    [[nodiscard]] std::span<const Index> touched() const { return contacts_.touched(); }
    void push(const TickContact& contact, double impulse, TissueState& state) const;
    void assemble(double h, const TissueState& state);
    void apply(double h, const Matrix3X& velocity, Matrix3X& result);
    void precondition();
    bool solve_linear(double h, const TissueState& state);
    bool find_active(double h, const TissueState& state);
    static double force_alone(double h, const TickContact& contact, double speed);
    void sweep(double h, TissueState& state);

    TickContacts contacts_;
    bool crowded_ = false;  ///< the active-set search failed in this tick; sweeps replace it
    std::int64_t passes_ = 0;
    std::vector<double> mass_;  ///< kg, of the touched vertices
    std::vector<Matrix3> block_inverse_;
    Matrix3X right_side_, solution_, residual_, direction_, image_, preconditioned_;
};

}  // namespace trocar
