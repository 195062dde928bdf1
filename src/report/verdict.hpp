// Speed and error of every method over a set of scenes, as one table and one chart, computed from records. Page 1
// (page_one.hpp) shows a subset.
#pragma once

#include <string>
#include <vector>

#include "report/chart.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"

namespace trocar {

/// One method combination over a set of scenes. Times: geometric mean over the scenes per process, then over processes.
struct VerdictRow {
    Method method;
    bool ours = false;       ///< its response is the study's `ours`
    bool control = false;    ///< it includes a control method: listed last, never ranked
    bool reference = false;  ///< its detector is the denominator of ratios
    int scenes = 0;          ///< planned scenes that could run
    int scenes_ok = 0;
    std::vector<std::string> scene_names;  ///< planned scenes
    int runs = 0;
    int failed_runs = 0;
    bool not_applicable = false;    ///< absent or unsupported on at least one scene
    double true_pairs = not_known;  ///< sum over scenes
    double false_negatives = not_known;
    double truncated_ticks = 0.0;  ///< ticks with a truncated pair list
    double false_positives = not_known;
    double contact_events = not_known;         ///< contacts of bodies found by the space-time oracle, sum over scenes
    double contact_events_missed = not_known;  ///< of contacts_between, reported neither at a frame nor between frames
    double depth_error_median_m = not_known;   ///< m, median over scenes of the median
    double depth_error_max_m = not_known;      ///< m, worst over scenes
    double error = not_known;                  ///< m, geometric mean over scenes of error_on()
    /// residual penetration, m, median over tissue scenes of the median; without tissue scenes, over all
    double residual_penetration_median_m = not_known;
    double residual_penetration_max_m = not_known;  ///< m, maximum over the same scenes
    double slowest_p99 = not_known;                 ///< ns, maximum p99 over the same scenes
    double tears = not_known;                       ///< ruptures, sum over scenes
    double side_undecided_max = not_known;          ///< samples with undecided side in the oracle, maximum over scenes
    double force_error_rms_equal_k =
        not_known;                            ///< N RMS against the reference of equal stiffness, maximum over scenes
    double force_error_rms_hard = not_known;  ///< N RMS against hard contact, maximum over scenes
    double force_within_equal_k = not_known;  ///< N RMS, largest bound of the references that give no error
    double force_within_hard = not_known;
    Estimate p50;                  ///< ns
    Estimate p99;                  ///< ns; NaN: too few ticks, or a failed scene
    Estimate ratio;                ///< p50 relative to the reference detector with the same response
    double deadline_misses = 0.0;  ///< sum over processes
    double timed_ticks = 0.0;
    int identical_to = -1;   ///< row with bit-identical motion on every scene; -1: none
    bool dominated = false;  ///< another row is at least as fast and accurate, and better in one.
    /// Sum of false negatives, false positives, and unreported contacts between frames where the study checks them.
    /// NaN: not judged.
    [[nodiscard]] double wrong() const;
};

struct Verdict {
    std::string mode;  ///< "closed_loop", or "replay" in a study of detectors only
    std::vector<std::string> scenes;
    std::vector<VerdictRow> rows;  ///< by error, then time; failed ones last
    /// Methods planned on a subset of the scenes. They are not comparable with `rows` and have their own table. Empty
    /// when no method was planned on all scenes.
    std::vector<VerdictRow> partial;
    [[nodiscard]] bool error_is_depth() const;
};

Verdict make_verdict(const Results& results, const std::string& reference, const std::string& mode,
                     const std::vector<std::string>& scenes);

/// Rows with identical motion are merged into one, which lists all names with their times.
Table verdict_table(const Verdict& verdict, const std::string& caption, double noise_floor);
/// Table of Verdict::partial, sorted by scenes and error; may have no rows.
Table partial_table(const Verdict& verdict, const std::string& caption, double noise_floor);
/// Has no series when no row has both time and error.
ScatterChart verdict_chart(const Verdict& verdict);
/// "12.3 [11.9–12.8]"; no brackets for one process.
std::string estimate_text(const Estimate& interval, double scale);

}  // namespace trocar
