// The stiffness matrix of the reference solver: sparse, symmetric, of 3×3 blocks and one last scalar row, and how its
// linear systems are solved. Its pattern is kept from step to step.
#pragma once

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

class BlockMatrix {
public:
    /// n nodes without couplings.
    void prepare(Index nodes);
    /// Makes room for the block of two nodes.
    void reserve(Index a, Index b);
    /// Sets all entries to zero.
    void clear();
    /// Adds `block` at (a, b); only the lower triangle is kept, so of two different nodes it is called once.
    void add(Index a, Index b, const Matrix3& block);
    /// Adds to the coupling of a node with the last row, and to the last diagonal entry.
    void add_last_row(Index node, const Vector3& row);
    void add_last(double value);
    /// Solves; false when the matrix is not positive definite. Neighbouring steps have similar matrices: conjugate
    /// gradients with the last factors come first, new factors where those do not fit any more.
    bool solve(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution);

private:
    bool solve_by_gradients(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution);
    void build();

    std::vector<std::vector<Index>> rows_;  ///< per node: nodes >= it that it is coupled with, ascending
    Eigen::SparseMatrix<double> matrix_;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
    Eigen::VectorXd rest_, conditioned_, along_, image_;
    bool dirty_ = true;
    bool analyzed_ = false;
    bool factors_ = false;  ///< solver_ holds factors of some earlier matrix
};

}  // namespace trocar
