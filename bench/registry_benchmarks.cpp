// trocar_microbench: every method of the registry and single stages by Google Benchmark, with its own flags and output.
// Names: detect/DETECTOR/SCENE, respond/RESPONSE/SCENE, per_pair/RESPONSE/…, triangle_test/… and derive/….
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "baselines/candidates.hpp"
#include "contact/derive.hpp"
#include "contact/usable.hpp"
#include "geometry/box_pairs.hpp"
#include "geometry/crossing.hpp"
#include "measure/environment.hpp"
#include "method/registry.hpp"
#include "pair_classes.hpp"
#include "scene/scene.hpp"
#include "simulate/frame_source.hpp"
#include "simulate/generated_scene.hpp"
#include "simulate/simulation.hpp"

namespace trocar::bench {
namespace {

/// Shipped scenes: one per class of bodies, and a fast needle.
constexpr std::array<const char*, 6> scene_names{"i2i_cross", "i2r_scrape", "i2t_poke",
                                                 "i2t_stab",  "r2t_bone",   "t2t_press"};
/// Most ticks of a pass: all of the contact on each of these scenes but the last, which ends in contact.
constexpr std::int64_t pass_ticks = 1000;

void add(const std::string& name, std::function<void(benchmark::State&)> function) {
    benchmark::RegisterBenchmark(name.c_str(), [function = std::move(function)](benchmark::State& state) {
        try {
            function(state);
        } catch (const std::exception& error) {
            state.SkipWithError(fmt::format("{}: {}", name_of(OutcomeKind::threw), error.what()).c_str());
        }
    })->Unit(benchmark::kMicrosecond);
}

/// False, and the benchmark ends with the outcome's name, when the outcome is not ok.
bool is_usable(const Outcome& outcome, benchmark::State& state) {
    if (outcome.ok()) return true;
    state.SkipWithError(fmt::format("{}: {}", name_of(outcome.kind), outcome.message).c_str());
    return false;
}

void count_pairs(benchmark::State& state, std::size_t ticks, double pairs) {
    state.counters["ticks"] = static_cast<double>(ticks);
    state.counters["pairs_per_tick"] = benchmark::Counter(pairs, benchmark::Counter::kAvgIterations);
}

void time_per_pair(benchmark::State& state, double pairs) {
    state.counters["time_per_pair"] =
        benchmark::Counter(pairs, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// A frame with pairs, and its contacts of the generator `intersection`.
struct ContactTick {
    const Frame* frame;
    ContactSet contacts;
};

class ShippedScene {
public:
    explicit ShippedScene(const std::string& name)
        : scene_(read_scene(std::filesystem::path(TROCAR_BENCH_SCENES) / (name + ".json"), std::nullopt)) {}

    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] std::int64_t ticks() const { return std::min(scene_.ticks, pass_ticks); }
    /// Frames of the neutral driver (simulate/frame_source.hpp). Throws std::runtime_error when they end early.
    const std::vector<Frame>& frames() {
        if (!frames_.empty()) return frames_;
        const std::unique_ptr<FrameSource> source = scene_frames(scene_, ticks());
        std::vector<Frame> frames;
        for (Frame frame; source->next(frame);) frames.push_back(frame);
        if (!source->outcome().ok()) throw std::runtime_error(source->outcome().message);
        return frames_ = std::move(frames);
    }
    /// Of those of frames() with pairs, a few that are evenly spread: together they fit into the cache.
    const std::vector<ContactTick>& contact_ticks() {
        if (!contact_ticks_.empty()) return contact_ticks_;
        const std::unique_ptr<Detector> detector = neutral_pairs();
        detector->prepare(scene_.topology, scene_.first);
        const std::unique_ptr<ContactGenerator> generator = make_contact_generator("intersection");
        generator->prepare(scene_.topology, scene_.first);
        std::vector<ContactTick> ticks;
        for (const Frame& frame : frames()) {
            ContactSet contacts;
            detector->update(frame, 0.0);
            detector->detect(frame, contacts);
            if (contacts.pairs.empty()) continue;
            generator->gather(frame, contacts);
            const Outcome outcome = check_contacts(scene_.topology, contacts);
            if (!outcome.ok()) throw std::runtime_error(outcome.message);
            ticks.push_back({&frame, std::move(contacts)});
        }
        constexpr std::size_t most = 16;
        const std::size_t stride = (ticks.size() + most - 1) / most;
        for (std::size_t i = 0; i < ticks.size(); i += stride) contact_ticks_.push_back(std::move(ticks[i]));
        return contact_ticks_;
    }

private:
    Scene scene_;
    std::vector<Frame> frames_;
    std::vector<ContactTick> contact_ticks_;
};

/// Only the last scene is kept in memory.
ShippedScene& shipped(const std::string& name) {
    static std::string last;
    static std::unique_ptr<ShippedScene> scene;
    if (last != name) {
        scene.reset();
        scene = std::make_unique<ShippedScene>(name);
        last = name;
    }
    return *scene;
}

// ---- detect/DETECTOR/SCENE: update and detect on prescribed frames ----

/// Every pass has a new detector, since frames are those of one motion.
void detect(benchmark::State& state, const std::string& name, const Topology& topology, std::span<const Frame> frames) {
    ContactSet found;
    found.native_wanted = false;
    double pairs = 0.0;
    std::unique_ptr<Detector> detector;
    while (state.KeepRunningBatch(static_cast<benchmark::IterationCount>(frames.size()))) {
        state.PauseTiming();
        detector = make_detector(name);
        detector->prepare(topology, frames.front());
        state.ResumeTiming();
        for (const Frame& frame : frames) {
            detector->update(frame, 0.0);
            detector->detect(frame, found);
            if (!found.outcome.ok()) break;
            pairs += static_cast<double>(found.pairs.size());
            benchmark::DoNotOptimize(found.pairs.data());
        }
        if (!is_usable(found.outcome, state)) break;
    }
    count_pairs(state, frames.size(), pairs);
}

/// A small scene whose tissue moves everywhere.
struct MovingSheet {
    static constexpr std::int64_t period = 64;  ///< steps
    InstrumentInTissue scene{{.tissue_triangles = 2000, .instrument_triangles = 500}};
    std::vector<Frame> frames = std::vector<Frame>(period);
    MovingSheet() {
        for (std::int64_t step = 0; step < period; ++step) scene.write(step, frames.at(static_cast<std::size_t>(step)));
    }
};

const MovingSheet& moving_sheet() {
    static const MovingSheet sheet;
    return sheet;
}

// ---- respond/RESPONSE/SCENE: ticks of the closed loop ----

std::unique_ptr<Simulation> closed_loop(const std::string& response, const Scene& scene, bool watched) {
    const ContactGeneratorEntry& generator =
        registry().contact_generator(default_contact_generator({.name = response}));
    return std::make_unique<Simulation>(scene, make_detector("ohc_clustered"), make_response(response), generator,
                                        SimulationSettings{.watched = watched});
}

/// Outcome of a pass with the energy and momentum audit, which finds a blow-up. Timed passes have none.
Outcome watched_outcome(const std::string& response, const std::string& scene_name) {
    static std::map<std::pair<std::string, std::string>, Outcome> known;
    const auto [entry, is_new] = known.try_emplace({response, scene_name});
    if (!is_new) return entry->second;
    const ContactGeneratorEntry& generator =
        registry().contact_generator(default_contact_generator({.name = response}));
    const std::string unreported = why_unreported(registry().detector("ohc_clustered"), generator);
    if (!unreported.empty()) return entry->second = {OutcomeKind::unsupported, unreported};
    const ShippedScene& scene = shipped(scene_name);
    const std::unique_ptr<Simulation> simulation = closed_loop(response, scene.scene(), true);
    for (std::int64_t tick = 0; tick < scene.ticks() && simulation->outcome().ok(); ++tick) {
        simulation->step();
        entry->second = simulation->outcome();
        if (!entry->second.ok()) entry->second.message = fmt::format("tick {}: {}", tick, entry->second.message);
    }
    return entry->second;
}

/// Every pass is the scene from its start.
void respond(benchmark::State& state, const std::string& response, const std::string& scene_name) {
    if (!is_usable(watched_outcome(response, scene_name), state)) return;
    const ShippedScene& scene = shipped(scene_name);
    double pairs = 0.0;
    std::unique_ptr<Simulation> simulation;
    while (state.KeepRunningBatch(scene.ticks())) {
        state.PauseTiming();
        simulation = closed_loop(response, scene.scene(), false);
        state.ResumeTiming();
        for (std::int64_t tick = 0; tick < scene.ticks(); ++tick) {
            pairs += static_cast<double>(simulation->step().pairs);
        }
        if (!is_usable(simulation->outcome(), state)) break;
    }
    count_pairs(state, static_cast<std::size_t>(scene.ticks()), pairs);
}

// ---- per_pair/RESPONSE/…: the stage `respond` alone, on given pairs ----

/// `generator`: the triangle test is in the span. Null: the contacts are given.
void respond_to(benchmark::State& state, const std::string& method, const Topology& topology,
                const Materials& materials, double dt, std::vector<ContactTick> ticks, ContactGenerator* generator) {
    const MethodSpec spec = parse_method(method);
    const std::unique_ptr<Response> response = make_response(spec.name, spec.parameters);
    response->prepare(topology, materials);
    ResponseOutput output;
    output.resize(topology.vertex_count, topology.body_count());
    double pairs = 0.0;
    while (state.KeepRunningBatch(static_cast<benchmark::IterationCount>(ticks.size()))) {
        for (ContactTick& tick : ticks) {
            if (generator != nullptr) generator->gather(*tick.frame, tick.contacts);
            response->respond(*tick.frame, dt, tick.contacts, {}, output);
            pairs += static_cast<double>(tick.contacts.pairs.size());
            benchmark::DoNotOptimize(output.contacts.data());
        }
    }
    count_pairs(state, ticks.size(), pairs);
    time_per_pair(state, pairs);
}

void respond_on_scene(benchmark::State& state, const std::string& method, const std::string& scene_name,
                      bool with_test) {
    ShippedScene& shipped_scene = shipped(scene_name);
    const Scene& scene = shipped_scene.scene();
    const std::unique_ptr<ContactGenerator> generator = make_contact_generator("intersection");
    generator->prepare(scene.topology, scene.first);
    respond_to(state, method, scene.topology, scene.materials, scene.dt, shipped_scene.contact_ticks(),
               with_test ? generator.get() : nullptr);
}

// ---- single stages on one frame of a generated scene ----

using TriangleVerdict = bool (*)(const Corners&, const Corners&);
using CornerPairs = std::vector<std::pair<Corners, Corners>>;

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

struct PressedSheet {
    InstrumentInTissue scene{InstrumentInTissueSpec{}};
    CornerPairs apart;  ///< boxes overlap
    CornerPairs meeting;
    Frame frame;
    ContactSet contacts;
    Materials materials = uniform_materials(scene.topology());
    PressedSheet() {
        const Topology& topology = scene.topology();
        scene.write(1, frame);
        std::vector<Box> boxes;
        triangle_boxes(frame.position, topology.triangles, boxes);
        std::vector<IndexPair> candidates;
        overlapping_boxes(boxes, topology.bodies[0].triangles, topology.bodies[1].triangles, candidates);
        for (const IndexPair& pair : candidates) {
            const Corners first = corners_of(topology.triangles, frame.position, pair.first);
            const Corners second = corners_of(topology.triangles, frame.position, pair.second);
            const bool meet = oracle_intersect(first, second);
            (meet ? meeting : apart).emplace_back(first, second);
            if (meet) contacts.pairs.push_back({pair.first, pair.second});
        }
        const std::unique_ptr<ContactGenerator> generator = make_contact_generator("intersection");
        generator->prepare(topology, frame);
        generator->gather(frame, contacts);
    }
};

const PressedSheet& pressed_sheet() {
    static const PressedSheet sheet;
    return sheet;
}

void test_triangles(benchmark::State& state, TriangleVerdict verdict, const CornerPairs& pairs) {
    double tested = 0.0;
    while (state.KeepRunning()) {
        int met = 0;
        for (const auto& [first, second] : pairs) met += verdict(first, second) ? 1 : 0;
        benchmark::DoNotOptimize(met);
        tested += static_cast<double>(pairs.size());
    }
    time_per_pair(state, tested);
}

void derive_contacts(benchmark::State& state) {
    const PressedSheet& sheet = pressed_sheet();
    ContactSet contacts = sheet.contacts;
    double derived = 0.0;
    while (state.KeepRunning()) {
        derive(sheet.scene.topology(), sheet.frame, contacts);
        benchmark::DoNotOptimize(contacts.contacts.data());
        derived += static_cast<double>(contacts.pairs.size());
    }
    time_per_pair(state, derived);
}

void add_stages() {
    for (const auto& [name, verdict] : {std::pair{"exact", TriangleVerdict{triangles_intersect}},
                                        {"interval_double", TriangleVerdict{interval_intersect}},
                                        {"moller_float", TriangleVerdict{moller_intersect}}}) {
        add(fmt::format("triangle_test/{}/apart", name),
            [verdict = verdict](benchmark::State& state) { test_triangles(state, verdict, pressed_sheet().apart); });
        add(fmt::format("triangle_test/{}/meeting", name),
            [verdict = verdict](benchmark::State& state) { test_triangles(state, verdict, pressed_sheet().meeting); });
    }
    add("derive/light_20k_x_2k", derive_contacts);
    for (const ResponseEntry& entry : registry().responses()) {
        const auto& readable = entry.contact_generators;
        if (entry.control || std::find(readable.begin(), readable.end(), "intersection") == readable.end()) continue;
        add(fmt::format("per_pair/{}/without_test/light_20k_x_2k", entry.name),
            [name = entry.name](benchmark::State& state) {
                const PressedSheet& sheet = pressed_sheet();
                respond_to(state, name, sheet.scene.topology(), sheet.materials, GeneratedScene::dt,
                           {{&sheet.frame, sheet.contacts}}, nullptr);
            });
    }
    // Per class and case; back-projection (§3.4.5) examines every vertex of the tool, whatever the pairs. It is
    // measured apart.
    static const std::vector<PairClass> classes = pair_classes();
    for (const PairClass& one : classes) {
        std::string class_name = one.name;
        std::replace(class_name.begin(), class_name.end(), ' ', '_');
        for (const char* method : {"thesis:n_back=0", "thesis", "thesis:profile=corrected"}) {
            add(fmt::format("per_pair/{}/without_test/{}", method, class_name),
                [&one, method](benchmark::State& state) {
                    respond_to(state, method, one.topology, one.materials, PairClass::dt, {{&one.frame, one.contacts}},
                               nullptr);
                });
        }
    }
}

// ---- all of them ----

void add_absent(const std::string& name, const AbsentMethod& absent) {
    add(name, [reason = absent.reason](benchmark::State& state) { is_usable({OutcomeKind::absent, reason}, state); });
}

void add_methods(const std::string& scene) {
    for (const DetectorEntry& entry : registry().detectors()) {
        add(fmt::format("detect/{}/{}", entry.name, scene), [name = entry.name, scene](benchmark::State& state) {
            ShippedScene& one = shipped(scene);
            detect(state, name, one.scene().topology, one.frames());
        });
    }
    for (const AbsentMethod& absent : registry().absent_detectors()) {
        add_absent(fmt::format("detect/{}/{}", absent.name, scene), absent);
    }
    for (const ResponseEntry& entry : registry().responses()) {
        add(fmt::format("respond/{}/{}", entry.name, scene),
            [name = entry.name, scene](benchmark::State& state) { respond(state, name, scene); });
    }
    for (const AbsentMethod& absent : registry().absent_responses()) {
        add_absent(fmt::format("respond/{}/{}", absent.name, scene), absent);
    }
    for (const bool with_test : {false, true}) {
        add(fmt::format("per_pair/thesis/{}/{}", with_test ? "with_test" : "without_test", scene),
            [scene, with_test](benchmark::State& state) { respond_on_scene(state, "thesis", scene, with_test); });
    }
}

void add_all() {
    for (const char* scene : scene_names) add_methods(scene);
    for (const DetectorEntry& entry : registry().detectors()) {
        add(fmt::format("detect/{}/light_2k_x_500", entry.name), [name = entry.name](benchmark::State& state) {
            detect(state, name, moving_sheet().scene.topology(), moving_sheet().frames);
        });
    }
    add_stages();
}

}  // namespace
}  // namespace trocar::bench

int main(int argc, char** argv) {
    enum ExitStatus : int { done = 0, bad_input = 2, internal_error = 70 };
    try {
        trocar::bench::add_all();
        benchmark::Initialize(&argc, argv);
        if (benchmark::ReportUnrecognizedArguments(argc, argv)) return bad_input;
        const std::map<std::string, std::string> environment = trocar::environment();
        for (const char* key : {"version", "commit", "dirty", "compiler", "flags", "build_type"}) {
            benchmark::AddCustomContext(key, environment.at(key));
        }
        const bool is_any = benchmark::RunSpecifiedBenchmarks() > 0;
        benchmark::Shutdown();
        return is_any ? done : bad_input;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "trocar_microbench: internal error: %s\n", error.what());
        return internal_error;
    }
}
