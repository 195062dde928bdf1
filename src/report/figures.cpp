#include "report/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

constexpr double us = 1.0e-3;  // ns to µs

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
    double burst = 0.0;
    for (std::size_t i = 0; i < record.rows.size(); ++i) {
        const StepRow& row = record.rows[i];
        const auto time = static_cast<double>(tick_ns(row, replay));
        if (row.outcome != OutcomeKind::ok) continue;
        if (std::isnan(figures.tick_cold) && row.pairs > 0) figures.tick_cold = time;
        if (static_cast<std::int64_t>(i) < warm_up_ticks) continue;
        times.push_back(time);
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
    figures.tick_p50 = quantile(times, 0.5);
    figures.tick_p90 = quantile(times, 0.9);
    figures.tick_p99 = tail_quantile(times, 0.99).value_or(not_known);
    figures.tick_max = *std::max_element(times.begin(), times.end());
}

double summary_of(const Record& record, const char* key) {
    const auto found = record.summary.find(key);
    return found == record.summary.end() ? not_known : found->second;
}

void add_summary(const Record& record, RunFigures& figures) {
    figures.work_p50 = summary_of(record, "work_median");
    figures.work_max = summary_of(record, "work_max");
    figures.allocations = summary_of(record, "allocations_median");
    figures.true_pairs = summary_of(record, "true_pairs");
    figures.missing = summary_of(record, "missing");
    figures.missing_touch = summary_of(record, "missing_touch");
    figures.extra = summary_of(record, "extra");
    figures.depth_error_p50 = summary_of(record, "depth_error_median_m");
    figures.depth_error_max = summary_of(record, "depth_error_max_m");
    figures.left_p50 = summary_of(record, "residual_median_m");
    figures.left_max = summary_of(record, "residual_max_m");
    figures.left_last = summary_of(record, "residual_last_m");
    figures.pairs_max = summary_of(record, "pairs_max");
    figures.force_max = summary_of(record, "force_max_n");
    figures.force_error = summary_of(record, "force_error_rms_n");
    figures.force_jump_max = summary_of(record, "force_jump_max_n");
    figures.strain_max = summary_of(record, "max_strain");
    figures.ruptures = summary_of(record, "ruptures");
    figures.truncated_ticks = summary_of(record, "truncated_ticks");
}

/// What a summary does not hold because only a report needs it.
void add_from_rows(const Record& record, RunFigures& figures) {
    std::vector<double> jumps;
    double pairs = 0.0;
    double native = 0.0;
    for (std::size_t i = 0; i < record.rows.size(); ++i) {
        const StepRow& row = record.rows[i];
        pairs += static_cast<double>(row.pairs);
        native += static_cast<double>(row.native_contacts);
        if (row.true_pairs >= 0) {
            // NaN as soon as one judged tick does not tell.
            const double touch = row.true_touch < 0 ? not_known : static_cast<double>(row.true_touch);
            figures.true_touch = std::isnan(figures.true_touch) ? touch : figures.true_touch + touch;
        }
        if (i == 0 || record.spec.mode != "closed_loop") continue;
        const Vector3& force = row.tool_force;
        const Vector3& before = record.rows[i - 1].tool_force;
        if (!force.allFinite() || !before.allFinite()) continue;
        if (jumps.empty()) figures.force_flips = 0.0;
        jumps.push_back((force - before).norm());
        if (force.dot(before) < 0.0) figures.force_flips += 1.0;
    }
    figures.force_jump_p99 = tail_quantile(jumps, 0.99).value_or(not_known);
    if (record.rows.empty()) return;
    figures.pairs_mean = pairs / static_cast<double>(record.rows.size());
    figures.native_mean = native / static_cast<double>(record.rows.size());
}

constexpr std::array column_list{
    FigureColumn{"timed_ticks", "Ticks that time figures are taken from: all but the first 10 of the run",
                 [](const RunFigures& f) { return f.timed_ticks; }},
    FigureColumn{
        "tick_p50_us",
        "Median time of a tick. Replay: update + detect; closed loop: move + update + detect + derive + respond "
        "+ advance. Truth and metrics are never timed",
        [](const RunFigures& f) { return f.tick_p50 * us; }},
    FigureColumn{"tick_p90_us", "90 % of the ticks took at most this",
                 [](const RunFigures& f) { return f.tick_p90 * us; }},
    FigureColumn{"tick_p99_us", "99 % of the ticks took at most this; only from 1000 timed ticks up",
                 [](const RunFigures& f) { return f.tick_p99 * us; }},
    FigureColumn{"tick_max_us", "Longest tick, the machine's own interruptions included",
                 [](const RunFigures& f) { return f.tick_max * us; }},
    FigureColumn{"tick_cold_us",
                 "Time of the first tick with an intersecting pair, warm-up or not: what a surgeon feels first",
                 [](const RunFigures& f) { return f.tick_cold * us; }},
    FigureColumn{"deadline_misses", "Timed ticks longer than 1 ms (back-to-back loop)",
                 [](const RunFigures& f) { return f.deadline_misses; }},
    FigureColumn{"longest_burst", "Most misses in a row", [](const RunFigures& f) { return f.longest_burst; }},
    FigureColumn{"true_touches", "Of the true pairs, those that only touch in a vertex or an edge",
                 [](const RunFigures& f) { return f.true_touch; }},
    FigureColumn{"pairs_mean", "Reported pairs per tick, mean", [](const RunFigures& f) { return f.pairs_mean; }},
    FigureColumn{"native_contacts_mean", "The library's own contacts per tick, mean",
                 [](const RunFigures& f) { return f.native_mean; }},
    FigureColumn{"force_jump_p99_N", "Change of the tool force from tick to tick, 99 %; only from 1000 ticks up",
                 [](const RunFigures& f) { return f.force_jump_p99; }},
    FigureColumn{"force_flips", "Ticks on which the tool force turned by more than 90 degrees",
                 [](const RunFigures& f) { return f.force_flips; }},
};

}  // namespace

RunFigures figures_of(const Record& record) {
    RunFigures figures;
    figures.record = &record;
    figures.stage_p50.fill(not_known);
    add_times(record, figures);
    add_summary(record, figures);
    add_from_rows(record, figures);
    return figures;
}

std::span<const FigureColumn> figure_columns() { return column_list; }

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

Estimate SceneResult::of(double RunFigures::*figure) const {
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
