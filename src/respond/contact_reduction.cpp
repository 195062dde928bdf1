#include "respond/contact_reduction.hpp"

#include <algorithm>

#include "geometry/crossing.hpp"

namespace trocar {
EdgeKey name_edges(const Topology& topology, const Frame& frame, const Contact& contact) {
    const Crossing crossing = cross_triangles(corners_of(topology.triangles, frame.position, contact.a),
                                              corners_of(topology.triangles, frame.position, contact.b));
    EdgeKey key{-1, -1, -1, -1};
    for (const CrossingEnd& end : crossing.ends) {
        if (end.triangle < 0) continue;
        const Index triangle = end.triangle == 0 ? contact.a : contact.b;
        const std::size_t place = end.triangle == 0 ? 0 : 2;
        const Index p = topology.triangles(end.edge, triangle);
        const Index q = topology.triangles((end.edge + 1) % 3, triangle);
        key[place] = std::min(p, q);
        key[place + 1] = std::max(p, q);
    }
    // Without known edges the triangle pair is the key.
    return key[0] < 0 || key[2] < 0 ? EdgeKey{contact.vertex_a, contact.a, contact.vertex_b, contact.b} : key;
}

void ContactReduction::prepare(const Topology& topology) {
    first_face_.assign(at(topology.vertex_count), -1);
    first_edge_.assign(at(topology.vertex_count), -1);
    faces_.clear();
    edges_.clear();
}

bool ContactReduction::keep(const VertexInFace& candidate) {
    VertexInFace v = candidate;
    Index& first = first_face_[at(v.vertex)];
    for (Index f = first; f >= 0; f = faces_[at(f)].next) {
        if (faces_[at(f)].face_body != v.face_body) continue;
        if (v.distance < faces_[at(f)].distance) {
            v.next = faces_[at(f)].next;
            faces_[at(f)] = v;
        }
        return false;
    }
    v.next = first;
    first = static_cast<Index>(faces_.size());
    faces_.push_back(v);
    return true;
}

bool ContactReduction::keep(const EdgeKey& key, const CrossedEdges& candidate) {
    Index& first = first_edge_[at(key[0])];
    for (Index e = first; e >= 0; e = edges_[at(e)].next) {
        EdgePair& known = edges_[at(e)];
        if (known.key != key) continue;
        if (candidate.depth > known.edges.depth) known.edges = candidate;
        return false;
    }
    edges_.push_back({.key = key, .edges = candidate, .next = first});
    first = static_cast<Index>(edges_.size()) - 1;
    return true;
}

void ContactReduction::clear() {
    for (const VertexInFace& v : faces_) first_face_[at(v.vertex)] = -1;
    faces_.clear();
    for (const EdgePair& pair : edges_) first_edge_[at(pair.key[0])] = -1;
    edges_.clear();
}

}  // namespace trocar
