// The contacts of one tick in the tissue's integrator: all of a sub-step are solved together, implicitly (backward
// Euler on velocity and gap), so that many contacts on one vertex share the load and their order does not matter.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/effect.hpp"
#include "scene/world.hpp"
#include "tissue/spring_kernels.hpp"

namespace trocar {

class ContactSolver {
public:
    /// `vertex_count` is that of the frame, `moving` how many of its vertices the tissue can move.
    ContactSolver(Index vertex_count, std::size_t moving);

    /// Takes over the effect's contacts that touch at least one vertex that moves; what does not move acts by its
    /// velocity. The effect must live until `react` of the same tick.
    void collect(const Effect& effect, const Frame& frame, const TissueState& state);
    [[nodiscard]] bool empty() const { return active_.empty(); }
    /// Positions in the state of the vertices that contacts act on.
    [[nodiscard]] std::span<const Index> touched() const { return touched_; }

    /// Setting `explicit`: what push_held gives is the force of the state at the start of the sub-step. Without this
    /// call it is that of the frame (setting `hold`).
    void hold_current_force(const TissueState& state);
    void push_held(double h, TissueState& state);
    /// At the start of a sub-step: constraints of a face or edge of tissue follow how it has turned and where
    /// on it the contact is by now. What is linearised once a tick lags behind light vertices, and feeds their
    /// swinging.
    void turn(const TissueState& state);
    /// Finds which contacts are on in this sub-step of h (s) and gives the touched vertices their new velocities.
    void solve(double h, TissueState& state);
    /// Coulomb friction of the contacts that press, after the normal forces of the sub-step are known.
    void rub(double h, int substeps, TissueState& state);
    /// Moves the gaps by the new velocities and adds up what each contact gave.
    void finish_substep(double h, int substeps, const TissueState& state);
    /// After the last sub-step: adds to the bodies that take reactions what the contacts gave, mean over the tick.
    void react(std::vector<Wrench>& reaction);

    /// Per contact of the effect, complete after the last sub-step; zero for contacts without tissue.
    [[nodiscard]] std::span<const ContactLoad> loads() const { return loads_; }
    /// How often all contacts were gone through since `collect`: products with their matrix, and sweeps.
    [[nodiscard]] std::int64_t passes() const { return passes_; }

private:
    /// One contact inside a tick: entries are the moving vertices with their signed weights.
    struct Active {
        std::size_t source = 0;
        int count = 0;
        std::array<Index, 6> vertex{};
        std::array<double, 6> weight{};
        Vector3 normal = Vector3::Zero();
        double depth = 0.0;           ///< m, now
        double stiffness = 0.0;       ///< N/m
        double damping = 0.0;         ///< N s/m, >= 0, implicit
        double explicit_damping = 0;  ///< N s/m, <= 0
        double fixed_rate = 0.0;      ///< m/s, normal velocity of P minus that of the face from what does not move here
        double mobility = 0.0;        ///< 1/kg, velocity of P per impulse
        double held = 0.0;            ///< N, for contacts_held
        double limit = 0.0;           ///< N, largest force
        double force = 0.0;           ///< N, of the last sub-step
        Vector3 surface = Vector3::Zero();  ///< m/s, velocity of the other side from what does not move here
        Vector3 rubbed = Vector3::Zero();   ///< N, friction of the last sub-step on P
        bool adhesive = false;
        bool bilateral = false;
        bool on = false;
        bool capped = false;  ///< on, and with the force `force` that its limit leaves it instead of its spring's
        bool rubs = false;
        bool turns = false;
    };

    /// The contacts that share one tangential spring: a vertex that several faces hold has one stretch, at the face
    /// that presses most, and slides at the sum of what all of them allow.
    struct Grip {
        double most = 0.0;        ///< N
        std::size_t firmest = 0;  ///< position in active_
    };

    static double within_limit(const Active& contact, double force);
    static bool reaches_limit(const Active& contact, double force);
    static bool leaves_limit(const Active& contact, double force);
    bool enter(const LinearContact& contact, const Frame& frame, const TissueState& state, Active& entry);
    void turn_tissues(const TissueState& state, Active& contact) const;
    void take_weights(const TissueState& state, const Vector3& weights, const Vector3& other_weights,
                      const Vector3& normal, Active& contact) const;
    void remember_slip(const LinearContact& contact, Active& entry);
    void gather_grip();
    [[nodiscard]] double rate(const Active& contact, const TissueState& state) const;
    void push(const Active& contact, double impulse, TissueState& state) const;
    void assemble(double h, const TissueState& state);
    void apply(double h, const Matrix3X& velocity, Matrix3X& result);
    void precondition();
    bool solve_linear(double h, const TissueState& state);
    bool find_active(double h, const TissueState& state);
    static double force_alone(double h, const Active& contact, double speed);
    void sweep(double h, TissueState& state);

    const Effect* effect_ = nullptr;
    double elapsed_ = 0.0;              ///< s, since the start of the tick
    std::vector<Vector3> mean_normal_;  ///< N, per contact of the effect: mean force as a vector
    // Buffers grow to the largest number of contacts seen and are kept.
    std::vector<Active> active_;
    bool crowded_ = false;  ///< in this tick the contacts that are on were not found: sweeps take their place
    std::int64_t passes_ = 0;
    std::vector<ContactLoad> loads_;      ///< per contact of the effect
    std::vector<Vector3> mean_friction_;  ///< N, per contact of the effect
    Matrix3X slip_;                       ///< per slip key (N at first), m: tangential spring of the contact
    std::vector<std::uint8_t> rubbed_;    ///< per slip key; 2: in contact in this tick, 1: in the last one, 0: not
    std::vector<Index> rubbing_;          ///< slip keys with rubbed_ > 0
    std::vector<Grip> grip_;              ///< of the sub-step, per slip key
    std::vector<Index> touched_;
    std::vector<Index> spot_;   ///< per vertex of the state: position in touched_ or -1
    std::vector<double> mass_;  ///< kg, of touched_
    std::vector<Matrix3> block_inverse_;
    Matrix3X right_side_, solution_, residual_, direction_, image_, preconditioned_;
};

}  // namespace trocar
