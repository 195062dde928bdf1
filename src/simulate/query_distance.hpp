// Query distance of a detector, one number per tick. It covers all features that may meet within the tick or have met
// since the last one, so that contact generators need no motion data.
#pragma once

#include <span>

#include "scene/scene.hpp"

namespace trocar {

class QueryDistance {
public:
    explicit QueryDistance(const Scene& scene);
    /// The same for bodies that all move. `frame`: first frame of the topology.
    QueryDistance(const Topology& topology, const Frame& frame);
    /// Query distance in m for a frame whose kinematic bodies have moved: margin + driven_move + min(tissue_move +
    /// deep, driven_move + 2 mean edges). The margin is 0.1 of the smallest mean edge of the bodies that move. The sum
    /// is rounded up to margin · 2ⁿ, so that structures need not be rebuilt every tick. `driven_move`, `tissue_move`:
    /// m, largest displacement since the last frame of a vertex of kinematic bodies, and of tissue that may have met
    /// another body. `deep`: m, depth beyond what the pairs show. The cap bounds the cost: tissue that moves farther in
    /// a tick has lost its neighbourhood, and the query would return every pair of triangles.
    [[nodiscard]] double of(double driven_move, double tissue_move, double deep) const;
    /// True where of() applies the cap; the tick is then reported as truncated.
    [[nodiscard]] bool is_cut(double driven_move, double tissue_move, double deep) const {
        return tissue_move + deep > driven_move + most();
    }
    /// m, the smallest mean edge.
    [[nodiscard]] double edge() const { return edge_; }

private:
    static constexpr double margin_edges = 0.1;
    static constexpr double most_edges = 2.0;
    [[nodiscard]] double margin() const { return margin_edges * edge_; }
    [[nodiscard]] double most() const { return most_edges * edge_; }
    double edge_ = 0.0;
};

/// m, largest displacement of a vertex of these ranges since the last frame.
double furthest_move(const Frame& frame, std::span<const Range> ranges);

}  // namespace trocar
