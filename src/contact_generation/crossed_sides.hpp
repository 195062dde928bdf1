// On which side of the other bodies' surfaces every vertex is: signed crossings, counted exactly since the start. A
// vertex that has crossed keeps the place on the surface where it did, its anchor, which follows it along the surface.
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

/// One passage of a surface past a vertex.
struct CrossedLayer {
    Index vertex = -1;
    Index vertex_body = -1;
    Index face_body = -1;
    Index triangle = -1;  ///< anchor: a triangle of the surface nearest to the vertex
    int sign = 0;         ///< +1: from the front to the back, so that it belongs in front; -1 the other way
    double depth = 0.0;   ///< m, from the anchor when it was last followed
};

/// The motion of a tick is taken in legs: tissue moves under tools at rest, hands move their bodies, scripts theirs.
/// Each leg moves the faces first and the vertices after that, the corners of a face one after the other in the order
/// of their numbers: this sweeps tetrahedra whose sides neighbours share, so that with exact signs every crossing is
/// counted once, whatever edge it passes.
class CrossedSides {
public:
    /// Finds where everything is at the start: what has to come out of a closed surface to be far away is inside; a
    /// body that passes through an open one belongs on the side that the scene declares (BodyRange::start_side).
    void prepare(const Topology& topology, const FeatureMesh& mesh, const Frame& first);
    /// Counts what tissue and hands did since the last tick: after it, sides are those of the start of this tick.
    void settle(const TickStart& start, const std::vector<PointFace>& near);
    /// Counts what scripts do in this tick.
    void carry_along(const TickStart& start, const std::vector<PointFace>& near);

    /// Null where the vertex has not crossed this surface.
    [[nodiscard]] const CrossedLayer* layer(Index vertex, Index face_body) const;
    /// Whether a point of an edge is on the wrong side of a body: by its first end's side and what the edge passes
    /// through on the way, among the triangles that are near.
    [[nodiscard]] bool is_beyond(const TickStart& start, const FeatureMesh& mesh, Index edge, double fraction,
                                 Index edge_body, Index face_body, const Partners& partners) const;
    /// keep(layer) brings the anchor of each layer up to date; those for which it says false are forgotten.
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
    std::vector<std::uint16_t> crossed_;  ///< per vertex: how many layers
};

}  // namespace trocar
