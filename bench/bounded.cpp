#include "bounded.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <numbers>
#include <utility>

#include "geometry/box_pairs.hpp"
#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "measure/allocations.hpp"
#include "measure/pair_truth.hpp"
#include "measure/statistics.hpp"
#include "simulate/frame_source.hpp"

namespace trocar::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t warm_up = 1000;       ///< ticks with a box pair that grow the buffers and report the usual time
constexpr std::int64_t truth_stride = 1000;  ///< one tick in so many is held against the oracle

std::int64_t ns_since(Clock::time_point start) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
}

/// Nothing but arithmetic in registers. Returns something so that it is not optimised away.
std::uint64_t spin(std::int64_t rounds) {
    std::uint64_t x = 1;
    for (std::int64_t i = 0; i < rounds; ++i) {
        x = x * 6364136223846793005ULL + 1442695040888963407ULL;  // Knuth's MMIX generator: each round needs the last
        asm volatile("" : "+r"(x));
    }
    return x;
}

/// Rounds of spin() that take about `ns`.
std::int64_t rounds_for(double ns) {
    constexpr std::int64_t probe = 100000;
    std::vector<double> times;
    for (int k = 0; k < 15; ++k) {
        const auto start = Clock::now();
        (void)spin(probe);
        times.push_back(static_cast<double>(ns_since(start)));
    }
    return std::max<std::int64_t>(1, std::llround(ns / median(times) * static_cast<double>(probe)));
}

Spread spread_of(const std::vector<double>& values) {
    if (values.empty()) return {};
    return {median(values), quantile(values, 0.99), quantile(values, 0.999),
            *std::max_element(values.begin(), values.end())};
}

struct BoundedRunner {
    BoundedResult result;
    std::unique_ptr<Detector> detector;
    ContactSet contacts;
    std::int64_t empty_rounds = 0;
    std::vector<double> work;
    std::vector<double> wall;
    std::vector<double> empty;
    std::vector<double> warm_up_wall;

    /// Both calls on one frame; wall time in ns.
    double step(const Frame& frame) {
        const std::int64_t allocations = allocation_count();
        const auto start = Clock::now();
        try {
            detector->update(frame, 0.0);
            detector->detect(frame, contacts);
        } catch (const std::exception& error) {
            contacts.outcome = {OutcomeKind::threw, error.what()};
        }
        const auto ns = static_cast<double>(ns_since(start));
        if (allocations >= 0 && result.allocations >= 0) result.allocations += allocation_count() - allocations;
        if (!contacts.outcome.ok()) result.outcome = contacts.outcome;
        return ns;
    }
};

BoundedRunner start(const Method& method, const Scene& scene) {
    BoundedRunner runner;
    runner.result.label = method.label;
    runner.result.library = method.library;
    runner.result.own = method.own;
    runner.result.claims_exact = method.claims_exact;
    runner.contacts.native_wanted = false;
    try {
        runner.detector = method.make();
        runner.detector->prepare(scene.topology, scene.first);
    } catch (const std::exception& error) {
        runner.result.outcome = {OutcomeKind::threw, error.what()};
    }
    return runner;
}

/// Pairs of triangles whose boxes overlap; no method is asked.
class BoxPairs {
public:
    explicit BoxPairs(const Topology& topology) : topology_(topology) {}
    std::int64_t count(const Frame& frame) {
        triangle_boxes(frame.position, topology_.triangles, boxes_);
        std::int64_t sum = 0;
        for (const auto& [a, b] : topology_.body_pairs) {
            overlapping_boxes(boxes_, topology_.bodies[static_cast<std::size_t>(a)].triangles,
                              topology_.bodies[static_cast<std::size_t>(b)].triangles, pairs_);
            sum += static_cast<std::int64_t>(pairs_.size());
        }
        return sum;
    }

private:
    const Topology& topology_;
    std::vector<Box> boxes_;
    std::vector<IndexPair> pairs_;
};

}  // namespace

Scene repeated(Scene scene, std::int64_t cycles, double pause) {
    Motion* motion = nullptr;
    for (SceneBody& body : scene.bodies) {
        if (!body.motion) continue;
        if (motion != nullptr) throw InputError(scene.name, "/bodies", "one body with a motion", "several");
        motion = &*body.motion;
    }
    if (motion == nullptr) throw InputError(scene.name, "/bodies", "one body with a motion", "none");
    const std::vector<MotionKey> once = std::exchange(motion->keys, {});
    const double period = once.back().time + pause;
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (std::int64_t cycle = 0; cycle < cycles; ++cycle) {
        const Matrix3 turn =
            Eigen::AngleAxisd(golden_angle * static_cast<double>(cycle), Vector3::UnitZ()).toRotationMatrix();
        for (MotionKey key : once) {
            key.time += period * static_cast<double>(cycle);
            key.translation = turn * key.translation;
            motion->keys.push_back(key);
        }
    }
    scene.ticks = std::llround(period * static_cast<double>(cycles) / scene.dt);
    return scene;
}

Scene repeated(const std::filesystem::path& scene_file, std::int64_t cycles) {
    constexpr double return_time = 0.1;  // s
    return repeated(read_scene(scene_file, std::nullopt), cycles, return_time);
}

BoundedMeasurement measure_bounded(const Scene& scene, const std::vector<Method>& methods, std::int64_t ticks,
                                   const std::function<void(const std::string&)>& now) {
    BoundedMeasurement measurement;
    measurement.scene = scene.name;
    std::vector<BoundedRunner> runners;
    for (const Method& method : methods) {
        if (now) now(method.label);
        runners.push_back(start(method, scene));
        for (std::vector<double>* series : {&runners.back().work, &runners.back().wall, &runners.back().empty}) {
            series->reserve(static_cast<std::size_t>(ticks));
        }
    }
    const std::unique_ptr<FrameSource> source = scene_frames(scene, scene.ticks);
    BoxPairs boxes(scene.topology);
    std::vector<double> box_pairs;
    std::vector<double> true_counts;
    std::vector<TrianglePair> truth;
    FnvHash hash;
    Frame frame;
    std::int64_t warm = 0;
    while (measurement.ticks < ticks && source->next(frame)) {
        ++measurement.driven_ticks;
        const std::int64_t overlapping = boxes.count(frame);
        const bool is_warm = warm >= warm_up;
        if (overlapping > 0 && !is_warm) ++warm;
        const bool counted = overlapping > 0 && is_warm;
        const bool judged = counted && measurement.ticks % truth_stride == 0;
        if (judged) {
            true_pairs(scene.topology, frame, truth);
            true_counts.push_back(static_cast<double>(truth.size()));
        }
        if (counted) {
            ++measurement.ticks;
            box_pairs.push_back(static_cast<double>(overlapping));
            hash.add(frame.hash());
        }
        // In another order every tick, so that nobody always finds the caches as the same neighbour left them.
        for (std::size_t k = 0; k < runners.size(); ++k) {
            BoundedRunner& runner = runners[(k + static_cast<std::size_t>(measurement.driven_ticks)) % runners.size()];
            BoundedResult& result = runner.result;
            if (!result.outcome.ok()) continue;
            if (now) now(result.label);
            if (is_warm && result.allocations < 0 && allocation_count() >= 0) result.allocations = 0;
            const double ns = runner.step(frame);
            if (overlapping == 0) continue;
            if (!is_warm) {
                runner.warm_up_wall.push_back(ns);
                if (warm == warm_up && result.own) runner.empty_rounds = rounds_for(median(runner.warm_up_wall));
                continue;
            }
            const auto work = static_cast<double>(runner.contacts.work.work());
            if (runner.work.empty() || work > result.work.max) {
                result.work.max = work;
                result.worst_tick = frame.tick;
            }
            runner.work.push_back(work);
            runner.wall.push_back(ns);
            if (runner.empty_rounds > 0) {
                const auto begin = Clock::now();
                (void)spin(runner.empty_rounds);
                runner.empty.push_back(static_cast<double>(ns_since(begin)));
            }
            result.truncated += runner.contacts.truncated ? 1 : 0;
            if (judged) {
                ++result.truth_ticks;
                result.wrong_ticks += runner.contacts.pairs == truth ? 0 : 1;
            }
        }
    }
    for (BoundedRunner& runner : runners) {
        runner.result.work = spread_of(runner.work);
        runner.result.wall = spread_of(runner.wall);
        runner.result.empty = spread_of(runner.empty);
        measurement.methods.push_back(std::move(runner.result));
    }
    measurement.box_pairs = median(box_pairs);
    measurement.true_pairs = median(true_counts);
    measurement.frames_hash = hash.text();
    return measurement;
}

}  // namespace trocar::bench
