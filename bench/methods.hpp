// Methods of the detection benchmark: every registered detector with several settings. Detectors missing from the table
// of settings run with their defaults.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "method/registry.hpp"

namespace trocar::bench {

/// Cells in which a method runs, besides those that name it.
enum class Part : std::uint8_t { everywhere, settings_cell };

struct Method {
    std::string label;    ///< method text; repeated measurements end in " (again)"
    std::string method;   ///< NAME[:key=value…]
    std::string library;  ///< "FCL 0.7.0"
    std::string family;   ///< "ohc", "tree", "cells", "boxes", "none": columns of the thesis' Table 3.1
    std::string narrow;   ///< name of the narrow phase
    bool own = false;
    bool claims_exact = false;
    bool query_distance = false;         ///< its detector supports a query distance
    bool within_query_distance = false;  ///< queried with the cell's query distance, not for intersecting pairs only
    Part part = Part::everywhere;
    /// Limit of triangles for quick and full runs, to bound the time; 0 = no limit.
    std::int64_t most_triangles_quick = 0;
    std::int64_t most_triangles_full = 0;
    std::function<std::unique_ptr<Detector>()> make;
};

/// A method that is not available, with the reason.
struct Missing {
    std::string name;
    std::string reason;
};

/// Methods in table order: ours, then other libraries. Absent detectors and undeclared setting keys go to `missing`.
std::vector<Method> methods(const Registry& registry, std::vector<Missing>& missing);

/// Parameter search of a detector: every method text to measure on a scene. A text without parameters is the adapter's
/// default, which this project recommends.
struct Search {
    std::string name;             ///< detector name
    std::string library_default;  ///< the library's own default, as far as the adapter offers it
    std::vector<std::string> tried;
};

/// Searches for detectors whose settings change the time and not the result. `edge`: mean edge of the scene's tissue,
/// m.
std::vector<Search> searches(double edge);

/// Denominators of ratios.
inline constexpr std::string_view embree_anchor = "embree_collide";
inline constexpr std::string_view fcl_anchor = "fcl_bvh";

/// Method for a method text, for sweeps. Throws InputError as make_detector does.
Method method_of(const std::string& method);

}  // namespace trocar::bench
