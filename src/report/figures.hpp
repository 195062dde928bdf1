// From records to the numbers of a report: what one run says, what several processes of a run say together, and what
// several scenes say together. Everything a table or a chart prints comes from here, and from records alone.
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

inline constexpr int processes_for_interval = 10;  ///< fewer: minimum to maximum over processes
inline constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

/// What one run says, in the words of the report; every number is the run's summary figure of measure/metrics.hpp that
/// figures.cpp names beside it. NaN = n/a.
struct RunFigures {
    const Record* record = nullptr;
    double substeps = not_known;  ///< n_sub, of the integrator in a tick; NaN in a replay
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
    double true_touches = not_known;  ///< touching pairs among the true ones
    double false_positives = not_known;
    double contact_events = not_known;         ///< contacts of two bodies that the space-time oracle sees
    double contact_events_missed = not_known;  ///< of these
    double query_distance_max_m = not_known;   ///< m; NaN where no source asks for near pairs
    double true_proximity_pairs =
        not_known;  ///< near pairs within the query distance, sum over the ticks judged in detail
    double proximity_false_negatives = not_known;       ///< of these: not brought
    double depth_error_median_m = not_known;            ///< m, over ticks with a contact
    double depth_error_max_m = not_known;               ///< m
    double residual_penetration_median_m = not_known;   ///< m, over ticks with a pair or a depth
    double residual_penetration_max_m = not_known;      ///< m
    double residual_penetration_final_m = not_known;    ///< m, after the last tick
    double residual_penetration_settled_m = not_known;  ///< m, from 200 ms after the last key on
    double overlap_volume_max_m3 = not_known;           ///< m³
    double min_translation_max_m = not_known;           ///< m
    double ticks_to_clear_median = not_known;
    double ticks_to_clear_max = not_known;
    double uncleared = not_known;
    double re_penetrations = not_known;
    double overshoot_max_m = not_known;  ///< m
    double wrong_side_vertices_max = not_known;
    double wrong_side_vertices_last = not_known;
    double side_undecided_max = not_known;    ///< samples whose side truth leaves open, most after a tick
    double side_undecided_ticks = not_known;  ///< judged ticks with such a sample
    double native_contacts_mean = not_known;  ///< native contacts per tick
    double pairs_mean = not_known;            ///< per tick
    double pairs_max = not_known;
    double force_max_n = not_known;                   ///< N
    double force_error_rms_equal_k = not_known;       ///< N, RMS below 30 Hz to the reference of equal stiffness
    double force_error_rms_hard = not_known;          ///< N, the same to hard contact
    double force_error_worst_equal_k = not_known;     ///< N
    double force_error_worst_hard = not_known;        ///< N
    double force_bound_equal_k = not_known;           ///< N RMS that the reference knows
    double force_bound_hard = not_known;              ///< N RMS
    double position_error_worst_equal_k = not_known;  ///< m
    double reference_clears_hard = not_known;
    double force_jump_p99_n = not_known;        ///< N per tick
    double force_jump_max_n = not_known;        ///< N per tick
    double force_without_touch_m = not_known;   ///< m
    double force_flips = not_known;             ///< ticks on which the force turned by more than 90 degrees
    double force_above_30hz_rms_n = not_known;  ///< N, above 30 Hz
    double force_above_30hz_share = not_known;
    double momentum_residual_share = not_known;
    double energy_residual_share = not_known;
    double max_strain = not_known;
    double strain_over_max = not_known;
    double ruptures = not_known;
    double truncated_ticks = not_known;
    [[nodiscard]] bool ok() const { return record->outcome.ok(); }
    /// False where the study wanted this run timed only: see Results.
    [[nodiscard]] bool judged() const { return record->spec.truth_stride > 0; }
};

RunFigures figures_of(const Record& record);

/// One figure of a record's summary; NaN when the run does not have it.
double summary_of(const Record& record, const std::string& key);

/// Keeps the larger one of those that are known (not NaN).
void take_larger(double& largest, double value);
/// Adds where both are known; the first known value replaces NaN.
void add_known(double& sum, double value);
/// Whether a class of pairs ("I2T", "I2T+R2T" …) names tissue.
bool meets_tissue(const std::string& pair_class);
/// For orders by size: what is not known comes last.
double or_last(double value);

/// " (12 undecided)", what stands behind a depth; empty where truth could report all sides.
std::string undecided_text(double samples);
inline constexpr const char* undecided_note =
    "Undecided: sample points, most after a tick, whose side truth leaves open, since the rim of an open sheet is "
    "inside their body; no depth is taken of them.";

/// Rounded to the three digits that tables print: what reads alike is equal, so that no row wins by a digit nobody
/// sees.
double as_printed(double value);

/// The same figure from several processes: the median, and 95 % (from 10 processes up) or minimum to maximum. Median
/// and 99 % of the ticks of a replay, which all processes share, have theirs over processes and blocks of ticks.
struct Estimate {
    double value = not_known;
    double low = not_known;
    double high = not_known;
    int processes = 0;
};
Estimate across_processes(const std::vector<double>& by_process);

/// The same with another interval: 95 % of the median over the processes resampled. Unchanged without a resample.
Estimate across_processes(const std::vector<double>& by_process, const Resamples& resamples);

/// " by implicit"; empty for the default stepper.
std::string by_stepper(const std::string& stepper);

/// Who is compared: everything of a specification but scene and repetition.
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

/// One method on one scene: its processes in order of repetition.
struct SceneResult {
    std::vector<RunFigures> runs;
    /// Of a replay with processes enough: tick_p50 and tick_p99 resampled over processes and blocks of ticks, drawn
    /// alike for all methods of the scene. Empty otherwise.
    Resamples p50_resamples;
    Resamples p99_resamples;
    [[nodiscard]] bool ok() const;
    /// Not made or not applicable (absent, unsupported): neither a number nor a failure.
    [[nodiscard]] bool not_applicable() const;
    [[nodiscard]] Estimate of(double RunFigures::*figure) const;
    /// p50_resamples, p99_resamples, or none for another figure.
    [[nodiscard]] const Resamples& resamples_of(double RunFigures::*figure) const;
    /// Of the first process: for figures that do not depend on the clock.
    [[nodiscard]] double first(double RunFigures::*figure) const;
    /// True when every process ended on the same state and the same pairs.
    [[nodiscard]] bool repeatable() const;
};

/// Two runs of one scene that moved alike, bit by bit, under the same forces.
bool same_motion(const RunFigures& a, const RunFigures& b);

/// A closed-loop run that a study leaves unjudged and that moved as a judged one did is reported with what truth says
/// of that one's outcome; what truth says of its own pairs stays unknown.
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
    /// Null when the method was not planned on the scene.
    [[nodiscard]] const SceneResult* find(const Method& method, const std::string& scene) const;
    /// A fact of the method's records, such as "detector.own"; empty when they have none.
    [[nodiscard]] std::string fact(const Method& method, const std::string& key) const;
    /// Factor below which two medians cannot be distinguished: 95 % of the ratios between processes of the same method
    /// on the same scene (and, where a knob is turned, at the same point) lie within it. NaN, not known, when every
    /// method has one process.
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
