#include "simulate/metamorphic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/fnv_hash.hpp"
#include "measure/permutation.hpp"
#include "method/registry.hpp"
#include "simulate/frame_source.hpp"
#include "simulate/simulation.hpp"

namespace trocar {
namespace {

using Pairs = std::vector<TrianglePair>;

constexpr std::uint32_t shuffle_seed = 1;
const Vector3 other_origin(16.0, -8.0, 4.0);  // m

void put(Record& record, const std::string& name, const char* ending, double value) {
    record.summary[metric_of("metamorphic_" + name + ending)] = value;
}

// ------------------------------------------------------------------ detectors: sets of pairs

/// Answers of a new detector, one per frame.
struct Answers {
    std::vector<Pairs> pairs;
    Outcome outcome;
};

Answers answers_of(const RunSpec& spec, const Topology& topology, const std::vector<Frame>& frames) {
    Answers answers;
    const std::unique_ptr<Detector> detector = make_detector(spec.detector);
    ContactSet contacts;
    contacts.native_wanted = false;
    try {
        detector->prepare(topology, frames.front());
        for (const Frame& frame : frames) {
            detector->update(frame, 0.0);
            detector->detect(frame, contacts);
            answers.pairs.push_back(contacts.pairs);
            if (answers.outcome.ok()) answers.outcome = contacts.outcome;
        }
    } catch (const std::exception& error) {
        answers.outcome = {OutcomeKind::threw, error.what()};
    }
    answers.pairs.resize(frames.size());
    return answers;
}

/// Number of pairs that only one of two answers has. Frames after a failure count as empty.
double differing(const Answers& ones, const Answers& others) {
    std::size_t count = 0;
    for (std::size_t f = 0; f < ones.pairs.size(); ++f) {
        Pairs different;
        std::set_symmetric_difference(ones.pairs[f].begin(), ones.pairs[f].end(), others.pairs[f].begin(),
                                      others.pairs[f].end(), std::back_inserter(different));
        count += different.size();
    }
    return static_cast<double>(count);
}

Answers permuted_answers(const RunSpec& spec, const Permutation& permutation, const std::vector<Frame>& frames) {
    std::vector<Frame> permuted;
    permuted.reserve(frames.size());
    for (const Frame& frame : frames) permuted.push_back(permutation.permuted(frame));
    Answers answers = answers_of(spec, permutation.topology, permuted);
    for (Pairs& pairs : answers.pairs) pairs = permutation.original(pairs);
    return answers;
}

std::vector<Frame> placed_frames(const std::vector<Frame>& frames, double factor, const Vector3& by) {
    std::vector<Frame> result;
    result.reserve(frames.size());
    for (const Frame& frame : frames) result.push_back(placed(frame, factor, by));
    return result;
}

/// Sum over body pairs, each pair alone against its swapped order.
double swapped_pairs_differ(const Scene& scene, const RunSpec& spec, const std::vector<Frame>& frames) {
    double sum = 0.0;
    for (const auto& [first, second] : scene.topology.body_pairs) {
        sum += differing(permuted_answers(spec, with_bodies_in_order(scene.topology, {first, second}), frames),
                         permuted_answers(spec, with_bodies_in_order(scene.topology, {second, first}), frames));
    }
    return sum;
}

void test_detector_permuted(const Scene& scene, const RunSpec& spec, Record& record) {
    constexpr std::int64_t wanted = 20;
    const std::unique_ptr<FrameSource> source = scene_frames(scene, spec.ticks);
    const std::int64_t stride = std::max<std::int64_t>(1, spec.ticks / wanted);
    std::vector<Frame> frames;
    std::vector<Frame> gridded;
    Frame frame;
    for (std::int64_t tick = 0; source->next(frame); ++tick) {
        if (tick % stride != 0) continue;
        frames.push_back(placed(frame, 1.0, Vector3::Zero()));
        gridded.push_back(on_grid(frame));
    }
    record.outcome = source->outcome();
    if (!record.outcome.ok()) return;
    const Topology& topology = scene.topology;
    const Answers once = answers_of(spec, topology, frames);
    record.outcome = once.outcome;
    double count = 0.0;
    FnvHash hash;
    for (const Pairs& pairs : once.pairs) {
        count += static_cast<double>(pairs.size());
        for (const TrianglePair& pair : pairs)
            hash.add_word(static_cast<std::uint64_t>(pair.a) << 32U | static_cast<std::uint64_t>(pair.b));
        hash.add_word(pairs.size());
    }
    record.state_hash = hash.text();
    record.summary[Metric::metamorphic_pairs] = count;
    if (!once.outcome.ok()) return;

    put(record, "twice", "_pairs", differing(once, answers_of(spec, topology, frames)));
    put(record, "triangles", "_pairs",
        differing(once,
                  permuted_answers(spec, shuffled(topology, shuffle_seed, Shuffle::triangles_and_vertices), frames)));
    if (topology.body_count() > 1) {
        std::vector<Index> order(topology.bodies.size());
        std::iota(order.rbegin(), order.rend(), 0);
        put(record, "bodies", "_pairs",
            differing(once, permuted_answers(spec, with_bodies_in_order(topology, order), frames)));
        put(record, "swapped", "_pairs", swapped_pairs_differ(scene, spec, frames));
    }
    const Answers here = answers_of(spec, topology, gridded);
    put(record, "origin", "_pairs",
        differing(here, answers_of(spec, topology, placed_frames(gridded, 1.0, other_origin))));
    put(record, "unit", "_pairs",
        differing(here, answers_of(spec, topology, placed_frames(gridded, 1000.0, Vector3::Zero()))));
}

// ------------------------------------------------------------------ responses: motion and force of a closed loop

struct Trace {
    std::vector<Matrix3X> position;  ///< m, every position_stride ticks and at the end
    std::vector<Matrix3X> load;      ///< N, per tick: force on every body
    Outcome outcome;
};

Trace trace_of(const Scene& scene, const RunSpec& spec) {
    constexpr std::int64_t position_stride = 10;
    Simulation simulation(scene, make_detector(spec.detector), make_response(spec.response),
                          registry().contact_generator(default_contact_generator(parse_method(spec.response))));
    Trace trace;
    for (std::int64_t tick = 0; tick < spec.ticks && simulation.outcome().ok(); ++tick) {
        simulation.step();
        if (tick % position_stride == 0 || tick + 1 == spec.ticks)
            trace.position.push_back(simulation.frame().position);
        const std::vector<Wrench>& loads = simulation.body_loads();
        Matrix3X forces(3, static_cast<Eigen::Index>(loads.size()));
        for (std::size_t b = 0; b < loads.size(); ++b) forces.col(static_cast<Eigen::Index>(b)) = loads[b].force;
        trace.load.push_back(std::move(forces));
    }
    trace.outcome = simulation.outcome();
    return trace;
}

struct Distance {
    double path = 0.0;   ///< m
    double force = 0.0;  ///< N
};

/// `vertex`, `body`: number in the first trace of each one in the second; empty: identity. Infinite when the runs end
/// differently.
Distance between(const Trace& one, const Trace& other, const Vector3& moved_by = Vector3::Zero(),
                 const std::vector<Index>& vertex = {}, const std::vector<Index>& body = {}) {
    if (one.outcome.kind != other.outcome.kind || one.position.size() != other.position.size()) {
        return {HUGE_VAL, HUGE_VAL};
    }
    Distance distance;
    const auto farthest = [](const Matrix3X& a, const Matrix3X& b, const std::vector<Index>& old, const Vector3& by) {
        double most = 0.0;
        for (Eigen::Index k = 0; k < b.cols(); ++k) {
            const Eigen::Index was = old.empty() ? k : old[static_cast<std::size_t>(k)];
            most = std::max(most, (b.col(k) - by - a.col(was)).norm());
        }
        return most;
    };
    for (std::size_t k = 0; k < one.position.size(); ++k) {
        distance.path = std::max(distance.path, farthest(one.position[k], other.position[k], vertex, moved_by));
    }
    for (std::size_t k = 0; k < std::min(one.load.size(), other.load.size()); ++k) {
        distance.force = std::max(distance.force, farthest(one.load[k], other.load[k], body, Vector3::Zero()));
    }
    return distance;
}

/// Body order reversed within each kind; empty where no kind has two.
std::vector<Index> reversed_within_kinds(const Topology& topology) {
    std::vector<Index> order(topology.bodies.size());
    std::iota(order.begin(), order.end(), 0);
    bool any = false;
    const auto kind = [&topology](Index b) { return topology.bodies[static_cast<std::size_t>(b)].kind; };
    for (std::size_t begin = 0; begin < order.size();) {
        std::size_t end = begin;
        while (end < order.size() && kind(static_cast<Index>(end)) == kind(static_cast<Index>(begin))) ++end;
        any = any || end - begin > 1;
        std::reverse(order.begin() + static_cast<std::ptrdiff_t>(begin),
                     order.begin() + static_cast<std::ptrdiff_t>(end));
        begin = end;
    }
    return any ? order : std::vector<Index>();
}

void test_response_permuted(const Scene& scene, const RunSpec& spec, Record& record) {
    const Trace once = trace_of(scene, spec);
    record.outcome = once.outcome;
    FnvHash hash;
    const auto add = [&hash](const Matrix3X& numbers) {
        Frame frame;
        frame.position = numbers;
        hash.add_word(frame.hash());
    };
    for (const Matrix3X& position : once.position) add(position);
    for (const Matrix3X& load : once.load) add(load);
    record.state_hash = hash.text();
    const auto reported = [&record](const std::string& name, const Distance& distance) {
        put(record, name, "_m", distance.path);
        put(record, name, "_n", distance.force);
    };
    reported("twice", between(once, trace_of(scene, spec)));
    const Permutation triangles = shuffled(scene.topology, shuffle_seed, Shuffle::triangles);
    reported("triangles", between(once, trace_of(permuted(scene, triangles), spec)));
    const std::vector<Index> order = reversed_within_kinds(scene.topology);
    if (!order.empty()) {
        const Permutation bodies = with_bodies_in_order(scene.topology, order);
        const Distance distance =
            between(once, trace_of(permuted(scene, bodies), spec), Vector3::Zero(), bodies.vertex, bodies.body);
        reported("bodies", distance);
        // A scene sorts bodies by kind, so that only pairs of one kind can be swapped.
        const bool tested =
            std::any_of(scene.topology.body_pairs.begin(), scene.topology.body_pairs.end(), [&scene](const auto& pair) {
                return scene.topology.bodies[static_cast<std::size_t>(pair[0])].kind ==
                       scene.topology.bodies[static_cast<std::size_t>(pair[1])].kind;
            });
        if (tested) reported("swapped", distance);
    }
    reported("origin", between(once, trace_of(moved(scene, other_origin), spec), other_origin));
    reported("unit", between(once, trace_of(through_millimetres(scene), spec)));
}

}  // namespace

Record run_metamorphic_test(const Scene& scene, const RunSpec& spec) {
    RunSpec whole = spec;
    if (whole.ticks == 0) whole.ticks = scene.ticks;
    Record record = started_record(spec);
    for (const char* name : metamorphic_names) {
        for (const char* ending : {"_pairs", "_m", "_n"}) put(record, name, ending, std::nan(""));
    }
    if (spec.response.empty()) {
        test_detector_permuted(scene, whole, record);
    } else {
        test_response_permuted(scene, whole, record);
    }
    return record;
}

}  // namespace trocar
