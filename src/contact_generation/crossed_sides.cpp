#include "contact_generation/crossed_sides.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "geometry/signed_crossing.hpp"

namespace trocar {
namespace {

/// Vertices are followed at a point a tiny_offset beside them, always the same way, so that no path runs exactly
/// through an edge of a regular mesh.
const Vector3 tiny_offset{1.37e-11, -2.91e-11, 2.23e-11};

/// Signed crossings of a vertex with a triangle. The triangle moves first, then the vertex.
int crossing(const Vector3& from, const Vector3& to, const std::array<Index, 3>& number, const Corners& before,
             const Corners& after) {
    const Box path = box_of(from, to).grown(1e-9);
    Box swept = box_of(before);
    swept.add(box_of(after));
    if (!path.overlaps(swept)) return 0;
    const Vector3 x = from + tiny_offset;
    int sum = 0;
    if (before != after) sum += sweep_crossing(x, number, before, after);
    if (from != to) sum += segment_crossing(x, to + tiny_offset, after[0], after[1], after[2]);
    return sum;
}

}  // namespace

const CrossedLayer* CrossedSides::layer(Index vertex, Index face_body) const {
    if (crossed_[at(vertex)] == 0) return nullptr;
    const auto found = std::find_if(layers_.begin(), layers_.end(), [&](const CrossedLayer& layer) {
        return layer.vertex == vertex && layer.face_body == face_body;
    });
    return found == layers_.end() ? nullptr : &*found;
}

bool CrossedSides::is_beyond(const TickStart& start, const FeatureMesh& mesh, Index edge, double fraction,
                             Index edge_body, Index face_body, const Partners& partners) const {
    const Topology& topology = start.topology();
    const Index first = mesh.ends(edge)[0];
    int count = 0;
    if (crossed_[at(first)] != 0) {
        for (const CrossedLayer& one : layers_) {
            if (one.vertex == first && one.face_body == face_body) count += one.sign;
        }
    }
    const Vector3 from = start.position(first, edge_body);
    const Vector3 to = (1.0 - fraction) * from + fraction * start.position(mesh.ends(edge)[1], edge_body);
    // The partners of one face at the edge contain every triangle that the edge crosses.
    partners.visit(mesh.faces_at_edge(edge).front(), [&](Index other) {
        if (topology.body_of_triangle[at(other)] != face_body) return;
        const auto [a, b, c] = start.corners(other, face_body);
        count += segment_crossing(from + tiny_offset, to + tiny_offset, a, b, c);
    });
    return count != 0;
}

void CrossedSides::add(const CrossedLayer& layer) {
    layers_.push_back(layer);
    ++crossed_[at(layer.vertex)];
}

void CrossedSides::cross(const PointFace& where, int crossings) {
    for (; crossings > 0; --crossings) cross_once(where, 1);
    for (; crossings < 0; ++crossings) cross_once(where, -1);
}

void CrossedSides::cross_once(const PointFace& where, int sign) {
    if (crossed_[at(where.vertex)] != 0) {
        const auto back = std::find_if(layers_.begin(), layers_.end(), [&](const CrossedLayer& layer) {
            return layer.vertex == where.vertex && layer.face_body == where.face_body && layer.sign == -sign;
        });
        if (back != layers_.end()) {
            --crossed_[at(where.vertex)];
            layers_.erase(back);
            return;
        }
    }
    add({where.vertex, where.vertex_body, where.face_body, where.triangle, sign});
}

void CrossedSides::settle(const TickStart& start, const std::vector<PointFace>& near) {
    const Topology& topology = start.topology();
    const Frame& frame = start.frame();
    for (const PointFace& one : near) {
        const auto c = topology.triangles.col(one.triangle);
        const std::array<Index, 3> number{c[0], c[1], c[2]};
        const Vector3 v0 = frame.previous.col(one.vertex);
        const Vector3 v1 = start.position(one.vertex, one.vertex_body);
        const Corners f0 = corners_of(topology.triangles, frame.previous, one.triangle);
        const Corners f1 = start.corners(one.triangle, one.face_body);
        // Tissue moves first: its vertex moves before the face of an operator-driven body.
        const bool vertex_first = start.is_tissue(one.vertex_body) && !start.is_tissue(one.face_body);
        cross(one, vertex_first ? crossing(v0, v1, number, f0, f0) + crossing(v1, v1, number, f0, f1)
                                : crossing(v0, v1, number, f0, f1));
    }
}

void CrossedSides::carry_along(const TickStart& start, const std::vector<PointFace>& near) {
    const Topology& topology = start.topology();
    const Frame& frame = start.frame();
    for (const PointFace& one : near) {
        if (start.is_tissue(one.vertex_body) && start.is_tissue(one.face_body)) continue;
        const auto c = topology.triangles.col(one.triangle);
        const std::array<Index, 3> number{c[0], c[1], c[2]};
        const Corners f1 = start.corners(one.triangle, one.face_body);
        cross(one, crossing(start.position(one.vertex, one.vertex_body), frame.position.col(one.vertex), number, f1,
                            corners_of(topology.triangles, frame.position, one.triangle)));
    }
}

void CrossedSides::prepare(const Topology& topology, const FeatureMesh& mesh, const Frame& first) {
    layers_.clear();
    layers_.reserve(256);
    crossed_.assign(at(topology.vertex_count), 0);
    std::vector<std::optional<SurfaceTree>> surfaces(topology.bodies.size());
    for (const auto& [a, b] : topology.body_pairs) {
        for (const auto& [body, face_body] : {std::array{a, b}, std::array{b, a}}) {
            const BodyRange& faces = topology.bodies[at(face_body)];
            std::optional<SurfaceTree>& surface = surfaces[at(face_body)];
            if (!surface) {
                std::vector<Index> all(at(faces.triangles.count));
                std::iota(all.begin(), all.end(), faces.triangles.first);
                surface.emplace(topology.triangles, std::move(all), first.position);
            }
            if (faces.closed) {
                start_closed(topology, first, *surface, body, face_body);
            } else {
                start_open(topology, mesh, first, *surface, body, face_body);
            }
        }
    }
}

void CrossedSides::start_layer(const Frame& first, const SurfaceTree& surface, Index vertex, Index body,
                               Index face_body, int count) {
    const Index nearest = surface.nearest(first.position.col(vertex));
    for (; nearest >= 0 && count > 0; --count) add({vertex, body, face_body, nearest, 1});
    for (; nearest >= 0 && count < 0; ++count) add({vertex, body, face_body, nearest, -1});
}

/// Ray cast to a point far outside. The signed crossing count is nonzero for a vertex inside the closed surface.
void CrossedSides::start_closed(const Topology& topology, const Frame& first, const SurfaceTree& surface, Index body,
                                Index face_body) {
    // A skew direction, so that no ray runs within a face of a box.
    const double size = (surface.box().max - surface.box().min).maxCoeff();
    const Vector3 outwards = size * Vector3(2.0, 1.237e-3, -2.713e-3);
    const Range vertices = topology.bodies[at(body)].vertices;
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        const Vector3 x = first.position.col(v) + tiny_offset;
        if (!box_of(x, x).overlaps(surface.box())) continue;
        const int count = -surface.crossings(x, x + outwards);
        if (count != 0) start_layer(first, surface, v, body, face_body, count);
    }
}

/// Breadth-first traversal of the body's edges. An edge that crosses the sheet changes the count, so that the counts of
/// a component are known up to a constant. The first crossing edge fixes it: its end on the declared side has count 0.
void CrossedSides::start_open(const Topology& topology, const FeatureMesh& mesh, const Frame& first,
                              const SurfaceTree& surface, Index body, Index face_body) {
    const auto crossings = [&](Index u, Index v) {
        return surface.crossings(first.position.col(u) + tiny_offset, first.position.col(v) + tiny_offset);
    };
    const Range vertices = topology.bodies[at(body)].vertices;
    std::vector<int> count(at(vertices.count), 0);
    std::vector<std::uint8_t> seen(at(vertices.count), 0);
    std::vector<Index> connected;
    const bool belongs_in_front = topology.bodies[at(face_body)].start_side == SheetSide::front;
    for (Index root = vertices.first; root < vertices.end(); ++root) {
        if (seen[at(root - vertices.first)] != 0) continue;
        seen[at(root - vertices.first)] = 1;
        connected.assign(1, root);
        bool settled = false;
        int right = 0;  // count on the declared side
        for (std::size_t next = 0; next < connected.size(); ++next) {
            const Index u = connected[next];
            for (const Index e : mesh.edges_at_vertex(u)) {
                const Index v = mesh.other_end(e, u);
                if (seen[at(v - vertices.first)] != 0) continue;
                seen[at(v - vertices.first)] = 1;
                const int here = count[at(u - vertices.first)];
                const int change = crossings(u, v);
                count[at(v - vertices.first)] = here + change;
                if (change != 0 && !settled) {
                    settled = true;
                    right = (change > 0) == belongs_in_front ? here : here + change;
                }
                connected.push_back(v);
            }
        }
        for (const Index v : connected) {
            const int crossed = count[at(v - vertices.first)] - right;
            if (crossed != 0) start_layer(first, surface, v, body, face_body, crossed);
        }
    }
}

}  // namespace trocar
