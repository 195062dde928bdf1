// Contact laws of the thesis, chapter 3, one pure function per equation, tested against closed forms. Index 1 is the
// instrument (or the first body), 2 the other. The order of a triangle's corners gives its outer normal. Depth is
// positive inside (thesis §3.4; METHODS §1, §6).
#pragma once

#include <array>
#include <span>

#include "contact/response_output.hpp"
#include "geometry/triangle_distance.hpp"
#include "geometry/types.hpp"

namespace trocar::equations {

using trocar::point_at;

/// Unit outer normal; zero for a triangle without area.
Vector3 unit_normal(const Corners& triangle);

/// Distance of each corner of `corners` below the plane of `face`, m, positive inside.
std::array<double, 3> depths_below(const Corners& face, const Corners& corners);

/// Index of the deepest corner (lowest index on a tie). The thesis assumes one corner inside.
int deepest_corner(const std::array<double, 3>& depths);

/// Index of the corner nearest to a point (lowest index on a tie).
int nearest_corner(const Corners& triangle, const Vector3& point);

/// The closest corner pair of two triangles (lowest indices on a tie).
struct CornerPair {
    int first = 0;
    int second = 0;
    double distance = 0.0;  ///< m
};
CornerPair closest_corners(const Corners& first, const Corners& second);

/// Scalar of eq. 3.4, N: k d - mu v_n. v_n = (V_penetrator - V_face)·n is the separating speed along the outer normal n
/// of the pierced face. The force on the penetrator is this times n, on the face its opposite. No clamp: fast
/// separation pulls.
double vertex_in_face_force(double k, double depth, double mu, double separating_speed);

/// Eq. 3.4: force on A2, N, `depth` below face 1 with outer normal n. A1 gets the opposite.
Vector3 instrument_instrument_vertex(double k, double depth, double mu, const Vector3& velocity1,
                                     const Vector3& velocity2, const Vector3& normal1);

/// Eq. 3.5: force on A2, N. `direction`: unit, along the intersection line; triangle 2 separates along it. `length`: m,
/// overlap of the two intervals. A1 gets the opposite.
Vector3 edge_crossing(double k, double length, const Vector3& direction);

/// Eq. 3.6 with the damper's sign corrected: force on A1 of the instrument, N, from (V1 - V2)·n2. A2 gets the opposite.
Vector3 instrument_tissue_vertex_dissipative(double k, double depth, double mu, const Vector3& velocity1,
                                             const Vector3& velocity2, const Vector3& normal2);

/// Eq. 3.6 as printed, with (V2 - V1)·n2: the damper adds energy.
Vector3 instrument_tissue_vertex_literal(double k, double depth, double mu, const Vector3& velocity1,
                                         const Vector3& velocity2, const Vector3& normal2);

/// Eq. 3.9: k of eq. 3.5, the mean of the tissue triangle's three edge springs.
double mean_stiffness(std::span<const double> stiffness);

/// Contact position of eq. 3.7 f. and 3.10 f.: intersection of the path from `previous` to `current` with the closed
/// triangle.
struct PathHit {
    bool found = false;
    double fraction = 0.0;            ///< of the path, in [0, 1]
    Vector3 point = Vector3::Zero();  ///< m
};
PathHit path_hit(const Corners& triangle, const Vector3& previous, const Vector3& current);

/// Eq. 3.7: normal velocity of A2 relative to A1, m/s; negative when closing.
double relative_normal_velocity(const Vector3& velocity1, const Vector3& velocity2, const Vector3& normal);

/// Eq. 3.8 with restitution e: V2' = V2 - (1 + e) v_R n when v_R < 0 (strictly), else V2. e = 0 is the printed
/// equation, e = 1 the printed words ("the opposite direction").
Vector3 projected_velocity(const Vector3& velocity1, const Vector3& velocity2, const Vector3& normal,
                           double restitution);

/// One spring at a vertex, for the equilibrium of eq. 3.8's text.
struct NeighbourSpring {
    Vector3 neighbour = Vector3::Zero();           ///< m
    Vector3 neighbour_velocity = Vector3::Zero();  ///< m/s
    double rest = 0.0;                             ///< m
    double k = 0.0;                                ///< N/m
    double preload = 0.0;                          ///< N
    double damping = 0.0;                          ///< N s/m
};
/// Sum of springs and external load on a vertex, N. By the equilibrium of A2 this is also the force on A1; a response
/// keeps only its pressing part, see pressing_part.
Vector3 equilibrium_force(const Vector3& position, const Vector3& velocity, std::span<const NeighbourSpring> springs,
                          const Vector3& external);

/// min(0, force·n) n: the part of a vertex's force that presses on a tool with outer normal n.
Vector3 pressing_part(const Vector3& force, const Vector3& normal);

/// Eq. 3.10: normal velocity of a tissue vertex against a rigid face at rest, m/s.
double rigid_normal_velocity(const Vector3& velocity, const Vector3& normal);

/// Eq. 3.11 with restitution e, as projected_velocity with V1 = 0.
Vector3 rigid_projected_velocity(const Vector3& velocity, const Vector3& normal, double restitution);

/// Eq. 3.12-3.17 for two masses.
struct Exchange {
    Vector3 relative = Vector3::Zero();   ///< V_R, 3.12, m/s
    bool direction_defined = false;       ///< false only for V_R = 0 exactly
    Vector3 direction = Vector3::Zero();  ///< n_R, 3.13; scaled, so that tiny velocities do not underflow
    double speed1 = 0.0;                  ///< V_1R, 3.14, m/s
    double speed2 = 0.0;
    double speed1_after = 0.0;  ///< V'_1R, 3.16
    double speed2_after = 0.0;
    Vector3 velocity1_after = Vector3::Zero();  ///< 3.17
    Vector3 velocity2_after = Vector3::Zero();
};
/// Elastic exchange along V_R. It reverses the whole relative velocity, also of separating or sliding masses; equal
/// velocities do not change. 3.17 is evaluated as V1 + 2 m2/(m1 + m2) V_R, without cancellation. Masses > 0, kg.
Exchange tissue_tissue(double mass1, double mass2, const Vector3& velocity1, const Vector3& velocity2);

/// Thesis §4.3.1 (Volino 2000): distributes a force at P = Σ w_i x_i as f_i = w_i F, N. Resultant and moment are
/// preserved.
std::array<Vector3, 3> distribute_force(const Vector3& weights, const Vector3& force);

/// The same for a correction of P's position or velocity: dx_i = (w_i/m_i) / Σ(w_j²/m_j) dP, the least mass-weighted
/// change. Mass 0: immovable vertex.
std::array<Vector3, 3> distribute_correction(const Vector3& weights, const Vector3& masses, const Vector3& correction);

/// Resultant of forces at points as force and moment about `about`, N and N m (thesis §3.4.1, "resultant force on the
/// stylus").
Wrench resultant(std::span<const Vector3> points, std::span<const Vector3> forces, const Vector3& about);

}  // namespace trocar::equations
