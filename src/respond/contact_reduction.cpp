#include "respond/contact_reduction.hpp"

#include <algorithm>

#include "geometry/crossing.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

void name_edge(const Topology& topology, Index triangle, int edge, std::size_t place, EdgeKey& key) {
    const Index p = topology.triangles(edge, triangle);
    const Index q = topology.triangles((edge + 1) % 3, triangle);
    key[place] = std::min(p, q);
    key[place + 1] = std::max(p, q);
}

}  // namespace

void ContactReduction::prepare(const Topology& topology) {
    first_face_.assign(at(topology.vertex_count), -1);
    first_edge_.assign(at(topology.vertex_count), -1);
    faces_.clear();
    edges_.clear();
}

void ContactReduction::keep(const VertexInFace& candidate) {
    VertexInFace v = candidate;
    Index& first = first_face_[at(v.vertex)];
    for (Index f = first; f >= 0; f = faces_[at(f)].next) {
        if (faces_[at(f)].face_body != v.face_body) continue;
        if (v.distance < faces_[at(f)].distance) {
            v.next = faces_[at(f)].next;
            faces_[at(f)] = v;
        }
        return;
    }
    v.next = first;
    first = static_cast<Index>(faces_.size());
    faces_.push_back(v);
}

void ContactReduction::keep_corners(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                                    const Contact& contact) {
    const equations::Corners face = corners_of(topology, frame.position, contact.a);
    for (int i = 0; i < 3; ++i) {
        VertexInFace v;
        v.vertex = topology.triangles(i, contact.b);
        v.triangle = contact.a;
        v.vertex_body = topology.body_of_triangle[at(contact.b)];
        v.face_body = topology.body_of_triangle[at(contact.a)];
        const Vector3 x = frame.position.col(v.vertex);
        v.weights = closest_point_on_triangle(face, x);
        v.distance = (x - equations::point_at(face, v.weights)).norm();
        v.depth = v.distance;
        v.nearest = topology.triangles(equations::nearest_corner(face, x), contact.a);
        v.normal = surface.blended_normal(topology, frame.position, contact.a, v.weights);
        keep(v);
    }
}

void ContactReduction::keep_edges(const Topology& topology, const Frame& frame, const Contact& contact) {
    const Crossing crossing = cross_triangles(corners_of(topology, frame.position, contact.a),
                                              corners_of(topology, frame.position, contact.b));
    EdgePair pair;
    pair.contact = contact;
    pair.key.fill(-1);
    for (const CrossingEnd& end : crossing.ends) {
        if (end.triangle < 0 || end.edge < 0) continue;
        name_edge(topology, end.triangle == 0 ? contact.a : contact.b, end.edge, end.triangle == 0 ? 0 : 2, pair.key);
    }
    if (pair.key[0] < 0 || pair.key[2] < 0) {
        pair.key = {contact.vertex_a, contact.a, contact.vertex_b, contact.b};  // no edges known: the pair itself
    }
    keep_edges(pair);
}

void ContactReduction::keep_pierced(const Topology& topology, const Frame& frame, const Contact& contact) {
    const Crossing crossing = cross_triangles(corners_of(topology, frame.position, contact.a),
                                              corners_of(topology, frame.position, contact.b));
    EdgePair pair;
    pair.contact = contact;
    pair.crosses = false;
    for (const CrossingEnd& end : crossing.ends) {
        if (end.triangle != 1 || end.edge < 0) continue;
        name_edge(topology, contact.b, end.edge, 2, pair.key);
        for (int edge = 0; edge < 3; ++edge) {
            name_edge(topology, contact.a, edge, 0, pair.key);
            keep_edges(pair);
        }
    }
}

void ContactReduction::keep_edges(const EdgePair& candidate) {
    Index& first = first_edge_[at(candidate.key[0])];
    for (Index e = first; e >= 0; e = edges_[at(e)].next) {
        EdgePair& known = edges_[at(e)];
        if (known.key != candidate.key) continue;
        const bool better = candidate.crosses && (!known.crosses || candidate.contact.depth > known.contact.depth);
        if (!better) return;
        known.contact = candidate.contact;
        known.crosses = true;
        return;
    }
    edges_.push_back(candidate);
    edges_.back().next = first;
    first = static_cast<Index>(edges_.size()) - 1;
}

void ContactReduction::clear() {
    for (const VertexInFace& v : faces_) first_face_[at(v.vertex)] = -1;
    faces_.clear();
    for (const EdgePair& pair : edges_) first_edge_[at(pair.key[0])] = -1;
    edges_.clear();
}

}  // namespace trocar
