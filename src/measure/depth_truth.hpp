// The independent answer about depth: how far points of one body lie inside another, or beyond an open sheet, from the
// frames alone. Never reads derive, a contact set or a method's state.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "scene/world.hpp"

namespace trocar {

/// Judges sample points (all vertices of a body, plus points spread evenly over its area) of either body of a pair
/// against the other body of the pair, and all edges of either against the other where that is closed: a rim or a fold
/// may pass through a thin tool between the samples (edge_depth.hpp).
///
/// Which side a point is on is decided by exact predicates alone. Closed body: inside where the signed number of
/// surface crossings of the upward ray (the winding number) is not 0. Open sheet: the winding number of the sheet's and
/// the point's motion since the first frame, that is the upward ray's signed crossings now minus those at the start,
/// minus what the sheet's rim contributed by passing over the ray. In the first frame the body's points are judged by
/// the straight way from the one that is farthest from the sheet. Where edges of the body pass through the sheet, the
/// first of them tells which points are on the side that the scene declares (BodyRange::start_side), and those are on
/// the right side; else the farthest point is. So a tool may start deep. Points that go around the rim, or through the
/// sheet and back, are therefore on the right side. So is what the surface of an instrument or rigid
/// body joins, round a free rim that is inside the body or has slipped past it, to no fewer points on the right side:
/// what is inside then is tissue, which is judged from the other side. Ties are broken by thinking every sample moved
/// by the same infinitesimal step, upwards first (Edelsbrunner and Mücke 1990). Depth is then the distance to the
/// nearest point of the surface.
class DepthTruth {
public:
    /// `counted` says which of Topology::body_pairs enter a Result (one flag each; empty = all).
    /// The topology outlives the object.
    DepthTruth(const Topology& topology, const Frame& first, std::span<const std::uint8_t> counted = {},
               Index area_samples = default_area_samples);

    static constexpr Index default_area_samples = 1000;  ///< per body

    struct Result {
        double max_depth = 0.0;       ///< m, over the samples and edges of all counted body pairs
        double mean_depth = 0.0;      ///< m, area mean over penetrating area samples, 0 when none
        std::int64_t wrong_side = 0;  ///< samples inside a closed body or beyond a sheet, stretches of edges inside
        std::int64_t wrong_side_vertices = 0;  ///< of these, vertices
    };
    /// Feed the frames in order: sheets need the history. A frame with a non-finite number gives NaN and −1, and leaves
    /// the history as it was.
    Result measure(const Frame& frame);

    /// Depth of one vertex against body `into` on the last measured frame, m; 0 when it is on the right side. NaN when
    /// the two bodies are not tested against each other.
    [[nodiscard]] double depth_of_vertex(Index vertex, Index into) const;

    /// Smallest distance between a sample of one body and the surface of the other on the last measured frame, over the
    /// counted pairs, m; infinite when there is none.
    [[nodiscard]] double clearance() const;

    ~DepthTruth();
    DepthTruth(const DepthTruth&) = delete;
    DepthTruth& operator=(const DepthTruth&) = delete;
    DepthTruth(DepthTruth&&) = delete;
    DepthTruth& operator=(DepthTruth&&) = delete;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
