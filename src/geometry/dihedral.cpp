#include "geometry/dihedral.hpp"

#include <cmath>
#include <numbers>

namespace trocar {
namespace {

/// One triangle over the edge e: its height as the vector that the far corner's gradient points against, and where
/// along the edge the height stands.
struct HingeSide {
    Vector3 inverse_height;  ///< 1/m, along the normal: normal / height
    double foot = 0.0;       ///< 0 at the start of the edge, 1 at its end
};

/// `normal` is e × far or its opposite, `far` the far corner seen from the start of the edge.
HingeSide side_of(const Vector3& e, const Vector3& far, const Vector3& normal) {
    return {.inverse_height = e.norm() / normal.squaredNorm() * normal, .foot = far.dot(e) / e.squaredNorm()};
}

/// Change of a HingeSide when its vectors change by the d_….
HingeSide change_of(const HingeSide& side, const Vector3& e, const Vector3& d_e, const Vector3& far,
                    const Vector3& d_far, const Vector3& normal, const Vector3& d_normal) {
    const double length = e.norm();
    const double square = normal.squaredNorm();
    return {.inverse_height = (e.dot(d_e) / (length * square)) * normal + length / square * d_normal -
                              2.0 * normal.dot(d_normal) / square * side.inverse_height,
            .foot = (d_far.dot(e) + far.dot(d_e) - 2.0 * side.foot * e.dot(d_e)) / e.squaredNorm()};
}

/// The far corners turn the angle against the normals; the ends of the edge share the opposite by the feet.
std::array<Vector3, 4> gradient_of(const HingeSide& first, const HingeSide& second) {
    return {(1.0 - first.foot) * first.inverse_height + (1.0 - second.foot) * second.inverse_height,
            first.foot * first.inverse_height + second.foot * second.inverse_height, -first.inverse_height,
            -second.inverse_height};
}

struct Vectors {
    Vector3 e, far_first, far_second, normal_first, normal_second;
};

Vectors vectors_of(const std::array<Vector3, 4>& corner) {
    Vectors v;
    v.e = corner[1] - corner[0];
    v.far_first = corner[2] - corner[0];
    v.far_second = corner[3] - corner[0];
    v.normal_first = v.e.cross(v.far_first);
    v.normal_second = v.far_second.cross(v.e);
    return v;
}

bool has_angle(const Vectors& v) { return v.normal_first.squaredNorm() > 0.0 && v.normal_second.squaredNorm() > 0.0; }

/// tan(φ/2) from tan φ, 0 ≤ φ ≤ π/2.
double halved(double tangent) { return tangent / (1.0 + std::sqrt(1.0 + tangent * tangent)); }

}  // namespace

double angle_of(double y, double x) {
    const double r = std::sqrt(x * x + y * y);
    // Half the angle to the nearer half of the x axis, then a quarter and an eighth of it.
    const double v = halved(halved(std::abs(y) / (r + std::abs(x))));
    const double z = v * v;
    double sum = arctangent_series.back();
    for (std::size_t k = arctangent_series.size() - 1; k-- > 0;) sum = sum * z + arctangent_series[k];
    double angle = 8.0 * v * sum;
    if (x < 0.0) angle = std::numbers::pi - angle;
    return y < 0.0 ? -angle : angle;
}

Dihedral dihedral(const HingeCorners& corner) {
    Dihedral result;
    result.gradient.fill(Vector3::Zero());
    const Vectors v = vectors_of(corner);
    if (!has_angle(v)) return result;
    result.has_angle = true;
    // The normals' cross product lies along the edge: (e × a) × (b × e) = −e (e × a)·b.
    result.angle = angle_of(-v.e.norm() * v.normal_first.dot(v.far_second), v.normal_first.dot(v.normal_second));
    result.gradient =
        gradient_of(side_of(v.e, v.far_first, v.normal_first), side_of(v.e, v.far_second, v.normal_second));
    return result;
}

std::array<Vector3, 4> gradient_change(const HingeCorners& corner, const std::array<Vector3, 4>& displacement) {
    std::array<Vector3, 4> result;
    result.fill(Vector3::Zero());
    const Vectors v = vectors_of(corner);
    if (!has_angle(v)) return result;
    const Vectors d = vectors_of(displacement);
    const Vector3 d_normal_first = d.e.cross(v.far_first) + v.e.cross(d.far_first);
    const Vector3 d_normal_second = d.far_second.cross(v.e) + v.far_second.cross(d.e);
    const HingeSide first = side_of(v.e, v.far_first, v.normal_first);
    const HingeSide second = side_of(v.e, v.far_second, v.normal_second);
    const HingeSide d_first = change_of(first, v.e, d.e, v.far_first, d.far_first, v.normal_first, d_normal_first);
    const HingeSide d_second =
        change_of(second, v.e, d.e, v.far_second, d.far_second, v.normal_second, d_normal_second);
    // gradient_of is a product of feet and heights: the ends of the edge get both changes.
    result = gradient_of({d_first.inverse_height, first.foot}, {d_second.inverse_height, second.foot});
    const Vector3 feet = d_first.foot * first.inverse_height + d_second.foot * second.inverse_height;
    result[0] -= feet;
    result[1] += feet;
    return result;
}

}  // namespace trocar
