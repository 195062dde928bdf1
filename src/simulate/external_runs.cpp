#include "simulate/external_runs.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <numeric>

#include "geometry/fnv_hash.hpp"
#include "geometry/random.hpp"
#include "measure/metrics.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "simulate/process_clock.hpp"

namespace trocar {
namespace {

/// The right answer at one frame.
struct ExternalTruth {
    std::vector<TrianglePair> pairs;
    std::vector<Index> touching;           ///< positions in `pairs`
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
            true_pairs(data_.topology, data_.frames[k], truth.pairs);
            truth.touching = touching_pairs(data_.topology, data_.frames[k], truth.pairs);
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
        const PairErrors errors = compare_pairs(contacts.pairs, truth.pairs, truth.touching);
        row.true_pairs = static_cast<std::int64_t>(truth.pairs.size());
        row.true_touch = static_cast<std::int64_t>(truth.touching.size());
        row.false_negatives = errors.false_negatives;
        row.false_positives = errors.false_positives;
        row.false_negatives_touch = errors.false_negatives_touch;
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

}  // namespace

std::vector<Record> run_external(const ExternalFrames& data, std::span<const RunSpec> specs,
                                 const std::function<void(std::size_t)>& turn) {
    return specs.empty() ? std::vector<Record>{} : ExternalTurns(data, specs, turn).run();
}

Record run_ccd_queries(const std::filesystem::path& file, const RunSpec& spec) {
    Record record = started_record(spec);
    double collide = 0.0;
    double false_negatives = 0.0;
    double false_positives = 0.0;
    double failed = 0.0;
    const std::vector<ContinuousQuery> queries = read_ccd_queries(file);
    for (const ContinuousQuery& query : queries) {
        collide += query.collides ? 1.0 : 0.0;
        ContactSet contacts;
        contacts.native_wanted = false;
        bool found = false;
        try {
            const std::unique_ptr<Detector> detector = make_detector(spec.detector);
            detector->prepare(query.start.topology, query.start.frame);
            for (const Frame* frame : {&query.start.frame, &query.end}) {
                if (!contacts.outcome.ok()) break;
                detector->update(*frame, 0.0);
                detector->detect(*frame, contacts);
                found = found || !contacts.pairs.empty() || !contacts.swept.empty();
            }
        } catch (const std::exception& error) {
            contacts.outcome = {OutcomeKind::threw, error.what()};
        }
        if (!contacts.outcome.ok()) {
            failed += 1.0;
            if (record.outcome.ok()) record.outcome = contacts.outcome;
            continue;
        }
        false_negatives += query.collides && !found ? 1.0 : 0.0;
        false_positives += !query.collides && found ? 1.0 : 0.0;
    }
    record.summary = {{Metric::judged_ticks, static_cast<double>(queries.size())},
                      {Metric::true_pairs, collide},
                      {Metric::false_negatives, false_negatives},
                      {Metric::false_positives, false_positives},
                      {Metric::failed_ticks, failed}};
    return record;
}

}  // namespace trocar
