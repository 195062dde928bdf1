// What a response wants to happen. A response never touches tissue or instruments; it fills an ResponseOutput, which
// the stepper applies, so that every response is integrated in the same way.
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

/// What a contact is there for; parts of a response that examine others' contacts go by it.
enum class ContactRole : std::uint8_t {
    penalty,     ///< a spring as soft as the law of the pair has it
    constraint,  ///< holds two features apart, with a stiffness that is no material's
    damper,      ///< no spring; acts at any gap
    grasp,       ///< a spring that pulls as well as it presses; acts at any gap
    solved       ///< no force law: ResponseOutput::solver finds its impulse
};

/// A contact force that the stepper re-evaluates in every sub-step (METHODS §4). It acts on the point
/// P = Σ weights_i x_i along `normal` with the law of StepLaw, v_P·normal − face_velocity as its rate and −gap as its
/// depth, and at most `limit`.
/// A contact with a positive gap is open: the stepper lets it join in the sub-step in which the gap closes.
/// `gap` is that at the *start of the tick* (CONTACT §2): bodies that scripts lead where the tick finds them, tissue
/// and what hands hold where the last tick left them; it changes by (v_P·normal − face_velocity)·t within the tick.
/// Where reaction_vertices are set, their weighted velocity takes the place of face_velocity. One of role `solved` has
/// no law (k and mu 0), and a surface_velocity where no reaction_vertices are set.
struct ContactForceLaw {
    ContactRole role = ContactRole::penalty;
    std::uint64_t source_id = 0;                   ///< Contact::id that it comes from, 0: none
    std::array<Index, 3> vertices{-1, -1, -1};     ///< pushed vertices; unused entries -1 with weight 0
    std::array<double, 3> weights{0.0, 0.0, 0.0};  ///< sum 1
    Vector3 normal = Vector3::Zero();              ///< unit, direction in which the vertices are pushed
    double gap = 0.0;                              ///< m, at the start of the tick, negative = penetrating
    double k = 0.0;                                ///< N/m
    double mu = 0.0;                               ///< N s/m
    double face_velocity = 0.0;                    ///< m/s, normal velocity of the other surface
    /// N, largest force: a pressure (Pa) times the feature's own area, so that a refined mesh tears alike. A contact at
    /// its limit gives exactly that and yields.
    double limit = std::numeric_limits<double>::infinity();
    bool adhesive = false;  ///< true: the force may pull while the gap is negative (faithful has no clamp)
    /// Body that takes the reaction −F, and the world point where it acts; -1 = none (a static body).
    Index reaction_body = -1;
    Vector3 reaction_point = Vector3::Zero();
    Vector3 other_point =
        Vector3::Zero();  ///< m, of a constraint: point of the other surface, at the start of the tick
    /// Vertices that take the reaction when the other side is tissue; all -1 when reaction_body is an instrument.
    std::array<Index, 3> reaction_vertices{-1, -1, -1};
    std::array<double, 3> reaction_weights{0.0, 0.0, 0.0};
    /// Coulomb friction on tissue: a tangential spring that slides at friction × normal force. 0 = none.
    double friction = 0.0;
    double tangent_k = 0.0;                      ///< N/m, of the tangential spring
    Vector3 surface_velocity = Vector3::Zero();  ///< m/s, of the other surface where no reaction_vertices are set
    /// Unit, along the other side's edge where the contact is one of two edges; else zero. The stepper turns the normal
    /// of a constraint with the tissue's face or edge in every sub-step, seen from other_point.
    Vector3 other_edge = Vector3::Zero();
    Index slip_key = -1;  ///< under which the integrator remembers the spring: a vertex, or above

    /// Acts at any gap, in both senses.
    [[nodiscard]] bool bilateral() const { return role == ContactRole::damper || role == ContactRole::grasp; }
};

/// A contact's law over a step of h (s), backward Euler on its penetration p = max(0, depth):
/// F = max(0, k p_end + mu (p_end - p_start) / h), so that nothing presses unless the step ends inside. Up to the
/// maximum, which is its user's, that is linear in the rate r (m/s) at which the gap opens: F = still - slope r.
/// `both_senses`: the law of a contact that pulls as well, k depth_end - mu r, whatever its gap.
struct StepLaw {
    StepLaw() = default;
    StepLaw(double k, double mu, double depth, double h, bool both_senses)
        : still(k * depth + (both_senses ? 0.0 : mu * std::min(depth, 0.0) / h)), slope(mu + h * k) {}
    [[nodiscard]] double force(double rate) const { return still - slope * rate; }

    double still = 0.0;  ///< N
    double slope = 0.0;  ///< N s/m
};

/// What one contact of a response output gave in the tick it was made for: handed back to the response in the next one.
struct ContactForce {
    double normal = 0.0;              ///< N, along the contact's normal, mean over the tick
    double friction = 0.0;            ///< N, along the surface, magnitude of the mean over the tick
    double slip = 0.0;                ///< m, stretch of the tangential spring, mean over the tick
    Vector3 force = Vector3::Zero();  ///< N, both together on the contact's vertices, mean over the tick
    /// J, of this force on the tissue that it moved, sub-step by sub-step; NaN: not reported.
    double work = std::numeric_limits<double>::quiet_NaN();
    bool at_limit = false;  ///< gave its limit when the tick ended
};

/// Puts a tissue vertex somewhere before the tissue is integrated.
struct PositionCorrection {
    Index vertex = -1;
    Vector3 position = Vector3::Zero();  ///< m, world
    Vector3 velocity = Vector3::Zero();  ///< m/s, world
    bool held = false;                   ///< true: it stays there for this tick (a grasp), its velocity acts on dampers
};

/// From which state the tissue takes the forces of a response output's contact force laws.
enum class ContactTiming : std::uint8_t {
    implicit,         ///< from the one that they lead to: solved together with the step
    at_tick_start,    ///< from the frame that the output was made for, over the whole tick
                      ///< (`thesis:contacts=zero_order_hold`)
    at_substep_start  ///< from the start of each sub-step (`thesis:contacts=explicit`)
};

/// Why a contact that the generator offered has no part in a response output.
enum class SkipReason : std::uint8_t {
    apart,         ///< not passed on (ContactSelection)
    no_direction,  ///< touch, coplanar or degenerate, or without normal, point or depth
    not_handled,   ///< the method has no answer to such a contact
    reduced        ///< another contact of the same vertex or edges stands for it
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
    std::array<std::int64_t, skip_reason_count> skipped{};  ///< contacts without a part in it, by SkipReason
    std::int64_t no_hit = 0;                                ///< projections without a contact point (METHODS §6)
    std::int64_t detached = 0;                              ///< grasped vertices that slipped in this tick
    std::int64_t grasped = 0;                               ///< vertices held by a grasp in this tick
    ContactTiming contact_timing = ContactTiming::implicit;
    SubstepSolver* solver = nullptr;  ///< of the contacts of role `solved`; the response's
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
