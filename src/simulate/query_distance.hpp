// How near two surfaces must be for a detector to report them: one number per tick, so that whatever may meet within
// the tick, or met since the last one, is among its answers. No source needs to know how anything moves.
#pragma once

#include <span>

#include "scene/scene.hpp"

namespace trocar {

class QueryDistance {
public:
    /// `margin`: of the smallest mean edge of the bodies that move, 1.
    QueryDistance(const Scene& scene, double margin);
    /// For a frame whose led bodies have moved, m: the margin, the furthest that any vertex of the led bodies, and of
    /// the tissue where it may have met another body, has come since the last frame, and what is deeper inside than its
    /// pairs would report, rounded up to margin · 2ⁿ so that structures need not follow every tick. All three in m: no
    /// vertex has gone further, nothing is deeper. Of the last two no more than two mean edges: what tissue goes beyond
    /// that in a tick, faster than what leads it, has no neighbourhood left, and to ask for it would be to ask for
    /// every pair of triangles.
    [[nodiscard]] double of(double driven_move, double tissue_move, double deep) const;
    /// True where of() has cut what these ask for: the tick is reported as truncated.
    [[nodiscard]] bool is_cut(double driven_move, double tissue_move, double deep) const {
        return tissue_move + deep > driven_move + most();
    }
    /// m, the smallest mean edge.
    [[nodiscard]] double edge() const { return edge_; }

private:
    static constexpr double most_edges = 2.0;
    [[nodiscard]] double most() const { return most_edges * edge_; }
    double edge_ = 0.0;
    double margin_ = 0.0;  ///< m
};

/// m, furthest that a vertex of these ranges has come since the last frame.
double furthest_move(const Frame& frame, std::span<const Range> ranges);

}  // namespace trocar
