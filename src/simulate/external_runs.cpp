#include "simulate/external_runs.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <numeric>

#include "geometry/fnv_hash.hpp"
#include "geometry/pair_file.hpp"
#include "geometry/random.hpp"
#include "measure/metrics.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/mesh_pair.hpp"
#include "simulate/process_clock.hpp"

namespace trocar {
namespace {

/// The right answer at one frame.
struct ExternalTruth {
    TickTruth exact;
    std::vector<TrianglePair> beginnings;  ///< sorted; of a data set with a motion
};

std::vector<TrianglePair> beginnings_of(const ExternalFrames& data) {
    std::vector<TrianglePair> at_start;
    true_pairs(data.topology, data.frames.front(), at_start);
    std::vector<TrianglePair> beginnings;
    for (const auto& [a, b] : *data.meeting) {
        const TrianglePair pair{a, b};
        if (!std::binary_search(at_start.begin(), at_start.end(), pair)) beginnings.push_back(pair);
    }
    return beginnings;
}

class ExternalTurns {
public:
    ExternalTurns(const ExternalFrames& data, std::span<const RunSpec> specs,
                  const std::function<void(std::size_t)>& turn)
        : data_(data), turn_(turn), random_(specs.front().seed) {
        FnvHash frames;
        for (const Frame& frame : data.frames) frames.add_word(frame.hash());
        for (const RunSpec& spec : specs) {
            Asked asked{.record = started_record(spec)};
            asked.record.frames_hash = frames.text();
            asked.record.environment["frames"] = "external; all detectors of the data take turns in one process";
            asked_.push_back(std::move(asked));
        }
        rounds_ = std::max<std::int64_t>(specs.front().ticks, 1);
    }

    std::vector<Record> run() {
        const std::size_t first = data_.meeting ? 1 : 0;
        for (std::size_t k = first; k < data_.frames.size(); ++k) {
            ExternalTruth& truth = truth_.emplace_back();
            truth.exact = truth_of(data_.topology, data_.frames[k]);
            if (data_.meeting) truth.beginnings = beginnings_of(data_);
        }
        std::vector<std::size_t> order(asked_.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        for (std::int64_t round = 0; round < rounds_; ++round) {
            random_.shuffle(order);
            for (const std::size_t i : order) {
                if (turn_) turn_(i);
                if (asked_[i].record.outcome.ok()) take_turn(round, asked_[i]);
            }
        }
        std::vector<Record> records;
        records.reserve(asked_.size());
        for (Asked& asked : asked_) {
            Record& record = asked.record;
            record.summary.merge(summarize(record.rows, {.mode = "replay", .warm_up = 0}));
            records.push_back(std::move(record));
        }
        return records;
    }

private:
    struct Asked {
        Record record;
        std::unique_ptr<Detector> detector = nullptr;
        ContactSet contacts = {};
    };

    void take_turn(std::int64_t round, Asked& asked) {
        const std::size_t first = data_.meeting ? 1 : 0;
        try {
            if (!asked.detector) {
                asked.contacts.native_wanted = false;
                asked.detector = make_detector(asked.record.spec.detector);
                asked.detector->prepare(data_.topology, data_.frames.front());
            }
            // An untimed frame fills the caches: the one before, or the last one of the poses.
            (void)timed(data_.meeting ? data_.frames.front() : data_.frames.back(), asked);
            for (std::size_t k = first; k < data_.frames.size() && asked.record.outcome.ok(); ++k) {
                StepRow row = timed(data_.frames[k], asked);
                row.tick = static_cast<std::int64_t>(asked.record.rows.size());
                if (round == 0) judge(truth_[k - first], asked, row);
                asked.record.rows.push_back(row);
            }
        } catch (const std::exception& error) {
            asked.record.outcome = {OutcomeKind::threw, error.what()};
        }
    }

    static StepRow timed(const Frame& frame, Asked& asked) {
        StepRow row;
        row.time = frame.time;
        const std::int64_t start = process_cpu_ns();
        asked.detector->update(frame, 0.0);
        const std::int64_t between = process_cpu_ns();
        asked.detector->detect(frame, asked.contacts);
        const std::int64_t end = process_cpu_ns();
        row.stage_ns[static_cast<std::size_t>(Stage::update)] = between - start;
        row.stage_ns[static_cast<std::size_t>(Stage::detect)] = end - between;
        row.pairs = static_cast<std::int64_t>(asked.contacts.pairs.size());
        row.swept = static_cast<std::int64_t>(asked.contacts.swept.size());
        row.work = asked.contacts.work;
        row.truncated = asked.contacts.truncated;
        row.outcome = asked.contacts.outcome.kind;
        if (!asked.contacts.outcome.ok()) asked.record.outcome = asked.contacts.outcome;
        return row;
    }

    void judge(const ExternalTruth& truth, Asked& asked, StepRow& row) const {
        const ContactSet& contacts = asked.contacts;
        judge_pairs(truth.exact, contacts.pairs, row);
        if (!data_.meeting) return;
        std::vector<TrianglePair> between;
        between.reserve(contacts.swept.size());
        for (const SweptContact& contact : contacts.swept) {
            if (contact.a < 0) {
                asked.record.outcome = {OutcomeKind::unsupported, "reports bodies between frames, not triangles"};
                return;
            }
            between.push_back({contact.a, contact.b});
        }
        row.true_swept = static_cast<std::int64_t>(truth.beginnings.size());
        row.swept_false_positives = compare_pairs(between, truth.beginnings, {}).false_positives;
        std::vector<TrianglePair> found = std::move(between);
        found.insert(found.end(), contacts.pairs.begin(), contacts.pairs.end());
        row.swept_false_negatives = compare_pairs(found, truth.beginnings, {}).false_negatives;
    }

    const ExternalFrames& data_;
    const std::function<void(std::size_t)>& turn_;
    Random random_;
    std::int64_t rounds_ = 1;
    std::vector<ExternalTruth> truth_;  ///< by frame that is asked
    std::vector<Asked> asked_;
};

/// One detector on questions with known answers, each in a world of its own.
class QueryRun {
public:
    explicit QueryRun(const RunSpec& spec) : spec_(spec), record_(started_record(spec)) {}

    /// The pair is found when it is reported at one of the frames or between them.
    void ask(const Topology& topology, std::initializer_list<const Frame*> frames, bool collides) {
        ContactSet contacts;
        contacts.native_wanted = false;
        bool found = false;
        try {
            const std::unique_ptr<Detector> detector = make_detector(spec_.detector);
            detector->prepare(topology, **frames.begin());
            for (const Frame* frame : frames) {
                if (!contacts.outcome.ok()) break;
                detector->update(*frame, 0.0);
                detector->detect(*frame, contacts);
                found = found || !contacts.pairs.empty() || !contacts.swept.empty();
            }
        } catch (const std::exception& error) {
            contacts.outcome = {OutcomeKind::threw, error.what()};
        }
        ++asked_;
        colliding_ += collides ? 1 : 0;
        if (!contacts.outcome.ok()) {
            ++failed_;
            if (record_.outcome.ok()) record_.outcome = contacts.outcome;
            return;
        }
        false_negatives_ += collides && !found ? 1 : 0;
        false_positives_ += !collides && found ? 1 : 0;
    }

    Record finish() {
        record_.summary = {{Metric::judged_ticks, asked_},
                           {Metric::true_pairs, colliding_},
                           {Metric::false_negatives, false_negatives_},
                           {Metric::false_positives, false_positives_},
                           {Metric::failed_ticks, failed_}};
        return std::move(record_);
    }

private:
    const RunSpec& spec_;
    Record record_;
    double asked_ = 0.0;
    double colliding_ = 0.0;
    double false_negatives_ = 0.0;
    double false_positives_ = 0.0;
    double failed_ = 0.0;
};

Mesh mesh_of(const Corners& corners) {
    Mesh one;
    one.vertices.resize(3, 3);
    for (int k = 0; k < 3; ++k) one.vertices.col(k) = corners[static_cast<std::size_t>(k)];
    one.triangles.resize(3, 1);
    one.triangles << 0, 1, 2;
    return one;
}

}  // namespace

std::vector<Record> run_external(const ExternalFrames& data, std::span<const RunSpec> specs,
                                 const std::function<void(std::size_t)>& turn) {
    return specs.empty() ? std::vector<Record>{} : ExternalTurns(data, specs, turn).run();
}

Record run_ccd_queries(const std::filesystem::path& file, const RunSpec& spec) {
    QueryRun run(spec);
    for (const ContinuousQuery& query : read_ccd_queries(file)) {
        run.ask(query.start.topology, {&query.start.frame, &query.end}, query.collides);
    }
    return run.finish();
}

Record run_pair_family(const std::filesystem::path& file, const RunSpec& spec) {
    QueryRun run(spec);
    for (const PairLine& line : read_pair_file(file)) {
        if (!line.truth) continue;
        const MeshPair question = make_mesh_pair(mesh_of(line.first), mesh_of(line.second));
        run.ask(question.topology, {&question.frame}, *line.truth);
    }
    return run.finish();
}

}  // namespace trocar
