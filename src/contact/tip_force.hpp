// Force that a haptic device displays for the load on an instrument (METHODS §8): plain sum, or through the trocar;
// then limiters. Force quality is measured before the limiters.
#pragma once

#include "geometry/types.hpp"

namespace trocar {

/// Force and moment about the world origin unless said otherwise.
struct Wrench {
    Vector3 force = Vector3::Zero();   ///< N
    Vector3 moment = Vector3::Zero();  ///< N m
};

/// The same wrench with its moment about `point` (m).
Wrench moved_to(const Wrench& about_origin, const Vector3& point);

/// Force on a 3-DOF device at the tip of an instrument that pivots about its trocar (METHODS §8). It is (tau × r)/|r|²
/// + (u·F) u, with r = tip - pivot, u = r/|r|, and |r| clamped to at least 30 mm. `about_pivot`: force and moment about
/// the pivot. Power is exact for pitch, yaw and insertion; roll_torque gives the part that is lost.
Vector3 fulcrum_tip_force(const Wrench& about_pivot, const Vector3& pivot, const Vector3& tip);

/// Torque about the shaft from pivot to tip, N m, which a 3-DOF device cannot display. 0 when tip and pivot coincide.
double roll_torque(const Wrench& about_pivot, const Vector3& pivot, const Vector3& tip);

/// Device settings of a run, the same for every response. 0 = off.
struct TipSettings {
    bool fulcrum = true;  ///< true: through the trocar if the body has one, else the plain sum; false: always the sum
    double saturation = 8.5;  ///< N, largest force of the device (PHANToM 1.0)
    double rate_limit = 0.0;  ///< N/s, largest change
    double filter = 0.0;      ///< Hz, first-order low-pass
    double ramp = 0.0;        ///< s, rise time of the displayed force after contact begins
};

/// Filters the tip force to the device force, tick by tick: ramp, low-pass, rate limit, saturation.
class TipDisplay {
public:
    /// `tip_force` in N. Call once per tick of `dt` s.
    Vector3 show(const Vector3& tip_force, const TipSettings& settings, double dt);
    /// True when the last force was clamped to `saturation`.
    [[nodiscard]] bool saturated() const { return saturated_; }

private:
    Vector3 filtered_ = Vector3::Zero();
    Vector3 limited_ = Vector3::Zero();
    double in_contact_ = 0.0;  ///< s since the force became nonzero
    bool saturated_ = false;
};

}  // namespace trocar
