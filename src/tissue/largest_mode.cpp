#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "tissue/stability.hpp"

namespace trocar {

LargestMode largest_mode(const Materials& materials, const Matrix3X& position) {
    const Eigen::Index n = position.cols();
    Matrix3X scale = Matrix3X::Zero(3, n);  // 1/sqrt(m), 0 where fixed
    Eigen::Index unknowns = 0;
    for (Eigen::Index v = 0; v < n; ++v) {
        const auto i = static_cast<std::size_t>(v);
        if (!materials.is_free(static_cast<Index>(v))) continue;
        scale.col(v).setConstant(1.0 / std::sqrt(materials.mass[i]));
        unknowns += 3;
    }
    LargestMode result;
    result.shape = Matrix3X::Zero(3, n);
    if (unknowns == 0) return result;

    // Lanczos iteration with full reorthogonalisation. The irrational step makes the start vector orthogonal to no mode
    // of a regular mesh.
    Matrix3X start(3, n);
    for (Eigen::Index i = 0; i < start.size(); ++i) {
        start.data()[i] = std::sin(1.0 + 0.754877666 * static_cast<double>(i * i + i));
    }
    start = (scale.array() != 0.0).select(start, 0.0).matrix();
    start /= start.norm();

    constexpr Eigen::Index most_vectors = 600;
    const Eigen::Index limit = std::min(unknowns, most_vectors);
    Eigen::MatrixXd basis(3 * n, limit);
    std::vector<double> alpha;
    std::vector<double> beta;
    Eigen::VectorXd vector = start.reshaped();
    Matrix3X image(3, n);
    Eigen::VectorXd weights;
    double value = 0.0;
    for (Eigen::Index j = 0; j < limit; ++j) {
        basis.col(j) = vector;
        const Matrix3X displacement = scale.cwiseProduct(vector.reshaped(3, n));
        apply_stiffness(materials, position, displacement, image);
        Eigen::VectorXd next = scale.cwiseProduct(image).reshaped();
        alpha.push_back(vector.dot(next));
        for (int repeat = 0; repeat < 2; ++repeat) {
            next -= basis.leftCols(j + 1) * (basis.leftCols(j + 1).transpose() * next);
        }
        const double length = next.norm();
        const bool last = j + 1 == limit || length <= 1e-14 * std::abs(alpha.front());
        // The cost of this problem grows with the cube of the vectors, so large ones are tested less often.
        const Eigen::Index between = j < 128 ? 8 : 64;
        if (last || j % between == between - 1) {
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
            const Eigen::Map<const Eigen::VectorXd> diagonal(alpha.data(), j + 1);
            const Eigen::Map<const Eigen::VectorXd> sub(beta.data(), j);
            solver.computeFromTridiagonal(diagonal, sub, Eigen::ComputeEigenvectors);
            value = solver.eigenvalues()(j);
            weights = solver.eigenvectors().col(j);
            // The eigenvalue's error is about the square of this residual over the gap to the next one.
            if (last || length * std::abs(weights(j)) <= 1e-9 * std::abs(value)) break;
        }
        beta.push_back(length);
        vector = next / length;
    }
    result.omega = std::sqrt(std::max(value, 0.0));
    const Eigen::VectorXd mode = basis.leftCols(weights.size()) * weights;
    result.shape = scale.cwiseProduct(mode.reshaped(3, n));
    const double largest = result.shape.cwiseAbs().maxCoeff();
    if (largest > 0.0) result.shape /= largest;
    return result;
}

}  // namespace trocar
