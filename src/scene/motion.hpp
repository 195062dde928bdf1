// Motion of a body: key poses over time, followed exactly or by a simulated operator.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

struct MotionKey {
    double time = 0.0;                           ///< s
    Vector3 translation = Vector3::Zero();       ///< m
    Vector3 rotation_degrees = Vector3::Zero();  ///< rotation vector, degrees, about the body origin
    double jaw = 1.0;                            ///< [0, 1], 0 closed
};

enum class Drive : std::uint8_t { prescribed, simulated_operator };

/// Simulated operator (METHODS §11): mass, damping and a virtual coupling to the target pose, displaced by contact.
struct OperatorModel {
    double mass = 0.1;                  ///< kg
    double damping = 1.0;               ///< N s/m
    double coupling_stiffness = 300.0;  ///< N/m
    double coupling_damping = 3.0;      ///< N s/m
};

struct Motion {
    Drive drive = Drive::prescribed;
    std::vector<MotionKey> keys;  ///< ascending time, at least one
    OperatorModel coupling;

    /// Pose at `time` (s): position and jaw linear, rotation on the shortest arc; constant before the first and after
    /// the last key.
    [[nodiscard]] Pose pose_at(double time) const;
    [[nodiscard]] double last_key_time() const { return keys.empty() ? 0.0 : keys.back().time; }
};

}  // namespace trocar
