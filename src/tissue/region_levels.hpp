// Tissue as nodes of several levels, for a stepper that integrates at full rate only what is near the tools. Level 0
// are the vertices; a node of a higher level stands for those around it, and a node that is asleep moves as three nodes
// of the next level do (linear between them). Stiffness, damping, mass and drag of what sleeps are those of its level
// projected on the next (Galerkin; mass and drag lumped), so that a far field of a few hundred nodes is as stiff as the
// vertices it stands for. What a spring far away pulls is exact when it was last examined and linear since.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tissue/body_boxes.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/written_vertices.hpp"

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

struct RegionLevel {
    // Edges and what they are of the part that sleeps below; springs at level 0, where the blocks are not kept.
    std::vector<Index> i, j;
    std::vector<SymmetricBlock> stiffness;  ///< N/m
    std::vector<SymmetricBlock> damping;    ///< N s/m
    std::vector<std::uint32_t> first_edge;  ///< per node + 1, into `edge_at`
    std::vector<std::uint32_t> edge_at;
    // The way to the next level; empty at the last one.
    std::vector<std::array<Index, 3>> parent;
    std::vector<std::array<double, 3>> weight;  ///< 0 for unused entries
    // Per node.
    std::vector<Vector3> rest;         ///< m
    std::vector<double> spacing;       ///< m, to the nodes around
    std::vector<double> mass;          ///< kg, of what sleeps below; level 0: of the vertex
    std::vector<double> drag;          ///< kg/s, likewise
    std::vector<double> whole_mass;    ///< kg, while all below sleeps
    std::vector<std::uint8_t> fixed;   ///< never moves
    std::vector<std::uint8_t> active;  ///< moves by itself; at the last level all do
    std::vector<Index> active_nodes;   ///< those of them that are not fixed
    std::vector<Index> active_at;      ///< per node: position in active_nodes
    std::vector<Index> piece;          ///< connected piece of tissue that nothing holds; -1: held
    std::vector<std::int64_t> stamp;   ///< when what sleeps was last brought up to date
    Matrix4X displacement;             ///< m, since the start
    Matrix4X offset;                   ///< m, of what sleeps: displacement less what the next level moves it by; not of
                                       ///< level 0, where it is part of the place
    Matrix4X velocity;                 ///< m/s; of level 0 it is the state's
    Matrix4X force;                    ///< N, of what sleeps below at displacement 0 and, of a node that sleeps, what
                                       ///< its edges pull by their offsets; level 0: rest bias

    [[nodiscard]] std::size_t size() const { return mass.size(); }
    [[nodiscard]] Index other_end(std::uint32_t edge, Index node) const { return i[edge] == node ? j[edge] : i[edge]; }
    /// Whether anything still moves with a node: else its mass is nothing but rounding.
    [[nodiscard]] bool has_a_say(Index node) const {
        constexpr double rounding = 1e-12;
        return mass[at(node)] > rounding * whole_mass[at(node)];
    }
};

/// Which nodes of the next level an edge acts on, and by how much: its two ends' shares, those of the second end
/// negative. Each pair of them has an edge there.
struct EdgeShares {
    std::array<Index, 6> node{};
    std::array<double, 6> factor{};
    std::size_t count = 0;

    EdgeShares(const RegionLevel& level, std::uint32_t edge) {
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
    /// Builds the levels from the rest positions (3×N, of the frame): each has about a tenth of the nodes of the one
    /// before; the last one `fewest` or less. Vertices that are changed otherwise than by what is awake are marked in
    /// `written`; `boxes` say which of them can have met anything. Tissue, written and boxes outlive the object.
    RegionTissue(MovingTissue& tissue, WrittenVertices& written, BodyBoxes& boxes, const Topology& topology,
                 const Matrix3X& rest, std::size_t fewest);

    /// Everything sleeps, at the places of the state and at rest.
    void start();
    /// A new moment: what sleeps is no longer up to date.
    void next_moment() {
        ++moment_;
        path_ += furthest_;
        furthest_ = 0.0;
        put_ = 0;
    }
    /// Vertices that have been put to new places in this moment.
    [[nodiscard]] std::size_t put() const { return put_; }
    /// m, no vertex that sleeps and may have met another body on the way has been put further since the last call.
    double take_path();
    /// m, how far a vertex has gone from there to where it is now if that is further than the way given and it may have
    /// met another body; else that way.
    [[nodiscard]] double further(Index vertex, const Vector3& from, double path);
    /// Whether a vertex is, but for that distance (m), where its next way may count for `further`.
    [[nodiscard]] bool is_beside_others(Index vertex, double distance) const;
    /// Brings a node that sleeps up to date, and what it moves with.
    void refresh(std::size_t level, Index node);
    /// Where everything that sleeps is now, into a frame; itself it stays as it is.
    void complete(Frame& frame) const;
    /// Neither changes a place; momentum goes to the nodes that the node moves with from now on.
    void activate(std::size_t level, Index node);
    void interpolate(std::size_t level, Index node);
    /// Examines a vertex that sleeps: what its springs pull now, and a step of over-relaxation to where they balance,
    /// so that what the nodes of the next level cannot do dies out. Gives the largest stretch of its springs. After the
    /// last of several visits, `report_pulls`.
    double relax(Index vertex);
    /// Passes on what springs that sleep pull otherwise than before: once for all, since springs side by side pull the
    /// same few nodes.
    void report_pulls();

    [[nodiscard]] std::vector<RegionLevel>& levels() { return levels_; }
    [[nodiscard]] const std::vector<RegionLevel>& levels() const { return levels_; }
    [[nodiscard]] Index pieces() const { return pieces_; }
    /// Nodes have woken or fallen asleep since the last call.
    bool take_changed();

private:
    void build_vertices(const Matrix3X& rest);
    void mark_pieces();
    void build_next();
    std::vector<Index> choose(const RegionLevel& fine) const;
    void find_parents(RegionLevel& fine, const RegionLevel& coarse, const std::vector<Index>& chosen) const;
    void project(const RegionLevel& fine, RegionLevel& coarse) const;

    /// What the next level moves a node by.
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

    /// What a visit reads of a spring, in one line of the cache: it comes to springs in no order that memory has.
    struct alignas(64) NearSpring {
        Index i = -1;
        Index j = -1;
        double k = 0.0;             ///< N/m
        double offset = 0.0;        ///< N, as in SpringArrays
        double inverse_rest = 0.0;  ///< 1/m
        /// N, of one that sleeps, on its i: at displacement 0, by the stiffness at rest.
        Eigen::Vector4d pull = Eigen::Vector4d::Zero();
        [[nodiscard]] Index other_end(Index vertex) const { return i == vertex ? j : i; }
    };
    /// A spring of a vertex that is visited.
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
    std::vector<RegionLevel> levels_;
    Matrix4X anchor_;                      ///< m, per vertex: its place less what the level above moves it by
    Matrix4X pulled_by_;                   ///< N, per node of level 1, not yet passed on
    std::vector<Index> pulled_;            ///< nodes of level 1 that have any
    std::vector<std::uint8_t> is_pulled_;  ///< per node of level 1
    std::vector<NearSpring> springs_;
    std::int64_t moment_ = 0;
    Index pieces_ = 0;
    std::size_t put_ = 0;
    double furthest_ = 0.0;       ///< m, in this moment
    double path_ = 0.0;           ///< m, in those before
    double relaxed_ = 0.0;        ///< m, furthest that a visit has moved a vertex
    std::vector<Around> around_;  ///< the springs of the vertex that is visited
    bool changed_ = true;
};

}  // namespace trocar
