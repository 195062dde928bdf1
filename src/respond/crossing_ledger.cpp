#include "respond/crossing_ledger.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/exact.hpp"
#include "respond/common.hpp"
#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Samples are tracked at a point a hair beside the vertex, always the same way, so that no path runs exactly through
/// an edge of a regular mesh.
const Vector3 hair{1.37e-11, -2.91e-11, 2.23e-11};

/// +1 when x lies inside the tetrahedron and its corners are positively oriented, -1 inside the other way, 0 outside.
int inside_tetrahedron(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d, const Vector3& x) {
    const int whole = orientation_sign(a, b, c, d);
    if (whole == 0) return 0;
    if (orientation_sign(x, b, c, d) != whole || orientation_sign(a, x, c, d) != whole ||
        orientation_sign(a, b, x, d) != whole || orientation_sign(a, b, c, x) != whole) {
        return 0;
    }
    return whole;
}

/// +1 when the segment goes from the front of the triangle to its back, -1 the other way, 0 without crossing.
int segment_crossing(const Vector3& from, const Vector3& to, const Vector3& a, const Vector3& b, const Vector3& c) {
    const int start = orientation_sign(a, b, c, from);  // -1: in front
    const int end = orientation_sign(a, b, c, to);
    if (start == end) return 0;
    const int s1 = orientation_sign(from, to, a, b);
    const int s2 = orientation_sign(from, to, b, c);
    const int s3 = orientation_sign(from, to, c, a);
    if (s1 != s2 || s2 != s3 || s1 == 0) return 0;
    return start < end ? 1 : -1;
}

/// Crossing of a point at rest by a triangle whose corners move from `p` to `q`, one after the other in the order of
/// their numbers. Front to back of the point counts +1: the triangle passes over it along its normal.
int sweep_crossing(const Vector3& x, const std::array<Index, 3>& number, const equations::Corners& p,
                   const equations::Corners& q) {
    std::array<std::size_t, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return number[i] < number[j]; });
    equations::Corners now = p;
    int sum = 0;
    for (const std::size_t i : order) {
        // The corner moves along now[i] → q[i]: the triangle sweeps this tetrahedron. It is positively oriented in
        // the sense of orientation_sign when the corner moves to the back of the triangle.
        const int sign = inside_tetrahedron(now[0], now[1], now[2], q[i], x);
        // Moving to the back (+1): the point was behind and is now in front, which is -1.
        sum -= sign;
        now[i] = q[i];
    }
    return sum;
}

/// Solid angle of a triangle seen from x over 4 pi (van Oosterom, Strackee 1983).
double winding_part(const equations::Corners& t, const Vector3& x) {
    const Vector3 a = t[0] - x;
    const Vector3 b = t[1] - x;
    const Vector3 c = t[2] - x;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    const double numerator = a.dot(b.cross(c));
    const double denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    return std::atan2(numerator, denominator) / (2.0 * std::numbers::pi);
}

}  // namespace

void CrossingLedger::prepare(const Topology& topology) {
    started_ = false;
    penetrations_.clear();
    tissues_.clear();
    samples_.clear();
    sample_of_vertex_.assign(at(topology.vertex_count), -1);
    const Index bodies = topology.body_count();
    tested_.assign(at(bodies * bodies), 0);
    for (const auto& [a, b] : topology.body_pairs) {
        tested_[at(a * bodies + b)] = 1;
        tested_[at(b * bodies + a)] = 1;
    }
    for (Index body = 0; body < bodies; ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        if (range.kind == BodyKind::tissue) {
            Tissue tissue;
            tissue.body = body;
            tissue.closed = range.closed;
            std::vector<Index> triangles(at(range.triangles.count));
            for (Index t = 0; t < range.triangles.count; ++t) triangles[at(t)] = range.triangles.first + t;
            tissue.grid.prepare(topology, triangles);
            tissues_.push_back(std::move(tissue));
        } else {
            for (Index v = range.vertices.first; v < range.vertices.end(); ++v) {
                sample_of_vertex_[at(v)] = static_cast<Index>(samples_.size());
                samples_.push_back({v, body});
            }
        }
    }
    for (Tissue& tissue : tissues_) {
        tissue.count.assign(samples_.size(), 0);
        tissue.entry.assign(samples_.size(), -1);
    }
}

int CrossingLedger::count(Index vertex, Index tissue) const {
    const Index sample = sample_of_vertex_[at(vertex)];
    for (const Tissue& one : tissues_) {
        if (one.body == tissue && sample >= 0) return one.count[at(sample)];
    }
    return 0;
}

Index CrossingLedger::nearest_triangle(const Topology& topology, const Frame& frame, Tissue& tissue,
                                       const Vector3& point) {
    Index best = -1;
    double best_distance = std::numeric_limits<double>::infinity();
    double reach = tissue.grid.cell();
    const Box& bounds = tissue.grid.bounds();
    const double furthest = (bounds.max - bounds.min).norm() + (point - bounds.min).norm();
    while (true) {
        Box box;
        box.add(point - Vector3::Constant(reach));
        box.add(point + Vector3::Constant(reach));
        tissue.grid.visit(box, [&](Index t) {
            const equations::Corners corners = corners_of(topology, frame.position, t);
            const Vector3 w = equations::nearest_weights(corners, point);
            const double distance = (w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2] - point).norm();
            if (distance < best_distance || (distance == best_distance && t < best)) {
                best_distance = distance;
                best = t;
            }
        });
        if (best_distance <= reach || reach > furthest) return best;
        reach *= 2.0;
    }
}

void CrossingLedger::find_start(const Topology& topology, const Frame& frame, const ContactSet& contacts) {
    const Index bodies = topology.body_count();
    std::vector<std::uint8_t> crossing(at(bodies * bodies), 0);
    for (const Contact& contact : contacts.contacts) {
        if (contact.a < 0 || contact.b < 0 || contact.kind == ContactCase::touch) continue;
        crossing[at(topology.body_of_triangle[at(contact.a)] * bodies + topology.body_of_triangle[at(contact.b)])] = 1;
    }
    for (Tissue& tissue : tissues_) {
        for (std::size_t s = 0; s < samples_.size(); ++s) {
            const Sample& sample = samples_[s];
            if (tested_[at(sample.body * bodies + tissue.body)] == 0) continue;
            const Vector3 x = frame.position.col(sample.vertex) + hair;
            Box box;
            box.add(x);
            const Range triangles = topology.bodies[at(tissue.body)].triangles;
            if (tissue.closed) {
                if (!box.overlaps(tissue.grid.bounds())) continue;
                double winding = 0.0;
                for (Index t = triangles.first; t < triangles.end(); ++t) {
                    winding += winding_part(corners_of(topology, frame.position, t), x);
                }
                tissue.count[s] = static_cast<std::int16_t>(std::lround(winding));
            } else if (crossing[at(sample.body * bodies + tissue.body)] != 0) {
                const Index nearest = nearest_triangle(topology, frame, tissue, x);
                if (nearest < 0) continue;
                const equations::Corners corners = corners_of(topology, frame.position, nearest);
                // Behind the sheet, and not merely beside its rim.
                const Vector3 w = equations::nearest_weights(corners, x);
                const Vector3 foot = w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2];
                const double below = equations::unit_normal(corners).dot(foot - x);
                if (below > 0.7 * (foot - x).norm()) tissue.count[s] = 1;
            }
        }
    }
}

void CrossingLedger::count_crossings(const Topology& topology, const Frame& frame, Tissue& tissue) {
    const Index bodies = topology.body_count();
    const Range range = topology.bodies[at(tissue.body)].vertices;
    tissue.largest_move = 0.0;
    for (Index v = range.first; v < range.end(); ++v) {
        tissue.largest_move = std::max(tissue.largest_move, (frame.position.col(v) - last_.col(v)).norm());
    }
    const Vector3 margin = Vector3::Constant(tissue.largest_move * 1.0000001 + 1e-9);
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        const Sample& sample = samples_[s];
        if (tested_[at(sample.body * bodies + tissue.body)] == 0) continue;
        const Vector3 from = last_.col(sample.vertex) + hair;
        const Vector3 to = frame.position.col(sample.vertex) + hair;
        Box path;
        path.add(from);
        path.add(to);
        Box box = path;
        box.min -= margin;
        box.max += margin;
        int change = 0;
        tissue.grid.visit(box, [&](Index t) {
            std::array<Index, 3> number{};
            for (int i = 0; i < 3; ++i) number[at(i)] = topology.triangles(i, t);
            const equations::Corners before = corners_of(topology, last_, t);
            const equations::Corners after = corners_of(topology, frame.position, t);
            Box here;
            for (const Vector3& corner : after) here.add(corner);
            if (here.overlaps(path)) change += segment_crossing(from, to, after[0], after[1], after[2]);
            if (before == after) return;
            for (const Vector3& corner : before) here.add(corner);
            Box point;
            point.add(from);
            if (here.overlaps(point)) change += sweep_crossing(from, number, before, after);
        });
        if (change != 0) tissue.count[s] = static_cast<std::int16_t>(tissue.count[s] + change);
    }
}

void follow_surface(const Topology& topology, const Surface& surface, const Frame& frame, const Vector3& point,
                    Index& triangle, Vector3& weights) {
    const auto distance_to = [&](Index t, Vector3& w) {
        const equations::Corners corners = corners_of(topology, frame.position, t);
        w = equations::nearest_weights(corners, point);
        return (w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2] - point).norm();
    };
    double distance = distance_to(triangle, weights);
    constexpr int most_steps = 4;
    for (int step = 0; step < most_steps; ++step) {
        const Index centre = triangle;
        for (int i = 0; i < 3; ++i) {
            for (const Index t : surface.triangles_at(topology.triangles(i, centre))) {
                Vector3 w;
                const double here = distance_to(t, w);
                if (here < distance) {
                    distance = here;
                    triangle = t;
                    weights = w;
                }
            }
        }
        if (triangle == centre) break;
    }
}

void CrossingLedger::update(const Topology& topology, const Surface& surface, const Frame& frame,
                            const ContactSet& contacts) {
    for (Tissue& tissue : tissues_) tissue.grid.fill(topology, frame.position);
    if (!started_) {
        find_start(topology, frame, contacts);
        started_ = true;
    } else {
        for (Tissue& tissue : tissues_) count_crossings(topology, frame, tissue);
    }
    last_ = frame.position;

    // Entries of the last tick that are still on the wrong side keep their anchor.
    kept_.swap(penetrations_);
    penetrations_.clear();
    for (Tissue& tissue : tissues_) {
        for (std::size_t s = 0; s < samples_.size(); ++s) {
            const int count = tissue.count[s];
            // Inside a closed body; on an open sheet either side may be the wrong one.
            const bool wrong = tissue.closed ? count > 0 : count != 0;
            Index& entry = tissue.entry[s];
            if (!wrong && entry < 0) continue;
            Penetration penetration;
            if (entry >= 0) {
                penetration = kept_[at(entry)];
                ++penetration.age;
            } else {
                penetration.vertex = samples_[s].vertex;
                penetration.body = samples_[s].body;
                penetration.tissue = tissue.body;
                penetration.side = count > 0 ? 1.0 : -1.0;
                penetration.triangle =
                    nearest_triangle(topology, frame, tissue, frame.position.col(samples_[s].vertex));
                if (penetration.triangle < 0) continue;
            }
            entry = -1;
            const Vector3 x = frame.position.col(penetration.vertex);
            follow_surface(topology, surface, frame, x, penetration.triangle, penetration.weights);
            penetration.normal = penetration.side * surface.blended_normal(topology, frame.position,
                                                                           penetration.triangle, penetration.weights);
            // From the nearest point to the one that the normal meets: pushing the surface there along the normal
            // closes the depth and nothing else.
            equations::Corners corners = corners_of(topology, frame.position, penetration.triangle);
            const Vector3 face = equations::unit_normal(corners);
            const double slope = face.dot(penetration.normal);
            constexpr double least_slope = 0.3;
            if (std::abs(slope) > least_slope) {
                const Vector3 target = x + face.dot(corners[0] - x) / slope * penetration.normal;
                follow_surface(topology, surface, frame, target, penetration.triangle, penetration.weights);
                corners = corners_of(topology, frame.position, penetration.triangle);
            }
            penetration.face = penetration.side * equations::unit_normal(corners);
            const Vector3 anchor = penetration.weights[0] * corners[0] + penetration.weights[1] * corners[1] +
                                   penetration.weights[2] * corners[2];
            penetration.last_depth = penetration.depth;
            penetration.depth = penetration.normal.dot(anchor - x);
            if (!wrong && (penetration.ruptured || (anchor - x).norm() > resting_margin)) continue;
            entry = static_cast<Index>(penetrations_.size());
            penetrations_.push_back(penetration);
        }
    }
}

}  // namespace trocar
