// What one stage of a tick hands to the next, looked through once by the harness: a number that is none, or a vertex
// that does not exist, ends a run with a name instead of somewhere in the next stage's memory.
#pragma once

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Of contacts.contacts. not_finite: a contact with geometry has a point, normal, depth or gap that is no number;
/// threw: it names a body, vertex or triangle that there is not, or its normal is not a unit. What a library or a
/// degenerate pair leaves unset is no failure. Never allocates when ok.
Outcome check_contacts(const Topology& topology, const ContactSet& contacts);

/// The same of a response output: its contacts, position corrections and forces. threw, too: weights whose sum is not
/// 1; a stiffness, friction or limit below 0, with which a contact would pull through its normal.
Outcome check_output(const Topology& topology, const ResponseOutput& output);

}  // namespace trocar
