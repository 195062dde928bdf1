// The contacts of one tick in the tissue's integrator: all of a sub-step are solved together, implicitly (backward
// Euler on velocity and gap), so that many contacts on one vertex share the load and their order does not matter.
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
    /// `vertex_count` is that of the frame, `moving` how many of its vertices the tissue can move.
    ContactSolver(Index vertex_count, std::size_t moving);

    /// As TickContacts has it.
    void collect(const ResponseOutput& output, const Frame& frame, const TissueState& state);
    [[nodiscard]] TickContacts& contacts() { return contacts_; }
    [[nodiscard]] const TickContacts& contacts() const { return contacts_; }

    /// Settings `explicit` and `unilateral`: every contact gives what it holds.
    void push_held(double h, TissueState& state);
    /// Finds which contacts are on in this sub-step of h (s) and gives the touched vertices their new velocities.
    void solve(double h, TissueState& state);
    /// Coulomb friction of the contacts that press, after the normal forces of the sub-step are known.
    void rub(double h, TissueState& state);
    /// How often all contacts were gone through since `collect`: products with their matrix, and sweeps.
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
    bool crowded_ = false;  ///< in this tick the contacts that are on were not found: sweeps take their place
    std::int64_t passes_ = 0;
    std::vector<double> mass_;  ///< kg, of the touched vertices
    std::vector<Matrix3> block_inverse_;
    Matrix3X right_side_, solution_, residual_, direction_, image_, preconditioned_;
};

}  // namespace trocar
