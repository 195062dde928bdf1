// Completes manually written contacts as contact generators do.
#pragma once

#include "contact/contact_set.hpp"
#include "contact_generation/pair_contacts.hpp"

namespace trocar::test {

inline void report_at_tick_start(const Topology& topology, const Frame& frame, ContactSet& contacts) {
    const TickStart start(topology, frame);
    for (Contact& contact : contacts.contacts) place_at_start(start, contact);
}

}  // namespace trocar::test
