#include "measure/depth_truth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "measure/body_surface.hpp"
#include "measure/edge_depth.hpp"

namespace trocar {
namespace {

/// Samples of one body judged against another body.
struct Direction {
    Index from = -1;
    Index into = -1;
    bool counted = true;
    std::optional<SheetSides> sheet;  ///< absent: `into` is closed, or its sides are not known
    std::vector<Side> side;           ///< per sample
};

}  // namespace

struct DepthTruth::State {
    const Topology* topology = nullptr;
    Matrix3X position;  ///< of the current frame
    Matrix3X previous;  ///< of the frame measured before
    std::vector<BodySurface> bodies;
    std::vector<Direction> directions;
    std::vector<double> vertex_bounds;  ///< of the samples of the direction measured now (measure/edge_depth.hpp)

    [[nodiscard]] BodySurface& body(Index number) { return bodies[static_cast<std::size_t>(number)]; }

    void advance_to(const Matrix3X& now) {
        previous.swap(position);
        position = now;
        for (BodySurface& one : bodies) one.follow();
    }

    void judge(Direction& direction) {
        BodySurface& from = body(direction.from);
        BodySurface& into = body(direction.into);
        if (direction.sheet) {
            direction.sheet->update();
            for (std::size_t i = 0; i < direction.side.size(); ++i) direction.side[i] = direction.sheet->side(i);
            return;
        }
        if (!into.range().closed) {
            std::fill(direction.side.begin(), direction.side.end(), Side::undecided);
            return;
        }
        const bool apart = !from.box().overlaps(into.box());
        for (std::size_t i = 0; i < direction.side.size(); ++i) {
            const bool inside = !apart && into.crossings(from.point(i)) != 0;
            direction.side[i] = inside ? Side::wrong : Side::right;
        }
    }

    /// m, of the samples of one direction; at most `nearest`.
    [[nodiscard]] double clearance(const Direction& direction, double nearest) {
        const Box& surface = body(direction.into).box();
        for (std::size_t i = 0; i < direction.side.size(); ++i) {
            const Vector3 p = body(direction.from).point(i);
            if (std::sqrt(surface.squared_distance(p)) < nearest)
                nearest = std::min(nearest, body(direction.into).distance(p));
        }
        return nearest;
    }

    [[nodiscard]] EdgeDepth depth_of_edges(const Direction& direction, double at_least) {
        const BodySurface& from = body(direction.from);
        BodySurface& into = body(direction.into);
        if (!into.range().closed || !from.box().overlaps(into.box())) return {.depth = at_least};
        return edge_depth(topology->triangles, position, from.edges(), into.rays(), into.surface(), vertex_bounds,
                          at_least);
    }

    /// Within `enough` (m) any bound on the depth.
    [[nodiscard]] double depth(const Direction& direction, std::size_t sample, double enough = 0.0) {
        switch (direction.side[sample]) {
            case Side::right:
                return 0.0;
            case Side::wrong:
                return body(direction.into).distance(body(direction.from).point(sample), enough);
            case Side::undecided:
                break;
        }
        return std::nan("");
    }
};

DepthTruth::DepthTruth(const Topology& topology, const Frame& first, std::span<const std::uint8_t> counted,
                       Index area_samples, bool sides_known)
    : state_(std::make_unique<State>()) {
    State& s = *state_;
    s.topology = &topology;
    s.position = first.position;
    s.previous = first.position;
    s.vertex_bounds.assign(at(topology.vertex_count), not_inside);
    s.bodies.reserve(topology.bodies.size());
    for (Index body = 0; body < topology.body_count(); ++body) {
        s.bodies.emplace_back(topology, body, s.position, s.previous, area_samples);
    }
    for (std::size_t pair = 0; pair < topology.body_pairs.size(); ++pair) {
        const auto [a, b] = topology.body_pairs[pair];
        for (const auto& [from, into] : {std::array{a, b}, std::array{b, a}}) {
            Direction direction;
            direction.from = from;
            direction.into = into;
            direction.counted = counted.empty() || counted[pair] != 0;
            direction.side.resize(s.body(from).sample_count(), Side::right);
            if (sides_known && !s.body(into).range().closed) direction.sheet.emplace(s.body(from), s.body(into));
            s.directions.push_back(std::move(direction));
            s.judge(s.directions.back());
        }
    }
}

DepthTruth::~DepthTruth() = default;

void DepthTruth::follow(const Frame& frame) {
    if (!frame.all_finite()) return;
    state_->advance_to(frame.position);
    for (Direction& direction : state_->directions) state_->judge(direction);
}

DepthTruth::Result DepthTruth::measure(const Frame& frame) {
    if (!frame.all_finite()) return {std::nan(""), std::nan(""), -1, std::nan(""), -1, -1};
    State& s = *state_;
    follow(frame);
    Result result;
    double weighted_depth = 0.0;
    double weight = 0.0;
    for (const Direction& direction : s.directions) {
        if (!direction.counted) continue;
        const BodySurface& from = s.body(direction.from);
        const auto own_bounds = s.vertex_bounds.begin() + from.range().vertices.first;
        std::fill_n(own_bounds, from.range().vertices.count, not_inside);
        for (std::size_t i = 0; i < direction.side.size(); ++i) {
            if (direction.side[i] == Side::undecided) ++result.side_undecided;
            if (direction.side[i] != Side::wrong) continue;
            // Of vertices the deepest one counts, of area samples each.
            const double enough = i < from.vertex_count() ? result.residual_penetration : 0.0;
            const double depth = s.depth(direction, i, enough);
            ++result.wrong_side;
            if (i < from.vertex_count()) {
                ++result.wrong_side_vertices;
                own_bounds[static_cast<std::ptrdiff_t>(i)] = depth;
            }
            result.residual_penetration = std::max(result.residual_penetration, depth);
            if (i < from.vertex_count()) continue;
            weighted_depth += from.area_weight() * depth;
            weight += from.area_weight();
        }
        const EdgeDepth edges = s.depth_of_edges(direction, result.residual_penetration);
        result.wrong_side += edges.stretches;
        result.residual_penetration = std::max(result.residual_penetration, edges.depth);
    }
    result.wrong_side_area = weight;
    if (weight > 0.0) result.residual_penetration_mean = weighted_depth / weight;
    return result;
}

double DepthTruth::clearance() const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Direction& direction : state_->directions) {
        if (direction.counted) nearest = state_->clearance(direction, nearest);
    }
    return nearest;
}

double DepthTruth::clearance(Index body_a, Index body_b) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Direction& direction : state_->directions) {
        const bool asked = (direction.from == body_a && direction.into == body_b) ||
                           (direction.from == body_b && direction.into == body_a);
        if (!asked) continue;
        if (std::find(direction.side.begin(), direction.side.end(), Side::wrong) != direction.side.end()) return 0.0;
        nearest = state_->clearance(direction, nearest);
    }
    return nearest;
}

double DepthTruth::depth_of_vertex(Index vertex, Index into) const {
    State& s = *state_;
    const Index from = s.topology->body_of_vertex(vertex);
    for (const Direction& direction : s.directions) {
        if (direction.from != from || direction.into != into) continue;
        return s.depth(direction, static_cast<std::size_t>(vertex - s.body(from).range().vertices.first));
    }
    return std::nan("");
}

void DepthTruth::each_sample(const std::function<void(const Judgement&)>& visit) const {
    State& s = *state_;
    for (const Direction& direction : s.directions) {
        if (!direction.counted) continue;
        const BodySurface& from = s.body(direction.from);
        for (std::size_t i = 0; i < direction.side.size(); ++i) {
            Judgement one{.from = direction.from, .into = direction.into};
            if (i < from.vertex_count()) {
                one.vertex = from.range().vertices.first + static_cast<Index>(i);
            } else {
                one.place = from.area_sample(i);
            }
            one.side = direction.side[i];
            one.depth = s.depth(direction, i);
            visit(one);
        }
    }
}

}  // namespace trocar
