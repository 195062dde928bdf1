#include "respond/equations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::equations {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

Vector3 unit_normal(const Corners& triangle) {
    const Vector3 n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    const double length = n.stableNorm();
    return length > 0.0 ? Vector3(n / length) : Vector3::Zero();
}

std::array<double, 3> depths_below(const Corners& face, const Corners& corners) {
    const Vector3 n = unit_normal(face);
    std::array<double, 3> depths{};
    for (std::size_t i = 0; i < 3; ++i) {
        // Relative to the nearest corner, which limits cancellation.
        depths[i] = -n.dot(corners[i] - face[at(nearest_corner(face, corners[i]))]);
    }
    return depths;
}

int deepest_corner(const std::array<double, 3>& depths) {
    return static_cast<int>(std::max_element(depths.begin(), depths.end()) - depths.begin());
}

int nearest_corner(const Corners& triangle, const Vector3& point) {
    int best = 0;
    for (int i = 1; i < 3; ++i) {
        if ((triangle[at(i)] - point).squaredNorm() < (triangle[at(best)] - point).squaredNorm()) best = i;
    }
    return best;
}

CornerPair closest_corners(const Corners& first, const Corners& second) {
    CornerPair best;
    double squared_distance = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const double here = (first[at(i)] - second[at(j)]).squaredNorm();
            if (here < squared_distance) {
                squared_distance = here;
                best = {i, j, 0.0};
            }
        }
    }
    best.distance = (first[at(best.first)] - second[at(best.second)]).norm();
    return best;
}

double vertex_in_face_force(double k, double depth, double mu, double separating_speed) {
    return k * depth - mu * separating_speed;
}

Vector3 instrument_instrument_vertex(double k, double depth, double mu, const Vector3& velocity1,
                                     const Vector3& velocity2, const Vector3& normal1) {
    return vertex_in_face_force(k, depth, mu, (velocity2 - velocity1).dot(normal1)) * normal1;
}

Vector3 edge_crossing(double k, double length, const Vector3& direction) { return k * length * direction; }

Vector3 instrument_tissue_vertex_dissipative(double k, double depth, double mu, const Vector3& velocity1,
                                             const Vector3& velocity2, const Vector3& normal2) {
    return vertex_in_face_force(k, depth, mu, (velocity1 - velocity2).dot(normal2)) * normal2;
}

Vector3 instrument_tissue_vertex_literal(double k, double depth, double mu, const Vector3& velocity1,
                                         const Vector3& velocity2, const Vector3& normal2) {
    return vertex_in_face_force(k, depth, mu, (velocity2 - velocity1).dot(normal2)) * normal2;
}

double mean_stiffness(std::span<const double> stiffness) {
    if (stiffness.empty()) return 0.0;
    double sum = 0.0;
    for (const double k : stiffness) sum += k;
    return sum / static_cast<double>(stiffness.size());
}

PathHit path_hit(const Corners& triangle, const Vector3& previous, const Vector3& current) {
    const Vector3 n = unit_normal(triangle);
    const double before = n.dot(previous - triangle[0]);
    const double after = n.dot(current - triangle[0]);
    // Both ends on one side, or a path inside the plane: no single contact position.
    if (before == after || (before > 0.0 && after > 0.0) || (before < 0.0 && after < 0.0)) return {};
    PathHit hit;
    hit.fraction = before / (before - after);
    hit.point = previous + hit.fraction * (current - previous);
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector3& a = triangle[i];
        const Vector3& b = triangle[(i + 1) % 3];
        if ((b - a).cross(hit.point - a).dot(n) < 0.0) return {};
    }
    hit.found = true;
    return hit;
}

double relative_normal_velocity(const Vector3& velocity1, const Vector3& velocity2, const Vector3& normal) {
    return velocity2.dot(normal) - velocity1.dot(normal);
}

Vector3 projected_velocity(const Vector3& velocity1, const Vector3& velocity2, const Vector3& normal,
                           double restitution) {
    const double v = relative_normal_velocity(velocity1, velocity2, normal);
    return v < 0.0 ? Vector3(velocity2 - (1.0 + restitution) * v * normal) : velocity2;
}

Vector3 equilibrium_force(const Vector3& position, const Vector3& velocity, std::span<const NeighbourSpring> springs,
                          const Vector3& external) {
    Vector3 sum = external;
    for (const NeighbourSpring& spring : springs) {
        const Vector3 d = spring.neighbour - position;
        const double length = d.norm();
        if (length == 0.0) continue;
        const Vector3 u = d / length;
        const double opening = (spring.neighbour_velocity - velocity).dot(u);
        sum += (spring.k * (length - spring.rest) + spring.preload + spring.damping * opening) * u;
    }
    return sum;
}

Vector3 pressing_part(const Vector3& force, const Vector3& normal) { return std::min(0.0, force.dot(normal)) * normal; }

double rigid_normal_velocity(const Vector3& velocity, const Vector3& normal) { return velocity.dot(normal); }

Vector3 rigid_projected_velocity(const Vector3& velocity, const Vector3& normal, double restitution) {
    return projected_velocity(Vector3::Zero(), velocity, normal, restitution);
}

Exchange tissue_tissue(double mass1, double mass2, const Vector3& velocity1, const Vector3& velocity2) {
    Exchange result;
    result.relative = velocity2 - velocity1;
    result.velocity1_after = velocity1;
    result.velocity2_after = velocity2;
    const double largest = result.relative.cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) return result;
    result.direction_defined = true;
    result.direction = result.relative / largest;
    result.direction /= result.direction.norm();
    const double sum = mass1 + mass2;
    result.speed1 = velocity1.dot(result.direction);
    result.speed2 = velocity2.dot(result.direction);
    result.speed1_after = ((mass1 - mass2) * result.speed1 + 2.0 * mass2 * result.speed2) / sum;
    result.speed2_after = ((mass2 - mass1) * result.speed2 + 2.0 * mass1 * result.speed1) / sum;
    result.velocity1_after = velocity1 + 2.0 * mass2 / sum * result.relative;
    result.velocity2_after = velocity2 - 2.0 * mass1 / sum * result.relative;
    return result;
}

std::array<Vector3, 3> distribute_force(const Vector3& weights, const Vector3& force) {
    return {weights[0] * force, weights[1] * force, weights[2] * force};
}

std::array<Vector3, 3> distribute_correction(const Vector3& weights, const Vector3& masses, const Vector3& correction) {
    Vector3 inverse = Vector3::Zero();
    for (int i = 0; i < 3; ++i) inverse[i] = masses[i] > 0.0 ? 1.0 / masses[i] : 0.0;
    const double sum = weights.cwiseAbs2().dot(inverse);
    std::array<Vector3, 3> result{Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
    if (sum == 0.0) return result;
    for (int i = 0; i < 3; ++i) result[at(i)] = weights[i] * inverse[i] / sum * correction;
    return result;
}

Wrench resultant(std::span<const Vector3> points, std::span<const Vector3> forces, const Vector3& about) {
    Wrench sum;
    for (std::size_t i = 0; i < points.size(); ++i) {
        sum.force += forces[i];
        // Subtracting the reference point first limits cancellation far from the origin.
        sum.moment += (points[i] - about).cross(forces[i]);
    }
    return sum;
}

}  // namespace trocar::equations
