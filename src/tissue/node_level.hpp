// Level of nodes of an implicit step. Level 0 holds the vertices of the tissue. Higher levels exist only where a part
// of the tissue is interpolated.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/index_lists.hpp"
#include "tissue/moving_tissue.hpp"

namespace trocar {

/// A symmetric 3×3 matrix: xx, xy, xz, yy, yz, zz.
using SymmetricBlock = std::array<double, 6>;

inline Matrix3 full(const SymmetricBlock& block) {
    Matrix3 result;
    result << block[0], block[1], block[2], block[1], block[3], block[4], block[2], block[4], block[5];
    return result;
}

/// along u uᵀ + across (1 - u uᵀ).
inline SymmetricBlock block_of(const Vector3& u, double along, double across) {
    const double d = along - across;
    return {d * u.x() * u.x() + across, d * u.x() * u.y(), d * u.x() * u.z(),
            d * u.y() * u.y() + across, d * u.y() * u.z(), d * u.z() * u.z() + across};
}

inline void add(const SymmetricBlock& more, SymmetricBlock& to) {
    for (std::size_t n = 0; n < 6; ++n) to[n] += more[n];
}

inline void add_scaled(double factor, const SymmetricBlock& more, SymmetricBlock& to) {
    for (std::size_t n = 0; n < 6; ++n) to[n] += factor * more[n];
}

struct NodeLevel {
    // Edges, with the blocks of the interpolated part below. At level 0: springs, blocks not stored.
    std::vector<Index> i, j;
    std::vector<SymmetricBlock> stiffness;  ///< N/m
    std::vector<SymmetricBlock> damping;    ///< N s/m
    NumberLists<std::uint32_t> edges;       ///< by node
    // Interpolation from the next level; empty at the last one.
    std::vector<std::array<Index, 3>> parent;
    std::vector<std::array<double, 3>> weight;  ///< 0 for unused entries
    // Per node.
    std::vector<Vector3> rest;         ///< m
    std::vector<double> spacing;       ///< m, to neighbouring nodes
    std::vector<double> mass;          ///< kg, of the interpolated part below; level 0: of the vertex
    std::vector<double> drag;          ///< kg/s, likewise
    std::vector<double> whole_mass;    ///< kg, with everything below interpolated
    std::vector<std::uint8_t> fixed;   ///< never moves
    std::vector<std::uint8_t> active;  ///< is integrated; at the last level all are
    std::vector<Index> active_nodes;   ///< active nodes that are not fixed
    std::vector<Index> active_at;      ///< per node: index in active_nodes
    std::vector<Index> piece;          ///< connected piece without a fixed vertex; -1: none
    std::vector<std::int64_t> stamp;   ///< moment of the last update of an interpolated node
    Matrix4X displacement;             ///< m, since the start
    Matrix4X offset;    ///< m, of interpolated nodes: displacement minus its interpolation; unused at level 0
    Matrix4X velocity;  ///< m/s; level 0: in the state
    Matrix4X force;     ///< N, of the interpolated part below at displacement 0, and of an interpolated node's edges by
                        ///< their offsets; level 0: rest bias

    [[nodiscard]] std::size_t size() const { return mass.size(); }
    [[nodiscard]] Index other_end(std::uint32_t edge, Index node) const { return i[edge] == node ? j[edge] : i[edge]; }
    /// True if any interpolated part remains at the node; otherwise its mass is only rounding.
    [[nodiscard]] bool has_a_say(Index node) const {
        constexpr double rounding = 1e-12;
        return mass[at(node)] > rounding * whole_mass[at(node)];
    }
    /// Fills `edges` from their ends.
    void list_edges();
    /// Makes every node active or interpolated.
    void set_active(bool is_active);
    /// Number of connected pieces without a fixed vertex.
    [[nodiscard]] Index pieces() const;
};

/// Vertices and springs of the tissue, with their pieces; no vertex is active.
NodeLevel level_of_vertices(const MovingTissue& tissue);

}  // namespace trocar
