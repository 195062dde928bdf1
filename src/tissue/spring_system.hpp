// The linear system of a linearly implicit Euler step over h (Baraff and Witkin 1998, eq. 6) for the springs of thesis
// eq. 3.1: A dv = b with A = M + h (C + D) + h² K, C the dampers, D the drag and K the springs' stiffness at the start
// of the step. Where a spring is shorter than its tension bears, what it does across itself is left out of K, so that A
// is positive definite at any place.
#pragma once

#include <cstdint>
#include <vector>

#include "tissue/spring_kernels.hpp"

namespace trocar {

class LaggedFactor;

/// Springs as the system has them: alpha u uᵀ + beta I between the two ends. In the order of SpringArrays.
struct SpringSystem {
    std::vector<double> x, y, z;  ///< unit direction from i to j
    std::vector<double> alpha;    ///< kg, h (c + h k) - beta
    std::vector<double> beta;     ///< kg, h² tension / length, at least 0
    std::vector<double> inertia;  ///< kg, per vertex of the state: mass + h drag; 0 = does not move
    std::vector<double> inverse;  ///< 12 per vertex: columns of the inverse of A's 3×3 block, each with a fourth 0
    Matrix4X right_side;          ///< N s: h f - h² K v

    SpringSystem(std::size_t spring_count, std::size_t vertex_count);
};

/// The vectors of conjugate gradients, 4 × vertices.
struct GradientVectors {
    Matrix4X residual, preconditioned, direction, image;
};

struct SystemKernels {
    /// Linearises the springs at the state for a step of h (s), constant forces in the right side; `inverse` is left.
    void (*linearise)(double h, const SpringArrays& springs, const TissueState& state, SpringSystem& system);
    /// Finds `inverse` for the springs as they are.
    void (*invert_blocks)(const SpringArrays& springs, SpringSystem& system);
    /// result = A · vector; columns of what does not move have to be 0 in `vector` and are 0 in `result`. Gives
    /// vector · result.
    double (*multiply)(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& vector,
                       Matrix4X& result);
    /// A step along the direction: the solution, the residual after it and that preconditioned. Gives their product.
    double (*advance)(const SpringSystem& system, double step, Matrix4X& solution, GradientVectors& vectors);
    /// direction = preconditioned + ratio direction.
    void (*turn)(double ratio, GradientVectors& vectors);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, the best one first; all give the same bits.
const std::vector<SystemKernels>& system_kernels();

/// Preconditioned conjugate gradients with the 3×3 blocks as preconditioner, or a factor in their place once it is
/// ready.
class ConjugateGradients {
public:
    explicit ConjugateGradients(std::size_t vertex_count);
    /// From now on; the factor outlives its use. nullptr: the blocks.
    void precondition_by(LaggedFactor* factor) { factor_ = factor; }
    /// Solves until the residual, measured by the preconditioner, is below `tolerance` times that of the right side,
    /// for at most `iterations`. Gives how many it took.
    int solve(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& right_side, double tolerance,
              int iterations, Matrix4X& solution);
    /// The same from `solution` as it is, which has to be finite; from nothing where that is no better. The residual is
    /// held against `size`, where that is more than the right side's own.
    int improve(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& right_side, double tolerance,
                int iterations, Matrix4X& solution, double size = 0.0);
    /// How large the last right side was, measured by the preconditioner (where that is a factor, nearly so): the
    /// larger of it and what it was held against.
    [[nodiscard]] double size() const { return size_; }

private:
    double start_from_nothing(const SpringSystem& system, const Matrix4X& right_side, Matrix4X& solution);
    [[nodiscard]] bool has_factor() const;
    double multiply(const SpringArrays& springs, const SpringSystem& system);
    double advance(const SpringSystem& system, double step, Matrix4X& solution);
    int iterate(const SpringArrays& springs, const SpringSystem& system, double rho, double small, int iterations,
                Matrix4X& solution);

    const SystemKernels* kernels_;
    LaggedFactor* factor_ = nullptr;
    GradientVectors vectors_;
    double size_ = 0.0;
};

}  // namespace trocar
