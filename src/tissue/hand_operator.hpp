// The simulated operator that leads an instrument: a mass with damping and a hand spring towards the scripted target,
// pushed back by contact (METHODS §11). Translation only; rotation and jaw follow the script.
#pragma once

#include <span>

#include "contact/effect.hpp"
#include "scene/motion.hpp"
#include "scene/world.hpp"

namespace trocar {

struct OperatorState {
    Vector3 position = Vector3::Zero();  ///< m, of the body origin, world
    Vector3 velocity = Vector3::Zero();  ///< m/s
};

/// Advances one instrument (the bodies that share its pose) over dt in `substeps` semi-implicit steps: hand spring and
/// damping explicit, contacts implicit. Contacts of the effect act when they push vertices of these bodies, or react on
/// one of these bodies without moving tissue; contacts with tissue come as `external` (the reaction that
/// MassSpring::advance returned, plus the effect's own wrenches), constant over the tick. `frame` gives the vertex
/// velocities for which gaps and face velocities were written. Returns the mean load of contacts and `external` on the
/// instrument over the tick, moments about the world origin.
Wrench advance_operator(const OperatorModel& model, const Topology& topology, const Frame& frame,
                        std::span<const Index> bodies, const Vector3& target, const Vector3& target_velocity,
                        const Effect& effect, const Wrench& external, double dt, int substeps, OperatorState& state);

}  // namespace trocar
