// One tick (update and detect) of every registered detector in its default setting on the same frames, side by side in
// one process. Pairs only: native contacts are not asked for.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <map>
#include <memory>

#include "detection_scene.hpp"
#include "method/registry.hpp"

namespace trocar::bench {
namespace {

constexpr double light = 0.001;  ///< m, depth of the tips

const DetectionScene& scene_of(int tissue_triangles) {
    static std::map<int, DetectionScene> scenes;
    auto found = scenes.find(tissue_triangles);
    if (found == scenes.end()) {
        found = scenes.emplace(tissue_triangles, detection_scene(tissue_triangles, 2000, light, 8)).first;
    }
    return found->second;
}

void tick(benchmark::State& state, const std::string& name, int tissue_triangles) {
    const DetectionScene& scene = scene_of(tissue_triangles);
    const std::unique_ptr<Detector> detector = make_detector(name);
    detector->prepare(scene.world.topology, scene.frames[0]);
    ContactSet contacts;
    contacts.native_wanted = false;
    std::size_t number = 0;
    for ([[maybe_unused]] const auto& step : state) {
        const Frame& frame = scene.frames[number++ % scene.frames.size()];
        detector->update(frame);
        detector->detect(frame, contacts);
        benchmark::DoNotOptimize(contacts.pairs.data());
    }
    if (!contacts.outcome.ok()) state.SkipWithError(contacts.outcome.message.c_str());
    state.counters["pairs"] = static_cast<double>(contacts.pairs.size());
    state.counters["work"] = static_cast<double>(contacts.work.work());
}

}  // namespace
}  // namespace trocar::bench

int main(int argc, char** argv) {
    for (const int triangles : {2000, 20000}) {
        for (const trocar::DetectorEntry& entry : trocar::registry().detectors()) {
            benchmark::RegisterBenchmark(fmt::format("{}/{}", entry.name, triangles).c_str(),
                                         [name = entry.name, triangles](benchmark::State& state) {
                                             trocar::bench::tick(state, name, triangles);
                                         })
                ->Unit(benchmark::kMicrosecond);
        }
    }
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
