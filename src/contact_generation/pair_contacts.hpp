// Common to `intersection` and `native`: converts contacts of the frame to the start of the tick.
#pragma once

#include "contact/contact_set.hpp"
#include "contact_generation/tick_start.hpp"

namespace trocar {

/// Sets the bodies of a contact with triangles. If point, normal and depth are finite, also sets on_a, on_b, gap and
/// approach. on_a and on_b are the entering vertex, or the triangle's point nearest to the contact.
void place_at_start(const TickStart& start, Contact& contact);

}  // namespace trocar
