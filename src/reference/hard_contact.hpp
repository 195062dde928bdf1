// Hard contact law of the reference solver: candidate vertex–face and edge–edge pairs, their repulsion, and the part of
// a motion without a collision. implicit_solver.hpp states the law.
#pragma once

#include <array>
#include <vector>

#include "geometry/box_pairs.hpp"
#include "reference/closest_points.hpp"
#include "reference/contact_term.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Force (N) at which surfaces stand about half the rest gap apart: the typical contact force of such scenes.
inline constexpr double typical_contact = 0.05;

class HardContact {
public:
    /// For the given body pairs, below `rest_gap` (m). moves: per vertex, 0 if it is fixed; pairs of fixed vertices are
    /// left out. The topology outlives the object.
    HardContact(const Topology& topology, std::vector<std::array<Index, 2>> contact_bodies,
                std::vector<std::uint8_t> moves, double rest_gap);

    /// Sets the positions (3×N, m) at which this step's edge pairs are weighted.
    void begin_step(const Matrix3X& x) { start_ = x; }
    /// Finds all feature pairs that may come within the rest gap along x + t motion, t in [0, 1].
    void find_candidates(const Matrix3X& x, const Matrix3X& motion);
    [[nodiscard]] bool empty() const { return candidates_.empty(); }
    /// Energy (J) of the candidates; infinite where two intersect. Unless `terms` is null, appends the repelling pairs
    /// and sets `smallest_gap` (m) to the smallest distance.
    double energy(const Matrix3X& x, std::vector<ContactTerm>* terms, double& smallest_gap) const;
    /// Part of the motion, in (0, 1], during which no two candidates collide.
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
    std::vector<double> candidate_weight_;  ///< 0 … 1, fades for nearly parallel edges
    std::vector<Box> boxes_;
    std::vector<IndexPair> box_pairs_;
};

}  // namespace trocar
