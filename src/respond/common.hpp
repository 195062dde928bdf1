// Utilities of the responses: class of a body pair, gap at the start of the tick, line of action of a contact.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "contact/contact.hpp"
#include "contact/response_output.hpp"
#include "geometry/types.hpp"
#include "method/entry.hpp"
#include "respond/equations.hpp"
#include "scene/vertex_springs.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Classes of thesis §3.4. Bodies are sorted by kind, so there are no swapped variants.
enum class CollisionClass : std::uint8_t {
    instrument_instrument,
    instrument_rigid,
    instrument_tissue,
    rigid_tissue,
    tissue_tissue,
    none
};
CollisionClass collision_class(BodyKind a, BodyKind b);

/// N/m, default stiffness between non-deformable bodies (METHODS §12).
inline constexpr double rigid_stiffness = 1000.0;
/// ResponseEntry::without_tissue of responses that use penalty springs between bodies without mass.
inline constexpr const char* acts_as_penalty = "acts as penalty between bodies without tissue";

/// m/s, rate at which scripted motion alone opens the gap of a contact. It is the rate by the frame's velocities and
/// face_velocity, without the parts of tissue and operators.
double scripted_rate(const Topology& topology, const Frame& frame, double dt, const ContactForceLaw& contact);
/// Converts a gap measured at the frame, after this tick's scripted motion, to the start of the tick (ContactForceLaw).
/// Otherwise that motion would count twice.
void report_at_start(const Topology& topology, const Frame& frame, double dt, ContactForceLaw& contact);

/// Lets `body` (-1: none) take the reaction of a contact whose points and gap are of the frame. It acts on the line of
/// action, at the pushed point minus gap × normal.
void react_on_line(const Frame& frame, Index body, ContactForceLaw& contact);

/// Parameter `k`. `auto_meaning`: the value of `auto`.
Parameter stiffness_parameter(const std::string& auto_meaning);
/// Value of `k=auto` of springs that are as soft as the tissue.
inline constexpr const char* auto_stiffness =
    "the scene's, else 1000 between instruments and rigid bodies, on tissue the mean of the springs there";

}  // namespace trocar
