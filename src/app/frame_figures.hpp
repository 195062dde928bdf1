// Figures of one frame in the JSON output of `trocar judge` and `trocar replay`.
#pragma once

#include <string>

#include "app/json_values.hpp"
#include "simulate/frame_judge.hpp"

namespace trocar::app {

/// --start.
inline FrameStart frame_start(const std::string& word) {
    return word == "clean" ? FrameStart::clean : FrameStart::unknown;
}

/// Lengths in m, areas in m², times in s; null: not known.
inline nlohmann::ordered_json frame_json(const FrameFigures& figures) {
    const StepRow& row = figures.row;
    const auto count = [](std::int64_t value) {
        return value < 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(value);
    };
    return {{"tick", row.tick},
            {"time", json_number(row.time)},
            {"true_pairs", count(row.true_pairs)},
            {"true_touch", count(row.true_touch)},
            {"residual_penetration", json_number(row.residual_penetration)},
            {"residual_penetration_mean", json_number(row.residual_penetration_mean)},
            {"wrong_side", count(row.wrong_side)},
            {"wrong_side_area", json_number(row.wrong_side_area)},
            {"wrong_side_vertices", count(row.wrong_side_vertices)},
            {"side_undecided", count(row.side_undecided)},
            {"passed_through", count(row.passed_through)},
            {"self_intersections", count(figures.self_intersections)}};
}

}  // namespace trocar::app
