// The simulated operator that leads an instrument: a mass with damping and a hand spring towards the scripted target,
// pushed back by contact (METHODS §11). Translation only; rotation and jaw follow the script.
#pragma once

#include <span>

#include "contact/effect.hpp"
#include "contact/outcome.hpp"
#include "scene/motion.hpp"

namespace trocar {

struct OperatorState {
    Vector3 position = Vector3::Zero();  ///< m, of the body origin, world
    Vector3 velocity = Vector3::Zero();  ///< m/s
};

/// Advances one instrument body over dt in `substeps` semi-implicit steps. Contacts whose pushed vertices belong to the
/// body act implicitly on it; `external` is a constant force (reactions from tissue, wrenches). Returns the mean
/// contact force on the body over the tick, N.
Vector3 advance_operator(const OperatorModel& model, const Vector3& target, const Vector3& target_velocity,
                         std::span<const LinearContact> contacts, const Vector3& external, double dt, int substeps,
                         OperatorState& state);

}  // namespace trocar
