// Second stage of ohc_clustered's cascade: which regions may meet, over all bodies at once, with regions as primitives
// of the thesis' three maps (cell_map.hpp). The list of pairs that share a cell is kept until a region leaves the cells
// it was entered with. Only boxes of regions are examined here, in double; nothing below a region is.
#pragma once

#include <vector>

#include "detect/cell_map.hpp"
#include "detect/clustered_bodies.hpp"
#include "detect/clustered_work.hpp"
#include "detect/lattice.hpp"
#include "detect/ohc_work.hpp"

namespace trocar {

class ClusteredRegions {
public:
    /// A region as the cells know it.
    struct Region {
        Index owner = -1;   ///< number in ClusteredBodies::all()
        Index number = -1;  ///< of the region in its body
        CellRange range{};  ///< with room to move
        bool entered = false;
    };
    /// Two regions by number, the one of the body with the lower number first.
    struct Pair {
        Index first;
        Index second;
    };
    /// A region by its longest edge, m.
    struct Sized {
        double size = 0.0;
        Index region = -1;
        bool operator<(const Sized& other) const {
            return size < other.size || (size == other.size && region < other.region);
        }
    };

    ClusteredRegions(const ClusteredBodies& bodies, const ClusteredClock& clock, OhcWork& work)
        : bodies_(bodies), clock_(clock), work_(work) {}

    /// Finds out who may hit whom.
    void prepare(const Topology& topology);
    /// Takes over the regions of the bodies that were built.
    void build();
    /// Cells for the regions that the last read moved; for all when the query distance is another one.
    void follow();
    /// Pairs of regions that share a cell, each once. Under a budget perhaps none, which the book of work reports.
    void find_pairs();
    /// Of those pairs, the ones whose boxes come within the query distance and of which at least one region moved.
    void find_meetings();
    [[nodiscard]] const std::vector<Pair>& meetings() const { return meetings_; }
    /// The median of the regions that meet, of each two the smaller one. Precondition: there are meetings.
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
    std::vector<Region> regions_;  ///< body by body, as MovingBody::first_region reports
    Lattice lattice_;
    CellMap map_;
    bool cells_are_set_ = false;
    double entered_query_distance_ = 0.0;  ///< m, that the regions' cells have room for
    bool pairs_known_ = false;             ///< no region left its cells since the list was made
    std::vector<Pair> pairs_;
    std::vector<Pair> meetings_;
    std::vector<Sized> by_size_;  ///< what a median is taken of
    std::vector<Index> large_;    ///< regions that cover too many cells
};

}  // namespace trocar
