// Contacts made of features: what `proximity` and `tracked_proximity` hand over for a vertex and a face, or for two
// edges.
#pragma once

#include "contact/contact_set.hpp"
#include "contact_generation/feature_search.hpp"
#include "contact_generation/tick_start.hpp"

namespace trocar {

/// m; nearer than this the way between two features has no direction.
inline constexpr double no_path = 1e-9;

/// A vertex and the point of a face; `normal`: unit, from the face to where the vertex belongs; `gap` along it, m.
Contact point_face_contact(const TickStart& start, const PointFace& one, const Vector3& normal, double gap);

/// Two edges, apart or `crossed`: then the normal leads back and the gap is negative.
Contact edge_edge_contact(const TickStart& start, const FeatureMesh& mesh, const EdgeEdge& one, bool crossed);

/// Which way a surface faces where bodies belong: its front, or its back where the scene says so of an open one.
double home_side(const BodyRange& body);

/// Sets approach, point and depth from body_a, body_b, on_a, on_b, normal and gap.
void finish_contact(const TickStart& start, Contact& contact);

}  // namespace trocar
