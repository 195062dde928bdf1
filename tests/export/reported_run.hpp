// One short run twice: as it is played for the exporters, and as Simulation itself reports it, tick by tick.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <vector>

#include "export/exporter.hpp"
#include "playback/playback.hpp"
#include "simulate/simulation.hpp"
#include "support/scene_samples.hpp"

namespace trocar::test {

/// What Simulation says after a tick.
struct ReportedTick {
    Matrix3X position;                ///< m
    std::vector<Vector3> load_force;  ///< N, of the contacts whose force is not 0
    Wrench tool;                      ///< about the world origin
};

/// A ball that comes down at a slant and turns while it presses a sheet.
inline std::string turning_poke_text() {
    return R"({"format":"trocar-scene-2","name":"turning poke","unit":"m","dt":0.001,"ticks":40,"seed":1,"bodies":[
      {"name":"sheet","kind":"tissue","closed":false,"parts":[{"shape":"sheet","size":[0.06,0.06],"edge":0.006}]},
      {"name":"tool","kind":"instrument","closed":true,"parts":[{"shape":"sphere","radius":0.008,"edge":0.003}],
       "motion":{"drive":"prescribed","keys":[{"time":0,"pose":[0.001,0.0007,0.009,0,0,0]},
                                              {"time":0.04,"pose":[0.004,0.0007,0.006,0,30,80]}]}}]})";
}

struct ReportedRun {
    Scene scene = scene_from_text(turning_poke_text());
    std::map<std::int64_t, ReportedTick> ticks;

    /// Exports the run into the folder, every `every`-th tick.
    ReportedRun(ExportFormat format, const std::filesystem::path& folder, std::int64_t every) {
        const auto exporter = make_exporter(format, scene.topology, scene.name, folder);
        RunSpec spec;
        spec.mode = "closed_loop";
        spec.detector = "ohc";
        spec.response = "penalty";
        spec.contacts = "intersection";
        RunLimits limits;
        limits.observe = [this](const Simulation& simulation, const StepRow& row) {
            ReportedTick& reported = ticks[row.tick];
            reported.position = simulation.frame().position;
            for (const ContactForce& load : simulation.contact_forces()) {
                if (load.force.norm() > 0.0) reported.load_force.push_back(load.force);
            }
            reported.tool = simulation.body_loads().front();
        };
        const Record record =
            play(scene, spec, limits, {.every = every}, [&](const PlayedFrame& frame) { exporter->add(frame); });
        EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
        exporter->finish();
    }
};

}  // namespace trocar::test
