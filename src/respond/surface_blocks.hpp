// Boxes of small groups of a surface's triangles: tells which triangles lie near a place without a look at all of them.
// A box is renewed only when what its vertices may have moved since then could bring it near.
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
    /// No vertex has moved further than this since the last call (m; infinite: nobody knows).
    void move(double furthest);
    /// Replaces `near` by all triangles whose box meets one of the boxes, in ascending order.
    void collect(const Topology& topology, const Matrix3X& position, const std::vector<Box>& boxes,
                 std::vector<Index>& near);

private:
    void refresh(const Matrix3X& position, std::size_t block);
    [[nodiscard]] bool may_meet(std::size_t block, const std::vector<Box>& boxes) const;

    Range triangles_;
    std::vector<Box> box_;              ///< per block, when it was last renewed
    std::vector<double> travelled_at_;  ///< m, per block: travelled_ then; -infinity: unknown
    std::vector<std::uint32_t> first_;  ///< blocks + 1, into vertex_
    std::vector<Index> vertex_;         ///< of each block, each once
    double travelled_ = 0.0;            ///< m, all moves up to now, one after the other
};

}  // namespace trocar
