#include "report/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

constexpr double us = 1.0e-3;  // ns to µs
constexpr double mm = 1.0e3;   // m to mm

std::int64_t tick_ns(const StepRow& row, bool replay) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < stage_count; ++i) {
        const auto stage = static_cast<Stage>(i);
        if (replay && stage != Stage::update && stage != Stage::detect) continue;
        sum += std::max<std::int64_t>(0, row.stage_ns.at(i));
    }
    return sum;
}

void add_times(const Record& record, RunFigures& figures) {
    const bool replay = record.spec.mode == "replay";
    std::vector<double> times;
    std::array<std::vector<double>, stage_count> stages;
    std::vector<double> work;
    double allocations = 0.0;
    double burst = 0.0;
    for (std::size_t i = 0; i < record.rows.size(); ++i) {
        const StepRow& row = record.rows[i];
        const auto time = static_cast<double>(tick_ns(row, replay));
        if (std::isnan(figures.tick_cold) && row.pairs > 0) figures.tick_cold = time;
        if (static_cast<std::int64_t>(i) < warm_up_ticks) continue;
        times.push_back(time);
        work.push_back(static_cast<double>(row.work.work()));
        allocations += row.allocations < 0 ? not_known : static_cast<double>(row.allocations);
        for (std::size_t s = 0; s < stage_count; ++s) {
            if (row.stage_ns.at(s) >= 0) stages.at(s).push_back(static_cast<double>(row.stage_ns.at(s)));
        }
        burst = time > haptic_deadline_ns ? burst + 1.0 : 0.0;
        figures.longest_burst = std::max(figures.longest_burst, burst);
        if (time > haptic_deadline_ns) figures.deadline_misses += 1.0;
    }
    for (std::size_t s = 0; s < stage_count; ++s) figures.stage_p50.at(s) = quantile(stages.at(s), 0.5);
    figures.timed_ticks = static_cast<double>(times.size());
    if (times.empty()) return;
    figures.allocations = allocations / figures.timed_ticks;
    figures.tick_p50 = quantile(times, 0.5);
    figures.tick_p90 = quantile(times, 0.9);
    if (static_cast<std::int64_t>(times.size()) >= ticks_for_p99) figures.tick_p99 = quantile(times, 0.99);
    figures.tick_max = *std::max_element(times.begin(), times.end());
    figures.work_p50 = quantile(work, 0.5);
    figures.work_max = *std::max_element(work.begin(), work.end());
}

void add_pairs(const Record& record, RunFigures& figures) {
    double pairs = 0.0;
    for (const StepRow& row : record.rows) {
        pairs += static_cast<double>(row.pairs);
        figures.pairs_max = std::max(figures.pairs_max, static_cast<double>(row.pairs));
        figures.ruptures += static_cast<double>(row.ruptures);
        figures.truncated_ticks += row.truncated ? 1.0 : 0.0;
        if (row.true_pairs < 0) continue;
        if (figures.judged_ticks == 0.0) {
            figures.true_pairs = figures.missing = figures.missing_touch = figures.extra = 0.0;
        }
        figures.judged_ticks += 1.0;
        figures.true_pairs += static_cast<double>(row.true_pairs);
        // NaN as soon as one judged tick does not tell.
        const double touch = row.true_touch < 0 ? not_known : static_cast<double>(row.true_touch);
        figures.true_touch = figures.judged_ticks == 1.0 ? touch : figures.true_touch + touch;
        figures.missing += static_cast<double>(std::max<std::int64_t>(0, row.missing));
        figures.missing_touch += static_cast<double>(std::max<std::int64_t>(0, row.missing_touch));
        figures.extra += static_cast<double>(std::max<std::int64_t>(0, row.extra));
    }
    if (!record.rows.empty()) figures.pairs_mean = pairs / static_cast<double>(record.rows.size());
}

void add_geometry(const Record& record, RunFigures& figures) {
    std::vector<double> errors;
    std::vector<double> left;
    for (const StepRow& row : record.rows) {
        if (std::isfinite(row.depth_error)) errors.push_back(row.depth_error);
        if (std::isfinite(row.max_strain)) {
            figures.strain_max =
                std::isnan(figures.strain_max) ? row.max_strain : std::max(figures.strain_max, row.max_strain);
        }
        if (!std::isfinite(row.max_depth)) continue;
        figures.left_last = row.max_depth;
        figures.left_max = std::isnan(figures.left_max) ? row.max_depth : std::max(figures.left_max, row.max_depth);
        if (row.pairs > 0 || row.max_depth > 0.0) left.push_back(row.max_depth);
    }
    if (!errors.empty()) {
        figures.depth_error_p50 = quantile(errors, 0.5);
        figures.depth_error_max = *std::max_element(errors.begin(), errors.end());
    }
    // Without any contact nothing was left either.
    if (!std::isnan(figures.left_max)) figures.left_p50 = left.empty() ? 0.0 : quantile(left, 0.5);
}

void add_forces(const Record& record, RunFigures& figures) {
    if (record.spec.mode != "closed_loop" || record.rows.empty()) return;
    std::vector<double> jumps;
    figures.force_max = 0.0;
    figures.force_flips = 0.0;
    for (std::size_t i = 0; i < record.rows.size(); ++i) {
        const Vector3& force = record.rows[i].tool_force;
        if (!force.allFinite()) continue;
        figures.force_max = std::max(figures.force_max, force.norm());
        if (i == 0) continue;
        const Vector3& before = record.rows[i - 1].tool_force;
        if (!before.allFinite()) continue;
        jumps.push_back((force - before).norm());
        if (force.dot(before) < 0.0) figures.force_flips += 1.0;
    }
    figures.force_jump_p99 =
        static_cast<std::int64_t>(jumps.size()) + 1 >= ticks_for_p99 ? quantile(jumps, 0.99) : not_known;
    if (!jumps.empty()) figures.force_jump_max = *std::max_element(jumps.begin(), jumps.end());
}

template <Stage stage>
double stage_us(const RunFigures& f) {
    return f.stage_p50.at(static_cast<std::size_t>(stage)) * us;
}

constexpr std::array metric_list{
    Metric{"timed_ticks", "Ticks that time figures are taken from: all but the first 10 of the run",
           [](const RunFigures& f) { return f.timed_ticks; }},
    Metric{"tick_p50_us",
           "Median time of a tick. Replay: update + detect; closed loop: move + update + detect + derive + respond + "
           "advance. Truth and metrics are never timed",
           [](const RunFigures& f) { return f.tick_p50 * us; }},
    Metric{"tick_p90_us", "90 % of the ticks took at most this", [](const RunFigures& f) { return f.tick_p90 * us; }},
    Metric{"tick_p99_us", "99 % of the ticks took at most this; only from 1000 timed ticks up",
           [](const RunFigures& f) { return f.tick_p99 * us; }},
    Metric{"tick_max_us", "Longest tick, the machine's own interruptions included",
           [](const RunFigures& f) { return f.tick_max * us; }},
    Metric{"tick_cold_us",
           "Time of the first tick with an intersecting pair, warm-up or not: what a surgeon feels first",
           [](const RunFigures& f) { return f.tick_cold * us; }},
    Metric{"deadline_misses", "Timed ticks longer than 1 ms (back-to-back loop)",
           [](const RunFigures& f) { return f.deadline_misses; }},
    Metric{"longest_burst", "Most misses in a row", [](const RunFigures& f) { return f.longest_burst; }},
    Metric{"move_p50_us", "Median time of stage move: pose of the instruments to vertices", stage_us<Stage::move>},
    Metric{"update_p50_us", "Median time of stage update: the detector follows the moved vertices",
           stage_us<Stage::update>},
    Metric{"detect_p50_us", "Median time of stage detect: the pairs, normalised and sorted", stage_us<Stage::detect>},
    Metric{"derive_p50_us", "Median time of stage derive: canonical contacts, the same code for every detector",
           stage_us<Stage::derive>},
    Metric{"respond_p50_us", "Median time of stage respond", stage_us<Stage::respond>},
    Metric{"advance_p50_us", "Median time of stage advance: the tissue's integrator", stage_us<Stage::advance>},
    Metric{"work_p50",
           "Median of vertices read + cells visited + box tests + triangle tests per tick, as the method counts",
           [](const RunFigures& f) { return f.work_p50; }},
    Metric{"work_max", "Largest of the same", [](const RunFigures& f) { return f.work_max; }},
    Metric{"allocations_per_tick", "Heap allocations inside timed stages, mean after the warm-up",
           [](const RunFigures& f) { return f.allocations; }},
    Metric{"judged_ticks", "Ticks on which the exact oracle was asked",
           [](const RunFigures& f) { return f.judged_ticks; }},
    Metric{"true_pairs", "Intersecting triangle pairs by exact arithmetic, touches included, sum over judged ticks",
           [](const RunFigures& f) { return f.true_pairs; }},
    Metric{"true_touches", "Of these, pairs that only touch in a vertex or an edge",
           [](const RunFigures& f) { return f.true_touch; }},
    Metric{"missing_pairs", "True pairs not reported, touches included", [](const RunFigures& f) { return f.missing; }},
    Metric{"missing_touches", "Of these, pairs that only touch", [](const RunFigures& f) { return f.missing_touch; }},
    Metric{"extra_pairs", "Reported pairs that do not intersect", [](const RunFigures& f) { return f.extra; }},
    Metric{"pairs_mean", "Reported pairs per tick, mean", [](const RunFigures& f) { return f.pairs_mean; }},
    Metric{"pairs_max", "Reported pairs per tick, largest", [](const RunFigures& f) { return f.pairs_max; }},
    Metric{
        "depth_error_p50_mm",
        "Median over ticks of the worst |depth of a contact - true depth at its point|, on the frame that detect saw",
        [](const RunFigures& f) { return f.depth_error_p50 * mm; }},
    Metric{"depth_error_max_mm", "Worst of the same", [](const RunFigures& f) { return f.depth_error_max * mm; }},
    Metric{
        "left_p50_mm",
        "Interpenetration left on the frame after the step: deepest instrument sample inside the other body by exact "
        "inside/outside; median over ticks with contact",
        [](const RunFigures& f) { return f.left_p50 * mm; }},
    Metric{"left_max_mm", "Largest of the same", [](const RunFigures& f) { return f.left_max * mm; }},
    Metric{"left_last_mm", "The same after the last tick", [](const RunFigures& f) { return f.left_last * mm; }},
    Metric{"force_max_N", "Largest tool force (mean over a tick)", [](const RunFigures& f) { return f.force_max; }},
    Metric{"force_jump_p99_N", "Change of the tool force from tick to tick, 99 %; only from 1000 ticks up",
           [](const RunFigures& f) { return f.force_jump_p99; }},
    Metric{"force_jump_max_N", "Largest of the same", [](const RunFigures& f) { return f.force_jump_max; }},
    Metric{"force_flips", "Ticks on which the tool force turned by more than 90 degrees",
           [](const RunFigures& f) { return f.force_flips; }},
    Metric{"strain_max", "Largest edge strain of the tissue (1 = doubled length)",
           [](const RunFigures& f) { return f.strain_max; }},
    Metric{"ruptures", "Ruptures that the response declared", [](const RunFigures& f) { return f.ruptures; }},
    Metric{"truncated_ticks", "Ticks on which a limit cut the list of pairs",
           [](const RunFigures& f) { return f.truncated_ticks; }},
};

/// splitmix64 (Steele, Lea, Flood 2014): the same resampling on every machine.
std::uint64_t next_random(std::uint64_t& state) {
    std::uint64_t z = (state += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
}

}  // namespace

RunFigures figures_of(const Record& record) {
    RunFigures figures;
    figures.record = &record;
    figures.stage_p50.fill(not_known);
    add_times(record, figures);
    add_pairs(record, figures);
    add_geometry(record, figures);
    add_forces(record, figures);
    return figures;
}

std::span<const Metric> metrics() { return metric_list; }

Interval across_processes(const std::vector<double>& by_process) {
    Interval result;
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
    // Percentile bootstrap of the median over processes (Efron and Tibshirani 1993, ch. 13).
    constexpr int resamples = 2000;
    std::uint64_t random = 1;
    std::vector<double> medians;
    std::vector<double> sample(by_process.size());
    for (int i = 0; i < resamples; ++i) {
        for (double& value : sample)
            value = by_process[static_cast<std::size_t>(next_random(random) % by_process.size())];
        medians.push_back(quantile(sample, 0.5));
    }
    result.low = quantile(medians, 0.025);
    result.high = quantile(medians, 0.975);
    return result;
}

std::string Contestant::label() const {
    std::string text = detector;
    if (!response.empty()) text += (text.empty() ? "" : " + ") + response;
    if (!contacts.empty() && mode == "closed_loop") text += " (" + contacts + ")";
    return text;
}

bool SceneResult::ok() const {
    return !runs.empty() && std::all_of(runs.begin(), runs.end(), [](const RunFigures& run) { return run.ok(); });
}

bool SceneResult::not_applicable() const {
    return std::any_of(runs.begin(), runs.end(), [](const RunFigures& run) {
        const OutcomeKind kind = run.record->outcome.kind;
        return kind == OutcomeKind::absent || kind == OutcomeKind::unsupported;
    });
}

Interval SceneResult::of(double RunFigures::*figure) const {
    std::vector<double> values;
    for (const RunFigures& run : runs) values.push_back(run.*figure);
    return across_processes(values);
}

double SceneResult::first(double RunFigures::*figure) const { return runs.empty() ? not_known : runs.front().*figure; }

bool SceneResult::repeatable() const {
    return std::all_of(runs.begin(), runs.end(), [this](const RunFigures& run) {
        const Record& one = *run.record;
        const Record& other = *runs.front().record;
        return one.state_hash == other.state_hash && one.frames_hash == other.frames_hash &&
               std::equal(one.rows.begin(), one.rows.end(), other.rows.begin(), other.rows.end(),
                          [](const StepRow& a, const StepRow& b) {
                              return a.pairs == b.pairs && a.missing == b.missing && a.extra == b.extra;
                          });
    });
}

Results::Results(const std::vector<Record>& records) {
    runs_.reserve(records.size());
    for (const Record& record : records) {
        runs_.push_back(figures_of(record));
        const RunSpec& spec = record.spec;
        if (spec.scene.empty()) continue;  // told once for all scenes: an unanswerable combination
        by_contestant_[{spec.mode, spec.detector, spec.response, spec.contacts}][spec.scene].runs.push_back(
            runs_.back());
        if (!spec.pair_class.empty()) class_of_scene_[spec.scene] = spec.pair_class;
    }
    std::vector<double> spreads;
    for (auto& [contestant, scenes] : by_contestant_) {
        for (auto& [scene, result] : scenes) {
            std::sort(result.runs.begin(), result.runs.end(), [](const RunFigures& a, const RunFigures& b) {
                return a.record->spec.repetition < b.record->spec.repetition;
            });
            for (std::size_t i = 0; i < result.runs.size(); ++i) {
                for (std::size_t j = i + 1; j < result.runs.size(); ++j) {
                    const double spread = std::abs(std::log(result.runs[i].tick_p50 / result.runs[j].tick_p50));
                    if (std::isfinite(spread)) spreads.push_back(spread);
                }
            }
        }
    }
    if (!spreads.empty()) noise_floor_ = std::exp(quantile(spreads, 0.95));
}

std::vector<Contestant> Results::contestants(std::string_view mode) const {
    std::vector<Contestant> list;
    for (const auto& [contestant, scenes] : by_contestant_) {
        if (contestant.mode == mode) list.push_back(contestant);
    }
    return list;
}

std::vector<std::string> Results::scenes(std::string_view mode) const {
    std::set<std::string> names;
    for (const auto& [contestant, scenes] : by_contestant_) {
        if (contestant.mode != mode) continue;
        for (const auto& [scene, result] : scenes) names.insert(scene);
    }
    return {names.begin(), names.end()};
}

const std::string& Results::class_of(const std::string& scene) const {
    static const std::string unknown;
    const auto found = class_of_scene_.find(scene);
    return found == class_of_scene_.end() ? unknown : found->second;
}

const SceneResult* Results::find(const Contestant& contestant, const std::string& scene) const {
    const auto scenes = by_contestant_.find(contestant);
    if (scenes == by_contestant_.end()) return nullptr;
    const auto result = scenes->second.find(scene);
    return result == scenes->second.end() ? nullptr : &result->second;
}

std::string Results::fact(const Contestant& contestant, const std::string& key) const {
    const auto scenes = by_contestant_.find(contestant);
    if (scenes == by_contestant_.end()) return {};
    for (const auto& [scene, result] : scenes->second) {
        for (const RunFigures& run : result.runs) {
            const auto found = run.record->environment.find(key);
            if (found != run.record->environment.end()) return found->second;
        }
    }
    return {};
}

}  // namespace trocar
