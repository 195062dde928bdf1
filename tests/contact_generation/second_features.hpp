// A second implementation of what the generators `proximity` and `tracked_proximity` report, slow and by other means,
// in long double: every vertex against every face and every edge against every edge; a closest point by solving for the
// foot of the perpendicular and else by the best of the three sides; whether it is one of the surface by the steepest
// direction over all faces that meet there; sides by the solid angle under which the vertex sees the surface, followed
// without a jump.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "scene/world.hpp"

namespace trocar::test {

using Real = long double;
using Point = Eigen::Matrix<Real, 3, 1>;
using EdgeEnds = std::array<Index, 2>;  ///< smaller vertex number first

/// Sine by which a feature's cone of directions is widened (CONTACT §2), and of the angle below which edges count as
/// parallel.
inline constexpr Real widening = 0.02L;
inline constexpr Real parallel_sine = 1e-3L;
/// Relative to what a threshold is about: nearer to it nothing is compared.
inline constexpr Real undecided = 1e-9L;

struct SecondPointFace {
    Index vertex = -1;
    Index triangle = -1;
    Index vertex_body = -1;
    Index face_body = -1;
    Point path = Point::Zero();  ///< m, from the surface to the vertex
    Real distance = 0.0L;        ///< m
    bool closest = false;        ///< on the whole surface around it, and this is the lowest triangle there
    bool at_rim = false;
    bool open = false;  ///< too near a threshold to be compared
    Real front = 0.0L;  ///< m, height over the face that faces the vertex most
    Point front_normal = Point::Zero();
};

struct SecondEdgeEdge {
    EdgeEnds a;
    EdgeEnds b;
    Index body_a = -1;
    Index body_b = -1;
    Point point_a = Point::Zero();
    Point point_b = Point::Zero();
    Point normal = Point::Zero();  ///< unit, from a to b
    Real distance = 0.0L;          ///< m
    bool may_be_apart = false;
    bool may_have_crossed = false;
    bool open = false;
};

class SecondFeatures {
public:
    explicit SecondFeatures(const Topology& topology) : topology_(&topology) {
        for (Index t = 0; t < topology.triangle_count(); ++t) {
            for (int i = 0; i < 3; ++i) {
                faces_at_vertex_[topology.triangles(i, t)].push_back(t);
                faces_at_edge_[ends(t, i)].push_back(t);
            }
        }
        edges_of_body_.resize(topology.bodies.size());
        for (const auto& [edge, faces] : faces_at_edge_) {
            const Index body = topology.body_of_triangle[static_cast<std::size_t>(faces.front())];
            edges_of_body_[static_cast<std::size_t>(body)].push_back(edge);
            neighbours_[edge[0]].push_back(edge[1]);
            neighbours_[edge[1]].push_back(edge[0]);
        }
    }

    /// Where the tick starts: tissue as it is, what is driven where it was, with what operators moved.
    void place(const Frame& frame) {
        x_.resize(static_cast<std::size_t>(topology_->vertex_count));
        for (std::size_t b = 0; b < topology_->bodies.size(); ++b) {
            const BodyRange& body = topology_->bodies[b];
            for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
                const bool tissue = body.kind == BodyKind::tissue;
                Vector3 at = tissue ? frame.position.col(v) : frame.previous.col(v);
                if (!tissue && !frame.operator_motion.empty()) at += frame.operator_motion[b];
                x_[static_cast<std::size_t>(v)] = at.cast<Real>();
            }
        }
    }
    [[nodiscard]] const Topology& topology() const { return *topology_; }
    [[nodiscard]] const std::vector<Point>& points() const { return x_; }
    [[nodiscard]] const std::map<Index, std::vector<Index>>& neighbours() const { return neighbours_; }

    [[nodiscard]] std::vector<SecondPointFace> point_faces(Real query_distance) const {
        std::vector<SecondPointFace> all;
        for (const auto& [first, second] : topology_->body_pairs) {
            for (const auto& [a, b] : {std::pair{first, second}, std::pair{second, first}}) {
                const Range vertices = body(a).vertices;
                for (Index v = vertices.first; v < vertices.end(); ++v) {
                    if (!faces_at_vertex_.contains(v)) continue;
                    for (Index t = body(b).triangles.first; t < body(b).triangles.end(); ++t) {
                        if (far(v, t, query_distance)) continue;
                        SecondPointFace one = look(x(v), t);
                        if (one.distance > query_distance * (1.0L + undecided)) continue;
                        one.open = one.open || std::abs(one.distance - query_distance) <= undecided * query_distance;
                        one.vertex = v;
                        one.vertex_body = a;
                        one.face_body = b;
                        all.push_back(one);
                    }
                }
            }
        }
        return all;
    }

    /// Nearest of all triangles of a body; what several share belongs to the lowest.
    [[nodiscard]] SecondPointFace nearest(const Point& point, Index face_body) const {
        SecondPointFace best{.distance = std::numeric_limits<Real>::infinity()};
        for (Index t = body(face_body).triangles.first; t < body(face_body).triangles.end(); ++t) {
            SecondPointFace one = look(point, t);
            constexpr Real rounding = 1e-15L;
            if (one.distance < (1.0L - rounding) * best.distance) best = one;
        }
        best.face_body = face_body;
        return best;
    }

    [[nodiscard]] bool is_within(Index vertex, Index face_body, Real distance) const {
        const Range triangles = body(face_body).triangles;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            if (!far(vertex, t, distance)) return true;
        }
        return false;
    }

    [[nodiscard]] std::vector<SecondEdgeEdge> edge_edges(Real query_distance) const {
        std::vector<SecondEdgeEdge> all;
        for (const auto& [a, b] : topology_->body_pairs) {
            for (const EdgeEnds& first : edges_of_body_[static_cast<std::size_t>(a)]) {
                for (const EdgeEnds& second : edges_of_body_[static_cast<std::size_t>(b)]) {
                    SecondEdgeEdge one{.a = first, .b = second, .body_a = a, .body_b = b};
                    if (closest(query_distance, one)) all.push_back(one);
                }
            }
        }
        return all;
    }

    /// Solid angle of a body's surface, 4π inside a closed one whose normals point outwards.
    [[nodiscard]] Real solid_angle(const Point& from, Index face_body, const std::vector<Point>& x) const {
        Real sum = 0.0L;
        for (Index t = body(face_body).triangles.first; t < body(face_body).triangles.end(); ++t) {
            std::array<Point, 3> r;
            std::array<Real, 3> size{};
            for (int i = 0; i < 3; ++i) {
                const auto k = static_cast<std::size_t>(i);
                r[k] = x[static_cast<std::size_t>(topology_->triangles(i, t))] - from;
                size[k] = r[k].norm();
            }
            const Real volume = r[0].dot(r[1].cross(r[2]));
            const Real below = size[0] * size[1] * size[2] + r[0].dot(r[1]) * size[2] + r[1].dot(r[2]) * size[0] +
                               r[2].dot(r[0]) * size[1];
            // What is asked of the sum is a whole number of turns: double is enough, and five times as fast.
            sum += 2.0 * std::atan2(static_cast<double>(volume), static_cast<double>(below));
        }
        return sum;
    }

    /// Vertices of a body and the number of another whose surface they can meet.
    [[nodiscard]] std::vector<std::pair<Range, Index>> questions() const {
        std::vector<std::pair<Range, Index>> all;
        for (const auto& [a, b] : topology_->body_pairs) {
            all.emplace_back(body(a).vertices, b);
            all.emplace_back(body(b).vertices, a);
        }
        return all;
    }
    [[nodiscard]] Index body_of(Index vertex) const {
        Index b = 0;
        while (vertex >= body(b).vertices.end()) ++b;
        return b;
    }
    [[nodiscard]] const BodyRange& body(Index b) const { return topology_->bodies[static_cast<std::size_t>(b)]; }

private:
    [[nodiscard]] EdgeEnds ends(Index t, int i) const {
        const Index u = topology_->triangles(i, t);
        const Index v = topology_->triangles((i + 1) % 3, t);
        return {std::min(u, v), std::max(u, v)};
    }
    [[nodiscard]] const Point& x(Index v) const { return x_[static_cast<std::size_t>(v)]; }
    [[nodiscard]] const Point& corner(Index t, int i) const { return x(topology_->triangles(i % 3, t)); }
    [[nodiscard]] Point unit_normal(Index t) const {
        const Point normal = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
        const Real size = normal.norm();
        return size > 0.0L ? Point(normal / size) : Point(Point::Zero());
    }

    [[nodiscard]] bool far(Index v, Index t, Real query_distance) const {
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax({corner(t, 0)[k], corner(t, 1)[k], corner(t, 2)[k]});
            if (x(v)[k] < low - 1.01L * query_distance || x(v)[k] > high + 1.01L * query_distance) return true;
        }
        return false;
    }

    /// Steepest that the distance from `point` falls when one leaves `foot` over the surface of a face that it lies on,
    /// along any direction that the face has there: 0 or less where the face has nothing nearer. `at`: corners of the
    /// face that the foot is on the side between, or on.
    [[nodiscard]] Real slope(const Point& path, Index face, const std::vector<Index>& at) const {
        const Point toward = path.normalized();
        std::array<Index, 3> v{topology_->triangles(0, face), topology_->triangles(1, face),
                               topology_->triangles(2, face)};
        if (at.size() == 2) {
            Index apex = v[0];
            for (const Index one : v) {
                if (one != at[0] && one != at[1]) apex = one;
            }
            const Point along = (x(at[1]) - x(at[0])).normalized();
            Point into = x(apex) - x(at[0]);
            into -= into.dot(along) * along;
            return into.norm() > 0.0L ? toward.dot(into.normalized()) : 0.0L;
        }
        while (v[0] != at[0]) std::rotate(v.begin(), v.begin() + 1, v.end());
        const Point u = (x(v[1]) - x(v[0])).normalized();
        const Point w = (x(v[2]) - x(v[0])).normalized();
        Real steepest = std::max(toward.dot(u), toward.dot(w));
        const Point normal = u.cross(w);
        if (normal.norm() > 0.0L) {
            const Point n = normal.normalized();
            const Point flat = toward - toward.dot(n) * n;
            if (flat.dot(n.cross(u)) > 0.0L && flat.dot(w.cross(n)) > 0.0L) steepest = std::max(steepest, flat.norm());
        }
        return steepest;
    }

    [[nodiscard]] SecondPointFace look(const Point& point, Index t) const {
        SecondPointFace one{.triangle = t};
        const Point e = corner(t, 1) - corner(t, 0);
        const Point f = corner(t, 2) - corner(t, 0);
        const Point p = point - corner(t, 0);
        const Real determinant = e.dot(e) * f.dot(f) - e.dot(f) * e.dot(f);
        std::array<Real, 3> weight{-1.0L, -1.0L, -1.0L};
        if (determinant > 0.0L) {
            weight[1] = (f.dot(f) * p.dot(e) - e.dot(f) * p.dot(f)) / determinant;
            weight[2] = (e.dot(e) * p.dot(f) - e.dot(f) * p.dot(e)) / determinant;
            weight[0] = 1.0L - weight[1] - weight[2];
        }
        std::vector<Index> on;  // corners that the foot is between
        const Real least = std::min({weight[0], weight[1], weight[2]});
        Point foot = Point::Zero();
        if (least > 0.0L) {
            foot = corner(t, 0) + weight[1] * e + weight[2] * f;
        } else {
            one.distance = std::numeric_limits<Real>::infinity();
            for (int i = 0; i < 3; ++i) {
                const Point along = corner(t, i + 1) - corner(t, i);
                const Real length = along.squaredNorm();
                const Real raw = length > 0.0L ? (point - corner(t, i)).dot(along) / length : 0.0L;
                const Real s = std::clamp(raw, 0.0L, 1.0L);
                const Point here = corner(t, i) + s * along;
                const Real distance = (point - here).norm();
                if (distance >= one.distance) continue;
                one.distance = distance;
                foot = here;
                const Index u = topology_->triangles(i, t);
                const Index v = topology_->triangles((i + 1) % 3, t);
                on = s <= 0.0L ? std::vector{u} : (s >= 1.0L ? std::vector{v} : std::vector{u, v});
                one.open = std::abs(raw) <= undecided || std::abs(raw - 1.0L) <= undecided;
            }
        }
        one.open = one.open || std::abs(least) <= undecided;
        one.path = point - foot;
        one.distance = one.path.norm();
        std::vector<Index> around{t};
        if (on.size() == 2) around = faces_at_edge_.at({std::min(on[0], on[1]), std::max(on[0], on[1])});
        if (on.size() == 1) around = faces_at_vertex_.at(on[0]);
        Real steepest = 0.0L;
        Real most = -1.0L;
        for (const Index face : around) {
            if (!on.empty() && one.distance > 0.0L) {
                const Real here = slope(one.path, face, on);
                steepest = std::max(steepest, here);
                one.open = one.open || std::abs(here - widening) <= undecided;
            }
            const Point normal = unit_normal(face);
            const Real height = one.path.dot(normal);
            if (std::abs(height) > most) {
                most = std::abs(height);
                one.front = height;
                one.front_normal = normal;
            }
        }
        one.closest = steepest <= widening && t == *std::min_element(around.begin(), around.end());
        // A vertex of a rim has more faces than a rim's edge has.
        if (on.size() == 2) one.at_rim = around.size() == 1;
        if (on.size() == 1) {
            for (const Index n : neighbours_.at(on[0])) {
                if (faces_at_edge_.at({std::min(on[0], n), std::max(on[0], n)}).size() == 1) one.at_rim = true;
            }
        }
        return one;
    }

    /// Whether the two come closest between their ends, within the query distance, where nothing next to them comes
    /// closer.
    [[nodiscard]] bool closest(Real query_distance, SecondEdgeEdge& one) const {
        for (int k = 0; k < 3; ++k) {
            const auto [low_a, high_a] = std::minmax(x(one.a[0])[k], x(one.a[1])[k]);
            const auto [low_b, high_b] = std::minmax(x(one.b[0])[k], x(one.b[1])[k]);
            if (low_a > high_b + 1.01L * query_distance || low_b > high_a + 1.01L * query_distance) return false;
        }
        const Point u = x(one.a[1]) - x(one.a[0]);
        const Point w = x(one.b[1]) - x(one.b[0]);
        const Point r = x(one.b[0]) - x(one.a[0]);
        // Normal equations of the least distance.
        const Real uu = u.dot(u);
        const Real uw = u.dot(w);
        const Real ww = w.dot(w);
        const Real determinant = uu * ww - uw * uw;
        if (!(determinant > 0.0L)) return false;
        const Real sine = std::sqrt(determinant / (uu * ww));
        if (sine < parallel_sine * (1.0L - 1e-6L)) return false;
        const Real s = (ww * r.dot(u) - uw * r.dot(w)) / determinant;
        const Real t = (uw * r.dot(u) - uu * r.dot(w)) / determinant;
        // Rounding of the double implementation grows with 1/sine².
        const Real near_end = undecided / (sine * sine);
        if (s < -near_end || s > 1.0L + near_end || t < -near_end || t > 1.0L + near_end) return false;
        one.open = sine < parallel_sine * (1.0L + 1e-6L) || std::min({s, 1.0L - s, t, 1.0L - t}) <= near_end;
        one.point_a = x(one.a[0]) + s * u;
        one.point_b = x(one.b[0]) + t * w;
        const Point between = one.point_b - one.point_a;
        one.distance = between.norm();
        if (one.distance > query_distance * (1.0L + undecided)) return false;
        one.open =
            one.open || std::abs(one.distance - query_distance) <= undecided * query_distance || one.distance < 1e-12L;
        if (one.distance < 1e-15L) return true;
        one.normal = between / one.distance;
        const Real rise_a = rise(one.a, one.normal, one.open);
        const Real fall_a = rise(one.a, -one.normal, one.open);
        const Real rise_b = rise(one.b, -one.normal, one.open);
        const Real fall_b = rise(one.b, one.normal, one.open);
        one.may_be_apart = rise_a <= widening && rise_b <= widening;
        one.may_have_crossed = fall_a <= widening && fall_b <= widening;
        return true;
    }

    [[nodiscard]] Real rise(const EdgeEnds& edge, const Point& normal, bool& open) const {
        Real most = -1.0L;
        for (const Index face : faces_at_edge_.at(edge)) {
            const Real here = slope(normal, face, {edge[0], edge[1]});
            open = open || std::abs(here - widening) <= 1e-7L;
            most = std::max(most, here);
        }
        return most;
    }

    const Topology* topology_;
    std::vector<Point> x_;  ///< m, per vertex
    std::map<Index, std::vector<Index>> faces_at_vertex_;
    std::map<EdgeEnds, std::vector<Index>> faces_at_edge_;
    std::map<Index, std::vector<Index>> neighbours_;
    std::vector<std::vector<EdgeEnds>> edges_of_body_;
};

/// On which side every vertex is, since the start: how often the surface of a body has passed it from front to back.
class SecondSides {
public:
    SecondSides(const SecondFeatures& features, const Topology& topology)
        : features_(&features), topology_(&topology) {}

    void start() {
        before_ = features_->points();
        count_.clear();
        for (const auto& [first, second] : topology_->body_pairs) {
            for (const auto& [a, b] : {std::pair{first, second}, std::pair{second, first}}) {
                if (!features_->body(b).closed) start_open(a, b);
            }
        }
    }

    /// From where the last tick started to where this one does.
    void follow() {
        const std::vector<Point>& now = features_->points();
        constexpr int parts = 24;
        std::vector<std::vector<Point>> between(parts + 1, before_);
        for (int k = 1; k <= parts; ++k) {
            for (std::size_t v = 0; v < now.size(); ++v)
                between[static_cast<std::size_t>(k)][v] += (now[v] - before_[v]) * (static_cast<Real>(k) / parts);
        }
        for (const auto& [first, second] : topology_->body_pairs) {
            for (const auto& [a, b] : {std::pair{first, second}, std::pair{second, first}}) {
                if (features_->body(b).closed) continue;
                const Real surface = most_moved(b, now);
                for (Index v = features_->body(a).vertices.first; v < features_->body(a).vertices.end(); ++v) {
                    const auto n = static_cast<std::size_t>(v);
                    const Real motion = surface + (now[n] - before_[n]).norm();
                    if (!(motion > 0.0L) || !features_->is_within(v, b, motion)) continue;
                    Real angle = features_->solid_angle(before_[n], b, before_);
                    if (std::abs(features_->solid_angle(now[n], b, now) - angle) < pi) continue;  // nothing has jumped
                    for (const std::vector<Point>& x : between) {
                        const Real next = features_->solid_angle(x[n], b, x);
                        count_[{v, b}] += jump(next - angle);
                        angle = next;
                    }
                }
            }
        }
        before_ = now;
    }

    /// 0 where the vertex is at home.
    [[nodiscard]] int count(Index vertex, Index face_body) const {
        const auto n = static_cast<std::size_t>(vertex);
        if (features_->body(face_body).closed) return winding(features_->points()[n], face_body);
        const auto found = count_.find({vertex, face_body});
        return found == count_.end() ? 0 : found->second;
    }
    /// Beyond a free rim nothing is left that has been crossed.
    void forget(Index vertex, Index face_body) { count_.erase({vertex, face_body}); }

    /// Of a point on an edge, whose first end is a vertex.
    [[nodiscard]] int count_on_edge(Index first, const Point& point, Index face_body) const {
        if (features_->body(face_body).closed) return winding(point, face_body);
        return count(first, face_body) + along(features_->points()[static_cast<std::size_t>(first)], point, face_body);
    }
    /// On the surface of a closed body, to rounding: it turns about the point by half of a whole number.
    [[nodiscard]] bool is_on(const Point& point, Index closed_body) const {
        const Real turns = features_->solid_angle(point, closed_body, features_->points()) / (4.0L * pi);
        return std::abs(turns - std::round(turns)) > 0.25L;
    }
    [[nodiscard]] const std::map<std::pair<Index, Index>, int>& counts() const { return count_; }

private:
    static constexpr Real pi = std::numbers::pi_v<Real>;
    static int jump(Real change) { return change > 2.0L * pi ? 1 : (change < -2.0L * pi ? -1 : 0); }
    [[nodiscard]] int winding(const Point& point, Index body) const {
        return static_cast<int>(std::lround(features_->solid_angle(point, body, features_->points()) / (4.0L * pi)));
    }
    [[nodiscard]] Real most_moved(Index body, const std::vector<Point>& now) const {
        Real most = 0.0L;
        for (Index v = features_->body(body).vertices.first; v < features_->body(body).vertices.end(); ++v)
            most = std::max(most, (now[static_cast<std::size_t>(v)] - before_[static_cast<std::size_t>(v)]).norm());
        return most;
    }
    /// Crossings on the straight path, by the jumps of the solid angle.
    [[nodiscard]] int along(const Point& from, const Point& to, Index face_body) const {
        constexpr int parts = 24;
        int sum = 0;
        Real angle = features_->solid_angle(from, face_body, features_->points());
        for (int k = 1; k <= parts; ++k) {
            const Point here = from + (to - from) * (static_cast<Real>(k) / parts);
            const Real next = features_->solid_angle(here, face_body, features_->points());
            sum += jump(next - angle);
            angle = next;
        }
        return sum;
    }

    void start_open(Index a, Index b) {
        const Range vertices = features_->body(a).vertices;
        const int home = features_->body(b).start_side == SheetSide::front ? 1 : -1;
        std::set<Index> seen;
        for (Index root = vertices.first; root < vertices.end(); ++root) {
            if (seen.contains(root) || !features_->neighbours().contains(root)) continue;
            std::vector<std::pair<Index, int>> part{{root, 0}};
            seen.insert(root);
            for (std::size_t k = 0; k < part.size(); ++k) {
                const auto [u, here] = part[k];
                for (const Index v : features_->neighbours().at(u)) {
                    if (!seen.insert(v).second) continue;
                    part.emplace_back(v, here + along(features_->points()[static_cast<std::size_t>(u)],
                                                      features_->points()[static_cast<std::size_t>(v)], b));
                }
            }
            // Home is the end of the count that lies on the declared side: the least in front, the largest behind.
            int right = home * part.front().second;
            for (const auto& [v, here] : part) right = std::min(right, home * here);
            for (const auto& [v, here] : part) {
                if (here != home * right) count_[{v, b}] = here - home * right;
            }
        }
    }

    const SecondFeatures* features_;
    const Topology* topology_;
    std::vector<Point> before_;
    std::map<std::pair<Index, Index>, int> count_;
};

}  // namespace trocar::test
