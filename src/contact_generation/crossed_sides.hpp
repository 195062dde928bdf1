// Side of every vertex relative to the other bodies' surfaces, by exact signed crossing counts since the start. A
// vertex that has crossed keeps an anchor on the surface, which follows it along the surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact_generation/feature_search.hpp"
#include "contact_generation/partners.hpp"
#include "contact_generation/tick_start.hpp"
#include "geometry/surface_tree.hpp"

namespace trocar {

/// One crossing of a vertex through a surface.
struct CrossedLayer {
    Index vertex = -1;
    Index vertex_body = -1;
    Index face_body = -1;
    Index triangle = -1;  ///< anchor: triangle of the surface nearest to the vertex
    int sign = 0;         ///< +1: crossed from front to back, belongs in front; -1: the opposite
    double depth = 0.0;   ///< m, distance from the anchor at its last update
};

/// The motion of a tick is split into legs: tissue, operator-driven bodies, scripted bodies. In each leg faces move
/// before vertices, the corners of a face one by one in the order of their numbers. Neighbouring faces then sweep
/// tetrahedra with common sides. With exact signs every crossing is counted once, even through an edge.
class CrossedSides {
public:
    /// Sets the sides at the start: by ray casting for closed surfaces, by the declared side (BodyRange::start_side)
    /// for open ones.
    void prepare(const Topology& topology, const FeatureMesh& mesh, const Frame& first);
    /// Counts crossings by tissue and operators since the last tick. Sides then refer to the start of this tick.
    void settle(const TickStart& start, const std::vector<PointFace>& near);
    /// Counts crossings by this tick's scripted motion.
    void carry_along(const TickStart& start, const std::vector<PointFace>& near);

    /// Null if the vertex has not crossed this surface.
    [[nodiscard]] const CrossedLayer* layer(Index vertex, Index face_body) const;
    /// True if a point of an edge is on the wrong side of a body. Adds the crossings of the edge with nearby triangles
    /// to the count of its first end.
    [[nodiscard]] bool is_beyond(const TickStart& start, const FeatureMesh& mesh, Index edge, double fraction,
                                 Index edge_body, Index face_body, const Partners& partners) const;
    /// keep(layer) updates the anchor of a layer; a layer for which it returns false is removed.
    template <typename Keep>
    void follow(const Keep& keep) {
        std::size_t kept = 0;
        for (CrossedLayer& layer : layers_) {
            if (keep(layer)) {
                layers_[kept++] = layer;
            } else {
                --crossed_[static_cast<std::size_t>(layer.vertex)];
            }
        }
        layers_.resize(kept);
    }

private:
    void cross(const PointFace& where, int crossings);
    void cross_once(const PointFace& where, int sign);
    void add(const CrossedLayer& layer);
    void start_closed(const Topology& topology, const Frame& first, const SurfaceTree& surface, Index body,
                      Index face_body);
    void start_open(const Topology& topology, const FeatureMesh& mesh, const Frame& first, const SurfaceTree& surface,
                    Index body, Index face_body);
    void start_layer(const Frame& first, const SurfaceTree& surface, Index vertex, Index body, Index face_body,
                     int count);

    std::vector<CrossedLayer> layers_;
    std::vector<std::uint16_t> crossed_;  ///< per vertex: number of layers
};

}  // namespace trocar
