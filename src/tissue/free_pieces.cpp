#include "tissue/free_pieces.hpp"

#include <numeric>

namespace trocar {
FreePieces::FreePieces(const std::vector<Spring>& springs, const TissueState& state) {
    const std::size_t count = state.size();
    std::vector<Index> parent(count);
    std::iota(parent.begin(), parent.end(), Index{0});
    const auto root = [&parent](Index v) {
        while (parent[at(v)] != v) v = parent[at(v)] = parent[at(parent[at(v)])];
        return v;
    };
    for (const Spring& spring : springs) {
        parent[at(root(state.place[at(spring.i)]))] = root(state.place[at(spring.j)]);
    }
    std::vector<Index> piece_of_root(count, 0);
    for (std::size_t v = 0; v < count; ++v) {
        if (!state.moves(static_cast<Index>(v))) piece_of_root[at(root(static_cast<Index>(v)))] = -1;
    }
    Index pieces = 0;
    for (std::size_t v = 0; v < count; ++v) {
        if (parent[v] == static_cast<Index>(v) && piece_of_root[v] == 0) piece_of_root[v] = ++pieces;
    }
    piece_.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
        const Index piece = piece_of_root[at(root(static_cast<Index>(v)))];
        piece_[v] = piece > 0 ? piece - 1 : -1;
    }
    momentum_.setZero(3, pieces);
    inertia_.setZero(pieces);
}

void FreePieces::begin(const SpringSystem& system, const TissueState& state) {
    momentum_.setZero();
    inertia_.setZero();
    for (std::size_t v = 0; v < piece_.size(); ++v) {
        if (piece_[v] < 0) continue;
        momentum_.col(piece_[v]) += system.right_side.col(static_cast<Eigen::Index>(v)).head<3>();
        inertia_[piece_[v]] += system.inertia[v];
    }
    for (std::size_t v = 0; v < piece_.size(); ++v) {
        if (piece_[v] >= 0 && !state.moves(static_cast<Index>(v))) inertia_[piece_[v]] = 0.0;
    }
}

void FreePieces::add(Index local, const Vector3& impulse) {
    if (piece_[at(local)] >= 0) momentum_.col(piece_[at(local)]) += impulse;
}

void FreePieces::close(const SpringSystem& system, const Matrix4X& start, TissueState& state) {
    for (std::size_t v = 0; v < piece_.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        if (piece_[v] < 0) continue;
        momentum_.col(piece_[v]) -= system.inertia[v] * (state.velocity.col(column) - start.col(column)).head<3>();
    }
    for (std::size_t v = 0; v < piece_.size(); ++v) {
        if (piece_[v] < 0 || inertia_[piece_[v]] == 0.0) continue;
        state.velocity.col(static_cast<Eigen::Index>(v)).head<3>() += momentum_.col(piece_[v]) / inertia_[piece_[v]];
    }
}

}  // namespace trocar
