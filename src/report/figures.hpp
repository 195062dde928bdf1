// Computes the numbers of a report from records alone: per run, over the processes of a run, and over scenes.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "measure/metrics.hpp"
#include "measure/record.hpp"
#include "measure/statistics.hpp"

namespace trocar {

inline constexpr int processes_for_interval = 10;  ///< with fewer, the interval is minimum to maximum over processes

/// Metrics of one run. NaN = n/a.
struct RunFigures {
    const Record* record = nullptr;
    std::array<double, metric_count> values{};  ///< by metric
    double operator[](Metric metric) const { return values.at(static_cast<std::size_t>(metric)); }
    double& operator[](Metric metric) { return values.at(static_cast<std::size_t>(metric)); }
    [[nodiscard]] bool ok() const { return record->outcome.ok(); }
    /// False for a run that is timed only: see Results.
    [[nodiscard]] bool judged() const { return record->spec.truth_stride > 0; }
};

RunFigures figures_of(const Record& record);

/// A fact of the run's environment, such as "run.stepper"; empty when absent.
const std::string& fact_of(const Record& record, const std::string& key);
/// Absent or unsupported: neither a number nor a failure.
bool never_ran(const Record& record);
/// Records of a mode that could run, in their order.
std::vector<const Record*> runs_of(const std::vector<Record>& records, std::string_view mode);

/// Sum and maximum of the known (not NaN) values; NaN without any.
double known_sum(const std::vector<double>& values);
double known_largest(const std::vector<double>& values);
/// True when a pair class ("I2T", "I2T+R2T" …) includes tissue.
bool meets_tissue(const std::string& pair_class);
/// Sort key: NaN comes last.
double or_last(double value);

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
Method method_of(const RunSpec& spec);

/// One method combination on one scene, processes in order of repetition.
struct SceneResult {
    std::vector<RunFigures> runs;
    /// Resamples of tick_p50 and tick_p99 over processes and blocks of ticks, drawn equally for all methods of the
    /// scene. Empty without replay or with too few processes.
    Resamples p50_resamples;
    Resamples p99_resamples;
    [[nodiscard]] const Record& record() const { return *runs.front().record; }
    [[nodiscard]] const std::string& scene() const { return record().spec.scene; }
    [[nodiscard]] bool ok() const;
    /// A process never ran.
    [[nodiscard]] bool not_applicable() const;
    /// Outcome of the first process that failed.
    [[nodiscard]] const Outcome& failure() const;
    [[nodiscard]] Estimate of(Metric metric) const;
    /// p50_resamples, p99_resamples, or empty for another metric.
    [[nodiscard]] const Resamples& resamples_of(Metric metric) const;
    /// Value of the first process, for figures independent of the clock.
    [[nodiscard]] double first(Metric metric) const;
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
    /// Results of a method by scene, in alphabetical order.
    [[nodiscard]] const std::map<std::string, SceneResult>& of(const Method& method) const;
    /// True when both methods ran on the same of these scenes, and moved alike on each.
    [[nodiscard]] bool move_alike(const Method& a, const Method& b, const std::vector<std::string>& scenes) const;
    /// Null when the study has no such run.
    [[nodiscard]] const SceneResult* find(const Method& method, const std::string& scene) const;
    /// A fact of the method's records, such as "detector.own"; empty when absent.
    [[nodiscard]] std::string fact(const Method& method, const std::string& key) const;
    /// Noise floor: ratio of medians below which a difference is not significant. It covers 95 % of the ratios between
    /// processes of one method on one scene and parameter value. NaN with one process per method.
    [[nodiscard]] double noise_floor() const { return noise_floor_; }
    /// p99 of a tick where a closed-loop run has enough ticks for one, else p90.
    [[nodiscard]] Metric tail_metric() const { return tail_metric_; }

private:
    void judge_by_twins();
    /// Fills the resamples of every method that replayed the scene.
    void resample_ticks(const std::string& scene);

    std::vector<RunFigures> runs_;
    std::map<Method, std::map<std::string, SceneResult>> by_method_;
    std::map<std::string, std::string> class_of_scene_;
    double noise_floor_ = not_known;
    Metric tail_metric_ = Metric::total_p90_ns;
};

}  // namespace trocar
