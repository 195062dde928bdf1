// Advances a scene implicitly with contact that is either hard or an elastic foundation: the solver behind every stored
// reference. It has its own formulae for springs and its own geometry of contact, and shares none with any method.
//
// Motion: BDF2 (second order; Curtiss & Hirschfelder 1952) on thesis eq. 3.1 with the scene's masses, springs, preload,
// bias, pins, damping and drag, each step found as the minimum of one potential by Newton's method with line search; or
// equilibrium without inertia and damping. The strain limiter is not part of it: strain is reported instead.
//
// Hard contact: surfaces repel within `rest_gap` of each other (barrier -(g - d)² ln(d/g) on every vertex-face and
// edge-edge distance d; Li et al. 2020, Incremental Potential Contact) and no step lets them meet, so that sides never
// need to be decided. Forces act along closest points, never pull, and vanish beyond rest_gap: complementarity holds up
// to that distance, which tends to 0 in the refinement.
//
// Equal k: an elastic foundation over the area of one of the two surfaces (of tissue if there is tissue, of both with
// half weight if both are tissue, else of the first body). A point of it that is d deep in the other body is pushed out
// along the shortest way with the pressure kappa d + eta d(d)/dt, never negative: the law of METHODS §5 (force kappa
// A_v d on a vertex) as an integral, so that it depends on no mesh and no count of pairs. kappa = k / mean vertex area
// and eta = mu / mean vertex area with the scene's k and mu: on average every vertex in contact carries k. A scene that
// gives no k gets METHODS §12: 3e6 N/m³ on tissue, 1000 N/m otherwise; mu 2 N s/m.
#pragma once

#include <Eigen/Sparse>
#include <memory>
#include <string>
#include <vector>

#include "reference/closest_points.hpp"
#include "scene/scene.hpp"

namespace trocar {

enum class ReferenceLaw : std::uint8_t { hard, foundation };

struct SolverSettings {
    ReferenceLaw law = ReferenceLaw::hard;
    double time_step = 0.002;   ///< s
    double rest_gap = 2e-5;     ///< m, hard: distance below which surfaces repel
    int foundation_points = 4;  ///< foundation: sample points along a triangle's edge, their square on a triangle
    bool quasi_static = false;  ///< equilibrium at every step: no inertia, no damping
};

class ImplicitSolver {
public:
    /// The scene outlives the solver. Starts at rest in the scene's first frame.
    ImplicitSolver(const Scene& scene, const SolverSettings& settings);
    ~ImplicitSolver();
    ImplicitSolver(const ImplicitSolver&) = delete;
    ImplicitSolver& operator=(const ImplicitSolver&) = delete;
    ImplicitSolver(ImplicitSolver&&) = delete;
    ImplicitSolver& operator=(ImplicitSolver&&) = delete;

    /// One time step: scripted bodies follow their script to time() + time_step. False when no solution was found;
    /// message() says why, and the state is that before the step.
    bool step();

    [[nodiscard]] double time() const;                 ///< s
    [[nodiscard]] const Matrix3X& position() const;    ///< 3×N, m, world
    [[nodiscard]] Vector3 force_on(Index body) const;  ///< N, of all contacts on the body, now
    /// Largest unbalanced force on a free vertex or operator in the last step, N.
    [[nodiscard]] double residual() const;
    /// Largest force of a single contact in the last step, N.
    [[nodiscard]] double largest_contact() const;
    /// Smallest distance between surfaces that may touch, if any is within the query distance, else infinity;
    /// foundation: minus the largest depth, m.
    [[nodiscard]] double smallest_gap() const;
    [[nodiscard]] double max_strain() const;
    [[nodiscard]] const std::string& message() const;
    [[nodiscard]] int iterations() const;  ///< of Newton's method in the last step
    /// Sum of the internal forces on pinned vertices, N: what the pins must hold.
    [[nodiscard]] Vector3 pin_force() const;
    /// Contact force on every vertex, 3×N, N.
    [[nodiscard]] Matrix3X contact_forces() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
