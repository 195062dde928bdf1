// Members of StepRow by column name and unit: the only list behind stored records and the columns of the Python module.
#pragma once

#include <fmt/format.h>

#include <string>

#include "measure/step_row.hpp"

namespace trocar {

/// Columns of a stored record: visit(name, unit, member). `row` is a StepRow, const or not. The unit is SI or "ns", "1"
/// for a pure number, and empty for flags and words.
template <typename Row, typename Visit>
void visit_row(Row& row, Visit&& visit) {
    visit("tick", "1", row.tick);
    visit("time", "s", row.time);
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        visit(fmt::format("{}_ns", stage_names.at(stage)), "ns", row.stage_ns.at(stage));
    }
    visit("query_distance", "m", row.query_distance);
    visit("pairs", "1", row.pairs);
    visit("contacts_offered", "1", row.contacts_offered);
    visit("contacts_used", "1", row.contacts_used);
    visit("native_contacts", "1", row.native_contacts);
    visit("true_pairs", "1", row.true_pairs);
    visit("true_touch", "1", row.true_touch);
    visit("false_negatives", "1", row.false_negatives);
    visit("false_positives", "1", row.false_positives);
    visit("false_negatives_touch", "1", row.false_negatives_touch);
    visit("deepest_pairs", "1", row.deepest_pairs);
    visit("deepest_false_negatives", "1", row.deepest_false_negatives);
    visit("true_proximity_pairs", "1", row.true_proximity_pairs);
    visit("proximity_false_negatives", "1", row.proximity_false_negatives);
    visit("swept", "1", row.swept);
    visit("true_swept", "1", row.true_swept);
    visit("swept_false_negatives", "1", row.swept_false_negatives);
    visit("swept_false_positives", "1", row.swept_false_positives);
    visit("swept_time_error", "1", row.swept_time_error);
    visit("residual_penetration", "m", row.residual_penetration);
    visit("residual_penetration_mean", "m", row.residual_penetration_mean);
    visit("depth_error", "m", row.depth_error);
    visit("native_depth_error", "m", row.native_depth_error);
    visit("wrong_side", "1", row.wrong_side);
    visit("wrong_side_vertices", "1", row.wrong_side_vertices);
    visit("side_undecided", "1", row.side_undecided);
    visit("overlap_volume", "m³", row.overlap_volume);
    visit("min_translation", "m", row.min_translation);
    visit("overshoot", "m", row.overshoot);
    visit("strain_over", "1", row.strain_over);
    visit("tool_force_x", "N", row.tool_force.x());
    visit("tool_force_y", "N", row.tool_force.y());
    visit("tool_force_z", "N", row.tool_force.z());
    visit("saturated", "", row.saturated);
    visit("max_strain", "1", row.max_strain);
    visit("ruptures", "1", row.ruptures);
    visit("detached", "1", row.detached);
    visit("grasped", "1", row.grasped);
    for (std::size_t reason = 0; reason < skip_reason_count; ++reason) {
        visit(fmt::format("skipped_{}", skip_reason_names.at(reason)), "1", row.skipped.at(reason));
    }
    visit("no_hit", "1", row.no_hit);
    visit("limited_edges", "1", row.limited_edges);
    visit("allocations", "1", row.allocations);
    visit("vertices_read", "1", row.work.vertices_read);
    visit("cells_visited", "1", row.work.cells_visited);
    visit("box_tests", "1", row.work.box_tests);
    visit("triangle_tests", "1", row.work.triangle_tests);
    visit("passed_through", "1", row.passed_through);
    visit("truncated", "", row.truncated);
    visit("outcome", "", row.outcome);
}

/// Columns that records leave out: ten columns of full digits would double a published study. Its summaries hold the
/// figures that reports need.
template <typename Row, typename Visit>
void visit_unstored_row(Row& row, Visit&& visit) {
    const auto visit_vector = [&visit](const std::string& name, const char* unit, auto& vector) {
        visit(name + "_x", unit, vector.x());
        visit(name + "_y", unit, vector.y());
        visit(name + "_z", unit, vector.z());
    };
    visit_vector("tool_moment", "N m", row.tool_moment);
    visit_vector("tip_force", "N", row.tip_force);
    visit_vector("device_force", "N", row.device_force);
    visit("roll_torque", "N m", row.roll_torque);
    visit("wrong_side_area", "m²", row.wrong_side_area);
}

}  // namespace trocar
