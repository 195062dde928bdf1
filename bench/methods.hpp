// Who takes part in the detection benchmark: every registered detector, each in the settings a reader asks for. The
// table of settings is data; a detector that the table does not know takes part with its defaults.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "method/registry.hpp"

namespace trocar::bench {

/// Which cells a method takes part in, besides those that name it.
enum class Part : std::uint8_t { everywhere, settings_cell };

struct Method {
    std::string label;    ///< method text; copies end in " (again)"
    std::string method;   ///< NAME[:key=value…], empty for the bench's own broad phases
    std::string library;  ///< "FCL 0.7.0"
    std::string family;   ///< "ohc", "tree", "cells", "boxes", "none": the columns of the thesis' Table 3.1
    std::string narrow;   ///< who decides the triangle pairs
    bool own = false;
    bool claims_exact = false;
    bool query_distance = false;         ///< its detector answers within a query distance
    bool within_query_distance = false;  ///< asked within the cell's reach, not for meeting pairs alone
    Part part = Part::everywhere;
    /// Scenes with more triangles leave it out, as its time would buy nothing; 0 = no limit. Quick runs and full ones.
    std::int64_t most_triangles_quick = 0;
    std::int64_t most_triangles_full = 0;
    std::function<std::unique_ptr<Detector>()> make;
};

/// What cannot take part, with the reason.
struct Missing {
    std::string name;
    std::string reason;
};

/// Table order: ours, then baselines. Settings of absent detectors and keys that a detector does not declare go to
/// `missing`.
std::vector<Method> methods(const Registry& registry, std::vector<Missing>& missing);

/// The search for a detector's best setting: every method text that is tried on a scene. Without parameters: what this
/// project recommends, the adapter's defaults.
struct Search {
    std::string name;             ///< of the detector
    std::string library_default;  ///< what a user gets who chooses nothing, as far as the adapter has it
    std::vector<std::string> tried;
};

/// For detectors with settings that change the time and not the answer. `edge`: mean edge of the scene's tissue, m.
std::vector<Search> searches(double edge);

/// The two that ratios are taken to.
inline constexpr std::string_view embree_anchor = "embree_collide";
inline constexpr std::string_view fcl_anchor = "fcl_bvh";

/// One method made from a method text, for sweeps. Throws InputError as make_detector does.
Method method_of(const std::string& method);

}  // namespace trocar::bench
