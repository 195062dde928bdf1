// Global intersection analysis of a single frame (Baraff, Witkin, Kass 2003): intersection curves of two surfaces and
// the smaller regions that they cut off.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "contact/contact_set.hpp"
#include "geometry/disjoint_sets.hpp"
#include "respond/surface.hpp"
#include "scene/world.hpp"

namespace trocar {

/// One curve of intersection between two bodies, body_a < body_b.
struct IntersectionContour {
    Index body_a = -1;
    Index body_b = -1;
    bool closed = false;  ///< false: ends at a mesh boundary, at a false negative, or where an edge only touches
    Range pairs;          ///< in IntersectionRegions::pairs_of
    /// Vertices of the smaller region (by area) that the curve cuts off from each surface. Empty if it encloses no
    /// vertex or does not separate the surface (an open curve, or one around a handle).
    std::vector<Index> inside_a, inside_b;
    bool separates_a = true;  ///< false: the flood fill passed around the curve
    bool separates_b = true;
    Vector3 centre = Vector3::Zero();  ///< m, length-weighted mean of the segments' midpoints
};

/// Traces curves over shared piercings: an edge through a face belongs to the two triangles at the edge, which are
/// neighbours on the curve. Piercings are decided by exact signs, ties alike for all triangles at an edge. A false
/// negative of the detector leaves its curve open. Buffers persist between ticks.
class IntersectionRegions {
public:
    void prepare(const Topology& topology);
    /// Replaces contours() by those of body pairs with tissue. `surface` must have been measured.
    void find(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
              const std::vector<TrianglePair>& pairs);
    [[nodiscard]] std::span<const IntersectionContour> contours() const { return {contours_.data(), used_}; }
    /// Indices in `pairs` of the pairs on a contour.
    [[nodiscard]] std::span<const Index> pairs_of(const IntersectionContour& contour) const {
        return {order_.data() + contour.pairs.first, static_cast<std::size_t>(contour.pairs.count)};
    }
    /// Contour of a pair by its index in `pairs`; -1: none.
    [[nodiscard]] Index contour_of(Index pair) const { return contour_of_[static_cast<std::size_t>(pair)]; }

private:
    /// An edge (low < high vertex) through a triangle.
    struct Piercing {
        Index low = -1;
        Index high = -1;
        Index triangle = -1;
        Index pair = -1;
        auto operator<=>(const Piercing&) const = default;
    };

    void pierce(const Topology& topology, const Frame& frame, Index edges_of, Index face, Index pair);
    [[nodiscard]] Vector3 centre_of(const IntersectionContour& contour) const;
    /// Collects the smaller region beside the cut edges; false if the cut does not separate.
    bool fill(const Topology& topology, const SurfaceNeighbours& surface, std::vector<Index>& inside);
    [[nodiscard]] bool is_cut(Index a, Index b) const;

    std::vector<Piercing> piercings_;
    std::vector<std::array<Vector3, 2>> segment_;  ///< per pair: segment of the curve
    DisjointSets connected_;                       ///< pairs by curve
    std::vector<std::uint8_t> open_;               ///< per pair; of the representative: the curve is open
    std::vector<Index> order_;
    std::vector<Index> contour_of_;
    std::vector<IntersectionContour> contours_;
    std::size_t used_ = 0;
    std::vector<std::array<Index, 2>> cut_;  ///< edges crossed an odd number of times, sorted
    std::vector<std::uint32_t> seen_;        ///< per vertex: stamp of a fill and its side
    std::uint32_t stamp_ = 0;
    std::array<std::vector<Index>, 2> front_;
};

}  // namespace trocar
