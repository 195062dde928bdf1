// Updates the interpolated vertices of a RegionTissue, a bounded number per tick. Vertices whose nodes have moved
// furthest since their last examination come first. One tick in four takes the vertices in turn instead. Vertices near
// a moving tool thus lag little, and vertices at rest cost nothing.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "tissue/region_levels.hpp"

namespace trocar {

class FarField {
public:
    /// The region outlives the object.
    explicit FarField(RegionTissue& region);

    /// Restarts with every interpolated vertex up to date.
    void start();
    /// Updates up to `most` interpolated vertices and relaxes those that fit this limit. Updates up to `most_beside`
    /// more beside other bodies. Vertices that may come into contact are thus never late, and no query distance has to
    /// cover a lag.
    void follow(std::size_t most, std::size_t most_beside);
    /// Largest ratio of length to rest length of an interpolated spring, as last examined.
    [[nodiscard]] double stretch() const { return std::max(stretch_, last_stretch_); }

private:
    /// Progress of the passes over the vertices that a node moves. Each vertex belongs to the parent with the largest
    /// weight, a free one first. The vertices of a node are contiguous in `order_`.
    struct Holding {
        std::uint32_t first = 0;  ///< into `order_`
        std::uint32_t end = 0;
        std::uint32_t next = 0;                               ///< position of the pass
        std::int64_t seen = -1;                               ///< last turn in which the node was active
        Eigen::Vector4d passed = Eigen::Vector4d::Zero();     ///< m, displacement at the start of the last pass
        Eigen::Vector4d beginning = Eigen::Vector4d::Zero();  ///< m, at the start of this pass
    };
    struct Late {
        double square = 0.0;  ///< m², displacement since the last pass
        std::uint32_t level = 0;
        Index node = -1;
        bool operator<(const Late& other) const {
            return std::tie(square, level, node) < std::tie(other.square, other.level, other.node);
        }
    };
    void find_late();
    void find_beside(std::size_t most);
    void go_around();
    bool examine(Index vertex);
    bool pass_over(const Late& late);

    RegionTissue* region_;
    std::vector<std::vector<Index>> owner_;      ///< per level but the last, per node: node of the next level
    std::vector<std::vector<Holding>> holding_;  ///< per level from 1 on, per node; empty at level 0
    std::vector<Index> order_;                   ///< free vertices
    std::vector<Late> late_;
    std::vector<Index> beside_;  ///< interpolated vertices beside other bodies
    double least_ = 0.0;         ///< m, smallest displacement of a late node
    std::int64_t tick_ = 0;
    std::int64_t turn_ = 0;  ///< number of searches for late nodes
    std::size_t most_ = 0;   ///< limit of updates in this tick
    std::size_t put_before_ = 0;
    std::size_t around_ = 0;  ///< index in `order_` of the round in turn
    double stretch_ = 0.0;    ///< in this round
    double last_stretch_ = 0.0;
};

}  // namespace trocar
