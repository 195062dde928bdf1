// Output of a response: contact force laws, held forces and position corrections. The stepper applies it, so that every
// response is integrated in the same way.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "contact/substep_solver.hpp"
#include "contact/tip_force.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// Purpose of a contact force law.
enum class ContactRole : std::uint8_t {
    penalty,     ///< spring of the body pair's stiffness
    constraint,  ///< keeps two features apart; its stiffness is numerical, not a material's
    damper,      ///< damper without spring; acts at any gap
    grasp,       ///< bilateral spring; acts at any gap
    solved       ///< no force law: ResponseOutput::solver computes its impulse
};

/// Contact force that the stepper re-evaluates in every sub-step (METHODS §4). It acts on the point P = Σ weights_i x_i
/// along `normal`. StepLaw gives it from the rate v_P·normal − face_velocity and the depth −gap; `limit` bounds it.
/// `gap` refers to the *start of the tick* (CONTACT §2): scripted bodies before this tick's motion, all else where the
/// last tick left it. It changes by (v_P·normal − face_velocity)·t within the tick. A contact with a positive gap is
/// open and acts from the sub-step in which the gap closes. Where reaction_vertices are set, their weighted velocity
/// replaces face_velocity. Role `solved` has k = mu = 0, and a surface_velocity where no reaction_vertices are set.
struct ContactForceLaw {
    ContactRole role = ContactRole::penalty;
    std::uint64_t source_id = 0;                   ///< Contact::id; 0: none
    std::array<Index, 3> vertices{-1, -1, -1};     ///< pushed vertices; unused entries -1 with weight 0
    std::array<double, 3> weights{0.0, 0.0, 0.0};  ///< sum 1
    Vector3 normal = Vector3::Zero();              ///< unit, direction in which the vertices are pushed
    double gap = 0.0;                              ///< m, at the start of the tick, negative = penetrating
    double k = 0.0;                                ///< N/m
    double mu = 0.0;                               ///< N s/m
    double face_velocity = 0.0;                    ///< m/s, normal velocity of the other surface
    /// N, largest force: a pressure (Pa) times the feature's area, independent of the mesh. A contact at its limit
    /// yields under that force.
    double limit = std::numeric_limits<double>::infinity();
    bool adhesive = false;  ///< true: the force may pull while the gap is negative (thesis, no clamp)
    /// Body that takes the reaction −F at reaction_point (m, world); -1: none (a static body).
    Index reaction_body = -1;
    Vector3 reaction_point = Vector3::Zero();
    Vector3 other_point = Vector3::Zero();  ///< m, of a constraint: the other surface's point at the start of the tick
    /// Vertices that take the reaction when the other side is tissue; else all -1.
    std::array<Index, 3> reaction_vertices{-1, -1, -1};
    std::array<double, 3> reaction_weights{0.0, 0.0, 0.0};
    /// Coulomb coefficient on tissue: a tangential spring slides at friction × normal force. 0: none.
    double friction = 0.0;
    double tangent_k = 0.0;                      ///< N/m, of the tangential spring
    Vector3 surface_velocity = Vector3::Zero();  ///< m/s, of the other surface where no reaction_vertices are set
    /// Unit, along the other side's edge in an edge–edge contact; else zero. In every sub-step the stepper rotates a
    /// constraint's normal with the tissue's face or edge about other_point.
    Vector3 other_edge = Vector3::Zero();
    Index slip_key = -1;  ///< key of the spring's state in the stepper: a vertex, or a larger number

    /// Acts at any gap, in both directions.
    [[nodiscard]] bool bilateral() const { return role == ContactRole::damper || role == ContactRole::grasp; }
    /// Its force may be negative.
    [[nodiscard]] bool pulls() const { return bilateral() || adhesive; }
};

/// Force law of a contact over a step of h (s), backward Euler on the penetration p = max(0, depth). F = max(0, k p_end
/// + mu (p_end - p_start) / h), zero unless the step ends with penetration. Without the maximum, which the caller
/// applies, F is linear in the opening rate r (m/s): F = still - slope r. `both_senses`: bilateral law k depth_end - mu
/// r at any gap.
struct StepLaw {
    StepLaw() = default;
    StepLaw(double k, double mu, double depth, double h, bool both_senses)
        : still(k * depth + (both_senses ? 0.0 : mu * std::min(depth, 0.0) / h)), slope(mu + h * k) {}
    [[nodiscard]] double force(double rate) const { return still - slope * rate; }

    double still = 0.0;  ///< N
    double slope = 0.0;  ///< N s/m
};

/// Force of one contact over a tick, passed to the response in the next tick.
struct ContactForce {
    double normal = 0.0;              ///< N, along the contact's normal, mean over the tick
    double friction = 0.0;            ///< N, along the surface, magnitude of the mean over the tick
    double slip = 0.0;                ///< m, stretch of the tangential spring, mean over the tick
    Vector3 force = Vector3::Zero();  ///< N, total on the contact's vertices, mean over the tick
    /// J, work of this force on the tissue, summed over sub-steps; NaN: not reported.
    double work = std::numeric_limits<double>::quiet_NaN();
    bool at_limit = false;  ///< at its limit at the end of the tick
};

/// Sets the state of a tissue vertex before the tissue is integrated.
struct PositionCorrection {
    Index vertex = -1;
    Vector3 position = Vector3::Zero();  ///< m, world
    Vector3 velocity = Vector3::Zero();  ///< m/s, world
    bool held = false;                   ///< true: fixed there for this tick (a grasp); its velocity acts on dampers
};

/// State at which contact forces on tissue are evaluated.
enum class ContactTiming : std::uint8_t {
    implicit,         ///< end of the step, solved together with it
    at_tick_start,    ///< frame of the output, for the whole tick (`thesis:contacts=zero_order_hold`)
    at_substep_start  ///< start of each sub-step (`thesis:contacts=explicit`)
};

/// Reason why a contact of the generator has no part in a response output.
enum class SkipReason : std::uint8_t {
    apart,         ///< not passed on (ContactSelection)
    no_direction,  ///< touch, coplanar or degenerate, or without normal, point or depth
    not_handled,   ///< the method defines no response to it
    reduced        ///< another contact of the same vertex or edges represents it
};
inline constexpr std::size_t skip_reason_count = 4;
inline constexpr std::array<const char*, skip_reason_count> skip_reason_names{"apart", "no_direction", "not_handled",
                                                                              "reduced"};

/// Output of a response, input of tissue, operator and metrics.
struct ResponseOutput {
    std::vector<ContactForceLaw> contacts;
    Matrix3X held_force;  ///< 3×N, N; constant over the tick. Empty until a response sizes it; zeroed by clear.
    std::vector<PositionCorrection> position_corrections;  ///< at most one per vertex
    std::vector<Wrench>
        wrench;  ///< per body: forces that no contact force law carries (reactions to position corrections …)
    std::array<std::int64_t, skip_reason_count> skipped{};  ///< contacts without effect, by SkipReason
    std::int64_t no_hit = 0;                                ///< projections without a contact point (METHODS §6)
    std::int64_t detached = 0;                              ///< grasped vertices that slipped in this tick
    std::int64_t grasped = 0;                               ///< vertices held by a grasp in this tick
    ContactTiming contact_timing = ContactTiming::implicit;
    SubstepSolver* solver = nullptr;  ///< for contacts of role `solved`; owned by the response
    SolverTiming solver_timing = SolverTiming::substep;

    void skip(SkipReason reason, std::int64_t count = 1) { skipped[static_cast<std::size_t>(reason)] += count; }
    [[nodiscard]] std::int64_t skipped_for(SkipReason reason) const {
        return skipped[static_cast<std::size_t>(reason)];
    }
    [[nodiscard]] std::int64_t all_skipped() const {
        return std::accumulate(skipped.begin(), skipped.end(), std::int64_t{0});
    }
    void resize(Index vertex_count, Index body_count);
    void clear();
};

}  // namespace trocar
