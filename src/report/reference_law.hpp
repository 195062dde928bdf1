// Errors of responses against the stored references, by law of contact.
#pragma once

#include <set>
#include <string>

#include "report/over_scenes.hpp"

namespace trocar {

/// The metrics of one law of contact.
struct ReferenceLaw {
    Metric force_error;     ///< N, root mean square
    Metric force_bound;     ///< N
    Metric force_max;       ///< N, of the reference
    Metric position_error;  ///< m, largest
    Metric position_bound;  ///< m
    bool of_scene;          ///< else hard
};
/// Contact as stiff as the scene says.
inline constexpr ReferenceLaw scene_law{Metric::force_error_rms_equal_k,     Metric::force_bound_equal_k,
                                        Metric::reference_force_max_equal_k, Metric::position_error_worst_equal_k,
                                        Metric::position_bound_equal_k,      true};
inline constexpr ReferenceLaw hard_law{Metric::force_error_rms_hard,     Metric::force_bound_hard,
                                       Metric::reference_force_max_hard, Metric::position_error_worst_hard,
                                       Metric::position_bound_hard,      false};

/// Closed-loop scenes on which some run knows the metric. A run that crashed does not know whether there is a
/// reference.
std::set<std::string> scenes_with(const Results& results, Metric metric);
ResultSet on_scenes(const ResultSet& results, const std::set<std::string>& scenes);

/// "3 of 5; 12 %": scenes with a force error within the bound of the reference; on the others the median error in
/// percent of the reference's largest force. A failed run is infinitely wrong.
std::string force_within_text(const ResultSet& on_references, const ReferenceLaw& law);

/// Percent of the reference's largest force, median over all scenes. A failed run is infinitely wrong.
double force_share(const ResultSet& on_references, const ReferenceLaw& law);

}  // namespace trocar
