// Computes the numbers of a report from records alone: per run, over the processes of a run, and over scenes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "measure/record.hpp"
#include "measure/statistics.hpp"

namespace trocar {

inline constexpr int processes_for_interval = 10;  ///< with fewer, the interval is minimum to maximum over processes
inline constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

/// Figures of one run; each is the summary figure of measure/metrics.hpp that figures.cpp names beside it. NaN = n/a.
struct RunFigures {
    const Record* record = nullptr;
    double substeps = not_known;  ///< n_sub, substeps of the integrator per tick; NaN in a replay
    double timed_ticks = not_known;
    double total_median_ns = not_known;           ///< ns
    double total_p90_ns = not_known;              ///< ns
    double total_p99_ns = not_known;              ///< ns; NaN below 1000 timed ticks
    double total_p999_ns = not_known;             ///< ns; NaN below 100 000 timed ticks
    double total_max_ns = not_known;              ///< ns
    double total_cold_ns = not_known;             ///< ns, first tick with a pair
    double deadline_misses = not_known;           ///< timed ticks longer than 1 ms
    double longest_burst = not_known;             ///< longest run of such ticks
    std::array<double, stage_count> stage_p50{};  ///< ns; NaN: stage not present
    std::array<double, stage_count> stage_p99{};  ///< ns
    double work_median = not_known;
    double work_max = not_known;
    double allocations_median = not_known;  ///< median per tick after the warm-up
    double true_pairs = not_known;          ///< sums over judged ticks
    double false_negatives = not_known;
    double false_negatives_touch = not_known;
    double true_touches = not_known;  ///< of true_pairs, those that only touch
    double false_positives = not_known;
    double contact_events = not_known;         ///< contacts of two bodies found by the space-time oracle
    double contact_events_missed = not_known;  ///< of contacts_between, not reported
    double query_distance_max_m =
        not_known;  ///< largest query distance, m; NaN where no contact generator uses near pairs
    double true_proximity_pairs =
        not_known;  ///< near pairs within the query distance, sum over the ticks judged in detail
    double proximity_false_negatives = not_known;       ///< of true_proximity_pairs, not reported
    double depth_error_median_m = not_known;            ///< m, over ticks with a contact
    double depth_error_max_m = not_known;               ///< m
    double residual_penetration_median_m = not_known;   ///< residual penetration, m, over ticks with a pair or a depth
    double residual_penetration_max_m = not_known;      ///< m
    double residual_penetration_final_m = not_known;    ///< m, after the last tick
    double residual_penetration_settled_m = not_known;  ///< m, from 200 ms after the last keyframe on
    double overlap_volume_max_m3 = not_known;           ///< m³
    double min_translation_max_m = not_known;           ///< m
    double ticks_to_clear_median = not_known;
    double ticks_to_clear_max = not_known;
    double uncleared = not_known;
    double re_penetrations = not_known;
    double overshoot_max_m = not_known;  ///< m
    double wrong_side_vertices_max = not_known;
    double wrong_side_vertices_last = not_known;
    double side_undecided_max = not_known;    ///< samples with undecided side in the oracle, maximum over ticks
    double side_undecided_ticks = not_known;  ///< judged ticks with an undecided sample
    double native_contacts_mean = not_known;  ///< native contacts per tick
    double pairs_mean = not_known;            ///< per tick
    double pairs_max = not_known;
    double force_max_n = not_known;                   ///< N
    double force_error_rms_equal_k = not_known;       ///< N, RMS below 30 Hz, against the reference of equal stiffness
    double force_error_rms_hard = not_known;          ///< N, same against hard contact
    double force_error_worst_equal_k = not_known;     ///< N
    double force_error_worst_hard = not_known;        ///< N
    double force_bound_equal_k = not_known;           ///< error bound of the reference, N RMS
    double force_bound_hard = not_known;              ///< N RMS
    double position_error_worst_equal_k = not_known;  ///< m
    double reference_clears_hard = not_known;
    double force_jump_p99_n = not_known;        ///< N per tick
    double force_jump_max_n = not_known;        ///< N per tick
    double force_without_touch_m = not_known;   ///< m
    double force_flips = not_known;             ///< ticks on which the force direction changes by more than 90 degrees
    double force_above_30hz_rms_n = not_known;  ///< N, above 30 Hz
    double force_above_30hz_share = not_known;
    double momentum_residual_share = not_known;
    double energy_residual_share = not_known;
    double max_strain = not_known;
    double strain_over_max = not_known;
    double ruptures = not_known;
    double truncated_ticks = not_known;
    [[nodiscard]] bool ok() const { return record->outcome.ok(); }
    /// False for a run that is timed only: see Results.
    [[nodiscard]] bool judged() const { return record->spec.truth_stride > 0; }
};

RunFigures figures_of(const Record& record);

/// One summary figure; NaN when the run lacks it.
double summary_of(const Record& record, const std::string& key);

/// Maximum of the known (not NaN) values.
void take_larger(double& largest, double value);
/// Sum of the known values; the first known value replaces NaN.
void add_known(double& sum, double value);
/// True when a pair class ("I2T", "I2T+R2T" …) includes tissue.
bool meets_tissue(const std::string& pair_class);
/// Sort key: NaN comes last.
double or_last(double value);

/// Suffix of a depth, " (12 undecided)"; empty when the oracle decides all sides.
std::string undecided_text(double samples);
inline constexpr const char* undecided_note =
    "Undecided: sample points, most after a tick, whose side truth leaves open, since the rim of an open sheet is "
    "inside their body; no depth is taken of them.";

/// Rounds to the three digits of the tables, so that equal printed values compare equal.
double as_printed(double value);

/// One figure over several processes: the median, with a 95 % interval (from 10 processes on) or minimum to maximum.
/// Tick median and p99 of a replay use intervals over processes and blocks of ticks.
struct Estimate {
    double value = not_known;
    double low = not_known;
    double high = not_known;
    int processes = 0;
};
Estimate across_processes(const std::vector<double>& by_process);

/// Same with the 95 % interval of the resampled medians. Unchanged without resamples.
Estimate across_processes(const std::vector<double>& by_process, const Resamples& resamples);

/// " by implicit"; empty for the default stepper.
std::string by_stepper(const std::string& stepper);

/// Compared method combination: the run specification without scene and repetition.
struct Method {
    std::string mode;
    std::string detector;
    std::string response;
    std::string contacts;
    std::string stepper = {};  ///< as RunSpec::stepper
    auto operator<=>(const Method&) const = default;
    /// "ohc + penalty (intersection)", and " by implicit" where the stepper is not the default one
    [[nodiscard]] std::string label() const;
};

/// One method combination on one scene, processes in order of repetition.
struct SceneResult {
    std::vector<RunFigures> runs;
    /// Resamples of tick_p50 and tick_p99 over processes and blocks of ticks, drawn equally for all methods of the
    /// scene. Empty without replay or with too few processes.
    Resamples p50_resamples;
    Resamples p99_resamples;
    [[nodiscard]] bool ok() const;
    /// Absent or unsupported: neither a number nor a failure.
    [[nodiscard]] bool not_applicable() const;
    [[nodiscard]] Estimate of(double RunFigures::*figure) const;
    /// p50_resamples, p99_resamples, or empty for another figure.
    [[nodiscard]] const Resamples& resamples_of(double RunFigures::*figure) const;
    /// Value of the first process, for figures independent of the clock.
    [[nodiscard]] double first(double RunFigures::*figure) const;
    /// True when final state and pairs are equal over all processes.
    [[nodiscard]] bool repeatable() const;
};

/// True when two runs of one scene have bit-identical motion under equal forces.
bool same_motion(const RunFigures& a, const RunFigures& b);

/// Figures of all runs by method and scene. An unjudged closed-loop run takes the outcome figures of a judged run with
/// bit-identical motion. Figures of its own pairs stay unknown.
class Results {
public:
    explicit Results(const std::vector<Record>& records);
    Results(const Results&) = delete;
    Results& operator=(const Results&) = delete;
    Results(Results&&) = delete;
    Results& operator=(Results&&) = delete;
    ~Results() = default;

    [[nodiscard]] const std::vector<RunFigures>& runs() const { return runs_; }  ///< in the order of the records
    [[nodiscard]] std::vector<Method> methods(std::string_view mode) const;
    [[nodiscard]] std::vector<std::string> scenes(std::string_view mode) const;
    [[nodiscard]] const std::string& class_of(const std::string& scene) const;
    /// Null when the study has no such run.
    [[nodiscard]] const SceneResult* find(const Method& method, const std::string& scene) const;
    /// A fact of the method's records, such as "detector.own"; empty when absent.
    [[nodiscard]] std::string fact(const Method& method, const std::string& key) const;
    /// Noise floor: ratio of medians below which a difference is not significant. It covers 95 % of the ratios between
    /// processes of one method on one scene and parameter value. NaN with one process per method.
    [[nodiscard]] double noise_floor() const { return noise_floor_; }

private:
    void judge_by_twins();
    /// Fills the resamples of every method that replayed the scene.
    void resample_ticks(const std::string& scene);

    std::vector<RunFigures> runs_;
    std::map<Method, std::map<std::string, SceneResult>> by_method_;
    std::map<std::string, std::string> class_of_scene_;
    double noise_floor_ = not_known;
};

}  // namespace trocar
