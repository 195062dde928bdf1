// Independent slow implementation of DepthTruth for the same sample points; shares no code with src/measure. It uses
// winding numbers from solid angles, brute force, and floating-point predicates. Sides of open sheets are computed from
// the first and the present frame alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "scene/world.hpp"

namespace trocar::test {

using Real = double;
using Point = Eigen::Matrix<Real, 3, 1>;
using Corners3 = std::array<Point, 3>;

/// Half the solid angle of a triangle seen from the origin, positive where its front faces away (van Oosterom and
/// Strackee 1983).
inline Real half_solid_angle(const Point& a, const Point& b, const Point& c) {
    const Real la = a.norm();
    const Real lb = b.norm();
    const Real lc = c.norm();
    return std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

/// Distance to a closed triangle by Voronoi regions (Ericson 2005, 5.1.5), m.
inline Real distance_to(const Corners3& t, const Point& p) {
    const Point ab = t[1] - t[0];
    const Point ac = t[2] - t[0];
    const Point ap = p - t[0];
    const Real d1 = ab.dot(ap);
    const Real d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return ap.norm();
    const Point bp = p - t[1];
    const Real d3 = ab.dot(bp);
    const Real d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return bp.norm();
    const Real vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - d1 / (d1 - d3) * ab).norm();
    const Point cp = p - t[2];
    const Real d5 = ab.dot(cp);
    const Real d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return cp.norm();
    const Real vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - d2 / (d2 - d6) * ac).norm();
    const Real va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1])).norm();
    }
    const Real whole = va + vb + vc;
    return (ap - vb / whole * ab - vc / whole * ac).norm();
}

/// Crossing of segment pq with the triangle: segment parameter in [0, 1], and +1 from front to back, else -1. `beside`:
/// tolerance outside the triangle as a barycentric coordinate.
inline std::optional<std::pair<Real, int>> passage(const Corners3& t, const Point& p, const Point& q, Real beside = 0) {
    const Point normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const Real before = normal.dot(p - t[0]);
    const Real after = normal.dot(q - t[0]);
    if ((before > 0) == (after > 0)) return std::nullopt;
    const Real path = before / (before - after);
    const Point x = p + path * (q - p);
    for (std::size_t i = 0; i < 3; ++i) {
        if (normal.dot((t[(i + 1) % 3] - t[i]).cross(x - t[i])) < -beside * normal.squaredNorm()) return std::nullopt;
    }
    return std::pair{path, before > 0 ? 1 : -1};
}

class SecondTruth {
public:
    /// Distance from a surface, m, beyond which both implementations must agree.
    static constexpr double undecidable = 1e-8;

    SecondTruth(const Topology& topology, const Frame& first) : topology_(&topology), start_(first.position) {
        for (const BodyRange& body : topology.bodies) {
            std::map<std::pair<Index, Index>, int> edges;
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                for (int i = 0; i < 3; ++i) {
                    const auto edge = std::minmax({topology.triangles(i, t), topology.triangles((i + 1) % 3, t)});
                    ++edges[{edge.first, edge.second}];
                }
            }
            std::set<Index> rim;
            for (const auto& [edge, count] : edges) {
                if (count != 1) continue;
                rim.insert(edge.first);
                rim.insert(edge.second);
            }
            edges_.push_back(std::move(edges));
            rim_.emplace_back(rim.begin(), rim.end());
        }
    }

    void examine(const Frame& frame) {
        now_ = frame.position;
        boxes_.assign(topology_->bodies.size(), {});
        for (std::size_t b = 0; b < topology_->bodies.size(); ++b) {
            const Range vertices = topology_->bodies[b].vertices;
            for (Index v = vertices.first; v < vertices.end(); ++v) boxes_[b].add(now_.col(v));
        }
    }

    /// True when the rim is at its position of the first frame.
    [[nodiscard]] bool rim_is_held(Index sheet) const {
        const auto& rim = rim_[at(sheet)];
        return std::all_of(rim.begin(), rim.end(), [this](Index v) { return now_.col(v) == start_.col(v); });
    }

    /// True when the rim of the sheet intersects a face of the body. The side of the body's points then depends on the
    /// path over its surface.
    [[nodiscard]] bool rim_pierces(Index sheet, Index from) const {
        const Range faces = body(from).triangles;
        for (const auto& [edge, count] : edges_[at(sheet)]) {
            if (count != 1) continue;
            const Vector3 p = now_.col(edge.first);
            const Vector3 q = now_.col(edge.second);
            if (!boxes_[at(from)].overlaps(Box{p.cwiseMin(q), p.cwiseMax(q)})) continue;
            for (Index t = faces.first; t < faces.end(); ++t) {
                if (passage(corners(t, now_), p.cast<Real>(), q.cast<Real>(), 1e-9)) return true;
            }
        }
        return false;
    }

    /// True when the winding number of a closed body about p is not 0.
    [[nodiscard]] bool is_inside(Index body, const Vector3& p) const {
        if (!boxes_[at(body)].overlaps(Box{p, p})) return false;
        Real sum = 0;
        const Range range = this->body(body).triangles;
        for (Index t = range.first; t < range.end(); ++t) {
            const Corners3 c = corners(t, now_);
            const Point x = p.cast<Real>();
            sum += half_solid_angle(c[0] - x, c[1] - x, c[2] - x);
        }
        return std::abs(sum) > std::numbers::pi_v<Real>;  // half solid angles: 2π per turn
    }

    [[nodiscard]] double distance(Index body, const Vector3& p) const { return distance(body, p, now_); }

    /// Signed number of sheet crossings of a point of `from`, from `before` in the first frame to `p` now. The rim is
    /// fixed, so the present sheet and the reversed first one form a closed shell. Crossings are the shell's winding
    /// number about p plus those of segment `before`–`p` with the first sheet. A path around the rim is not covered.
    [[nodiscard]] int crossed(Index from, Index sheet, const Vector3& before, const Vector3& p) {
        return at_start(from, sheet, before) + through_start(sheet, moved(before), moved(p)) + shell(sheet, p);
    }

    /// Segments of the edges of `from` inside the closed body `into`, and their maximum depth, m.
    struct Edges {
        int stretches = 0;
        int shallow = 0;  ///< of `stretches`, those less than `undecidable` deep
        double depth = 0.0;
    };
    [[nodiscard]] Edges edges_inside(Index from, Index into) const {
        Edges result;
        const Range other = body(into).triangles;
        for (const auto& [edge, count] : edges_[at(from)]) {
            const Vector3 p = now_.col(edge.first);
            const Vector3 q = now_.col(edge.second);
            if (!boxes_[at(into)].overlaps(Box{p.cwiseMin(q), p.cwiseMax(q)})) continue;
            std::vector<Real> cuts{0, 1};
            for (Index t = other.first; t < other.end(); ++t) {
                // A surplus cut is harmless; a missing one would merge inside and outside.
                const auto path = passage(corners(t, now_), p.cast<Real>(), q.cast<Real>(), 1e-9);
                if (path) cuts.push_back(path->first);
            }
            std::sort(cuts.begin(), cuts.end());
            bool was_inside = false;
            bool is_shallow = false;
            const auto on = [&](Real path) { return Vector3(p + path * (q - p)); };
            for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
                if (!(cuts[i] < cuts[i + 1])) continue;
                const Real middle = 0.5 * (cuts[i] + cuts[i + 1]);
                const bool inside = is_inside(into, on(middle));
                if (inside && !was_inside) {
                    ++result.stretches;
                    is_shallow = true;
                    ++result.shallow;
                }
                if (inside && is_shallow && distance(into, on(middle)) > undecidable) {
                    is_shallow = false;
                    --result.shallow;
                }
                if (inside) {
                    result.depth = deepest(into, on, cuts[i], cuts[i + 1], (q - p).norm(), result.depth);
                }
                was_inside = inside;
            }
        }
        return result;
    }

private:
    /// Branch and bound: distance is 1-Lipschitz along the edge.
    template <typename On>
    [[nodiscard]] double deepest(Index into, const On& on, Real first, Real last, Real length, double most) const {
        std::vector<std::pair<Real, Real>> waiting{{first, last}};
        while (!waiting.empty()) {
            const auto [from, to] = waiting.back();
            waiting.pop_back();
            const Real middle = 0.5 * (from + to);
            const double here = distance(into, on(middle));
            most = std::max(most, here);
            if (here + 0.5 * (to - from) * length <= most + std::max(0.1 * undecidable, 0.002 * most)) continue;
            waiting.emplace_back(from, middle);
            waiting.emplace_back(middle, to);
        }
        return most;
    }

    [[nodiscard]] const BodyRange& body(Index number) const { return topology_->bodies[at(number)]; }

    [[nodiscard]] Corners3 corners(Index triangle, const Matrix3X& where) const {
        const auto c = topology_->triangles.col(triangle);
        return {where.col(c[0]).cast<Real>(), where.col(c[1]).cast<Real>(), where.col(c[2]).cast<Real>()};
    }

    /// Small offset against exact crossings of mesh edges.
    static Point moved(const Vector3& p) { return p.cast<Real>() + Point(1.31e-10, 2.73e-10, 0.67e-10); }

    [[nodiscard]] double distance(Index body_number, const Vector3& p, const Matrix3X& where) const {
        Real least = std::numeric_limits<Real>::infinity();
        const Range range = body(body_number).triangles;
        for (Index t = range.first; t < range.end(); ++t) {
            least = std::min(least, distance_to(corners(t, where), p.cast<Real>()));
        }
        return static_cast<double>(least);
    }

    [[nodiscard]] int through_start(Index sheet, const Point& p, const Point& q) const {
        const Range range = body(sheet).triangles;
        int sum = 0;
        const Vector3 low = p.cwiseMin(q).cast<double>() - Vector3::Constant(1e-9);
        const Vector3 high = p.cwiseMax(q).cast<double>() + Vector3::Constant(1e-9);
        for (Index t = range.first; t < range.end(); ++t) {
            const Vector3 a = start_.col(topology_->triangles(0, t));
            const Vector3 b = start_.col(topology_->triangles(1, t));
            const Vector3 c = start_.col(topology_->triangles(2, t));
            if (!Box{low, high}.overlaps(Box{a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)})) continue;
            if (const auto path = passage(corners(t, start_), p, q)) sum += path->second;
        }
        return sum;
    }

    /// Winding number about p of the present sheet joined with the reversed first one.
    [[nodiscard]] int shell(Index sheet, const Vector3& p) const {
        const Range range = body(sheet).triangles;
        Box box;
        for (Index v = body(sheet).vertices.first; v < body(sheet).vertices.end(); ++v) {
            box.add(now_.col(v));
            box.add(start_.col(v));
        }
        if (!box.overlaps(Box{p, p})) return 0;
        Real sum = 0;
        for (Index t = range.first; t < range.end(); ++t) {
            const auto c = topology_->triangles.col(t);
            if (now_.col(c[0]) == start_.col(c[0]) && now_.col(c[1]) == start_.col(c[1]) &&
                now_.col(c[2]) == start_.col(c[2])) {
                continue;
            }
            const Point x = moved(p);
            const Corners3 after = corners(t, now_);
            const Corners3 before = corners(t, start_);
            sum += half_solid_angle(after[0] - x, after[1] - x, after[2] - x) -
                   half_solid_angle(before[0] - x, before[1] - x, before[2] - x);
        }
        return static_cast<int>(std::lround(static_cast<double>(sum / (2 * std::numbers::pi_v<Real>))));
    }

    /// Side of p in the first frame, relative to the vertex farthest from the sheet. Where edges cross the sheet,
    /// relative to the side that the scene declares.
    [[nodiscard]] int at_start(Index from, Index sheet, const Vector3& p) {
        const auto [known, is_new] = reference_.try_emplace({from, sheet});
        Reference& reference = known->second;
        if (is_new) {
            double most = -1.0;
            for (Index v = body(from).vertices.first; v < body(from).vertices.end(); ++v) {
                const double away = distance(sheet, start_.col(v), start_);
                if (away <= most) continue;
                most = away;
                reference.point = start_.col(v);
            }
            const Range faces = body(sheet).triangles;
            std::set<int> levels;
            for (const auto& [edge, count] : edges_[at(from)]) {
                for (Index t = faces.first; t < faces.end(); ++t) {
                    const Point u = start_.col(edge.first).cast<Real>();
                    const Point v = start_.col(edge.second).cast<Real>();
                    const auto path = passage(corners(t, start_), u, v);
                    if (!path) continue;
                    const bool in_front = body(sheet).start_side == SheetSide::front;
                    const Index right = (path->second > 0) == in_front ? edge.first : edge.second;
                    levels.insert(through_start(sheet, moved(reference.point), moved(start_.col(right))));
                }
            }
            reference.level = levels.empty() ? 0 : *levels.begin();
        }
        return through_start(sheet, moved(reference.point), moved(p)) - reference.level;
    }

    struct Reference {
        Vector3 point = Vector3::Zero();
        int level = 0;
    };

    const Topology* topology_;
    Matrix3X start_;
    Matrix3X now_;
    std::vector<Box> boxes_;
    std::vector<std::map<std::pair<Index, Index>, int>> edges_;
    std::vector<std::vector<Index>> rim_;
    std::map<std::pair<Index, Index>, Reference> reference_;
};

}  // namespace trocar::test
