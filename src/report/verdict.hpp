// Speed and error of every method over a set of scenes, as one table, computed from records. Page 1
// (page_one.hpp) shows a subset.
#pragma once

#include <string>
#include <vector>

#include "report/chart.hpp"
#include "report/document.hpp"
#include "report/over_scenes.hpp"

namespace trocar {

/// One method combination over a set of scenes. Times: geometric mean over the scenes per process, then over processes.
struct VerdictRow {
    Method method;
    bool ours = false;       ///< its response is the study's `ours`
    bool control = false;    ///< it includes a control method: listed last, never ranked
    bool reference = false;  ///< its detector is the denominator of ratios
    ResultSet planned;       ///< scenes that could run
    ResultSet ok;            ///< of these: all processes ended well
    ResultSet judged;        ///< of these: scenes with tissue, or all of a verdict without any
    int failed_runs = 0;
    bool not_applicable = false;      ///< absent or unsupported on at least one scene
    double error = not_known;         ///< m, geometric mean over scenes of error_on()
    double slowest_tick = not_known;  ///< ns, maximum of Results::tail_metric() over the judged scenes
    Estimate p50;                     ///< ns
    Estimate p99;                     ///< ns; NaN: too few ticks, or a failed scene
    Estimate ratio;                   ///< p50 relative to the reference detector with the same response
    int identical_to = -1;            ///< row with bit-identical motion on every scene; -1: none
    bool dominated = false;           ///< another row is at least as fast and accurate, and better in one.
    [[nodiscard]] std::vector<std::string> scene_names() const;  ///< planned
    /// Residual penetration on the judged scenes, m: the largest, and the median over scenes of the median.
    [[nodiscard]] double residual_max() const { return judged.largest(Metric::residual_penetration_max_m); }
    [[nodiscard]] double residual_median() const { return judged.median(Metric::residual_penetration_median_m); }
    /// N RMS over scenes: the largest error beyond the bound of its reference, and the largest bound of the others.
    struct ForceError {
        double worst = not_known;
        double within = not_known;
    };
    [[nodiscard]] ForceError force_error(Metric of, Metric bound) const;
    /// Sum of false negatives, false positives, and unreported contacts between frames where the study checks them.
    /// NaN: not judged.
    [[nodiscard]] double wrong() const;
};

VerdictRow make_row(const Results& results, const Method& method, const std::string& reference,
                    const std::vector<std::string>& scenes);

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
/// The rows point into the results.
Verdict make_verdict(Results&& results, const std::string& reference, const std::string& mode,
                     const std::vector<std::string>& scenes) = delete;

/// Rows with identical motion are merged into one, which lists all names with their times.
Table verdict_table(const Verdict& verdict, const std::string& caption, double noise_floor);
/// Table of Verdict::partial, sorted by scenes and error; may have no rows.
Table partial_table(const Verdict& verdict, const std::string& caption, double noise_floor);
/// An answer that a limit cut is unknown, never free of contact: ", cut in 3 ticks" stands wherever missed pairs do.
std::string cut_text(const ResultSet& results);
/// "1 of 12": contacts between frames that were never reported.
std::string between_text(const ResultSet& results);

}  // namespace trocar
