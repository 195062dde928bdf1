// One tick as plain data: stage times, counts and geometric truth. Rows are appended to a reserved vector.
#pragma once

#include <array>
#include <cstdint>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"

namespace trocar {

/// Stages of a tick in order (DESIGN §5). observe is never timed.
enum class Stage : std::uint8_t { move, update, detect, contacts, respond, advance };
inline constexpr std::size_t stage_count = 6;
inline constexpr std::array<const char*, stage_count> stage_names{"move",     "update",  "detect",
                                                                  "contacts", "respond", "advance"};

struct StepRow {
    std::int64_t tick = -1;
    double time = 0.0;                                                       ///< s
    std::array<std::int64_t, stage_count> stage_ns{-1, -1, -1, -1, -1, -1};  ///< -1: stage not present in this run
    double query_distance = not_known;  ///< m, query distance of the detector; 0: intersecting pairs
    std::int64_t pairs = 0;
    std::int64_t contacts_offered = 0;  ///< by the contact generator
    std::int64_t contacts_used = 0;     ///< of these: used by the output
    std::int64_t native_contacts = 0;
    std::int64_t true_pairs = -1;                  ///< -1: truth not computed on this tick
    std::int64_t true_touch = -1;                  ///< of `true_pairs`: pairs that only touch
    std::int64_t false_negatives = -1;             ///< false negatives
    std::int64_t false_positives = -1;             ///< false positives
    std::int64_t false_negatives_touch = -1;       ///< of `false_negatives`: pairs that only touch
    std::int64_t deepest_pairs = -1;               ///< the deepest of `true_pairs` (pair_truth.hpp)
    std::int64_t deepest_false_negatives = -1;     ///< of these: not reported
    std::int64_t true_proximity_pairs = -1;        ///< disjoint pairs within `query_distance`; -1: not computed
    std::int64_t proximity_false_negatives = -1;   ///< of these: not reported
    std::int64_t swept = 0;                        ///< reported contacts that begin since the frame before
    std::int64_t true_swept = -1;                  ///< pairs that begin to touch (space_time.hpp); -1: not computed
    std::int64_t swept_false_negatives = -1;       ///< of these: reported neither as swept contact nor as pair
    std::int64_t swept_false_positives = -1;       ///< swept contacts that are false positives
    double swept_time_error = not_known;           ///< fraction of a tick, largest error of a reported first contact
    double residual_penetration = not_known;       ///< m, by truth, after the step
    double residual_penetration_mean = not_known;  ///< m, area mean over penetrating samples, after the step
    double depth_error = not_known;                ///< m, largest |contact depth - true depth| on the frame of detect
    double native_depth_error = not_known;         ///< m, the same of the library's own contacts
    std::int64_t wrong_side = -1;                  ///< DepthTruth::Result, after the step; -1: not computed
    double wrong_side_area = not_known;            ///< m², of area samples, after the step
    std::int64_t wrong_side_vertices = -1;         ///< of these, vertices of bodies
    std::int64_t side_undecided = -1;              ///< samples of undecided side, after the step
    double overlap_volume = not_known;             ///< m³, of closed bodies, after the step
    double min_translation = not_known;            ///< m, largest over pairs of closed bodies
    double overshoot = not_known;                  ///< m, gap soon after a penetration, opened by no script
    double strain_over = not_known;                ///< 1, edge strain above the limit, after the step
    Vector3 tool_force = Vector3::Constant(not_known);    ///< N, on the first instrument with a motion,
                                                          ///< mean over the tick; NaN in a replay
    Vector3 tool_moment = Vector3::Constant(not_known);   ///< N m, of the same load about the tip
    Vector3 tip_force = Vector3::Constant(not_known);     ///< N, at the tip by the device's rule, before its limiters
    Vector3 device_force = Vector3::Constant(not_known);  ///< N, the same after the device's limiters
    double roll_torque = not_known;                       ///< N m, about the shaft; NaN without a trocar
    bool saturated = false;                               ///< device_force is clamped to the device's largest force
    double max_strain = not_known;                        ///< 1
    std::int64_t ruptures = 0;
    std::int64_t detached = 0;                              ///< grasped vertices that slipped
    std::int64_t grasped = 0;                               ///< vertices held by a grasp
    std::array<std::int64_t, skip_reason_count> skipped{};  ///< contacts offered and not used, by SkipReason
    std::int64_t no_hit = 0;                                ///< projections without a contact point
    std::int64_t limited_edges = 0;                         ///< edges that the strain limiter acted on
    std::int64_t allocations = -1;  ///< heap allocations inside timed stages; -1: not counted in this build
    WorkCounters work;
    std::int64_t passed_through = -1;  ///< passages completed in this tick (passage.hpp); -1: no pair to examine
    bool truncated = false;
    OutcomeKind outcome = OutcomeKind::ok;

    /// Sum over the stages that are present, ns.
    [[nodiscard]] std::int64_t total_ns() const {
        std::int64_t sum = 0;
        for (const std::int64_t ns : stage_ns) sum += ns > 0 ? ns : 0;
        return sum;
    }
};

}  // namespace trocar
