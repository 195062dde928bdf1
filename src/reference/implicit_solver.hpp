// Implicit solver behind every stored reference, with hard contact or an elastic foundation. Its spring formulae and
// contact geometry share no code with the methods under test.
//
// Motion: BDF2 (second order; Curtiss & Hirschfelder 1952) on thesis eq. 3.1 with the scene's masses, springs, preload,
// bias, pins, damping and drag. Each step minimises one potential by Newton's method with line search; quasi-static
// steps omit inertia and damping. The strain limiter is not part of it: strain is reported instead.
//
// Hard contact: surfaces within `rest_gap` repel by the barrier -(g - d)² ln(d/g) on vertex-face and edge-edge
// distances d (Li et al. 2020, Incremental Potential Contact). No step lets surfaces intersect, so that sides never
// need to be decided. Forces act along closest points, never pull, and vanish beyond rest_gap. Complementarity holds up
// to that distance, which tends to 0 in the refinement.
//
// Equal k: an elastic foundation over the area of one of the two surfaces. It is the tissue's, both with half weight if
// both are tissue, else that of the first body. A point at depth d is pushed out along the shortest path with the
// pressure kappa d + eta d(d)/dt, never negative. This is the law of METHODS §5 (force kappa A_v d on a vertex) as an
// integral, independent of mesh and pair count. kappa = k / mean vertex area and eta = mu / mean vertex area, with the
// scene's k and mu. A vertex in contact thus carries k on average. Defaults are those of METHODS §12: 3e6 N/m³ on
// tissue, 1000 N/m otherwise; mu 2 N s/m.
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
    int foundation_points = 4;  ///< foundation: sample points along a triangle's edge; squared per triangle
    bool quasi_static = false;  ///< equilibrium at every step: no inertia, no damping
};

class ImplicitSolver {
public:
    /// Starts at rest in the scene's first frame. The scene outlives the solver.
    ImplicitSolver(const Scene& scene, const SolverSettings& settings);
    ~ImplicitSolver();
    ImplicitSolver(const ImplicitSolver&) = delete;
    ImplicitSolver& operator=(const ImplicitSolver&) = delete;
    ImplicitSolver(ImplicitSolver&&) = delete;
    ImplicitSolver& operator=(ImplicitSolver&&) = delete;

    /// One time step: scripted bodies follow their script to time() + time_step. Returns false if no solution was
    /// found; message() then holds the reason and the state is unchanged.
    bool step();

    [[nodiscard]] double time() const;                 ///< s
    [[nodiscard]] const Matrix3X& position() const;    ///< 3×N, m, world
    [[nodiscard]] Vector3 force_on(Index body) const;  ///< N, current sum of all contacts on the body
    /// Largest unbalanced force on a free vertex or operator in the last step, N.
    [[nodiscard]] double residual() const;
    /// Largest force of a single contact in the last step, N.
    [[nodiscard]] double largest_contact() const;
    /// m, smallest distance of candidate surface pairs, infinite without candidates. Foundation: minus the largest
    /// depth.
    [[nodiscard]] double smallest_gap() const;
    [[nodiscard]] double max_strain() const;
    [[nodiscard]] const std::string& message() const;
    [[nodiscard]] int iterations() const;  ///< Newton iterations in the last step
    /// Sum of the internal forces on pinned vertices, N: the load on the pins.
    [[nodiscard]] Vector3 pin_force() const;
    /// Contact force on every vertex, 3×N, N.
    [[nodiscard]] Matrix3X contact_forces() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
