#include "reference/block_matrix.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
void BlockMatrix::prepare(Index nodes) {
    rows_.assign(at(nodes), {});
    for (Index n = 0; n < nodes; ++n) rows_[at(n)].push_back(n);
    dirty_ = true;
}

void BlockMatrix::reserve(Index a, Index b) {
    const Index column = std::min(a, b);
    const Index row = std::max(a, b);
    auto& list = rows_[at(column)];
    const auto found = std::lower_bound(list.begin(), list.end(), row);
    if (found != list.end() && *found == row) return;
    list.insert(found, row);
    dirty_ = true;
}

void BlockMatrix::clear() {
    if (dirty_) build();
    std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
}

void BlockMatrix::add(Index a, Index b, const Matrix3& block) {
    const Index column = std::min(a, b);
    const Index row = std::max(a, b);
    const auto& list = rows_[at(column)];
    const auto place = std::lower_bound(list.begin(), list.end(), row) - list.begin();
    for (int c = 0; c < 3; ++c) {
        double* const values = matrix_.valuePtr() + matrix_.outerIndexPtr()[3 * column + c] + 3 * place;
        for (int r = 0; r < 3; ++r) values[r] += a >= b ? block(r, c) : block(c, r);
    }
}

void BlockMatrix::add_last_row(Index node, const Vector3& row) {
    for (int c = 0; c < 3; ++c) matrix_.valuePtr()[matrix_.outerIndexPtr()[3 * node + c + 1] - 1] += row[c];
}

void BlockMatrix::add_last(double value) { matrix_.valuePtr()[matrix_.nonZeros() - 1] += value; }

bool BlockMatrix::solve(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution) {
    if (factors_ && solve_by_gradients(right_side, solution)) return true;
    if (!analyzed_) solver_.analyzePattern(matrix_);
    analyzed_ = true;
    solver_.factorize(matrix_);
    factors_ = solver_.info() == Eigen::Success && solver_.vectorD().minCoeff() > 0.0;
    if (!factors_) return false;
    solution = solver_.solve(right_side);
    return solution.allFinite();
}

bool BlockMatrix::solve_by_gradients(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution) {
    constexpr int most_gradients = 16;  // about the time of new factors
    constexpr double forcing = 1e-4;    // relative, in the norm of the factors' inverse
    solution.setZero(right_side.size());
    rest_ = right_side;
    conditioned_ = solver_.solve(rest_);
    along_ = conditioned_;
    double square = rest_.dot(conditioned_);
    const double enough = forcing * forcing * square;
    for (int i = 0; i < most_gradients; ++i) {
        image_.noalias() = matrix_.selfadjointView<Eigen::Lower>() * along_;
        const double curvature = along_.dot(image_);
        if (!(curvature > 0.0) || !std::isfinite(curvature)) return false;
        const double length = square / curvature;
        solution += length * along_;
        rest_ -= length * image_;
        conditioned_ = solver_.solve(rest_);
        const double next = rest_.dot(conditioned_);
        if (next <= enough) return solution.allFinite();
        along_ = conditioned_ + next / square * along_;
        square = next;
    }
    return false;
}

void BlockMatrix::build() {
    const auto nodes = static_cast<Index>(rows_.size());
    const Index size = 3 * nodes + 1;
    matrix_.resize(size, size);
    Eigen::VectorXi count(size);
    for (Index n = 0; n < nodes; ++n)
        count.segment<3>(3 * n).setConstant(static_cast<int>(3 * rows_[at(n)].size() + 1));
    count[size - 1] = 1;
    matrix_.reserve(count);
    for (Index n = 0; n < nodes; ++n) {
        for (int c = 0; c < 3; ++c) {
            for (const Index row : rows_[at(n)]) {
                for (int r = 0; r < 3; ++r) matrix_.insert(3 * row + r, 3 * n + c) = 0.0;
            }
            matrix_.insert(size - 1, 3 * n + c) = 0.0;
        }
    }
    matrix_.insert(size - 1, size - 1) = 0.0;
    matrix_.makeCompressed();
    dirty_ = false;
    analyzed_ = false;
}

}  // namespace trocar
