// Second level of ohc's cascade: triangles in cells that two groups of bodies share. Two passes with one bit per cell:
// first over vertices, which rules out nearly all triangles, then over the exact cells of the remaining triangles. This
// file decides the order of bodies; occupancy.hpp holds the bits. Nothing is hashed here.
#pragma once

#include <cstdint>
#include <vector>

#include "detect/occupancy.hpp"
#include "detect/ohc_bodies.hpp"
#include "detect/ohc_work.hpp"
#include "detect/triangle_cells.hpp"

namespace trocar {

class OhcOccupancy {
public:
    OhcOccupancy(const OhcBodies& bodies, OhcWork& work) : bodies_(bodies), work_(work) {}

    /// Reserves room for `room` triangles; more are allocated on demand.
    void prepare(std::size_t room);
    /// Removes all triangles.
    void clear();
    /// Finds the groups' triangles in shared cells. Precondition: `meeting` is the result of place_groups, not empty.
    void find(const Frame& frame, const CellRange& meeting);

    /// Triangles that share a cell, each once.
    [[nodiscard]] const std::vector<Primitive>& primitives() const { return primitives_; }
    /// Triangles too large for the lattice, sorted; they are tested against everything.
    [[nodiscard]] const std::vector<Index>& huge() const { return huge_; }
    /// Upper bound on the calls of for_each_shared_cell over all primitives.
    [[nodiscard]] std::size_t entries() const { return entries_; }
    /// Calls use(cell) for the shared cells of a primitive; repeatedly for a cell that several of its pieces cover.
    template <typename Use>
    void for_each_shared_cell(const Frame& frame, const Primitive& primitive, const Use& use) const {
        bodies_.cells().for_each_range(frame, primitive,
                                       [&](const CellRange& range) { shared_.for_each_shared(range, use); });
    }

private:
    using Group = OhcBodies::Group;
    /// The primitives of a group.
    struct Run {
        std::size_t first = 0;
        std::size_t end = 0;
    };

    void find_near(const Frame& frame, const CellRange& meeting);
    /// Cells by which the vertices of a group are dilated.
    [[nodiscard]] int spread_of(const Group& group) const { return near_.spread_for(bodies_.around(group)); }
    void find_shared(const Frame& frame);
    void put_in_field(const Frame& frame, const Group& group);
    template <typename IsShared>
    void collect(const Frame& frame, std::size_t group, const IsShared& is_shared);
    void keep_meeting(const Frame& frame, const BodyRange& body, std::size_t first);
    void add_all(Range triangles) {
        for (Index t = triangles.first; t < triangles.end(); ++t) found_.push_back(t);
    }

    const OhcBodies& bodies_;
    OhcWork& work_;
    OccupancyKernels kernels_ = occupancy_kernels().front();
    Occupancy near_;                    ///< where groups may meet, judged by vertices
    Occupancy shared_;                  ///< where groups meet, judged by triangles
    bool plain_ = true;                 ///< the pass over vertices suffices in this tick
    std::vector<Index> found_;          ///< triangles that their vertices did not rule out
    std::vector<std::uint32_t> sides_;  ///< per vertex of the current body, as in box_sides
    std::vector<Index> huge_;
    std::vector<Primitive> primitives_;
    std::vector<Run> runs_;  ///< per group
    std::size_t entries_ = 0;
};

}  // namespace trocar
