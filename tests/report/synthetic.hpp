// Records made by hand, so that every number of a report can be worked out on paper.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "geometry/gzip.hpp"
#include "measure/metrics.hpp"
#include "measure/record.hpp"
#include "report/report.hpp"

namespace trocar::test {

struct SyntheticRun {
    std::string mode = "closed_loop";
    std::string scene = "poke";
    std::string pair_class = "I2T";
    std::string detector = "mine";
    std::string response = "push";
    std::string contacts = "intersection";
    bool own = true;
    std::int64_t repetition = 0;
    std::int64_t ticks = 1110;
    std::int64_t first_tick_us = 100;  ///< tick i takes first_tick_us + i * step_us, all of it in stage detect
    std::int64_t step_us = 0;
    double residual_mm = 0.5;  ///< after every tick
    std::int64_t true_pairs = 4;
    std::int64_t false_negatives = 0;
    std::int64_t false_positives = 0;
    std::string state_hash = "00000000000000aa";
    std::string knob = {};
    std::string point = {};
    Outcome outcome = {};
};

inline Record synthetic(const SyntheticRun& run) {
    Record record;
    record.spec = {.study = "made_up",
                   .mode = run.mode,
                   .scene = run.scene,
                   .scene_file = run.scene + ".json",
                   .scene_hash = "0123456789abcdef",
                   .pair_class = run.pair_class,
                   .detector = run.detector,
                   .response = run.mode == "replay" ? "" : run.response,
                   .contacts = run.mode == "replay" ? "" : run.contacts,
                   .setting = "default",
                   .repetition = run.repetition,
                   .seed = 1,
                   .ticks = run.ticks};
    record.spec.knob = run.knob;
    record.spec.point = run.point;
    record.environment = {{"commit", "abc1234"},
                          {"dirty", "no"},
                          {"cpu", "Paper CPU"},
                          {"study.reference", "theirs"},
                          {"detector.own", run.own ? "yes" : "no"},
                          {"response.own", "yes"},
                          {"detector.setting", "default"},
                          {"study.file", "made_up.json"}};
    record.outcome = run.outcome;
    if (run.mode == "replay") {
        record.frames_hash = "00000000000000ff";
    } else {
        record.state_hash = run.state_hash;
    }
    if (!run.outcome.ok()) return record;
    for (std::int64_t tick = 0; tick < run.ticks; ++tick) {
        StepRow row;
        row.tick = tick;
        row.time = 0.001 * static_cast<double>(tick);
        row.stage_ns.at(static_cast<std::size_t>(Stage::update)) = 0;
        row.stage_ns.at(static_cast<std::size_t>(Stage::detect)) = 1000 * (run.first_tick_us + tick * run.step_us);
        row.pairs = run.true_pairs - run.false_negatives + run.false_positives;
        row.true_pairs = run.true_pairs;
        row.true_touch = 1;
        row.false_negatives = run.false_negatives;
        row.false_negatives_touch = run.false_negatives > 0 ? 1 : 0;
        row.false_positives = run.false_positives;
        row.residual_penetration = run.residual_mm * 1e-3;
        row.tool_force = Vector3(0.0, 0.0, tick % 2 == 0 ? 1.0 : -1.0);
        record.rows.push_back(row);
    }
    record.summary = summarize(record.rows, {.mode = run.mode});
    return record;
}

/// Writes records as a study does.
inline void store_records(const std::filesystem::path& folder, const std::vector<Record>& records) {
    std::filesystem::create_directories(folder);
    std::string lines;
    for (const Record& record : records) lines += to_json_line(record) + "\n";
    std::ofstream(folder / records_name, std::ios::binary) << gzipped(lines);
}

/// All that a report says, page 1 and what stands behind it, as Markdown.
inline std::string whole(const Report& report) { return to_markdown(report.document); }

}  // namespace trocar::test
