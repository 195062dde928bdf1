#include "report/figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace trocar {
namespace {

/// Results::noise_floor().
double noise_between(const std::vector<RunFigures>& runs) {
    using Same = std::array<std::string, 8>;
    std::map<Same, std::vector<double>> processes;  // ns, median ticks of the processes that did the same
    for (const RunFigures& run : runs) {
        const RunSpec& spec = run.record->spec;
        if (spec.scene.empty()) continue;
        processes[{spec.mode, spec.scene, spec.detector, spec.response, spec.contacts, spec.stepper, spec.knob,
                   spec.point}]
            .push_back(run[Metric::total_median_ns]);
    }
    std::vector<double> spreads;
    for (const auto& [same, medians] : processes) {
        for (std::size_t i = 0; i < medians.size(); ++i) {
            for (std::size_t j = i + 1; j < medians.size(); ++j) {
                const double spread = std::abs(std::log(medians[i] / medians[j]));
                if (std::isfinite(spread)) spreads.push_back(spread);
            }
        }
    }
    return spreads.empty() ? not_known : std::exp(quantile(spreads, 0.95));
}

using TickTimes = std::vector<std::vector<double>>;  // ns, by process and tick

/// Timed ticks of a replay; empty when the processes did not time the same ticks.
TickTimes replayed_ticks(const SceneResult& result) {
    TickTimes times;
    for (const RunFigures& run : result.runs) {
        times.emplace_back();
        const std::vector<StepRow>& rows = run.record->rows;
        for (std::size_t i = static_cast<std::size_t>(warm_up_ticks); i < rows.size(); ++i) {
            times.back().push_back(static_cast<double>(tick_ns(rows[i], true)));
        }
        if (times.back().empty() || times.back().size() != times.front().size()) return {};
    }
    return times;
}

/// What is common to all processes: the course of the ticks without what the machine did to one of them.
std::vector<double> median_over_processes(const TickTimes& times) {
    std::vector<double> course;
    std::vector<double> tick(times.size());
    for (std::size_t t = 0; t < times.front().size(); ++t) {
        for (std::size_t p = 0; p < times.size(); ++p) tick[p] = times[p][t];
        course.push_back(median(tick));
    }
    return course;
}

}  // namespace

const std::string& fact_of(const Record& record, const std::string& key) {
    static const std::string none;
    const auto found = record.environment.find(key);
    return found == record.environment.end() ? none : found->second;
}

bool never_ran(const Record& record) {
    return record.outcome.kind == OutcomeKind::absent || record.outcome.kind == OutcomeKind::unsupported;
}

std::vector<const Record*> runs_of(const std::vector<Record>& records, std::string_view mode) {
    std::vector<const Record*> runs;
    for (const Record& record : records) {
        if (record.spec.mode == mode && !never_ran(record)) runs.push_back(&record);
    }
    return runs;
}

double known_sum(const std::vector<double>& values) {
    double sum = not_known;
    for (const double value : values) {
        if (!std::isnan(value)) sum = std::isnan(sum) ? value : sum + value;
    }
    return sum;
}

double known_largest(const std::vector<double>& values) {
    double largest = not_known;
    for (const double value : values) largest = std::fmax(largest, value);
    return largest;
}

bool meets_tissue(const std::string& pair_class) { return pair_class.find('T') != std::string::npos; }

double or_last(double value) { return std::isnan(value) ? std::numeric_limits<double>::infinity() : value; }

RunFigures figures_of(const Record& record) {
    RunFigures figures;
    figures.record = &record;
    for (const MetricInfo& info : metrics()) figures[info.metric] = value_of(record.summary, info.metric);
    if (record.summary.empty()) {  // a run that never began has missed nothing and cut nothing
        for (const auto count : {Metric::timed_ticks, Metric::deadline_misses, Metric::longest_burst, Metric::ruptures,
                                 Metric::truncated_ticks}) {
            figures[count] = 0.0;
        }
    }
    return figures;
}

bool same_motion(const RunFigures& a, const RunFigures& b) {
    const Record& first = *a.record;
    const Record& second = *b.record;
    const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
    // A state knows nothing of forces where scripts drive all bodies.
    return first.spec.scene == second.spec.scene && a.ok() && b.ok() && !first.state_hash.empty() &&
           first.state_hash == second.state_hash && same(a[Metric::force_max_n], b[Metric::force_max_n]) &&
           same(a[Metric::force_jump_max_n], b[Metric::force_jump_max_n]);
}

double as_printed(double value) {
    if (!std::isfinite(value) || value == 0.0) return value;
    const double step = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 2.0);
    return std::round(value / step) * step;
}

Estimate across_processes(const std::vector<double>& by_process) {
    Estimate result;
    result.processes = static_cast<int>(by_process.size());
    if (by_process.empty() ||
        std::any_of(by_process.begin(), by_process.end(), [](double v) { return std::isnan(v); })) {
        return result;
    }
    result.value = quantile(by_process, 0.5);
    if (result.processes < processes_for_interval) {
        const auto [low, high] = std::minmax_element(by_process.begin(), by_process.end());
        result.low = *low;
        result.high = *high;
        return result;
    }
    const auto interval = bootstrap(by_process, median, 1);
    result.low = interval.low;
    result.high = interval.high;
    return result;
}

Estimate across_processes(const std::vector<double>& by_process, const Resamples& resamples) {
    Estimate result = across_processes(by_process);
    if (resamples.empty() || std::isnan(result.value)) return result;
    const Bounds bounds = bounds_of_median(resamples);
    result.low = bounds.low;
    result.high = bounds.high;
    return result;
}

std::string by_stepper(const std::string& stepper) { return stepper.empty() ? stepper : " by " + stepper; }

std::string Method::label() const {
    std::string text = detector;
    if (!response.empty()) text += (text.empty() ? "" : " + ") + response;
    if (!contacts.empty() &&
        (mode == "closed_loop" || mode == "paced" || (mode == "replay" && contacts != "intersection")))
        text += " (" + contacts + ")";
    return text + by_stepper(stepper);
}

Method method_of(const RunSpec& spec) { return {spec.mode, spec.detector, spec.response, spec.contacts, spec.stepper}; }

bool SceneResult::ok() const {
    return !runs.empty() && std::all_of(runs.begin(), runs.end(), [](const RunFigures& run) { return run.ok(); });
}

bool SceneResult::not_applicable() const {
    return std::any_of(runs.begin(), runs.end(), [](const RunFigures& run) { return never_ran(*run.record); });
}

const Outcome& SceneResult::failure() const {
    return std::find_if(runs.begin(), runs.end(), [](const RunFigures& run) { return !run.ok(); })->record->outcome;
}

Estimate SceneResult::of(Metric metric) const {
    std::vector<double> values;
    for (const RunFigures& run : runs) values.push_back(run[metric]);
    return across_processes(values, resamples_of(metric));
}

const Resamples& SceneResult::resamples_of(Metric metric) const {
    static const Resamples none;
    if (metric == Metric::total_median_ns) return p50_resamples;
    return metric == Metric::total_p99_ns ? p99_resamples : none;
}

double SceneResult::first(Metric metric) const { return runs.empty() ? not_known : runs.front()[metric]; }

bool SceneResult::repeatable() const {
    return std::all_of(runs.begin(), runs.end(), [this](const RunFigures& run) {
        const Record& one = *run.record;
        const Record& other = *runs.front().record;
        return one.state_hash == other.state_hash && one.frames_hash == other.frames_hash &&
               std::equal(one.rows.begin(), one.rows.end(), other.rows.begin(), other.rows.end(),
                          [](const StepRow& a, const StepRow& b) {
                              return a.pairs == b.pairs && a.false_negatives == b.false_negatives &&
                                     a.false_positives == b.false_positives;
                          });
    });
}

Results::Results(const std::vector<Record>& records) {
    runs_.reserve(records.size());
    for (const Record& record : records) {
        runs_.push_back(figures_of(record));
        const RunSpec& spec = record.spec;
        if (spec.scene.empty()) continue;   // reported once for all scenes: an unanswerable combination
        if (!spec.point.empty()) continue;  // a knob that is turned makes another run, not another process of the same
        by_method_[method_of(spec)][spec.scene].runs.push_back(runs_.back());
        if (!spec.pair_class.empty()) class_of_scene_[spec.scene] = spec.pair_class;
    }
    for (auto& [method, scenes] : by_method_) {
        for (auto& [scene, result] : scenes) {
            std::sort(result.runs.begin(), result.runs.end(), [](const RunFigures& a, const RunFigures& b) {
                return a.record->spec.repetition < b.record->spec.repetition;
            });
        }
    }
    judge_by_twins();
    noise_floor_ = noise_between(runs_);
    const bool has_p99 = std::any_of(runs_.begin(), runs_.end(), [](const RunFigures& run) {
        return run.record->spec.mode == "closed_loop" && !std::isnan(run[Metric::total_p99_ns]);
    });
    if (has_p99) tail_metric_ = Metric::total_p99_ns;
    for (const std::string& scene : scenes("replay")) resample_ticks(scene);
}

void Results::judge_by_twins() {
    for (auto& [method, scenes] : by_method_) {
        if (method.mode != "closed_loop") continue;
        for (auto& [scene, result] : scenes) {
            for (RunFigures& run : result.runs) {
                if (run.judged() || !run.ok()) continue;
                for (const RunFigures& twin : runs_) {
                    const RunSpec& spec = twin.record->spec;
                    if (spec.mode != method.mode || !twin.judged() || !same_motion(run, twin)) {
                        continue;
                    }
                    for (const MetricInfo& info : metrics()) {
                        if (info.source == MetricSource::geometry) run[info.metric] = twin[info.metric];
                    }
                    break;
                }
            }
        }
    }
}

void Results::resample_ticks(const std::string& scene) {
    std::vector<std::pair<SceneResult*, TickTimes>> replayed;
    std::int64_t block = 1;
    for (auto& [method, scenes] : by_method_) {
        const auto found = scenes.find(scene);
        if (method.mode != "replay" || found == scenes.end() || !found->second.ok() ||
            found->second.runs.size() < static_cast<std::size_t>(processes_for_interval)) {
            continue;
        }
        TickTimes times = replayed_ticks(found->second);
        if (times.empty()) continue;
        // The longest of all, so that every method is drawn alike and none too finely.
        const std::vector<double> common = median_over_processes(times);
        block = std::max(block, block_length(static_cast<std::int64_t>(common.size()), lag_one_correlation(common)));
        replayed.emplace_back(&found->second, std::move(times));
    }
    for (auto& [result, times] : replayed) {
        constexpr std::size_t most_values = 2'000'000;  // sorted per process: a report is a matter of minutes
        const auto resamples = static_cast<int>(std::clamp<std::size_t>(most_values / times.front().size(), 200, 1000));
        auto resampled = resampled_quantiles(times, {0.5, 0.99}, block, 1, resamples);
        result->p50_resamples = std::move(resampled[0]);
        result->p99_resamples = std::move(resampled[1]);
    }
}

std::vector<Method> Results::methods(std::string_view mode) const {
    std::vector<Method> list;
    for (const auto& [method, scenes] : by_method_) {
        if (method.mode == mode) list.push_back(method);
    }
    return list;
}

std::vector<std::string> Results::scenes(std::string_view mode) const {
    std::set<std::string> names;
    for (const auto& [method, scenes] : by_method_) {
        if (method.mode != mode) continue;
        for (const auto& [scene, result] : scenes) names.insert(scene);
    }
    return {names.begin(), names.end()};
}

const std::string& Results::class_of(const std::string& scene) const {
    static const std::string unknown;
    const auto found = class_of_scene_.find(scene);
    return found == class_of_scene_.end() ? unknown : found->second;
}

const std::map<std::string, SceneResult>& Results::of(const Method& method) const {
    static const std::map<std::string, SceneResult> none;
    const auto scenes = by_method_.find(method);
    return scenes == by_method_.end() ? none : scenes->second;
}

bool Results::move_alike(const Method& a, const Method& b, const std::vector<std::string>& scenes) const {
    bool any = false;
    for (const std::string& scene : scenes) {
        const SceneResult* first = find(a, scene);
        const SceneResult* second = find(b, scene);
        if ((first == nullptr) != (second == nullptr)) return false;
        if (first == nullptr) continue;
        if (!first->ok() || !second->ok() || !same_motion(first->runs.front(), second->runs.front())) return false;
        any = true;
    }
    return any;
}

const SceneResult* Results::find(const Method& method, const std::string& scene) const {
    const auto result = of(method).find(scene);
    return result == of(method).end() ? nullptr : &result->second;
}

std::string Results::fact(const Method& method, const std::string& key) const {
    for (const auto& [scene, result] : of(method)) {
        for (const RunFigures& run : result.runs) {
            if (run.record->environment.contains(key)) return fact_of(*run.record, key);
        }
    }
    return {};
}

}  // namespace trocar
