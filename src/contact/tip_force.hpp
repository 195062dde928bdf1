// What a haptic device shows of the load on an instrument (METHODS §8): the tip force by plain sum or through the
// trocar, and the limiters between that force and the motor. Force health is measured before any limiter.
#pragma once

#include "geometry/types.hpp"

namespace trocar {

/// Force and moment about the world origin unless said otherwise.
struct Wrench {
    Vector3 force = Vector3::Zero();   ///< N
    Vector3 moment = Vector3::Zero();  ///< N m
};

/// The same load with its moment about another point, m.
Wrench moved_to(const Wrench& about_origin, const Vector3& point);

/// Force that a 3-DOF device shows at the tip of an instrument that turns about its trocar (METHODS §8):
/// (tau × r)/|r|² + (u·F) u with r = tip - pivot. `about_pivot` holds force and moment about the pivot. |r| is clamped
/// to at least 30 mm. Power-exact for pitch, yaw and insertion; the torque about the shaft is lost, see roll_torque.
Vector3 fulcrum_tip_force(const Wrench& about_pivot, const Vector3& pivot, const Vector3& tip);

/// Torque about the shaft from pivot to tip, N m: what a 3-DOF device cannot show. 0 when tip and pivot coincide.
double roll_torque(const Wrench& about_pivot, const Vector3& pivot, const Vector3& tip);

/// The device of a run: how it shows the load on an instrument, the same for every response. 0 = off.
struct TipSettings {
    bool fulcrum = true;      ///< through the trocar where the body has one, else the plain sum; false: always the sum
    double saturation = 8.5;  ///< N, largest force of the device (PHANToM 1.0)
    double rate_limit = 0.0;  ///< N/s, largest change
    double filter = 0.0;      ///< Hz, first-order low-pass
    double ramp = 0.0;        ///< s, in which the shown force rises from 0 after a time without force
};

/// From the tip force to the device force, tick by tick: ramp, filter, rate limit, saturation.
class TipDisplay {
public:
    /// `tip_force` in N, once per tick of `dt` s.
    Vector3 show(const Vector3& tip_force, const TipSettings& settings, double dt);
    /// True when the last force was cut to the device's largest.
    [[nodiscard]] bool saturated() const { return saturated_; }

private:
    Vector3 filtered_ = Vector3::Zero();
    Vector3 limited_ = Vector3::Zero();
    double in_contact_ = 0.0;  ///< s since the force left zero
    bool saturated_ = false;
};

}  // namespace trocar
