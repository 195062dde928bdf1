// The hard law of the reference solver: which vertices and faces, edges and edges may meet, how they repel each other,
// and how far a motion may go before two of them would meet (the law is reported in implicit_solver.hpp).
#pragma once

#include <array>
#include <vector>

#include "geometry/box_pairs.hpp"
#include "reference/closest_points.hpp"
#include "reference/contact_term.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Force at which surfaces stand about half the rest gap apart, N: the size of forces in such scenes.
inline constexpr double typical_contact = 0.05;

class HardContact {
public:
    /// Between the given bodies, below `rest_gap` (m). moves: per vertex, whether it may give way; pairs in which
    /// nothing may are left out. The topology outlives the object.
    HardContact(const Topology& topology, std::vector<std::array<Index, 2>> contact_bodies,
                std::vector<std::uint8_t> moves, double rest_gap);

    /// Place from which this step's pairs of edges are judged.
    void begin_step(const Matrix3X& x) { start_ = x; }
    /// Finds all pairs of features that may come within the rest gap on the way x + t motion, t in [0, 1].
    void find_candidates(const Matrix3X& x, const Matrix3X& motion);
    [[nodiscard]] bool empty() const { return candidates_.empty(); }
    /// Energy of the candidates, J; infinite where two meet. Adds those that repel each other to `terms` unless null,
    /// and then puts the smallest distance of all into `smallest_gap`, m.
    double energy(const Matrix3X& x, std::vector<ContactTerm>* terms, double& smallest_gap) const;
    /// Part of the motion after which no two candidates have met, in (0, 1].
    [[nodiscard]] double safe_part(const Matrix3X& x, const Matrix3X& motion) const;

private:
    void find_features();
    void add_features(Index t, Index u);
    [[nodiscard]] double edge_weight(const FeaturePair& pair) const;

    const Topology& topology_;
    std::vector<std::array<Index, 2>> contact_bodies_;
    std::vector<std::uint8_t> moves_;
    double rest_gap_;
    std::vector<Index> first_triangle_of_vertex_;
    std::vector<std::array<Index, 2>> edges_;
    std::vector<Index> first_triangle_of_edge_;
    std::vector<std::array<Index, 3>> edges_of_triangle_;
    Matrix3X start_;
    std::vector<FeaturePair> candidates_;
    std::vector<double> candidate_weight_;  ///< 0 … 1, edges that are nearly parallel fade
    std::vector<Box> boxes_;
    std::vector<IndexPair> box_pairs_;
};

}  // namespace trocar
