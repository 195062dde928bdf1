// Replay page of one scene: one HTML file that works offline, or a small one that shares its script with the pages of a
// report. Numbers and curves cover every tick; frames are drawn every n-th tick and at the largest values.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/world.hpp"
#include "view/capture.hpp"

namespace trocar {

/// A stored reference's force, as a curve.
struct ViewedReference {
    std::string name;
    bool solid = false;         ///< drawn as the main reference
    std::vector<double> force;  ///< N, magnitude of the force on the tool, per tick of the scene; NaN: none
};

struct ViewPage {
    std::string scene;
    std::string about;  ///< one line under the title
    std::string foot;   ///< how it was made
    std::vector<std::string> notes;
    double dt = 0.001;  ///< s
    std::int64_t ticks = 0;
    Topology topology;
    Matrix3X rest;           ///< 3×N, m, world, before the first tick
    Index tool_vertex = -1;  ///< where the force on the tool is drawn when no contact has one; -1: no tool
    std::vector<ViewedRun> runs;
    std::vector<ViewedReference> references;
};

/// Bytes of one page without its script; limit for a scene's frames.
inline constexpr std::size_t view_page_budget = 340'000;
/// Bytes of one page with its script.
inline constexpr std::size_t view_file_bound = 1'500'000;

/// `script`: name of the script's file beside the page; empty: the script is embedded. While the frames exceed the
/// budget, every second one is dropped, but never the largest-value and last ones. The page states which frames remain.
std::string view_html(const ViewPage& page, const std::string& script, std::size_t budget = view_page_budget);

/// Largest error of a coordinate on the page, m: half a quantisation step of the longest side of its box.
double view_error_bound(const ViewPage& page);

}  // namespace trocar
