// The replay page of one scene: one HTML file that works offline, or a small one beside the script that pages of a
// report share. Every number and every curve is of every tick; frames are drawn every n-th tick and at the worst ones.
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
    bool solid = false;         ///< drawn as the one that counts
    std::vector<double> force;  ///< N, size of the force on the tool, one per tick of the scene; NaN: none there
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

/// Bytes of one page without its script; what a scene's frames may take.
inline constexpr std::size_t view_page_budget = 340'000;
/// Bytes of one page with its script.
inline constexpr std::size_t view_file_bound = 1'500'000;

/// `script`: name of the script's file beside the page; empty: the script is within the page. Where all frames take
/// more than the budget, every second one is left out, the worst and the last ones never, until they do not; the page
/// says which are left.
std::string view_html(const ViewPage& page, const std::string& script, std::size_t budget = view_page_budget);

/// Largest error of a coordinate on the page, m: half a quantisation step of the longest side of its box.
double view_error_bound(const ViewPage& page);

}  // namespace trocar
