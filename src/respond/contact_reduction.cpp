#include "respond/contact_reduction.hpp"

#include <algorithm>

#include "geometry/crossing.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

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

void ContactReduction::keep_edges(const Topology& topology, const Frame& frame, const Contact& contact) {
    const Crossing crossing = cross_triangles(corners_of(topology, frame.position, contact.a),
                                              corners_of(topology, frame.position, contact.b));
    EdgePair pair;
    pair.contact = contact;
    pair.key.fill(-1);
    for (const CrossingEnd& end : crossing.ends) {
        if (end.triangle < 0 || end.edge < 0) continue;
        const Index triangle = end.triangle == 0 ? contact.a : contact.b;
        const Index p = topology.triangles(end.edge, triangle);
        const Index q = topology.triangles((end.edge + 1) % 3, triangle);
        const std::size_t place = end.triangle == 0 ? 0 : 2;
        pair.key[place] = std::min(p, q);
        pair.key[place + 1] = std::max(p, q);
    }
    if (pair.key[0] < 0 || pair.key[2] < 0) {
        pair.key = {contact.vertex_a, contact.a, contact.vertex_b, contact.b};  // no edges known: the pair itself
    }
    Index& first = first_edge_[at(pair.key[0])];
    for (Index e = first; e >= 0; e = edges_[at(e)].next) {
        if (edges_[at(e)].key != pair.key) continue;
        if (contact.depth > edges_[at(e)].contact.depth) edges_[at(e)].contact = contact;
        return;
    }
    pair.next = first;
    first = static_cast<Index>(edges_.size());
    edges_.push_back(pair);
}

void ContactReduction::clear() {
    for (const VertexInFace& v : faces_) first_face_[at(v.vertex)] = -1;
    faces_.clear();
    for (const EdgePair& pair : edges_) first_edge_[at(pair.key[0])] = -1;
    edges_.clear();
}

}  // namespace trocar
