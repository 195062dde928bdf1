#include "measure/space_time.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "geometry/continuous.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

MovingTriangle moving(const Topology& topology, const Frame& frame, Index triangle) {
    return moving_triangle(topology.triangles, frame.previous, frame.position, triangle);
}

MovingTriangle backwards(MovingTriangle triangle) {
    for (MovingPoint& point : triangle) std::swap(point.start, point.end);
    return triangle;
}

Corners at_start(const MovingTriangle& t) { return {t[0].start, t[1].start, t[2].start}; }
Corners at_end(const MovingTriangle& t) { return {t[0].end, t[1].end, t[2].end}; }

}  // namespace

bool SpaceTimeTruth::measure(const Frame& frame) {
    const Topology& topology = *topology_;
    beginnings_.clear();
    body_pairs_.assign(topology.body_pairs.size(), {});
    if (frame.previous.cols() != frame.position.cols() || !frame.all_finite() || !frame.previous.allFinite()) {
        return false;
    }
    triangle_boxes(frame.position, topology.triangles, boxes_);
    triangle_boxes(frame.previous, topology.triangles, boxes_before_);
    for (std::size_t t = 0; t < boxes_.size(); ++t) boxes_[t].add(boxes_before_[t]);
    for (std::size_t p = 0; p < topology.body_pairs.size(); ++p) {
        const auto& [body_a, body_b] = topology.body_pairs[p];
        BodyPairTick& tick = body_pairs_[p];
        overlapping_boxes(boxes_, topology.bodies[at(body_a)].triangles, topology.bodies[at(body_b)].triangles,
                          candidates_);
        met_.clear();
        for (const IndexPair& candidate : candidates_) {
            const MovingTriangle first = moving(topology, frame, candidate.first);
            const MovingTriangle second = moving(topology, frame, candidate.second);
            if (oracle_intersect(at_end(first), at_end(second))) tick.at_end = true;
            if (oracle_intersect(at_start(first), at_start(second))) {
                tick.at_start = true;
                met_.push_back(candidate);
                continue;
            }
            const std::optional<double> time = oracle_first_contact(first, second);
            if (!time) continue;
            met_.push_back(candidate);
            tick.first = std::fmin(tick.first, *time);
            beginnings_.push_back(
                {.a = candidate.first, .b = candidate.second, .body_a = body_a, .body_b = body_b, .time = *time});
        }
        tick.between_frames = !met_.empty();
        if (tick.at_end || met_.empty()) continue;
        for (const IndexPair& pair : met_) {
            const std::optional<double> from_end = oracle_first_contact(
                backwards(moving(topology, frame, pair.first)), backwards(moving(topology, frame, pair.second)));
            if (from_end) tick.last = std::fmax(tick.last, 1.0 - *from_end);
        }
    }
    std::sort(beginnings_.begin(), beginnings_.end(), [](const SweptContact& x, const SweptContact& y) {
        return TrianglePair{x.a, x.b} < TrianglePair{y.a, y.b};
    });
    return true;
}

void judge_swept(const Topology& topology, const SpaceTimeTruth& truth, const ContactSet& contacts, StepRow& row) {
    const std::vector<SweptContact>& beginnings = truth.beginnings();
    row.true_swept = static_cast<std::int64_t>(beginnings.size());
    row.swept_false_negatives = 0;
    row.swept_false_positives = 0;
    const auto reported_time = [&contacts](const SweptContact& beginning) -> std::optional<double> {
        for (const SweptContact& reported : contacts.swept) {
            if (reported.a == beginning.a && reported.b == beginning.b) return reported.time;
        }
        return std::nullopt;
    };
    for (const SweptContact& beginning : beginnings) {
        if (const std::optional<double> time = reported_time(beginning)) {
            row.swept_time_error = std::fmax(row.swept_time_error, std::abs(*time - beginning.time));
            continue;
        }
        const bool by_bodies =
            std::any_of(contacts.swept.begin(), contacts.swept.end(), [&beginning](const SweptContact& reported) {
                return reported.a < 0 && reported.body_a == beginning.body_a && reported.body_b == beginning.body_b;
            });
        const bool by_pair =
            std::binary_search(contacts.pairs.begin(), contacts.pairs.end(), TrianglePair{beginning.a, beginning.b});
        if (!by_bodies && !by_pair) ++row.swept_false_negatives;
    }
    for (const SweptContact& reported : contacts.swept) {
        if (reported.a >= 0) {
            const bool is_true = std::any_of(beginnings.begin(), beginnings.end(), [&reported](const SweptContact& b) {
                return b.a == reported.a && b.b == reported.b;
            });
            row.swept_false_positives += is_true ? 0 : 1;
            continue;
        }
        const Index number = topology.body_pair(reported.body_a, reported.body_b);
        const BodyPairTick tick = number < 0 ? BodyPairTick{} : truth.body_pairs()[at(number)];
        row.swept_false_positives += tick.between_frames ? 0 : 1;
        if (!tick.at_start && tick.between_frames) {
            row.swept_time_error = std::fmax(row.swept_time_error, std::abs(reported.time - tick.first));
        }
    }
}

ContactEvents::ContactEvents(const Topology& topology)
    : topology_(&topology), open_(topology.body_pairs.size(), -1), reported_(topology.body_pairs.size(), 0) {}

void ContactEvents::follow(const Frame& frame, double dt, const SpaceTimeTruth& truth, const ContactSet& contacts) {
    const Topology& topology = *topology_;
    std::fill(reported_.begin(), reported_.end(), std::uint8_t{0});
    const auto report = [&](Index body_a, Index body_b) {
        const Index number = topology.body_pair(body_a, body_b);
        if (number >= 0) reported_[at(number)] = 1;
    };
    for (const TrianglePair& pair : contacts.pairs) {
        report(topology.body_of_triangle[at(pair.a)], topology.body_of_triangle[at(pair.b)]);
    }
    for (const SweptContact& contact : contacts.swept) report(contact.body_a, contact.body_b);
    const double start = frame.time - dt;
    for (std::size_t p = 0; p < truth.body_pairs().size(); ++p) {
        const BodyPairTick& tick = truth.body_pairs()[p];
        if (open_[p] < 0 && tick.between_frames) {
            open_[p] = static_cast<std::ptrdiff_t>(events_.size());
            const auto& [body_a, body_b] = topology.body_pairs[p];
            // In contact from the very first frame on: there was no earlier moment to see it.
            const double begin = tick.at_start ? (frame.tick == 0 ? frame.time : start) : start + tick.first * dt;
            events_.push_back({.body_a = body_a, .body_b = body_b, .begin = begin});
        }
        if (open_[p] < 0) continue;
        ContactEvent& event = events_[at(open_[p])];
        if (event.missed() && reported_[p] != 0) event.seen = frame.time;
        if (tick.at_end) continue;
        event.end = start + tick.last * dt;
        open_[p] = -1;
    }
}

}  // namespace trocar
