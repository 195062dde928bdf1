// Parts of every response of ours: the class of a body pair, the gap of a contact as an ResponseOutput has it, and the
// line on which a contact's force and its reaction act.
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

/// The five classes of thesis §3.4; bodies are sorted by kind, so there are no swapped variants.
enum class CollisionClass : std::uint8_t {
    instrument_instrument,
    instrument_rigid,
    instrument_tissue,
    rigid_tissue,
    tissue_tissue,
    none
};
CollisionClass collision_class(BodyKind a, BodyKind b);

/// Corners of a triangle, m, world.
equations::Corners corners_of(const Topology& topology, const Matrix3X& position, Index triangle);

/// Stiffness between non-deformable bodies where nobody says otherwise, N/m (METHODS §12).
inline constexpr double rigid_stiffness = 1000.0;
/// ResponseEntry::without_tissue of responses that have springs alone where nothing has a mass.
inline constexpr const char* acts_as_penalty = "acts as penalty between bodies without tissue";

/// Translation that a hand gave a body in the last tick, m/s; zero for bodies that no hand leads.
Vector3 operator_velocity(const Frame& frame, double dt, Index body);
/// How fast scripts alone open the gap of a contact within the tick, m/s: of the velocities that it was written for
/// (vertices as in the frame, face_velocity), the part that is neither tissue's nor a hand's.
double scripted_rate(const Topology& topology, const Frame& frame, double dt, const ContactForceLaw& contact);
/// For a contact whose gap was measured at the frame, where scripts have made this tick's motion already: reports it at
/// the start of the tick, as ContactForceLaw wants it. It closes at the end of the tick where it was measured, not one
/// tick's motion beyond.
void report_at_start(const Topology& topology, const Frame& frame, double dt, ContactForceLaw& contact);

/// Makes `body` (-1: none) take the reaction of a contact whose points and gap are of the frame, on the line of action:
/// at the pushed point, the gap away from it along the normal.
void react_on_line(const Frame& frame, Index body, ContactForceLaw& contact);

/// A parameter that is a number, in [low, high] or one of `words`.
Parameter number_parameter(const std::string& name, const std::string& unit, const std::string& value, double low,
                           double high, const std::string& meaning, std::vector<std::string> words = {});
/// `k`, with what it is where neither method nor scene says anything.
Parameter stiffness_parameter(const std::string& default_meaning);

}  // namespace trocar
