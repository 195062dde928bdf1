// Contacts that a test writes by hand, completed as every source tells them.
#pragma once

#include "contact/contact_set.hpp"
#include "source/pair_contacts.hpp"

namespace trocar::test {

inline void tell_at_tick_start(const Topology& topology, const Frame& frame, ContactSet& contacts) {
    const TickStart start(topology, frame);
    for (Contact& contact : contacts.contacts) place_at_start(start, contact);
}

}  // namespace trocar::test
