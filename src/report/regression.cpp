#include "report/regression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "measure/metrics.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

std::string name_of_run(const RunSpec& spec) {
    std::string text =
        fmt::format("{} {}: {}", spec.mode, spec.scene.empty() ? "all scenes" : spec.scene, method_of(spec).label());
    if (!spec.point.empty()) text += fmt::format(" [{} {}]", spec.knob, spec.point);
    return text;
}

using Runs = std::map<std::string, const Record*>;

Runs first_processes(const std::vector<Record>& records) {
    Runs runs;
    for (const Record& record : records) {
        if (record.spec.repetition == 0) runs[name_of_run(record.spec)] = &record;
    }
    return runs;
}

bool of_the_clock(const MetricInfo& info) { return info.unit == "ns" || is_timed(info.source); }

double relative_change(double before, double after) {
    if (std::isnan(before) && std::isnan(after)) return 0.0;
    if (before == after) return 0.0;
    const double larger = std::max(std::abs(before), std::abs(after));
    return std::isfinite(before) && std::isfinite(after) ? std::abs(after - before) / larger : HUGE_VAL;
}

void compare_rows(const std::string& run, const Record& before, const Record& after,
                  std::vector<FigureChange>& changes) {
    std::map<std::int64_t, const StepRow*> rows;
    for (const StepRow& row : before.rows) rows[row.tick] = &row;
    std::int64_t different = 0;
    FigureChange first{.run = run, .figure = {}, .before = {}, .after = {}, .size = HUGE_VAL};
    for (const StepRow& row : after.rows) {
        const auto other = rows.find(row.tick);
        if (other == rows.end()) continue;
        const StepRow& old = *other->second;
        if (old.pairs == row.pairs && old.contacts_offered == row.contacts_offered &&
            old.native_contacts == row.native_contacts) {
            continue;
        }
        if (different++ > 0) continue;
        const auto reported = [](const StepRow& r) {
            return fmt::format("{} / {} / {}", r.pairs, r.contacts_offered, r.native_contacts);
        };
        first.figure = fmt::format("pairs / contacts / native contacts, first at tick {}", row.tick);
        first.before = reported(old);
        first.after = reported(row);
    }
    if (different == 0) return;
    first.figure += fmt::format(" ({} ticks differ)", different);
    changes.push_back(std::move(first));
}

}  // namespace

StudyComparison compare_studies(const std::vector<Record>& before, const std::vector<Record>& after, double tolerance) {
    StudyComparison result;
    const Runs old_runs = first_processes(before);
    const Runs new_runs = first_processes(after);
    for (const auto& [name, record] : new_runs) {
        if (!old_runs.contains(name)) result.extra.push_back(name);
    }
    for (const auto& [name, old_record] : old_runs) {
        const auto found = new_runs.find(name);
        if (found == new_runs.end()) {
            result.missing.push_back(name);
            continue;
        }
        const Record& a = *old_record;
        const Record& b = *found->second;
        if (a.spec.scene_hash != b.spec.scene_hash || a.spec.ticks != b.spec.ticks || a.spec.seed != b.spec.seed ||
            a.spec.truth_stride != b.spec.truth_stride || a.frames_hash != b.frames_hash) {
            result.stale.push_back(name);
            continue;
        }
        ++result.compared;
        if (a.outcome.kind != b.outcome.kind) {
            result.changes.push_back({name, "outcome", outcome_text(a.outcome), outcome_text(b.outcome), HUGE_VAL});
        }
        compare_rows(name, a, b, result.changes);
        for (const MetricInfo& info : metrics()) {
            if (of_the_clock(info)) continue;
            const double x = value_of(a.summary, info.metric);
            const double y = value_of(b.summary, info.metric);
            const double size = relative_change(x, y);
            if (size <= tolerance) continue;
            result.changes.push_back({name, header_of(info), format_number(x), format_number(y), size});
        }
    }
    std::stable_sort(result.changes.begin(), result.changes.end(),
                     [](const FigureChange& a, const FigureChange& b) { return a.size > b.size; });
    return result;
}

}  // namespace trocar
