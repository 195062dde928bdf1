#include "scene/rotation.hpp"

#include <cmath>
#include <numbers>

namespace trocar {
namespace {

/// Taylor series for |x| <= pi/4: the first term left out is below 2^-56 of the sum.
double sine_series(double x) {
    const double y = x * x;
    double sum = 1.0;
    for (int n = 18; n > 0; n -= 2) sum = 1.0 - y / (n * (n + 1.0)) * sum;
    return x * sum;
}

double cosine_series(double x) {
    const double y = x * x;
    double sum = 1.0;
    for (int n = 17; n > 0; n -= 2) sum = 1.0 - y / (n * (n + 1.0)) * sum;
    return sum;
}

/// For 0 <= x <= pi/2.
SineCosine sine_cosine_of_quarter(double x) {
    if (x <= std::numbers::pi / 4.0) return {sine_series(x), cosine_series(x)};
    const double rest = std::numbers::pi / 2.0 - x;
    return {cosine_series(rest), sine_series(rest)};
}

/// Angle in [0, pi/2] of a point with sine, cosine >= 0 on the unit circle, by Newton steps on sin(angle - x) = 0; each
/// step cubes the error.
double angle_of_quarter(double sine, double cosine) {
    double x = std::numbers::pi / 2.0 * sine / (sine + cosine);
    for (int step = 0; step < 4; ++step) {
        const SineCosine at = sine_cosine_of_quarter(std::fmin(std::fmax(x, 0.0), std::numbers::pi / 2.0));
        x += sine * at.cosine - cosine * at.sine;
    }
    return std::fmin(std::fmax(x, 0.0), std::numbers::pi / 2.0);
}

double length(double x, double y, double z) {
    const double largest = std::fmax(std::fabs(x), std::fmax(std::fabs(y), std::fabs(z)));
    if (largest == 0.0) return 0.0;
    x /= largest;
    y /= largest;
    z /= largest;
    return largest * std::sqrt(x * x + y * y + z * z);
}

}  // namespace

SineCosine sine_cosine_of_degrees(double degrees) {
    const double turned = std::remainder(degrees, 360.0);  // exact, in [-180, 180]
    const double quarters = std::nearbyint(turned / 90.0);
    const double x = (turned - 90.0 * quarters) * (std::numbers::pi / 180.0);
    const double sine = sine_series(x);
    const double cosine = cosine_series(x);
    switch (static_cast<int>(quarters)) {
        case 1:
            return {cosine, -sine};
        case -1:
            return {-cosine, sine};
        case 2:
        case -2:
            return {-sine, -cosine};
        default:
            return {sine, cosine};
    }
}

Quaternion rotation_from_degrees(const Vector3& vector) {
    const double angle = length(vector.x(), vector.y(), vector.z());
    if (angle == 0.0) return Quaternion::Identity();
    const SineCosine half = sine_cosine_of_degrees(0.5 * angle);
    return {half.cosine, half.sine * (vector.x() / angle), half.sine * (vector.y() / angle),
            half.sine * (vector.z() / angle)};
}

Quaternion shortest_arc(const Quaternion& from, const Quaternion& to, double u) {
    if (u <= 0.0) return from;
    if (u >= 1.0) return to;
    Quaternion turn = from.conjugate() * to;
    if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
    const double sine = length(turn.x(), turn.y(), turn.z());
    if (sine == 0.0) return from;
    const SineCosine part = sine_cosine_of_quarter(u * angle_of_quarter(sine, turn.w()));
    const double scale = part.sine / sine;
    return from * Quaternion(part.cosine, scale * turn.x(), scale * turn.y(), scale * turn.z());
}

}  // namespace trocar
