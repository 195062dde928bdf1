#include "simulate/interleaved.hpp"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <fstream>
#include <map>
#include <numeric>
#include <optional>
#include <string>

#include "geometry/fnv_hash.hpp"
#include "geometry/random.hpp"
#include "measure/allocations.hpp"
#include "measure/metrics.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "simulate/process_clock.hpp"
#include "simulate/query_distance.hpp"
#include "simulate/simulation.hpp"

namespace trocar {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double budget_s = 0.5;  ///< of a detector's own time and that of writing its frames
constexpr std::int64_t fewest_ticks = 2;
constexpr double least_memory = 1.5e9;  ///< bytes that a detector finds at least, or it is not asked

/// Bytes of malloc, and of the process where libraries map memory themselves.
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

void add_pairs(const std::vector<TrianglePair>& pairs, FnvHash& hash) {
    for (const TrianglePair pair : pairs) {
        hash.add_word((static_cast<std::uint64_t>(static_cast<std::uint32_t>(pair.a)) << 32U) |
                      static_cast<std::uint32_t>(pair.b));
    }
}

std::string hash_of(const std::vector<TrianglePair>& pairs, const std::vector<TrianglePair>& near) {
    FnvHash hash;
    add_pairs(pairs, hash);
    add_pairs(near, hash);
    return hash.text();
}

/// m, of a closed loop on these frames with the default margin: a period of the motion is looked at.
double query_distance_on(const GeneratedScene& scene) {
    Frame frame;
    scene.write(0, frame);
    const QueryDistance distance(scene.topology(), frame);
    const std::vector<Range> all{{0, scene.topology().vertex_count}};
    double move = 0.0;
    constexpr std::int64_t period = 64;
    for (std::int64_t step = 1; step <= period; ++step) {
        scene.write(step, frame);
        move = std::max(move, furthest_move(frame, all));
    }
    return distance.of(move, 0.0, 0.0);
}

/// The exact answer at one tick.
struct Truth {
    TickTruth exact;
    std::vector<TrianglePair> near;
};

/// A detector while it takes its turns.
struct Member {
    Record record;
    std::function<std::unique_ptr<Detector>()> make;
    std::unique_ptr<Detector> detector;
    ContactSet contacts;
    double query_distance = 0.0;                 ///< m; 0: intersecting pairs
    std::int64_t blocks = 0;                     ///< it takes part in
    std::int64_t ticks_per_block = 0;            ///< timed
    std::map<std::int64_t, std::string> answer;  ///< tick -> hash of the pair set
    bool agrees = true;                          ///< with truth, wherever that was computed
    bool claims_exact = false;

    [[nodiscard]] bool takes_part(std::int64_t block) const {
        return blocks > 0 && (block + 1) % (interleaved_blocks / blocks) == 0;
    }
    [[nodiscard]] bool ok() const { return record.outcome.ok(); }
};

class Turns {
public:
    Turns(const GeneratedScene& scene, std::span<const InterleavedRun> runs,
          const std::function<void(std::size_t)>& turn)
        : scene_(scene), turn_(turn), random_(runs.front().spec.seed) {
        const std::int64_t ticks = runs.front().spec.ticks;
        ticks_per_block_ = ticks_per_block(ticks);
        most_ticks_ = std::max(ticks, fewest_ticks);
        const auto start = Clock::now();
        scene_.write(0, frame_);
        scene_.write(1, frame_);
        write_s_ = std::chrono::duration<double>(Clock::now() - start).count() / 3.0;
        for (const InterleavedRun& run : runs) {
            Member member;
            const RunSpec& spec = run.spec;
            member.record = started_record(spec);
            member.make = run.make;
            member.claims_exact = run.claims_exact;
            member.record.environment["frames"] = "generated; all detectors of the scene take turns in one process";
            if (!spec.contacts.empty() && registry().contact_generator(spec.contacts).wants_query_distance) {
                if (!(query_distance_ > 0.0)) query_distance_ = query_distance_on(scene_);
                member.query_distance = query_distance_;
            }
            members_.push_back(std::move(member));
        }
    }

    std::vector<Record> run() {
        find_truth();
        for (const std::size_t i : shuffled()) start(i);
        for (std::int64_t block = 0; block < interleaved_blocks; ++block) {
            for (const std::size_t i : shuffled()) {
                if (members_[i].ok() && members_[i].takes_part(block)) take_turn(block, i);
            }
        }
        std::vector<Record> records;
        for (Member& member : members_) {
            summarise(member);
            records.push_back(std::move(member.record));
        }
        return records;
    }

private:
    std::vector<std::size_t> shuffled() {
        std::vector<std::size_t> order(members_.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        random_.shuffle(order);
        return order;
    }
    void find_truth() {
        for (std::int64_t block = 0; block < interleaved_blocks; ++block) {
            const std::int64_t tick = first_tick_of_block(block, ticks_per_block_);
            scene_.write(tick, frame_);
            Truth& truth = truth_[tick];
            truth.exact = truth_of(scene_.topology(), frame_);
            if (query_distance_ > 0.0) true_near_pairs(scene_.topology(), frame_, query_distance_, truth.near);
            frames_hash_.add_word(frame_.hash());
        }
    }

    StepRow time_tick(std::int64_t tick, Member& member) {
        scene_.write(tick, frame_);
        StepRow row;
        row.tick = tick;
        row.time = frame_.time;
        const std::int64_t allocations = allocation_count();
        const std::int64_t start = process_cpu_ns();
        member.detector->update(frame_, member.query_distance);
        const std::int64_t between = process_cpu_ns();
        member.detector->detect(frame_, member.contacts);
        const std::int64_t end = process_cpu_ns();
        if (allocations >= 0) row.allocations = allocation_count() - allocations;
        row.stage_ns[static_cast<std::size_t>(Stage::update)] = between - start;
        row.stage_ns[static_cast<std::size_t>(Stage::detect)] = end - between;
        if (member.query_distance > 0.0) row.query_distance = member.query_distance;
        row.pairs = static_cast<std::int64_t>(member.contacts.pairs.size());
        row.work = member.contacts.work;
        row.truncated = member.contacts.truncated;
        row.outcome = member.contacts.outcome.kind;
        if (!member.contacts.outcome.ok()) member.record.outcome = member.contacts.outcome;
        if (member.contacts.truncated) {
            member.record.outcome = {OutcomeKind::unsupported, "the list of pairs was cut off"};
        }
        return row;
    }

    void start(std::size_t index) {
        Member& member = members_[index];
        if (memory_left() < least_memory) {
            member.record.outcome = {OutcomeKind::unsupported, "less than 1.5 GB of memory left"};
            return;
        }
        if (turn_) turn_(index);
        member.contacts.native_wanted = false;
        try {
            scene_.write(0, frame_);
            const Memory before = memory_now();
            const std::int64_t cpu_begin = process_cpu_ns();
            member.detector = member.make();
            member.detector->prepare(scene_.topology(), frame_);
            member.record.summary[Metric::prepare_ns] = static_cast<double>(process_cpu_ns() - cpu_begin);
            StepRow row = time_tick(1, member);
            const Memory after = memory_now();
            member.record.summary[Metric::memory_bytes] =
                static_cast<double>(std::max(after.heap - before.heap, after.resident - before.resident));
            if (!member.ok()) return;
            // The first tick pays for growing buffers. A second one has the usual cost, unless a tick is long anyway.
            constexpr std::int64_t long_tick_ns = 300'000'000;
            if (row.total_ns() < long_tick_ns) row = time_tick(2, member);
            plan(1e-9 * static_cast<double>(row.total_ns()), member);
        } catch (const std::exception& error) {
            member.record.outcome = {OutcomeKind::threw, error.what()};
        }
    }

    void plan(double tick_s, Member& member) const {
        const double affordable = budget_s / (tick_s + write_s_);
        const auto ticks = static_cast<std::int64_t>(
            std::clamp(affordable, static_cast<double>(fewest_ticks), static_cast<double>(most_ticks_)));
        // Nested choices of blocks, so that any two detectors have ticks in common.
        member.blocks = ticks >= 4 * interleaved_blocks ? 8 : ticks >= 16 ? 4 : ticks >= 6 ? 2 : 1;
        member.ticks_per_block = std::clamp<std::int64_t>(ticks / member.blocks, 1, ticks_per_block_);
    }

    void take_turn(std::int64_t block, std::size_t index) {
        Member& member = members_[index];
        if (turn_) turn_(index);
        try {
            const std::int64_t first = first_tick_of_block(block, ticks_per_block_);
            time_tick(first - 1, member);  // fills the caches
            for (std::int64_t tick = first; tick < first + member.ticks_per_block && member.ok(); ++tick) {
                StepRow row = time_tick(tick, member);
                member.answer[tick] = answer_of(member);
                if (const auto truth = truth_.find(tick); truth != truth_.end()) judge(truth->second, member, row);
                member.record.rows.push_back(row);
            }
        } catch (const std::exception& error) {
            member.record.outcome = {OutcomeKind::threw, error.what()};
        }
    }

    static std::string answer_of(const Member& member) {
        static const std::vector<TrianglePair> none;
        return hash_of(member.contacts.pairs, member.query_distance > 0.0 ? member.contacts.near : none);
    }

    static void judge(const Truth& truth, Member& member, StepRow& row) {
        judge_pairs(truth.exact, member.contacts.pairs, row);
        if (member.query_distance > 0.0) {
            row.true_proximity_pairs = static_cast<std::int64_t>(truth.near.size());
            row.proximity_false_negatives = compare_pairs(member.contacts.near, truth.near, {}).false_negatives;
        }
        if (member.answer[row.tick] != expected(truth, member)) member.agrees = false;
    }

    static std::string expected(const Truth& truth, const Member& member) {
        static const std::vector<TrianglePair> none;
        return hash_of(truth.exact.pairs, member.query_distance > 0.0 ? truth.near : none);
    }

    /// Of those asked the same, the exact detector with most ticks; null where none agreed with truth.
    [[nodiscard]] const Member* witness(double query_distance) const {
        const Member* best = nullptr;
        for (const Member& member : members_) {
            const bool trusted = member.claims_exact && member.agrees && member.ok() && !member.answer.empty();
            if (!trusted || member.query_distance != query_distance) continue;
            if (best == nullptr || member.answer.size() > best->answer.size()) best = &member;
        }
        return best;
    }

    void summarise(Member& member) const {
        const Member* const exact = witness(member.query_distance);
        double differing = 0.0;
        for (const auto& [tick, hash] : member.answer) {
            std::optional<std::string> right;
            if (const auto truth = truth_.find(tick); truth != truth_.end()) {
                right = expected(truth->second, member);
            } else if (exact != nullptr) {
                if (const auto found = exact->answer.find(tick); found != exact->answer.end()) right = found->second;
            }
            if (right && *right != hash) differing += 1.0;
        }
        member.record.frames_hash = frames_hash_.text();
        // Every turn begins with an untimed tick, so that none is left out as warm-up.
        member.record.summary.merge(summarize(member.record.rows, {.mode = "replay", .warm_up = 0}));
        member.record.summary[Metric::differing_ticks] = differing;
    }

    const GeneratedScene& scene_;
    const std::function<void(std::size_t)>& turn_;
    Random random_;
    std::int64_t ticks_per_block_ = 1;
    std::int64_t most_ticks_ = 1;
    double write_s_ = 0.0;
    double query_distance_ = 0.0;  ///< m; 0: no member has one
    Frame frame_;
    std::vector<Member> members_;
    std::map<std::int64_t, Truth> truth_;
    FnvHash frames_hash_;
};

}  // namespace

std::int64_t ticks_per_block(std::int64_t ticks) {
    return std::max<std::int64_t>(1, (ticks + interleaved_blocks - 1) / interleaved_blocks);
}

std::int64_t first_tick_of_block(std::int64_t block, std::int64_t ticks_per_block) {
    return 4 + block * (ticks_per_block + 1);
}

InterleavedRun interleaved_run(const RunSpec& spec) {
    const DetectorEntry& entry = registry().detector(parse_method(spec.detector).name);
    return {.spec = spec, .claims_exact = entry.claims_exact, .make = [text = spec.detector] {
                return make_detector(text);
            }};
}

std::vector<Record> run_interleaved(const GeneratedScene& scene, std::span<const InterleavedRun> runs,
                                    const std::function<void(std::size_t)>& turn) {
    return runs.empty() ? std::vector<Record>{} : Turns(scene, runs, turn).run();
}

}  // namespace trocar
