// Contacts as a baseline keeps them, for the tests of what keeps and of what compares.
#pragma once

#include "study/contact_baseline.hpp"

namespace trocar {

inline Contact contact_at(Index a, Index b, double depth) {
    Contact contact;
    contact.a = a;
    contact.b = b;
    contact.kind = ContactCase::a_enters_b;
    contact.point = {0.25, 0.25, -depth};
    contact.normal = {0.0, 0.0, 1.0};
    contact.depth = depth;
    return contact;
}

inline BaselineAnswer three_contacts() {
    return {.ticks = {{.tick = 0, .contacts = {contact_at(0, 5, 1e-3), contact_at(2, 5, 2e-3)}},
                      {.tick = 40, .contacts = {contact_at(0, 6, 3e-3)}}}};
}

}  // namespace trocar
