#include "measure/depth_truth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "geometry/exact.hpp"
#include "measure/edge_depth.hpp"
#include "measure/ray_grid.hpp"
#include "measure/surface_distance.hpp"
#include "measure/vertical_crossings.hpp"

namespace trocar {
namespace {

/// A directed edge of a surface's boundary chain: edges that the triangles on both sides cancel do not appear.
struct RimEdge {
    Index from = -1;
    Index to = -1;
    int count = 0;  ///< net number of times that triangles run along it
};

std::vector<RimEdge> rim_of(const Triangles& triangles, Range range) {
    std::map<std::pair<Index, Index>, int> net;
    for (Index t = range.first; t < range.end(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            const Index u = triangles(corner, t);
            const Index v = triangles((corner + 1) % 3, t);
            if (u < v) ++net[{u, v}];
            if (v < u) --net[{v, u}];
        }
    }
    std::vector<RimEdge> rim;
    for (const auto& [edge, count] : net) {
        if (count != 0) rim.push_back({edge.first, edge.second, count});
    }
    return rim;
}

/// A point that rides on a triangle.
struct AreaSample {
    Index triangle = -1;
    Vector3 weights = Vector3::Zero();  ///< barycentric
};

/// Evenly by area over the triangles of the range, the same on every machine: strata along the summed area, and within
/// the triangles the additive recurrence of Roberts (2018), folded into the triangle.
std::vector<AreaSample> spread(const Triangles& triangles, Range range, const Matrix3X& position, Index count,
                               double& total_area) {
    std::vector<double> area_up_to;
    total_area = 0.0;
    for (Index t = range.first; t < range.end(); ++t) {
        const Vector3 a = position.col(triangles(0, t));
        const Vector3 b = position.col(triangles(1, t));
        const Vector3 c = position.col(triangles(2, t));
        total_area += 0.5 * (b - a).cross(c - a).norm();
        area_up_to.push_back(total_area);
    }
    std::vector<AreaSample> samples;
    if (!(total_area > 0.0)) return samples;
    constexpr double step_u = 0.7548776662466927;
    constexpr double step_v = 0.5698402909980532;
    for (Index i = 0; i < count; ++i) {
        const double wanted = total_area * (i + 0.5) / count;
        const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end() - 1, wanted);
        double u = std::fmod(0.5 + step_u * (i + 1), 1.0);
        double v = std::fmod(0.5 + step_v * (i + 1), 1.0);
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        samples.push_back({range.first + static_cast<Index>(found - area_up_to.begin()), Vector3(1.0 - u - v, u, v)});
    }
    return samples;
}

struct BodySamples {
    std::vector<AreaSample> area;
    std::vector<std::array<Index, 2>> edges;  ///< both ways, sorted
    double area_weight = 0.0;                 ///< m², surface that one area sample stands for
    Box box;                                  ///< of the vertices, on the current frame
    Box swept;                                ///< the same together with the frame before
    RayGrid grid;
    bool grid_is_current = false;
    SurfaceDistance distance;
    bool distance_is_current = false;
    std::vector<RimEdge> rim;  ///< empty for a watertight surface
    std::vector<RimEdge> moved_rim;
};

/// Samples of one body judged against another body.
struct Direction {
    Index from = -1;
    Index into = -1;
    bool counted = true;
    std::vector<int> crossings;  ///< per sample (vertices, then area samples), of the upward ray on the current frame
    std::vector<int> side;       ///< per sample, open sheets: 0 = the side of the first frame
    std::vector<std::uint8_t> wrong;
    std::vector<std::uint8_t> seen;  ///< buffers of join_round_rim
    std::vector<std::size_t> group;
};

}  // namespace

struct DepthTruth::State {
    const Topology* topology = nullptr;
    Matrix3X position;  ///< of the current frame
    Matrix3X previous;  ///< of the frame measured before
    Matrix3X original;  ///< of the first frame
    std::vector<BodySamples> bodies;
    std::vector<Direction> directions;

    [[nodiscard]] const BodyRange& range(Index body) const { return topology->bodies[static_cast<std::size_t>(body)]; }
    [[nodiscard]] BodySamples& samples(Index body) { return bodies[static_cast<std::size_t>(body)]; }

    [[nodiscard]] std::size_t sample_count(Index body) {
        return static_cast<std::size_t>(range(body).vertices.count) + samples(body).area.size();
    }

    [[nodiscard]] Vector3 point(Index body, std::size_t sample, const Matrix3X& at) {
        const Range vertices = range(body).vertices;
        if (sample < static_cast<std::size_t>(vertices.count)) {
            return at.col(vertices.first + static_cast<Index>(sample));
        }
        const AreaSample& area = samples(body).area[sample - static_cast<std::size_t>(vertices.count)];
        const auto corners = topology->triangles.col(area.triangle);
        return area.weights[0] * at.col(corners[0]) + area.weights[1] * at.col(corners[1]) +
               area.weights[2] * at.col(corners[2]);
    }

    /// Takes over the positions and brings boxes and moved rim edges up to date.
    void advance_to(const Matrix3X& now) {
        previous.swap(position);
        position = now;
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            BodySamples& body = bodies[b];
            body.swept = body.box;
            body.box = Box{};
            const Range vertices = topology->bodies[b].vertices;
            for (Index v = vertices.first; v < vertices.end(); ++v) body.box.add(position.col(v));
            if (vertices.count > 0) {
                body.swept.add(body.box.min);
                body.swept.add(body.box.max);
            }
            body.grid_is_current = false;
            body.distance_is_current = false;
            body.moved_rim.clear();
            for (const RimEdge& edge : body.rim) {
                if (position.col(edge.from) != previous.col(edge.from) ||
                    position.col(edge.to) != previous.col(edge.to)) {
                    body.moved_rim.push_back(edge);
                }
            }
        }
    }

    [[nodiscard]] const RayGrid& grid(Index into) {
        BodySamples& body = samples(into);
        if (!body.grid_is_current) {
            body.grid.build(topology->triangles, range(into).triangles, position, body.box);
            body.grid_is_current = true;
        }
        return body.grid;
    }

    [[nodiscard]] int crossings(Index into, const Vector3& p) {
        return grid(into).crossings(topology->triangles, position, p);
    }

    [[nodiscard]] double distance(Index into, const Vector3& p) {
        BodySamples& body = samples(into);
        if (!body.distance_is_current) {
            body.distance.refit(topology->triangles, position);
            body.distance_is_current = true;
        }
        return body.distance.distance(topology->triangles, position, p);
    }

    [[nodiscard]] EdgeDepth depth_of_edges(const Direction& direction) {
        const BodySamples& from = samples(direction.from);
        if (!range(direction.into).closed || !from.box.overlaps(samples(direction.into).box)) return {};
        return edge_depth(topology->triangles, position, from.edges, grid(direction.into),
                          [&](const Vector3& p) { return distance(direction.into, p); });
    }

    /// What the rim contributed to the ray's crossings while the point went p → q past the old rim, and the rim then
    /// moved over the point at q (the sheet's sweep is closed by walls along its rim).
    [[nodiscard]] int rim_contribution(const BodySamples& sheet, const Vector3& p, const Vector3& q) const {
        int sum = 0;
        const double low_x = std::min(p.x(), q.x());
        const double high_x = std::max(p.x(), q.x());
        const double low_y = std::min(p.y(), q.y());
        const double high_y = std::max(p.y(), q.y());
        for (const RimEdge& edge : sheet.rim) {
            const Vector3 u = previous.col(edge.from);
            const Vector3 v = previous.col(edge.to);
            if (std::max(u.x(), v.x()) < low_x || std::min(u.x(), v.x()) > high_x || std::max(u.y(), v.y()) < low_y ||
                std::min(u.y(), v.y()) > high_y) {
                continue;
            }
            sum += edge.count * edge_passage(u, v, p, q);
        }
        for (const RimEdge& edge : sheet.moved_rim) {
            const Vector3 u0 = previous.col(edge.from);
            const Vector3 v0 = previous.col(edge.to);
            const Vector3 u1 = position.col(edge.from);
            const Vector3 v1 = position.col(edge.to);
            sum -= edge.count * (upward_crossing(u0, v0, v1, q) + upward_crossing(u0, v1, u1, q));
        }
        return sum;
    }

    [[nodiscard]] Vector3 farthest_sample(const Direction& direction) {
        Vector3 farthest = Vector3::Zero();
        double most = -1.0;
        for (std::size_t i = 0; i < direction.wrong.size(); ++i) {
            const Vector3 p = point(direction.from, i, position);
            const double away = distance(direction.into, p);
            if (away > most) {
                most = away;
                farthest = p;
            }
        }
        return farthest;
    }

    /// A vertex that the scene declares to be on the right side of the open sheet: the end of an edge through the
    /// sheet. -1 when no edge passes through.
    [[nodiscard]] Index declared_right(const Direction& direction) const {
        const bool in_front = range(direction.into).start_side == SheetSide::front;
        const Box& sheet = bodies[static_cast<std::size_t>(direction.into)].box;
        const Range own = range(direction.from).triangles;
        const Range other = range(direction.into).triangles;
        for (Index t = own.first; t < own.end(); ++t) {
            for (int i = 0; i < 3; ++i) {
                const Index from = topology->triangles(i, t);
                const Index to = topology->triangles((i + 1) % 3, t);
                const Vector3 p = position.col(from);
                const Vector3 q = position.col(to);
                Box edge;
                edge.add(p);
                edge.add(q);
                if (!edge.overlaps(sheet)) continue;
                for (Index face = other.first; face < other.end(); ++face) {
                    const Vector3 a = position.col(topology->triangles(0, face));
                    const Vector3 b = position.col(topology->triangles(1, face));
                    const Vector3 c = position.col(topology->triangles(2, face));
                    if (!edge.overlaps(Box{a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)})) continue;
                    const int start = orientation_sign(a, b, c, p);  // -1: in front
                    if (start == 0 || orientation_sign(a, b, c, q) != -start) continue;
                    const int side = orientation_sign(p, q, a, b);
                    if (side == 0 || orientation_sign(p, q, b, c) != side || orientation_sign(p, q, c, a) != side) {
                        continue;
                    }
                    return (start < 0) == in_front ? from : to;
                }
            }
        }
        return -1;
    }

    /// True where the straight way between two samples meets the other body, be it at an edge.
    [[nodiscard]] bool meets(const Direction& direction, std::size_t one, std::size_t another) {
        const Index into = direction.into;
        const Vector3 p = point(direction.from, one, position);
        const Vector3 q = point(direction.from, another, position);
        Box segment;
        segment.add(p);
        segment.add(q);
        if (!segment.overlaps(bodies[static_cast<std::size_t>(into)].box)) return false;
        const Range other = range(into).triangles;
        for (Index face = other.first; face < other.end(); ++face) {
            const Vector3 a = position.col(topology->triangles(0, face));
            const Vector3 b = position.col(topology->triangles(1, face));
            const Vector3 c = position.col(topology->triangles(2, face));
            if (!segment.overlaps(Box{a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)})) continue;
            const int start = orientation_sign(a, b, c, p);
            if (start == orientation_sign(a, b, c, q)) continue;
            const int side = orientation_sign(p, q, a, b);
            if (orientation_sign(p, q, b, c) * side >= 0 && orientation_sign(p, q, c, a) * side >= 0) return true;
        }
        return false;
    }

    /// Calls act(neighbour) for the samples that an edge joins to a vertex.
    template <typename Act>
    void each_neighbour(const Direction& direction, std::size_t vertex, const Act& act) const {
        const Index first = range(direction.from).vertices.first;
        const auto& edges = bodies[static_cast<std::size_t>(direction.from)].edges;
        const Index v = first + static_cast<Index>(vertex);
        for (auto edge = std::lower_bound(edges.begin(), edges.end(), std::array<Index, 2>{v, -1});
             edge != edges.end() && (*edge)[0] == v; ++edge) {
            act(static_cast<std::size_t>((*edge)[1] - first));
        }
    }

    /// True where a rim edge of the sheet that has moved since the start, so that nothing holds it, is near the body.
    [[nodiscard]] bool free_rim_near(const BodySamples& body, const BodySamples& sheet) const {
        const auto moved = [&](Index v) { return position.col(v) != original.col(v); };
        return std::any_of(sheet.rim.begin(), sheet.rim.end(), [&](const RimEdge& edge) {
            if (!moved(edge.from) && !moved(edge.to)) return false;
            Box box;
            box.add(position.col(edge.from));
            box.add(position.col(edge.to));
            return box.overlaps(body.box);
        });
    }

    /// While a free rim is inside a body there is a way round it, and once it has slipped past points of the body
    /// nothing is left between them and the rest, though by their history they are beyond the sheet. What the body's
    /// surface joins to vertices on the right side, and is no more than those, is therefore on the right side; for good
    /// where no edge from there meets the sheet.
    void join_round_rim(Direction& direction) {
        const auto vertex_count = static_cast<std::size_t>(range(direction.from).vertices.count);
        const auto wrong = [&](std::size_t sample) { return direction.wrong[sample] != 0; };
        const auto right_vertices = static_cast<std::size_t>(std::count(
            direction.wrong.begin(), direction.wrong.begin() + static_cast<std::ptrdiff_t>(vertex_count), 0));
        direction.seen.assign(vertex_count, 0);
        for (std::size_t first = 0; first < vertex_count; ++first) {
            if (!wrong(first) || direction.seen[first] != 0) continue;
            std::vector<std::size_t>& group = direction.group;
            group.assign(1, first);
            direction.seen[first] = 1;
            bool joined = false;
            bool met = false;
            for (std::size_t next = 0; next < group.size(); ++next) {
                each_neighbour(direction, group[next], [&](std::size_t other) {
                    if (meets(direction, group[next], other)) {
                        met = true;
                    } else if (!wrong(other)) {
                        joined = true;
                    } else if (direction.seen[other] == 0) {
                        direction.seen[other] = 1;
                        group.push_back(other);
                    }
                });
            }
            if (!joined || group.size() > right_vertices) continue;
            for (const std::size_t sample : group) {
                direction.wrong[sample] = 0;
                if (!met) direction.side[sample] = 0;
            }
        }
        join_area(direction, vertex_count);
    }

    /// The same for the points between vertices.
    void join_area(Direction& direction, std::size_t vertex_count) {
        const Index first = range(direction.from).vertices.first;
        for (std::size_t sample = vertex_count; sample < direction.wrong.size(); ++sample) {
            if (direction.wrong[sample] == 0) continue;
            bool joined = false;
            bool free = true;
            for (int i = 0; i < 3; ++i) {
                const Index triangle = samples(direction.from).area[sample - vertex_count].triangle;
                const auto corner = static_cast<std::size_t>(topology->triangles(i, triangle) - first);
                const bool met = meets(direction, sample, corner);
                joined = joined || (!met && direction.wrong[corner] == 0);
                free = free && !met && direction.side[corner] == 0;
            }
            if (joined) direction.wrong[sample] = 0;
            if (free) direction.side[sample] = 0;
        }
    }

    void judge(Direction& direction, bool first) {
        const BodySamples& from = samples(direction.from);
        const BodySamples& into = samples(direction.into);
        const bool closed = range(direction.into).closed;
        // Rays that start above everything, or beside everything, meet nothing, neither now nor on the way.
        const Box& ways = first ? from.box : from.swept;
        const Box& surface = first ? into.box : into.swept;
        const bool apart = ways.max.x() < surface.min.x() || ways.min.x() > surface.max.x() ||
                           ways.max.y() < surface.min.y() || ways.min.y() > surface.max.y() ||
                           ways.min.z() > surface.max.z() || (closed && ways.max.z() < surface.min.z());
        Vector3 reference = Vector3::Zero();
        int reference_crossings = 0;
        if (first && !closed && !apart) {
            reference = farthest_sample(direction);
            reference_crossings = crossings(direction.into, reference);
        }
        for (std::size_t i = 0; i < direction.wrong.size(); ++i) {
            const int before = direction.crossings[i];
            const Vector3 q = point(direction.from, i, position);
            const int now = apart ? 0 : crossings(direction.into, q);
            direction.crossings[i] = now;
            if (closed) {
                direction.wrong[i] = now != 0;
                continue;
            }
            // At the start the way leads from the sample that is known to be on the right side.
            const int start = first ? reference_crossings : before;
            int change = now - start;
            if (!apart && !into.rim.empty()) {
                change -= rim_contribution(into, first ? reference : point(direction.from, i, previous), q);
            }
            direction.side[i] += change;
            direction.wrong[i] = direction.side[i] != 0;
        }
        const auto is_wrong = [](std::uint8_t wrong) { return wrong != 0; };
        if (!first && !closed && range(direction.from).kind != BodyKind::tissue &&
            std::any_of(direction.wrong.begin(), direction.wrong.end(), is_wrong) && free_rim_near(from, into)) {
            join_round_rim(direction);
        }
        if (!first || closed || std::none_of(direction.wrong.begin(), direction.wrong.end(), is_wrong)) return;
        const Index right = declared_right(direction);
        if (right < 0) return;
        const int level = direction.side[static_cast<std::size_t>(right - range(direction.from).vertices.first)];
        for (std::size_t i = 0; i < direction.wrong.size(); ++i) {
            direction.side[i] -= level;
            direction.wrong[i] = direction.side[i] != 0;
        }
    }
};

DepthTruth::DepthTruth(const Topology& topology, const Frame& first, std::span<const std::uint8_t> counted,
                       Index area_samples)
    : state_(std::make_unique<State>()) {
    State& s = *state_;
    s.topology = &topology;
    s.position = first.position;
    s.original = first.position;
    s.bodies.resize(topology.bodies.size());
    for (Index body = 0; body < topology.body_count(); ++body) {
        const BodyRange& range = s.range(body);
        BodySamples& samples = s.samples(body);
        double area = 0.0;
        samples.area = spread(topology.triangles, range.triangles, first.position, area_samples, area);
        if (!samples.area.empty()) samples.area_weight = area / static_cast<double>(samples.area.size());
        for (Index t = range.triangles.first; t < range.triangles.end(); ++t) {
            for (int corner = 0; corner < 3; ++corner) {
                const Index u = topology.triangles(corner, t);
                const Index v = topology.triangles((corner + 1) % 3, t);
                samples.edges.push_back({u, v});
                samples.edges.push_back({v, u});
            }
        }
        std::sort(samples.edges.begin(), samples.edges.end());
        samples.edges.erase(std::unique(samples.edges.begin(), samples.edges.end()), samples.edges.end());
        if (!range.closed) samples.rim = rim_of(topology.triangles, range.triangles);
        samples.distance.prepare(topology.triangles, range.triangles, first.position);
    }
    for (std::size_t pair = 0; pair < topology.body_pairs.size(); ++pair) {
        const auto [a, b] = topology.body_pairs[pair];
        for (const auto& [from, into] : {std::array{a, b}, std::array{b, a}}) {
            Direction direction;
            direction.from = from;
            direction.into = into;
            direction.counted = counted.empty() || counted[pair] != 0;
            direction.crossings.resize(s.sample_count(from), 0);
            direction.side.resize(s.sample_count(from), 0);
            direction.wrong.resize(s.sample_count(from), 0);
            s.directions.push_back(std::move(direction));
        }
    }
    s.advance_to(first.position);
    for (Direction& direction : s.directions) s.judge(direction, true);
}

DepthTruth::~DepthTruth() = default;

DepthTruth::Result DepthTruth::measure(const Frame& frame) {
    if (!frame.all_finite()) return {std::nan(""), std::nan(""), -1, -1};
    State& s = *state_;
    s.advance_to(frame.position);
    Result result;
    double weighted_depth = 0.0;
    double weight = 0.0;
    for (Direction& direction : s.directions) {
        s.judge(direction, false);
        if (!direction.counted) continue;
        const EdgeDepth edges = s.depth_of_edges(direction);
        result.wrong_side += edges.stretches;
        result.max_depth = std::max(result.max_depth, edges.depth);
        const auto vertex_count = static_cast<std::size_t>(s.range(direction.from).vertices.count);
        for (std::size_t i = 0; i < direction.wrong.size(); ++i) {
            if (direction.wrong[i] == 0) continue;
            const double depth = s.distance(direction.into, s.point(direction.from, i, s.position));
            ++result.wrong_side;
            if (i < vertex_count) ++result.wrong_side_vertices;
            result.max_depth = std::max(result.max_depth, depth);
            if (i < vertex_count) continue;
            weighted_depth += s.samples(direction.from).area_weight * depth;
            weight += s.samples(direction.from).area_weight;
        }
    }
    if (weight > 0.0) result.mean_depth = weighted_depth / weight;
    return result;
}

double DepthTruth::clearance() const {
    State& s = *state_;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Direction& direction : s.directions) {
        if (!direction.counted) continue;
        const Box& surface = s.samples(direction.into).box;
        for (std::size_t i = 0; i < direction.wrong.size(); ++i) {
            const Vector3 p = s.point(direction.from, i, s.position);
            const Vector3 beside = (surface.min - p).cwiseMax(p - surface.max).cwiseMax(0.0);
            if (beside.norm() < nearest) nearest = std::min(nearest, s.distance(direction.into, p));
        }
    }
    return nearest;
}

double DepthTruth::depth_of_vertex(Index vertex, Index into) const {
    State& s = *state_;
    const Index from = s.topology->body_of_vertex(vertex);
    for (const Direction& direction : s.directions) {
        if (direction.from != from || direction.into != into) continue;
        const auto sample = static_cast<std::size_t>(vertex - s.range(from).vertices.first);
        return direction.wrong[sample] == 0 ? 0.0 : s.distance(into, s.position.col(vertex));
    }
    return std::nan("");
}

}  // namespace trocar
