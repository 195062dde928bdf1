// Boxes of small groups of a surface's triangles, renewed where vertices moved: tells which triangles lie near a place
// without a look at all of them.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

class SurfaceBlocks {
public:
    void prepare(const Topology& topology, Range triangles);
    /// Boxes at these positions (3×N, m); triangles with a non-finite corner are nowhere.
    void refresh_all(const Matrix3X& position);
    /// The same where only vertices in `moved` have moved since the last call.
    void refresh(const Matrix3X& position, const std::vector<Range>& moved);
    /// Replaces `near` by all triangles whose box meets one of the boxes, in ascending order.
    void collect(const Topology& topology, const Matrix3X& position, const std::vector<Box>& boxes,
                 std::vector<Index>& near) const;

private:
    void refresh_block(const Matrix3X& position, std::size_t block);

    Range triangles_;
    std::vector<Box> box_;                    ///< per block
    std::vector<std::uint32_t> first_;        ///< blocks + 1, into vertex_
    std::vector<Index> vertex_;               ///< of each block, each once
    std::vector<std::uint32_t> first_block_;  ///< N + 1, into block_
    std::vector<std::uint32_t> block_;        ///< of each vertex
    std::vector<std::uint8_t> stale_;         ///< per block
};

}  // namespace trocar
