// Runs of the published default study, made again by this program: its figures are those that stand in the report.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "measure/metrics.hpp"
#include "measure/record.hpp"
#include "method/registry.hpp"
#include "report/report.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"

namespace trocar::test {

/// First processes of the default study that are wanted. Runs of methods that this build lacks are not asked for.
inline std::vector<Record> published_runs(const std::function<bool(const RunSpec&)>& wanted) {
    std::vector<Record> runs;
    for (Record& record : read_records(std::filesystem::path(TROCAR_SOURCE_DIR) / "reports" / "default")) {
        const RunSpec& spec = record.spec;
        const auto has = [](const auto& entries, const std::string& method) {
            if (method.empty()) return true;
            const std::string name = parse_method(method).name;
            return std::ranges::any_of(entries, [&](const auto& one) { return one.name == name; });
        };
        const bool is_known = has(registry().detectors(), spec.detector) && has(registry().responses(), spec.response);
        if (!is_known || spec.repetition != 0 || spec.scene.empty() || !wanted(spec)) continue;
        runs.push_back(std::move(record));
    }
    return runs;
}

inline Record made_again(const Record& published) {
    const std::filesystem::path studies = std::filesystem::path(TROCAR_SOURCE_DIR) / "bench" / "studies";
    const Scene scene = read_scene(studies / published.spec.scene_file, std::nullopt);
    return make_run(scene, published.spec);
}

/// Every figure that no clock has a part in. The published file has 17 digits of each.
inline void expect_same_figures(const Record& published, const Record& again) {
    int compared = 0;
    for (const auto& [metric, value] : published.summary) {
        const MetricInfo& info = info_of(metric);
        if (is_timed(info.source) || info.source == MetricSource::counters) continue;
        const double now = value_of(again.summary, metric);
        EXPECT_TRUE((std::isnan(value) && std::isnan(now)) || value == now ||
                    std::abs(now - value) <= 1e-9 * std::abs(value) + 1e-15)
            << info.name << " is " << now << ", published as " << value;
        ++compared;
    }
    EXPECT_GE(compared, 8);
    EXPECT_EQ(again.outcome.kind, published.outcome.kind);
    EXPECT_EQ(again.frames_hash, published.frames_hash);
    EXPECT_EQ(again.state_hash, published.state_hash);
}

inline void expect_the_same_again(const std::vector<Record>& runs) {
    for (const Record& published : runs) {
        SCOPED_TRACE(published.spec.detector + " + " + published.spec.response + " on " + published.spec.scene);
        expect_same_figures(published, made_again(published));
    }
}

}  // namespace trocar::test
