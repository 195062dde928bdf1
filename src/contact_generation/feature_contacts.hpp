// Contacts of features, vertex–face and edge–edge, for `proximity` and `tracked_proximity`.
#pragma once

#include "contact/contact_set.hpp"
#include "contact_generation/feature_search.hpp"
#include "contact_generation/tick_start.hpp"

namespace trocar {

/// m; below this distance the direction between two features is undefined.
inline constexpr double no_path = 1e-9;

/// Vertex–face contact. `normal`: unit, from the face to the vertex's allowed side; `gap`: m, along it.
Contact point_face_contact(const TickStart& start, const PointFace& one, const Vector3& normal, double gap);

/// Edge–edge contact. If `crossed`, the normal is reversed and the gap negative.
Contact edge_edge_contact(const TickStart& start, const FeatureMesh& mesh, const EdgeEdge& one, bool crossed);

/// 1 if bodies belong in front of the surface; -1 for an open surface whose declared side is the back.
double home_side(const BodyRange& body);

/// Sets approach, point and depth from body_a, body_b, on_a, on_b, normal and gap.
void finish_contact(const TickStart& start, Contact& contact);

}  // namespace trocar
