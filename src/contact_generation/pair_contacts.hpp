// What `intersection` and `native` share: contacts that come with triangles, a point, a normal and a depth at the frame
// are reported at the start of the tick as well.
#pragma once

#include "contact/contact_set.hpp"
#include "contact_generation/tick_start.hpp"

namespace trocar {

/// Sets bodies, points, gap and approach of a contact whose triangles, normal, depth and point are known; leaves others
/// as they are. The points are the entering vertex, where there is one, and what is nearest on the other triangle.
void place_at_start(const TickStart& start, Contact& contact);

}  // namespace trocar
