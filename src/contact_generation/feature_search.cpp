#include "contact_generation/feature_search.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

/// Sine by which the Voronoi cone of an edge or corner is widened, so that flat surfaces and rounding omit no contact.
constexpr double widening = 0.02;

Box widened(const Corners& corners, const Vector3& by) {
    const Box box = box_of(corners);
    return {box.min - by, box.max + by};
}

Vector3 unit_normal_of(const Corners& c) {
    const Vector3 normal = area_normal(c);
    const double size = normal.norm();
    return size > 0.0 ? Vector3(normal / size) : Vector3::Zero();
}

}  // namespace

std::uint64_t point_face_id(Index vertex, Index triangle) {
    return (static_cast<std::uint64_t>(vertex) << 32) | static_cast<std::uint64_t>(triangle);
}

std::uint64_t edge_edge_id(Index edge_a, Index edge_b) {
    constexpr std::uint64_t kind = std::uint64_t{1} << 63;
    return kind | (static_cast<std::uint64_t>(edge_a) << 32) | static_cast<std::uint64_t>(edge_b);
}

void FeatureSearch::prepare(const Topology& topology) {
    mesh_.prepare(topology);
    point_faces_.clear();
    edge_edges_.clear();
    point_faces_.reserve(1024);
    edge_edges_.reserve(1024);
}

void FeatureSearch::run(const TickStart& start, const ContactSet& contacts) {
    query_distance_ = contacts.query_distance;
    seen_.clear();
    point_faces_.clear();
    edge_edges_.clear();
    for (const std::vector<TrianglePair>* pairs : {&contacts.pairs, &contacts.near}) {
        for (const TrianglePair& pair : *pairs) examine_pair(start, pair);
    }
}

/// Skips features whose boxes are further apart than the query distance.
void FeatureSearch::examine_pair(const TickStart& start, const TrianglePair& pair) {
    const Topology& topology = start.topology();
    const Index body_a = topology.body_of_triangle[at(pair.a)];
    const Index body_b = topology.body_of_triangle[at(pair.b)];
    const Corners a = start.corners(pair.a, body_a);
    const Corners b = start.corners(pair.b, body_b);
    constexpr double rounding = 1e-9;
    const Vector3 within = Vector3::Constant(query_distance_ * (1.0 + rounding));
    const Box around_a = widened(a, within);
    const Box around_b = widened(b, within);
    for (int i = 0; i < 3; ++i) {
        if (around_b.overlaps({a[at(i)], a[at(i)]})) {
            examine_point(start, topology.triangles(i, pair.a), body_a, pair.b, body_b);
        }
        if (around_a.overlaps({b[at(i)], b[at(i)]})) {
            examine_point(start, topology.triangles(i, pair.b), body_b, pair.a, body_a);
        }
    }
    const auto box_of_edge = [](const Corners& c, int i) {
        const Vector3& u = c[at(i)];
        const Vector3& v = c[at((i + 1) % 3)];
        return Box{u.cwiseMin(v), u.cwiseMax(v)};
    };
    std::array<Box, 3> edges_b;
    for (int j = 0; j < 3; ++j) edges_b[at(j)] = box_of_edge(b, j);
    for (int i = 0; i < 3; ++i) {
        Box edge_a = box_of_edge(a, i);
        edge_a.min -= within;
        edge_a.max += within;
        if (!edge_a.overlaps(around_b)) continue;
        for (int j = 0; j < 3; ++j) {
            if (!edge_a.overlaps(edges_b[at(j)])) continue;
            examine_edges(start, mesh_.edges_of(pair.a)[at(i)], body_a, mesh_.edges_of(pair.b)[at(j)], body_b);
        }
    }
}

void FeatureSearch::place(const TickStart& start, const Vector3& point, PointFace& found) const {
    const Corners corners = start.corners(found.triangle, found.face_body);
    found.weights = closest_point_on_triangle(corners, point);
    found.path = point - point_at(corners, found.weights);
    found.distance = found.path.norm();
}

void FeatureSearch::examine_point(const TickStart& start, Index vertex, Index vertex_body, Index triangle,
                                  Index face_body) {
    if (!seen_.insert(point_face_id(vertex, triangle))) return;
    PointFace found{.vertex = vertex, .triangle = triangle, .vertex_body = vertex_body, .face_body = face_body};
    place(start, start.position(vertex, vertex_body), found);
    if (found.distance > query_distance_) return;
    judge(start, false, found);
    point_faces_.push_back(found);
}

/// Sets is_closest and front. On an edge or corner `front` is the angle-weighted pseudonormal, whose sign is always
/// correct (Baerentzen and Aanaes 2005).
void FeatureSearch::judge(const TickStart& start, bool fully, PointFace& found) const {
    const auto corner = start.topology().triangles.col(found.triangle);
    const int inside = static_cast<int>((found.weights.array() > 0.0).count());
    found.is_closest = false;
    if (inside == 3) {
        found.front = unit_normal_of(start.corners(found.triangle, found.face_body));
        found.is_closest = true;
        return;
    }
    const double wide = widening * found.distance;
    Vector3 front = Vector3::Zero();
    if (inside == 2) {
        const int apex = found.weights[0] == 0.0 ? 0 : (found.weights[1] == 0.0 ? 1 : 2);
        const Index edge = mesh_.edges_of(found.triangle)[at((apex + 1) % 3)];
        const auto faces = mesh_.faces_at_edge(edge);
        found.is_closest = faces.front() == found.triangle;
        const Vector3 foot = start.position(mesh_.ends(edge)[0], found.face_body);
        const Vector3 along = (start.position(mesh_.ends(edge)[1], found.face_body) - foot).normalized();
        for (const Index t : faces) {
            const Vector3 to_apex = start.position(mesh_.apex(t, edge), found.face_body) - foot;
            const Vector3 into = to_apex - to_apex.dot(along) * along;
            if (found.path.dot(into) > wide * into.norm()) found.is_closest = false;
            front += unit_normal_of(start.corners(t, found.face_body));
        }
    } else {
        const int here = found.weights[0] > 0.0 ? 0 : (found.weights[1] > 0.0 ? 1 : 2);
        const Index vertex = corner[here];
        const auto faces = mesh_.faces_at_vertex(vertex);
        found.is_closest = faces.front() == found.triangle;
        // Only the first face of a vertex fan evaluates the corner.
        if (!found.is_closest && !fully) return;
        const Vector3 foot = start.position(vertex, found.face_body);
        for (const Index e : mesh_.edges_at_vertex(vertex)) {
            const Vector3 along = start.position(mesh_.other_end(e, vertex), found.face_body) - foot;
            if (found.path.dot(along) > wide * along.norm()) found.is_closest = false;
        }
        for (const Index t : faces) {
            const auto c = start.topology().triangles.col(t);
            const int i = c[0] == vertex ? 0 : (c[1] == vertex ? 1 : 2);
            const Vector3 u = start.position(c[(i + 1) % 3], found.face_body) - foot;
            const Vector3 w = start.position(c[(i + 2) % 3], found.face_body) - foot;
            const Vector3 normal = u.cross(w);
            const double size = normal.norm();
            if (size > 0.0) front += std::atan2(size, u.dot(w)) / size * normal;
        }
    }
    const double size = front.norm();
    if (size > 0.0) found.front = front / size;
}

PointFace FeatureSearch::walk(const TickStart& start, const Vector3& point, Index face_body, Index triangle) const {
    PointFace best{.triangle = triangle, .face_body = face_body};
    place(start, point, best);
    constexpr int most_steps = 8;
    for (int step = 0; step < most_steps; ++step) {
        const Index centre = best.triangle;
        for (int i = 0; i < 3; ++i) {
            for (const Index t : mesh_.faces_at_vertex(start.topology().triangles(i, centre))) {
                PointFace next{.triangle = t, .face_body = face_body};
                place(start, point, next);
                if (next.distance < best.distance || (next.distance == best.distance && t < best.triangle)) best = next;
            }
        }
        if (best.triangle == centre) break;
    }
    judge(start, true, best);
    return best;
}

void FeatureSearch::examine_edges(const TickStart& start, Index edge_a, Index body_a, Index edge_b, Index body_b) {
    if (!seen_.insert(edge_edge_id(edge_a, edge_b))) return;
    const Vector3 a0 = start.position(mesh_.ends(edge_a)[0], body_a);
    const Vector3 along_a = start.position(mesh_.ends(edge_a)[1], body_a) - a0;
    const Vector3 b0 = start.position(mesh_.ends(edge_b)[0], body_b);
    const Vector3 along_b = start.position(mesh_.ends(edge_b)[1], body_b) - b0;
    const Vector3 across = along_a.cross(along_b);
    const double size = across.norm();
    const Vector3 between = b0 - a0;
    const double apart = between.dot(across);
    // Nearly parallel edges are covered by the vertex–face contacts of their ends.
    constexpr double parallel_sine = 1e-3;
    if (std::abs(apart) > query_distance_ * size ||
        size * size <= parallel_sine * parallel_sine * along_a.squaredNorm() * along_b.squaredNorm())
        return;
    const double s = between.cross(along_b).dot(across) / (size * size);
    const double t = between.cross(along_a).dot(across) / (size * size);
    if (!(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0)) return;
    EdgeEdge found{
        .edge_a = edge_a, .edge_b = edge_b, .body_a = body_a, .body_b = body_b, .fraction_a = s, .fraction_b = t};
    found.normal = across / (apart < 0.0 ? -size : size);
    found.distance = std::abs(apart) / size;
    const Vector3 back = -found.normal;
    found.may_be_apart = is_ridge(start, edge_a, body_a, found.normal) && is_ridge(start, edge_b, body_b, back);
    found.may_have_crossed = is_ridge(start, edge_a, body_a, back) && is_ridge(start, edge_b, body_b, found.normal);
    if (found.may_be_apart || found.may_have_crossed) edge_edges_.push_back(found);
}

/// True if no face at the edge rises above the plane through the edge with this normal.
bool FeatureSearch::is_ridge(const TickStart& start, Index edge, Index body, const Vector3& normal) const {
    const Vector3 foot = start.position(mesh_.ends(edge)[0], body);
    const Vector3 along = (start.position(mesh_.ends(edge)[1], body) - foot).normalized();
    for (const Index t : mesh_.faces_at_edge(edge)) {
        const Vector3 to_apex = start.position(mesh_.apex(t, edge), body) - foot;
        const Vector3 into = to_apex - to_apex.dot(along) * along;
        if (normal.dot(into) > widening * into.norm()) return false;
    }
    return true;
}

}  // namespace trocar
