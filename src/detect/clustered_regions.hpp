// Second stage of ohc_clustered's cascade: regions of all bodies that may meet, with regions as primitives of the
// thesis' three maps (cell_map.hpp). The list of pairs that share a cell is kept until a region leaves its entered
// cells. Uses only boxes of regions, in double.
#pragma once

#include <vector>

#include "detect/cell_map.hpp"
#include "detect/clustered_bodies.hpp"
#include "detect/clustered_work.hpp"
#include "detect/collision_filter.hpp"
#include "detect/lattice.hpp"
#include "detect/ohc_work.hpp"

namespace trocar {

class ClusteredRegions {
public:
    /// A region as entered in the cells.
    struct Region {
        Index owner = -1;   ///< number in ClusteredBodies::all()
        Index number = -1;  ///< of the region in its body
        CellRange range{};  ///< cells of its box and a margin for motion
        bool entered = false;
    };
    /// Numbers of two regions, the one of the lower body first.
    struct Pair {
        Index first;
        Index second;
    };
    /// A region with its longest edge (m).
    struct Sized {
        double size = 0.0;
        Index region = -1;
        bool operator<(const Sized& other) const {
            return size < other.size || (size == other.size && region < other.region);
        }
    };

    ClusteredRegions(const ClusteredBodies& bodies, const ClusteredClock& clock, OhcWork& work)
        : bodies_(bodies), clock_(clock), work_(work) {}

    /// Stores which bodies may collide.
    void prepare(const Topology& topology);
    /// Takes over the regions of the clustered bodies.
    void build();
    /// Enters regions that the last read moved into their cells; all regions when the query distance changed.
    void follow();
    /// Finds pairs of regions that share a cell, each once. May end early under a budget, which OhcWork records.
    void find_pairs();
    /// Selects the pairs whose boxes are within the query distance and of which at least one region moved.
    void find_meetings();
    [[nodiscard]] const std::vector<Pair>& meetings() const { return meetings_; }
    /// Median over meetings() of the smaller region of each. Precondition: meetings() is not empty.
    [[nodiscard]] Sized median_meeting() { return median_size(); }

    [[nodiscard]] const Region& region(Index number) const { return regions_[static_cast<std::size_t>(number)]; }
    [[nodiscard]] const Topology& topology() const { return bodies_.topology(); }
    [[nodiscard]] const MovingBody& owner_of(const Region& region) const { return bodies_.moving(region.owner); }
    [[nodiscard]] const BlockBoxes& boxes_of(const Region& region) const { return *owner_of(region).boxes; }
    [[nodiscard]] const Extent& extent_of(const Region& region) const { return boxes_of(region).region(region.number); }

private:
    void choose_cells();
    Sized median_size();
    void enter(Region& region, bool anew);

    const ClusteredBodies& bodies_;
    const ClusteredClock& clock_;
    OhcWork& work_;
    std::vector<Region> regions_;  ///< body by body, from MovingBody::first_region on
    Lattice lattice_;
    CollisionFilter filter_;
    CellMap map_;
    bool cells_are_set_ = false;
    double entered_query_distance_ = 0.0;  ///< query distance (m) that the entered cells include
    bool pairs_known_ = false;             ///< no region left its cells since the list was made
    std::vector<Pair> pairs_;
    std::vector<Pair> meetings_;
    std::vector<Sized> by_size_;  ///< scratch for the median
    std::vector<Index> large_;    ///< regions that cover too many cells
};

}  // namespace trocar
