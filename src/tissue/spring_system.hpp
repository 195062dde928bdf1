// Linear system of a linearly implicit Euler step over h (Baraff and Witkin 1998, eq. 6) for the springs of thesis
// eq. 3.1: `A dv = b`, `A = M + h (C + D) + h² K`. C holds the dampers, D the drag and K the spring stiffness. All are
// linearised at the start of the step. K's transverse part (tension over length) is clamped at 0, so that A is always
// positive definite.
#pragma once

#include <cstdint>
#include <vector>

#include "tissue/spring_kernels.hpp"

namespace trocar {

class LaggedFactor;

/// Springs of the system: alpha u uᵀ + beta I between both ends, in the order of SpringArrays.
struct SpringSystem {
    std::vector<double> x, y, z;  ///< unit direction from i to j
    std::vector<double> alpha;    ///< kg, h (c + h k) - beta
    std::vector<double> beta;     ///< kg, h² tension / length, at least 0
    std::vector<double> inertia;  ///< kg, per vertex of the state: mass + h drag; 0 = fixed
    /// 12 per vertex: columns of the inverse of A's 3×3 diagonal block, each padded with 0
    std::vector<double> inverse;
    Matrix4X right_side;  ///< N s: h f - h² K v

    SpringSystem(std::size_t spring_count, std::size_t vertex_count);
};

/// Vectors of conjugate gradients, 4 × vertices.
struct GradientVectors {
    Matrix4X residual, preconditioned, direction, image;
};

struct SystemKernels {
    /// Linearises the springs at the state for a step of h (s), constant forces in the right side; `inverse` is
    /// unchanged.
    void (*linearise)(double h, const SpringArrays& springs, const TissueState& state, SpringSystem& system);
    /// Computes `inverse` for the current springs.
    void (*invert_blocks)(const SpringArrays& springs, SpringSystem& system);
    /// result = A · vector. Columns of fixed vertices must be 0 in `vector` and are 0 in `result`. Returns vector ·
    /// result.
    double (*multiply)(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& vector,
                       Matrix4X& result);
    /// Steps along the direction: updates solution, residual and preconditioned residual. Returns the product of the
    /// last two.
    double (*advance)(const SpringSystem& system, double step, Matrix4X& solution, GradientVectors& vectors);
    /// direction = preconditioned + ratio direction.
    void (*turn)(double ratio, GradientVectors& vectors);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, best first; all give the same bits.
const std::vector<SystemKernels>& system_kernels();

/// Preconditioned conjugate gradients. The preconditioner is the 3×3 diagonal blocks, or a factor once it is ready.
class ConjugateGradients {
public:
    explicit ConjugateGradients(std::size_t vertex_count);
    /// Sets the preconditioner; the factor must outlive its use. nullptr: the diagonal blocks.
    void precondition_by(LaggedFactor* factor) { factor_ = factor; }
    /// Solves until the residual in the norm of the preconditioner is below `tolerance` times that of the right side,
    /// or for `iterations`. Returns the number of iterations.
    int solve(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& right_side, double tolerance,
              int iterations, Matrix4X& solution);
    /// As solve, starting from `solution`, which must be finite, or from zero where that is no worse. The tolerance is
    /// relative to `size` where that exceeds the norm of the right side.
    int improve(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& right_side, double tolerance,
                int iterations, Matrix4X& solution, double size = 0.0);
    /// Reference norm of the last `improve`: the larger of its `size` and the right side's norm, approximate with a
    /// factor.
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
