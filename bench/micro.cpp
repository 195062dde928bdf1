#include "micro.hpp"

#ifdef TROCAR_BENCH_GOOGLE
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "baselines/candidates.hpp"
#include "contact/derive.hpp"
#include "geometry/box_pairs.hpp"
#include "geometry/crossing.hpp"
#include "pair_classes.hpp"

namespace trocar::bench {
namespace {

/// Debian's benchmark library is a debug build and says so on its own reporter; only its clock is used here.
class Collector final : public benchmark::BenchmarkReporter {
public:
    bool ReportContext(const Context& /*context*/) override { return true; }
    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (run.error_occurred || run.iterations == 0) continue;
            const auto items = run.counters.find("items");
            const double count = items == run.counters.end() ? 1.0 : items->second.value;
            results.push_back({run.run_name.function_name,
                               1e9 * run.real_accumulated_time / static_cast<double>(run.iterations) / count,
                               static_cast<std::int64_t>(count)});
        }
    }
    std::vector<MicroResult> results;
};

using TriangleVerdict = bool (*)(const Corners&, const Corners&);
using CornerPairs = std::vector<std::pair<Corners, Corners>>;

void test_triangles(benchmark::State& state, TriangleVerdict verdict, const CornerPairs& pairs) {
    for ([[maybe_unused]] const auto& round : state) {
        int met = 0;
        for (const auto& [first, second] : pairs) met += verdict(first, second) ? 1 : 0;
        benchmark::DoNotOptimize(met);
    }
    state.counters["items"] = static_cast<double>(pairs.size());
}

/// Uniform numbers for every vertex: what a response costs does not depend on them.
Materials uniform_materials(const Topology& topology) {
    const auto vertices = static_cast<std::size_t>(topology.vertex_count);
    Materials materials;
    materials.rest_bias = Matrix3X::Zero(3, topology.vertex_count);
    materials.pinned.assign(vertices, 0);
    materials.mass.assign(vertices, 0.0);
    materials.area.assign(vertices, 0.0);
    materials.mean_stiffness.assign(vertices, 0.0);
    materials.drag.assign(vertices, 0.0);
    materials.triangle_stiffness.assign(static_cast<std::size_t>(topology.triangle_count()), 0.0);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            materials.mass[static_cast<std::size_t>(v)] = 1e-5;
            materials.area[static_cast<std::size_t>(v)] = 1e-6;
            materials.mean_stiffness[static_cast<std::size_t>(v)] = 100.0;
        }
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            materials.triangle_stiffness[static_cast<std::size_t>(t)] = 100.0;
        }
    }
    materials.contact_laws.resize(topology.body_pairs.size());
    materials.trocar_point.resize(topology.bodies.size());
    materials.tip.assign(topology.bodies.size(), Vector3::Zero());
    return materials;
}

}  // namespace

std::vector<MicroResult> run_micro(bool quick, std::vector<Missing>& /*missing*/) {
    const ContactScene scene(SceneSpec{});
    const Topology& topology = scene.topology();
    Frame frame;
    scene.write(1, frame);
    std::vector<Box> boxes;
    triangle_boxes(frame.position, topology.triangles, boxes);
    std::vector<IndexPair> candidates;
    overlapping_boxes(boxes, topology.bodies[0].triangles, topology.bodies[1].triangles, candidates);
    CornerPairs apart;
    CornerPairs meeting;
    ContactSet contacts;
    for (const IndexPair& pair : candidates) {
        const Corners first = baselines::corners_of(topology, frame, pair.first);
        const Corners second = baselines::corners_of(topology, frame, pair.second);
        const bool meet = oracle_intersect(first, second);
        (meet ? meeting : apart).emplace_back(first, second);
        if (meet) contacts.pairs.push_back({pair.first, pair.second});
    }
    const auto add = [](const std::string& name, auto function) {
        benchmark::RegisterBenchmark(name.c_str(), std::move(function));
    };
    for (const auto& [name, verdict] : {std::pair{"exact", TriangleVerdict{triangles_intersect}},
                                        {"interval, double", TriangleVerdict{interval_intersect}},
                                        {"Möller, float", TriangleVerdict{moller_intersect}}}) {
        for (const auto& [kind, pairs] : {std::pair{"boxes overlap, apart", &apart}, {"meeting", &meeting}}) {
            add(fmt::format("triangle test {}: {}", name, kind),
                [verdict = verdict, pairs = pairs](benchmark::State& state) {
                    test_triangles(state, verdict, *pairs);
                });
        }
    }
    add("derive, per pair", [&](benchmark::State& state) {
        for ([[maybe_unused]] const auto& round : state) {
            derive(topology, frame, contacts);
            benchmark::DoNotOptimize(contacts.contacts.data());
        }
        state.counters["items"] = static_cast<double>(contacts.pairs.size());
    });
    const std::unique_ptr<ContactGenerator> generator = make_contact_generator("intersection");
    generator->prepare(topology, frame);
    generator->gather(frame, contacts);
    const Materials materials = uniform_materials(topology);
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.control) continue;
        if (std::find(entry.contact_generators.begin(), entry.contact_generators.end(), "intersection") ==
            entry.contact_generators.end())
            continue;
        add(fmt::format("response {}, per pair", entry.name), [&, name = entry.name](benchmark::State& state) {
            const std::unique_ptr<Response> response = make_response(name);
            response->prepare(topology, materials);
            ResponseOutput output;
            output.resize(topology.vertex_count, topology.body_count());
            for ([[maybe_unused]] const auto& round : state) {
                response->respond(frame, ContactScene::dt(), contacts, {}, output);
                benchmark::DoNotOptimize(output.contacts.data());
            }
            state.counters["items"] = static_cast<double>(contacts.pairs.size());
        });
    }
    // Per class and case; back-projection (§3.4.5) examines every vertex of the tool, whatever the pairs. It is
    // measured apart.
    const std::vector<PairClass> classes = pair_classes();
    for (const PairClass& one : classes) {
        for (const auto& [what, method] : {std::pair{"faithful without back-projection", "thesis:n_back=0"},
                                           {"faithful", "thesis"},
                                           {"corrected", "thesis:profile=corrected"}}) {
            add(fmt::format("{}, per pair: thesis {}", one.name, what),
                [&one, text = std::string(method)](benchmark::State& state) {
                    const MethodSpec spec = parse_method(text);
                    const std::unique_ptr<Response> response = make_response(spec.name, spec.parameters);
                    response->prepare(one.topology, one.materials);
                    ResponseOutput output;
                    output.resize(one.topology.vertex_count, one.topology.body_count());
                    for ([[maybe_unused]] const auto& round : state) {
                        response->respond(one.frame, PairClass::dt, one.contacts, {}, output);
                        benchmark::DoNotOptimize(output.contacts.data());
                    }
                    state.counters["items"] = static_cast<double>(one.contacts.pairs.size());
                });
        }
    }
    const ContactScene small({.tissue_triangles = 2000, .instrument_triangles = 500});
    std::vector<Frame> frames(8);
    for (std::size_t i = 0; i < frames.size(); ++i) small.write(static_cast<std::int64_t>(i), frames[i]);
    for (const DetectorEntry& entry : registry().detectors()) {
        if (entry.control) continue;
        add(fmt::format("detector {}, light 2k x 500", entry.name), [&, name = entry.name](benchmark::State& state) {
            const std::unique_ptr<Detector> detector = make_detector(name);
            detector->prepare(small.topology(), frames[0]);
            ContactSet found;
            found.native_wanted = false;
            std::size_t number = 0;
            for ([[maybe_unused]] const auto& round : state) {
                const Frame& now = frames[++number % frames.size()];
                detector->update(now, 0.0);
                detector->detect(now, found);
                benchmark::DoNotOptimize(found.pairs.data());
            }
            if (!found.outcome.ok()) state.SkipWithError(found.outcome.message.c_str());
        });
    }
    std::string program = "trocar_bench";
    std::string least = quick ? "--benchmark_min_time=0.1" : "--benchmark_min_time=0.5";
    std::array<char*, 2> arguments{program.data(), least.data()};
    int count = static_cast<int>(arguments.size());
    benchmark::Initialize(&count, arguments.data());
    Collector collector;
    benchmark::RunSpecifiedBenchmarks(&collector);
    benchmark::Shutdown();
    return std::move(collector.results);
}

}  // namespace trocar::bench

#else

namespace trocar::bench {

std::vector<MicroResult> run_micro(bool /*quick*/, std::vector<Missing>& missing) {
    missing.push_back({"micro benchmarks", "library not found: Google Benchmark"});
    return {};
}

}  // namespace trocar::bench

#endif
