#include "contact/derive.hpp"

#include <algorithm>
#include <array>

#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

/// Edges with a smaller sine between them have no usable common normal (METHODS §6).
constexpr double parallel_sine = 1e-3;

struct PlacedTriangle {
    std::array<Index, 3> vertex;
    Corners corner;
};

PlacedTriangle placed(const Topology& topology, const Frame& frame, Index triangle) {
    const auto vertex = topology.triangles.col(triangle);
    return {{vertex[0], vertex[1], vertex[2]}, corners_of(topology.triangles, frame.position, triangle)};
}

/// Corner of the largest depth; ties go to the lowest vertex number.
std::size_t deepest_corner(const PlacedTriangle& triangle, const std::array<double, 3>& depth) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < 3; ++i) {
        if (depth[i] > depth[best] || (depth[i] == depth[best] && triangle.vertex[i] < triangle.vertex[best])) best = i;
    }
    return best;
}

std::size_t nearest_corner(const PlacedTriangle& triangle, const Vector3& point) {
    std::size_t best = 0;
    double best_distance = (triangle.corner[0] - point).squaredNorm();
    for (std::size_t i = 1; i < 3; ++i) {
        const double distance = (triangle.corner[i] - point).squaredNorm();
        if (distance < best_distance || (distance == best_distance && triangle.vertex[i] < triangle.vertex[best])) {
            best = i;
            best_distance = distance;
        }
    }
    return best;
}

/// Closest pair of corners; ties go to the lowest numbers, a's first.
void closest_corners(const PlacedTriangle& a, const PlacedTriangle& b, Contact& contact) {
    double best_distance = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const double distance = (a.corner[i] - b.corner[j]).squaredNorm();
            const bool lower =
                a.vertex[i] < contact.vertex_a || (a.vertex[i] == contact.vertex_a && b.vertex[j] < contact.vertex_b);
            if (distance < best_distance || (distance == best_distance && lower)) {
                best_distance = distance;
                contact.vertex_a = a.vertex[i];
                contact.vertex_b = b.vertex[j];
            }
        }
    }
}

Vector3 edge_vector(const PlacedTriangle& triangle, int edge) {
    return triangle.corner[static_cast<std::size_t>((edge + 1) % 3)] - triangle.corner[static_cast<std::size_t>(edge)];
}

}  // namespace

Contact derive_contact(const Topology& topology, const Frame& frame, TrianglePair pair) {
    Contact contact;
    contact.a = pair.a;
    contact.b = pair.b;
    const PlacedTriangle a = placed(topology, frame, pair.a);
    const PlacedTriangle b = placed(topology, frame, pair.b);
    const Crossing crossing = cross_triangles(a.corner, b.corner);
    if (crossing.kind == CrossingKind::degenerate) {
        contact.kind = ContactCase::degenerate;
        return contact;
    }
    if (crossing.kind == CrossingKind::coplanar) {
        contact.kind = ContactCase::coplanar;
        return contact;
    }
    if (crossing.kind == CrossingKind::none) {
        // The exact test finds an intersection that rounding hides: a touch.
        if (triangles_intersect(a.corner, b.corner)) contact.kind = ContactCase::touch;
        return contact;
    }
    contact.interval_length = crossing.length;
    contact.interval_direction = crossing.direction;
    switch (crossing.overlap_case) {
        case CrossingCase::first_enters_second: {
            contact.kind = ContactCase::a_enters_b;
            const std::size_t entering = deepest_corner(a, crossing.first_depth);
            contact.vertex_a = a.vertex[entering];
            contact.vertex_b = b.vertex[nearest_corner(b, a.corner[entering])];
            contact.point = a.corner[entering];
            contact.normal = -crossing.second_normal;
            contact.depth = std::max(crossing.first_depth[entering], 0.0);
            break;
        }
        case CrossingCase::second_enters_first: {
            contact.kind = ContactCase::b_enters_a;
            const std::size_t entering = deepest_corner(b, crossing.second_depth);
            contact.vertex_b = b.vertex[entering];
            contact.vertex_a = a.vertex[nearest_corner(a, b.corner[entering])];
            contact.point = b.corner[entering];
            contact.normal = crossing.first_normal;
            contact.depth = std::max(crossing.second_depth[entering], 0.0);
            break;
        }
        case CrossingCase::edges_cross: {
            contact.kind = ContactCase::edges_cross;
            closest_corners(a, b, contact);
            contact.point = 0.5 * (crossing.ends[0].point + crossing.ends[1].point);
            const CrossingEnd& end_of_a = crossing.ends[crossing.ends[0].triangle == 0 ? 0 : 1];
            const CrossingEnd& end_of_b = crossing.ends[crossing.ends[0].triangle == 0 ? 1 : 0];
            const Vector3 edge_a = edge_vector(a, end_of_a.edge);
            const Vector3 edge_b = edge_vector(b, end_of_b.edge);
            const Vector3 across = edge_a.cross(edge_b);
            const double norm = across.norm();
            contact.normal = crossing.direction;
            if (norm >= parallel_sine * edge_a.norm() * edge_b.norm()) {
                contact.normal = across / norm;
                if (contact.normal.dot(crossing.direction) < 0.0) contact.normal = -contact.normal;
            }
            contact.depth = crossing.length * contact.normal.dot(crossing.direction);
            break;
        }
        case CrossingCase::unset:
            break;
    }
    if (crossing.kind == CrossingKind::touch) contact.kind = ContactCase::touch;
    return contact;
}

void derive(const Topology& topology, const Frame& frame, ContactSet& contacts) {
    contacts.contacts.clear();
    for (const TrianglePair pair : contacts.pairs) contacts.contacts.push_back(derive_contact(topology, frame, pair));
}

}  // namespace trocar
