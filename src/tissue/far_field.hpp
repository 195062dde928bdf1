// Follows what sleeps in a RegionTissue, so many vertices a tick: first those whose nodes have gone furthest since they
// were last examined, so that what lies near a moving tool is never far from where it should be and what rests costs
// nothing; in one tick of four one after the other.
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

    /// Everything that sleeps is where its nodes have it.
    void start();
    /// Puts up to `most` vertices where they are by now and looks closely at those that there is room for. Of what lies
    /// beside other bodies up to `most_beside` more are put: what may be met next is never late, and no query distance
    /// has to span how late it was.
    void follow(std::size_t most, std::size_t most_beside);
    /// Largest stretch of a spring that sleeps, as last seen.
    [[nodiscard]] double stretch() const { return std::max(stretch_, last_stretch_); }

private:
    /// What is on the way from one pass over the vertices that a node moves to the next. Vertices belong to the parent
    /// with the largest share in them, as nodes do; those of a node lie side by side in `order_`.
    struct Holding {
        std::uint32_t first = 0;  ///< into `order_`
        std::uint32_t end = 0;
        std::uint32_t next = 0;                               ///< where the pass stands
        std::int64_t seen = -1;                               ///< turn in which the node was last awake
        Eigen::Vector4d passed = Eigen::Vector4d::Zero();     ///< m, its displacement as the last pass began
        Eigen::Vector4d beginning = Eigen::Vector4d::Zero();  ///< m, as this pass began
    };
    struct Late {
        double square = 0.0;  ///< m²
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
    std::vector<std::vector<Index>> owner_;      ///< per level but the last and node: node of the next level
    std::vector<std::vector<Holding>> holding_;  ///< per level from 1 on and node; empty at level 0
    std::vector<Index> order_;                   ///< vertices that move
    std::vector<Late> late_;
    std::vector<Index> beside_;  ///< vertices that sleep beside other bodies
    double least_ = 0.0;         ///< m, from which on a node is late
    std::int64_t tick_ = 0;
    std::int64_t turn_ = 0;  ///< of searching for late nodes
    std::size_t most_ = 0;   ///< that this tick may put
    std::size_t put_before_ = 0;
    std::size_t around_ = 0;  ///< into `order_`, where the slow round goes on
    double stretch_ = 0.0;    ///< in this round
    double last_stretch_ = 0.0;
};

}  // namespace trocar
