#include "measurement.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <ctime>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <fstream>
#include <map>
#include <numeric>
#include <optional>

#include "geometry/fnv_hash.hpp"
#include "geometry/random.hpp"
#include "measure/allocations.hpp"
#include "measure/pair_truth.hpp"

namespace trocar::bench {
namespace {

using Clock = std::chrono::steady_clock;

/// CPU time of the whole process, all threads: unlike wall time it does not grow when other programs take their turns,
/// and unlike a thread's time it cannot be shed to a helper thread. ns
std::int64_t cpu_now() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1'000'000'000 * static_cast<std::int64_t>(now.tv_sec) + now.tv_nsec;
}

std::int64_t ns_between(Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(to - from).count();
}

/// Of these pairs alone, or behind those of which `hash` is.
FnvHash hash_of(const std::vector<TrianglePair>& pairs, FnvHash hash = {}) {
    for (const TrianglePair pair : pairs) {
        hash.add_word((static_cast<std::uint64_t>(static_cast<std::uint32_t>(pair.a)) << 32U) |
                      static_cast<std::uint32_t>(pair.b));
    }
    return hash;
}

struct Memory {
    std::int64_t heap = 0;
    std::int64_t resident = 0;
};
Memory memory_now() {
    malloc_trim(0);
    const struct mallinfo2 info = mallinfo2();
    std::ifstream stream("/proc/self/statm");
    std::int64_t total = 0;
    std::int64_t resident = 0;
    stream >> total >> resident;
    return {static_cast<std::int64_t>(info.uordblks + info.hblkhd), resident * sysconf(_SC_PAGESIZE)};
}

/// Bytes that the machine can still give; unlimited where it does not report.
double memory_left() {
    std::ifstream stream("/proc/meminfo");
    for (std::string line; std::getline(stream, line);) {
        if (line.starts_with("MemAvailable:")) return 1024.0 * std::stod(line.substr(13));
    }
    return 1e18;
}

template <typename Value>
Value middle(std::vector<Value> values) {
    if (values.empty()) return Value{};
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    return *half;
}

/// The exact answer at one step.
struct Truth {
    std::vector<TrianglePair> pairs;
    std::vector<TrianglePair> near;
    FnvHash hash;         ///< of pairs
    FnvHash within_hash;  ///< of both
};

struct StepTime {
    std::int64_t update = 0;  ///< ns, CPU
    std::int64_t detect = 0;  ///< ns, CPU
    std::int64_t wall = 0;    ///< ns, both
    std::int64_t allocations = 0;
};

/// A method while it is measured.
struct Runner {
    MethodResult result;
    std::unique_ptr<Detector> detector;
    ContactSet contacts;
    std::int64_t relaxations = 0;      ///< blocks it takes part in
    std::int64_t steps_per_visit = 0;  ///< measured ones
    std::vector<WorkCounters> work;
    std::vector<std::int64_t> pairs;
    std::vector<std::int64_t> near_pairs;
    std::map<std::int64_t, FnvHash> answer;  ///< step -> hash of the pair set

    [[nodiscard]] bool visits_block(std::int64_t block) const {
        return relaxations > 0 && (block + 1) % (block_count / relaxations) == 0;
    }
};

class Cell {
public:
    Cell(const FrameMaker& frames, const MeasureOptions& options) : frames_(frames), options_(options) {
        steps_per_block_ = std::max<std::int64_t>(1, (options.most_steps + block_count - 1) / block_count);
        const auto start = Clock::now();
        frames_.write(0, frame_);
        frames_.write(1, frame_);
        write_ns_ = static_cast<double>(ns_between(start, Clock::now())) / 3.0;
    }

    CellMeasurement run(const std::vector<Method>& methods) {
        std::vector<Runner> runners(methods.size());
        Random random(options_.seed);
        find_truth();
        for (const std::size_t i : shuffled(methods.size(), random)) start(methods[i], runners[i]);
        for (std::int64_t block = 0; block < block_count; ++block) {
            for (const std::size_t i : shuffled(runners.size(), random)) {
                if (runners[i].result.outcome.ok() && runners[i].visits_block(block)) visit(block, runners[i]);
            }
        }
        CellMeasurement measurement;
        compare_answers(runners);
        for (Runner& runner : runners) {
            summarise(runner);
            measurement.methods.push_back(std::move(runner.result));
        }
        std::vector<std::int64_t> counts;
        std::vector<std::int64_t> near_counts;
        for (const auto& [step, truth] : truth_) {
            counts.push_back(static_cast<std::int64_t>(truth.pairs.size()));
            near_counts.push_back(static_cast<std::int64_t>(truth.near.size()));
        }
        measurement.true_pairs = middle(counts);
        measurement.true_near_pairs = middle(near_counts);
        measurement.frames_hash = frames_hash_.text();
        return measurement;
    }

private:
    static std::vector<std::size_t> shuffled(std::size_t count, Random& random) {
        std::vector<std::size_t> order(count);
        std::iota(order.begin(), order.end(), std::size_t{0});
        random.shuffle(order);
        return order;
    }
    /// Step numbers leave room for the settling step before each block.
    [[nodiscard]] std::int64_t first_step(std::int64_t block) const { return 4 + block * (steps_per_block_ + 1); }

    void find_truth() {
        for (std::int64_t block = 0; block < block_count; ++block) {
            const std::int64_t step = first_step(block);
            frames_.write(step, frame_);
            Truth& truth = truth_[step];
            true_pairs(*frames_.topology, frame_, truth.pairs);
            truth.hash = hash_of(truth.pairs);
            if (options_.query_distance > 0.0)
                true_near_pairs(*frames_.topology, frame_, options_.query_distance, truth.near);
            truth.within_hash = hash_of(truth.near, truth.hash);
            frames_hash_.add_word(frame_.hash());
        }
    }

    void report(const std::string& label) const {
        if (options_.now) options_.now(label);
    }

    StepTime time_step(std::int64_t step, Runner& runner) {
        frames_.write(step, frame_);
        const std::int64_t allocations = allocation_count();
        const auto wall_start = Clock::now();
        const std::int64_t start = cpu_now();
        runner.detector->update(frame_, runner.result.within_query_distance ? options_.query_distance : 0.0);
        const std::int64_t between = cpu_now();
        runner.detector->detect(frame_, runner.contacts);
        const std::int64_t end = cpu_now();
        const auto wall_end = Clock::now();
        StepTime time{between - start, end - between, ns_between(wall_start, wall_end),
                      allocation_count() - allocations};
        if (allocations < 0) time.allocations = -1;
        if (!runner.contacts.outcome.ok()) runner.result.outcome = runner.contacts.outcome;
        if (runner.contacts.truncated) {
            runner.result.outcome = {OutcomeKind::unsupported, "the list of pairs was cut off"};
        }
        return time;
    }

    /// Makes, prepares and warms up; decides how many steps the budget allows.
    void start(const Method& method, Runner& runner) {
        MethodResult& result = runner.result;
        result.label = method.label;
        result.method = method.method;
        result.library = method.library;
        result.family = method.family;
        result.narrow = method.narrow;
        result.own = method.own;
        result.claims_exact = method.claims_exact;
        result.within_query_distance = method.within_query_distance;
        constexpr double least_memory = 1.5e9;
        if (memory_left() < least_memory) {
            result.outcome = {OutcomeKind::unsupported, "less than 1.5 GB of memory left"};
            return;
        }
        report(method.label);
        runner.contacts.native_wanted = false;
        try {
            frames_.write(0, frame_);
            const Memory before = memory_now();
            const auto begin = Clock::now();
            runner.detector = method.make();
            runner.detector->prepare(*frames_.topology, frame_);
            result.prepare_ns = static_cast<double>(ns_between(begin, Clock::now()));
            StepTime time = time_step(1, runner);
            const Memory after = memory_now();
            result.heap_bytes = after.heap - before.heap;
            result.resident_bytes = after.resident - before.resident;
            if (!result.outcome.ok()) return;
            // The first step pays for growing buffers; a second one says what a step costs, unless it is long anyway.
            constexpr std::int64_t long_step_ns = 300'000'000;
            if (time.wall < long_step_ns) time = time_step(2, runner);
            plan(static_cast<double>(time.wall), runner);
        } catch (const std::exception& error) {
            result.outcome = {OutcomeKind::threw, error.what()};
        }
    }

    void plan(double step_ns, Runner& runner) const {
        const double affordable = options_.budget_s * 1e9 / (step_ns + write_ns_);
        const auto steps = static_cast<std::int64_t>(std::clamp(affordable, static_cast<double>(options_.fewest_steps),
                                                                static_cast<double>(options_.most_steps)));
        // Nested choices of blocks, so that any two methods have steps in common.
        runner.relaxations = steps >= 4 * block_count ? 8 : steps >= 16 ? 4 : steps >= 6 ? 2 : 1;
        runner.steps_per_visit = std::clamp<std::int64_t>(steps / runner.relaxations, 1, steps_per_block_);
    }

    void visit(std::int64_t block, Runner& runner) {
        MethodResult& result = runner.result;
        report(result.label);
        try {
            const std::int64_t first = first_step(block);
            const StepTime settling = time_step(first - 1, runner);
            result.cold_ns.push_back(settling.update + settling.detect);
            for (std::int64_t step = first; step < first + runner.steps_per_visit && result.outcome.ok(); ++step) {
                const StepTime time = time_step(step, runner);
                result.step.push_back(step);
                result.update_ns.push_back(time.update);
                result.detect_ns.push_back(time.detect);
                result.wall_ns.push_back(time.wall);
                result.allocations = std::max(result.allocations, time.allocations);
                runner.work.push_back(runner.contacts.work);
                result.work_max = std::max(result.work_max, runner.contacts.work.work());
                runner.pairs.push_back(static_cast<std::int64_t>(runner.contacts.pairs.size()));
                runner.near_pairs.push_back(static_cast<std::int64_t>(runner.contacts.near.size()));
                runner.answer[step] = hash_of(runner.contacts.pairs);
                if (result.within_query_distance)
                    runner.answer[step] = hash_of(runner.contacts.near, runner.answer[step]);
                if (const auto truth = truth_.find(step); truth != truth_.end()) judge(truth->second, runner);
            }
        } catch (const std::exception& error) {
            result.outcome = {OutcomeKind::threw, error.what()};
        }
    }

    static void judge(const Truth& truth, Runner& runner) {
        MethodResult& result = runner.result;
        const PairErrors errors = compare_pairs(runner.contacts.pairs, truth.pairs, {});
        ++result.truth_steps;
        result.true_pairs += static_cast<std::int64_t>(truth.pairs.size());
        result.false_negatives += errors.false_negatives;
        result.false_positives += errors.false_positives;
        if (!result.within_query_distance) return;
        const PairErrors near_errors = compare_pairs(runner.contacts.near, truth.near, {});
        result.true_pairs += static_cast<std::int64_t>(truth.near.size());
        result.false_negatives += near_errors.false_negatives;
        result.false_positives += near_errors.false_positives;
    }

    void compare_answers(std::vector<Runner>& runners) const {
        for (const bool within_query_distance : {false, true}) compare_answers(runners, within_query_distance);
    }

    /// Steps without truth are held against a method that was asked the same and agreed with truth wherever it was
    /// asked: one that claims exactness, with the most steps.
    void compare_answers(std::vector<Runner>& runners, bool within_query_distance) const {
        const Runner* reference = nullptr;
        for (const Runner& runner : runners) {
            const MethodResult& result = runner.result;
            if (result.within_query_distance != within_query_distance || !result.claims_exact || !result.exact() ||
                result.truth_steps == 0)
                continue;
            if (reference == nullptr || runner.answer.size() > reference->answer.size()) reference = &runner;
        }
        for (Runner& runner : runners) {
            if (runner.result.within_query_distance != within_query_distance) continue;
            for (const auto& [step, hash] : runner.answer) {
                std::optional<FnvHash> expected;
                if (const auto truth = truth_.find(step); truth != truth_.end()) {
                    expected = within_query_distance ? truth->second.within_hash : truth->second.hash;
                } else if (reference != nullptr) {
                    if (const auto found = reference->answer.find(step); found != reference->answer.end()) {
                        expected = found->second;
                    }
                }
                if (expected && *expected != hash) ++runner.result.differing_steps;
            }
        }
    }

    static void summarise(Runner& runner) {
        const auto of = [&runner](std::int64_t WorkCounters::*counter) {
            std::vector<std::int64_t> values;
            for (const WorkCounters& work : runner.work) values.push_back(work.*counter);
            return middle(values);
        };
        runner.result.work = {of(&WorkCounters::vertices_read), of(&WorkCounters::cells_visited),
                              of(&WorkCounters::box_tests), of(&WorkCounters::triangle_tests)};
        runner.result.pairs = middle(runner.pairs);
        runner.result.near_pairs = middle(runner.near_pairs);
    }

    const FrameMaker& frames_;
    const MeasureOptions& options_;
    std::int64_t steps_per_block_ = 1;
    double write_ns_ = 0.0;
    Frame frame_;
    std::map<std::int64_t, Truth> truth_;
    FnvHash frames_hash_;
};

}  // namespace

CellMeasurement measure(const FrameMaker& frames, const std::vector<Method>& methods, const MeasureOptions& options) {
    return Cell(frames, options).run(methods);
}

}  // namespace trocar::bench
