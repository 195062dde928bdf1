// Stiffness matrix of the reference solver and its linear solves: sparse, symmetric, of 3×3 blocks and one last scalar
// row. The sparsity pattern persists between steps.
#pragma once

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

class BlockMatrix {
public:
    /// Resets to `nodes` nodes without couplings.
    void prepare(Index nodes);
    /// Adds the block of two nodes to the sparsity pattern.
    void reserve(Index a, Index b);
    /// Sets all entries to zero.
    void clear();
    /// Adds `block` at (a, b). Only the lower triangle is kept, so call it once for two different nodes.
    void add(Index a, Index b, const Matrix3& block);
    /// Add to the coupling of a node with the last row, and to the last diagonal entry.
    void add_last_row(Index node, const Vector3& row);
    void add_last(double value);
    /// Solves; false if the matrix is not positive definite. Conjugate gradients preconditioned with the last factors
    /// run first; new factors are computed where these no longer fit.
    bool solve(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution);

private:
    bool solve_by_gradients(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution);
    void build();

    std::vector<std::vector<Index>> rows_;  ///< per node: coupled nodes >= it, ascending
    Eigen::SparseMatrix<double> matrix_;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
    Eigen::VectorXd rest_, conditioned_, along_, image_;
    bool dirty_ = true;
    bool analyzed_ = false;
    bool factors_ = false;  ///< solver_ holds factors of an earlier matrix
};

}  // namespace trocar
