// Who is how fast and how wrong, over a set of scenes: every method with all its columns, in one table and one
// chart. Page 1 (page_one.hpp) takes the few that a hurried reader needs. All of it is computed from records.
#pragma once

#include <string>
#include <vector>

#include "report/chart.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"

namespace trocar {

/// One method over a set of scenes. Times: geometric mean over the scenes, per process, then across processes.
struct VerdictRow {
    Method method;
    bool ours = false;       ///< its response is the one that the study names as `ours`
    bool control = false;    ///< a method of it holds the others to account: reported last, never ranked
    bool reference = false;  ///< its detector is the one that ratios are taken to
    int scenes = 0;          ///< scenes it was planned on and that could be run
    int scenes_ok = 0;
    std::vector<std::string> scene_names;  ///< those it was planned on
    int runs = 0;
    int failed_runs = 0;
    bool not_applicable = false;    ///< absent or unsupported on at least one scene
    double true_pairs = not_known;  ///< sum over scenes
    double false_negatives = not_known;
    double truncated_ticks = 0.0;  ///< in which a limit cut the list of pairs
    double false_positives = not_known;
    double contact_events = not_known;         ///< of bodies, seen by the space-time oracle, sum over scenes
    double contact_events_missed = not_known;  ///< of these, neither at a frame nor between frames
    double depth_error_median_m = not_known;   ///< m, median over scenes of the median
    double depth_error_max_m = not_known;      ///< m, worst over scenes
    double error = not_known;                  ///< m, geometric mean over scenes of error_on()
    double residual_penetration_median_m =
        not_known;  ///< m, median over the tissue scenes of the median; without one, over all
    double residual_penetration_max_m = not_known;  ///< m, worst of the same scenes
    double slowest_p99 = not_known;                 ///< ns, p99 of the slowest of the same scenes
    double tears = not_known;                       ///< ruptures, summed over the scenes
    double side_undecided_max = not_known;          ///< samples whose side truth leaves open, worst over scenes
    double force_error_rms_equal_k = not_known;     ///< N RMS to the reference of equal stiffness, worst over scenes
    double force_error_rms_hard = not_known;        ///< N RMS to hard contact, worst over scenes
    double force_within_equal_k = not_known;        ///< N RMS, largest bound of the references that report no error
    double force_within_hard = not_known;
    Estimate p50;                  ///< ns
    Estimate p99;                  ///< ns; NaN: n too small, or a scene failed
    Estimate ratio;                ///< of p50 to the reference detector with the same response
    double deadline_misses = 0.0;  ///< of all processes
    double timed_ticks = 0.0;
    int identical_to = -1;   ///< row with the same motion, bit by bit, on every scene; -1: none
    bool dominated = false;  ///< another row is at least as fast and as good, and better in one
    /// Pairs missed and extra, and contacts between frames never reported where a study searches for them. NaN: not
    /// judged.
    [[nodiscard]] double wrong() const;
};

struct Verdict {
    std::string mode;  ///< "closed_loop", or "replay" in a study of detectors alone
    std::vector<std::string> scenes;
    std::vector<VerdictRow> rows;  ///< by error, fastest of equals first, failed ones last
    /// Methods that were planned on some of the scenes only: their errors and means are over those and compare with
    /// no other row, so they are reported in a table of their own. Empty when no method was planned on all scenes.
    std::vector<VerdictRow> partial;
    [[nodiscard]] bool error_is_depth() const;
};

Verdict make_verdict(const Results& results, const std::string& reference, const std::string& mode,
                     const std::vector<std::string>& scenes);

/// Rows that move alike are printed as one, which names them all with their times.
Table verdict_table(const Verdict& verdict, const std::string& caption, double noise_floor);
/// Verdict::partial, sorted by scenes and error; without rows when there is none.
Table partial_table(const Verdict& verdict, const std::string& caption, double noise_floor);
/// Without series when no row has both a time and an error.
ScatterChart verdict_chart(const Verdict& verdict);
/// "12.3 [11.9–12.8]"; without brackets for one process.
std::string estimate_text(const Estimate& interval, double scale);

}  // namespace trocar
