// Validation of each stage's output, once per tick: a number that is not finite or a missing vertex ends the run with a
// named outcome.
#pragma once

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Checks contacts.contacts. not_finite: a contact with geometry has a point, normal, depth, gap, approach or weight
/// that is not finite. threw: a body, vertex or triangle does not exist, or a normal is not a unit vector. Fields that
/// a library or a degenerate pair leaves unset are valid. Never allocates when ok.
Outcome check_contacts(const Topology& topology, const ContactSet& contacts);

/// Checks contacts, position corrections and forces of a response output in the same way. threw also: weights that do
/// not sum to 1; a negative friction, limit or non-adhesive stiffness; a `solved` contact with a law or without solver.
Outcome check_output(const Topology& topology, const ResponseOutput& output);

}  // namespace trocar
