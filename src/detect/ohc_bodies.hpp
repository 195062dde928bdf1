// First level of ohc's cascade, by boxes of whole bodies. It finds pairs of bodies that may meet, the cell size, and
// where bodies can meet. Triangles are read only for the cell size.
#pragma once

#include <cstdint>
#include <vector>

#include "detect/collision_filter.hpp"
#include "detect/lattice.hpp"
#include "detect/ohc_meeting.hpp"
#include "detect/ohc_work.hpp"
#include "detect/tick_part.hpp"
#include "detect/triangle_cells.hpp"
#include "detect/vertex_kernels.hpp"
#include "scene/world.hpp"

namespace trocar {

/// The empty range: low above high.
constexpr CellRange no_cells{Cell{1, 1, 1, 0}, Cell{0, 0, 0, 0}};
inline bool is_empty(const CellRange& range) { return range.low[0] > range.high[0]; }

class OhcBodies {
public:
    /// Bodies that may collide with the same others and not with each other.
    struct Group {
        std::size_t first_body;  ///< of order()
        std::size_t end_body;
        CellRange range = no_cells;
    };

    explicit OhcBodies(const OhcSettings& settings) : settings_(settings) {}

    /// Forgets everything. The frame determines the cell size.
    void prepare(const Topology& topology, const Frame& frame);

    [[nodiscard]] const Topology& topology() const { return *topology_; }
    /// Bodies that take part, group by group, those with few triangles first: the last and largest body then needs no
    /// marking. Under a limit instruments come first, so that truncation affects them least.
    [[nodiscard]] const std::vector<Index>& order() const { return order_; }
    [[nodiscard]] const std::vector<Group>& groups() const { return groups_; }
    [[nodiscard]] const CollisionFilter& filter() const { return filter_; }
    [[nodiscard]] Index body_of(Index triangle) const { return topology_->body_of_triangle[at(triangle)]; }
    [[nodiscard]] const BodyRange& body(Index number) const { return topology_->bodies[at(number)]; }

    /// Sets the query distance (m). It is added around the triangles of one of two groups, the one with fewer of them.
    /// With more groups, half of it is added around all.
    void set_query_distance(double query_distance);
    [[nodiscard]] double query_distance() const { return query_distance_; }
    /// Margin around the triangles of a group, m.
    [[nodiscard]] double around(const Group& group) const { return cells_.around(order_[group.first_body]); }

    template <typename Use>
    void for_each_body(const Group& group, const Use& use) const {
        for (std::size_t k = group.first_body; k < group.end_body; ++k) use(body(order_[k]));
    }

    [[nodiscard]] TriangleCells& cells() { return cells_; }
    [[nodiscard]] const TriangleCells& cells() const { return cells_; }
    /// False while all points coincided or no frame could be read.
    [[nodiscard]] bool has_cell() const { return cell_edge_ != 0.0; }
    /// Sets h to 1.5 × the mean edge of the moving body with the shortest edges (METHODS §12). The mean edge of all
    /// triangles is a lower bound. A coarse body beside a fine one would otherwise cover too many cells.
    void choose_cell(const Frame& frame);

    /// Reads the boxes of all bodies, swept: of both frames. False when a number is not finite or the frame does not
    /// fit the topology.
    bool read_boxes(const Frame& frame);
    /// Computes the cell ranges of the groups and meeting(); returns the cells that meeting() covers.
    CellRange place_groups();
    /// Boxes in which bodies can meet.
    [[nodiscard]] const MeetingBoxes& meeting() const { return meeting_; }

private:
    void make_groups();
    [[nodiscard]] double edge_length(const Frame& frame, Range triangles) const;
    CellRange place_all();
    void find_parts();
    [[nodiscard]] Extent wide_box(Index body) const;
    [[nodiscard]] CellRange cells_of(const Extent& box) const;

    const OhcSettings& settings_;
    const Topology* topology_ = nullptr;
    const VertexKernels& kernels_ = vertex_kernels().front();
    std::vector<Index> order_;
    std::vector<Group> groups_;
    CollisionFilter filter_;
    std::vector<Extent> boxes_;             ///< per body, m
    std::vector<BoxOnPath<Extent>> paths_;  ///< per body, swept only
    std::vector<TickPart> parts_;           ///< per body: times at which it may meet another
    std::vector<Extent> wide_boxes_;        ///< per body, with the margin around its triangles
    MeetingBoxes meeting_;
    double cell_edge_ = 0.0;       ///< m; 0: not chosen yet
    double query_distance_ = 0.0;  ///< query distance, m
    TriangleCells cells_;
};

}  // namespace trocar
