// Tissue as a hierarchy of nodes, for a stepper that integrates only the surroundings of the tools at full rate. Level
// 0 holds the vertices; a node of a higher level represents the nodes around it. An interpolated node moves linearly
// with three nodes of the next level. Stiffness and damping of the interpolated part are projected on the next level
// (Galerkin); mass and drag are lumped. A few hundred nodes are thus as stiff as the vertices that they replace. The
// force of an interpolated spring is exact at its last examination and linear since.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tissue/body_boxes.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/node_level.hpp"
#include "tissue/written_vertices.hpp"

namespace trocar {

/// Nodes of the next level that an edge acts on. The factor is the weight in the edge's first end minus that in the
/// second. Each pair of these nodes has an edge there.
struct EdgeShares {
    std::array<Index, 6> node{};
    std::array<double, 6> factor{};
    std::size_t count = 0;

    EdgeShares(const NodeLevel& level, std::uint32_t edge) {
        for (std::size_t n = 0; n < 3; ++n) add(level.parent[at(level.i[edge])][n], level.weight[at(level.i[edge])][n]);
        for (std::size_t n = 0; n < 3; ++n)
            add(level.parent[at(level.j[edge])][n], -level.weight[at(level.j[edge])][n]);
    }

private:
    void add(Index to, double by) {
        if (by == 0.0) return;
        for (std::size_t n = 0; n < count; ++n) {
            if (node[n] != to) continue;
            factor[n] += by;
            return;
        }
        node[count] = to;
        factor[count++] = by;
    }
};

class RegionTissue {
public:
    /// Builds the levels from rest positions (3×N, of the frame). Each level has about a tenth of the nodes of the
    /// previous one; the last has `fewest` or less. `written` receives the vertices that change without being active.
    /// `boxes` provides which vertices may have met another body. Tissue, written and boxes must outlive the object.
    RegionTissue(MovingTissue& tissue, WrittenVertices& written, BodyBoxes& boxes, const Topology& topology,
                 const Matrix3X& rest, std::size_t fewest);

    /// Makes every node below the last level interpolated and at rest, at the positions of the state.
    void start();
    /// Begins a new moment: interpolated nodes are no longer up to date.
    void next_moment() {
        ++moment_;
        path_ += furthest_;
        furthest_ = 0.0;
        put_ = 0;
    }
    /// Number of vertices updated in this moment.
    [[nodiscard]] std::size_t put() const { return put_; }
    /// m, bound on the displacement of interpolated vertices that may have met another body, since the last call.
    double take_path();
    /// m, the larger of `path` and the displacement of the vertex from `from`. The latter counts only if the vertex may
    /// have met another body.
    [[nodiscard]] double further(Index vertex, const Vector3& from, double path);
    /// True if the vertex, moved by up to `distance` (m), may count in `further` with its next displacement.
    [[nodiscard]] bool is_beside_others(Index vertex, double distance) const;
    /// Updates an interpolated node, and the nodes that it depends on, to this moment.
    void refresh(std::size_t level, Index node);
    /// Writes the current positions and velocities of all interpolated vertices to a frame. The object does not change.
    void complete(Frame& frame) const;
    /// Neither changes a position. `interpolate` restricts the node's excess momentum to its parents.
    void activate(std::size_t level, Index node);
    void interpolate(std::size_t level, Index node);
    /// Examines an interpolated vertex: linearises its springs and takes one over-relaxation step towards equilibrium.
    /// This removes deformation that the nodes of the next level cannot represent. Returns the largest ratio of length
    /// to rest length of its springs. Call `report_pulls` after the last vertex of a relaxation sweep.
    double relax(Index vertex);
    /// Restricts changed forces of interpolated springs, once for all, because neighbours act on the same few nodes.
    void report_pulls();

    [[nodiscard]] std::vector<NodeLevel>& levels() { return levels_; }
    [[nodiscard]] const std::vector<NodeLevel>& levels() const { return levels_; }
    /// True if nodes became active or interpolated since the last call.
    bool take_changed();

private:
    void build_vertices(const Matrix3X& rest);
    void build_next();
    std::vector<Index> choose(const NodeLevel& fine) const;
    void find_parents(NodeLevel& fine, const NodeLevel& coarse, const std::vector<Index>& chosen) const;
    void project(const NodeLevel& fine, NodeLevel& coarse) const;

    /// Motion of a node as interpolated from the next level.
    struct Carried {
        Eigen::Vector4d displacement = Eigen::Vector4d::Zero();  ///< m
        Eigen::Vector4d velocity = Eigen::Vector4d::Zero();      ///< m/s
    };
    Carried carried(std::size_t level, Index node);
    [[nodiscard]] SymmetricBlock stiffness_of(std::size_t level, std::uint32_t edge) const;
    [[nodiscard]] SymmetricBlock damping_of(std::size_t level, std::uint32_t edge) const;
    [[nodiscard]] Eigen::Vector4d pull(std::uint32_t edge) const;
    void add_edge(std::size_t level, std::uint32_t edge, const SymmetricBlock& stiffness, const SymmetricBlock& damping,
                  double sign);
    void add_mass(std::size_t level, Index node, double mass, double drag);
    void add_force(std::size_t level, Index node, const Eigen::Vector4d& force);
    void add_pull(std::uint32_t spring, const Eigen::Vector4d& pull);
    void add_pull_at(Index vertex, const Eigen::Vector4d& force);
    void add_momentum(std::size_t level, Index node, const Eigen::Vector4d& momentum);
    void take_pull(std::uint32_t spring, const SymmetricBlock& stiffness);

    /// Data of a spring for relaxation, in one cache line, because springs are accessed in no memory order.
    struct alignas(64) NearSpring {
        Index i = -1;
        Index j = -1;
        double k = 0.0;             ///< N/m
        double offset = 0.0;        ///< N, as in SpringArrays
        double inverse_rest = 0.0;  ///< 1/m
        /// N, on i, of an interpolated spring at displacement 0, linear with the rest stiffness.
        Eigen::Vector4d pull = Eigen::Vector4d::Zero();
        [[nodiscard]] Index other_end(Index vertex) const { return i == vertex ? j : i; }
    };
    /// A spring of the vertex under relaxation.
    struct Around {
        SymmetricBlock at_rest{};  ///< N/m
        SymmetricBlock now{};      ///< N/m
        Eigen::Vector4d pull;      ///< N, on the vertex
    };

    MovingTissue* tissue_;
    WrittenVertices* written_;
    BodyBoxes* boxes_;
    std::vector<Index> body_of_;        ///< per vertex
    std::vector<double> longest_edge_;  ///< m, at rest, per vertex
    std::vector<NodeLevel> levels_;
    Matrix4X anchor_;                      ///< m, per vertex: position minus interpolated displacement
    Matrix4X pulled_by_;                   ///< N, per node of level 1: force not yet restricted
    std::vector<Index> pulled_;            ///< nodes of level 1 with such a force
    std::vector<std::uint8_t> is_pulled_;  ///< per node of level 1
    std::vector<NearSpring> springs_;
    std::int64_t moment_ = 0;
    std::size_t put_ = 0;
    double furthest_ = 0.0;       ///< m, in this moment
    double path_ = 0.0;           ///< m, in earlier moments
    double relaxed_ = 0.0;        ///< m, largest displacement by relaxation
    std::vector<Around> around_;  ///< springs of the vertex under relaxation
    bool changed_ = true;
};

}  // namespace trocar
