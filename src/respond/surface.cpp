#include "respond/surface.hpp"

#include <cmath>

#include "geometry/exact.hpp"

namespace trocar {
void SurfaceNeighbours::prepare(const Topology& topology) {
    triangles_.fill(topology.vertex_count, [&topology](const auto& act) {
        for (Index t = 0; t < topology.triangle_count(); ++t) {
            for (int i = 0; i < 3; ++i) act(topology.triangles(i, t), t);
        }
    });
    area_.clear();
}

void SurfaceNeighbours::measure(const Topology& topology, const Matrix3X& position) {
    if (!area_.empty()) return;
    area_.assign(at(topology.vertex_count), 0.0);
    for (Index t = 0; t < topology.triangle_count(); ++t) {
        const double third = area_normal(corners_of(topology.triangles, position, t)).norm() / 6.0;
        for (int i = 0; i < 3; ++i) area_[at(topology.triangles(i, t))] += third;
    }
}

Vector3 SurfaceNeighbours::vertex_normal(const Topology& topology, const Matrix3X& position, Index vertex) const {
    Vector3 sum = Vector3::Zero();
    for (const Index t : triangles_at(vertex)) sum += area_normal(corners_of(topology.triangles, position, t));
    const double length = sum.norm();
    return length > 0.0 ? Vector3(sum / length) : Vector3::Zero();
}

Vector3 SurfaceNeighbours::blended_normal(const Topology& topology, const Matrix3X& position, Index triangle,
                                          const Vector3& weights) const {
    Vector3 face = area_normal(corners_of(topology.triangles, position, triangle));
    const double size = face.norm();
    if (size > 0.0) face /= size;
    const bool bends = topology.bodies[at(topology.body_of_triangle[at(triangle)])].kind == BodyKind::tissue;
    constexpr double crease = 0.5;  // cosine of 60 degrees
    Vector3 sum = Vector3::Zero();
    for (int i = 0; i < 3; ++i) {
        if (weights[i] == 0.0) continue;
        const Index vertex = topology.triangles(i, triangle);
        if (bends) {
            sum += weights[i] * vertex_normal(topology, position, vertex);
            continue;
        }
        Vector3 corner = Vector3::Zero();
        for (const Index t : triangles_at(vertex)) {
            const Vector3 normal = area_normal(corners_of(topology.triangles, position, t));
            if (normal.dot(face) >= crease * normal.norm()) corner += normal;
        }
        const double length = corner.norm();
        if (length > 0.0) sum += weights[i] / length * corner;
    }
    const double length = sum.norm();
    constexpr double least_agreement = 0.26;  // cosine of 75 degrees
    if (length == 0.0 || sum.dot(face) < least_agreement * length) return face;
    return sum / length;
}

}  // namespace trocar
