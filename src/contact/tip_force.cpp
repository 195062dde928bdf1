#include "contact/tip_force.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar {

Wrench moved_to(const Wrench& about_origin, const Vector3& point) {
    return {.force = about_origin.force, .moment = about_origin.moment - point.cross(about_origin.force)};
}

Vector3 fulcrum_tip_force(const Wrench& about_pivot, const Vector3& pivot, const Vector3& tip) {
    constexpr double shortest_lever = 0.03;
    const Vector3 lever = tip - pivot;
    const double length = lever.norm();
    if (length == 0.0) return about_pivot.force;
    const Vector3 shaft = lever / length;
    const Vector3 sideways = about_pivot.moment.cross(shaft) / std::max(length, shortest_lever);
    return sideways + shaft.dot(about_pivot.force) * shaft;
}

double roll_torque(const Wrench& about_pivot, const Vector3& pivot, const Vector3& tip) {
    const Vector3 lever = tip - pivot;
    const double length = lever.norm();
    return length == 0.0 ? 0.0 : lever.dot(about_pivot.moment) / length;
}

Vector3 TipDisplay::show(const Vector3& tip_force, const TipSettings& settings, double dt) {
    Vector3 force = tip_force;
    in_contact_ = force.isZero(0.0) ? 0.0 : in_contact_ + dt;
    if (settings.ramp > 0.0) force *= std::min(1.0, in_contact_ / settings.ramp);
    if (settings.filter > 0.0) {
        filtered_ += (1.0 - std::exp(-2.0 * std::numbers::pi * settings.filter * dt)) * (force - filtered_);
        force = filtered_;
    }
    if (settings.rate_limit > 0.0) {
        const Vector3 change = force - limited_;
        const double largest = settings.rate_limit * dt;
        force = change.norm() <= largest ? force : Vector3(limited_ + largest * change.normalized());
        limited_ = force;
    }
    saturated_ = settings.saturation > 0.0 && force.norm() > settings.saturation;
    return saturated_ ? Vector3(settings.saturation * force.normalized()) : force;
}

}  // namespace trocar
