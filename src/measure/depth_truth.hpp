// Independent truth about depth: how far points of one body lie inside another, or beyond an open sheet. It reads the
// frames alone, never derive, a contact set or a method's state.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "measure/sheet_sides.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Samples are all vertices of a body and points spread evenly over its area. Samples of either body of a pair are
/// judged against the other body. Edges are judged too where the other body is closed, since a rim or a fold may pass
/// through a thin tool between samples (edge_depth.hpp).
///
/// Exact predicates alone decide the side of a point. Closed body: inside where the winding number (signed surface
/// crossings of the upward ray) is not 0. Open sheet: beyond where the sheet cuts the point off from the part of its
/// body that is on the right side (sheet_sides.hpp). A sample whose side is undecided, while the sheet's rim is inside
/// the body, has no depth and is counted. Parts of the sheet inside a closed body are still judged by the sheet's own
/// samples. Depth is the distance to the nearest point of the surface.
class DepthTruth {
public:
    /// `counted`: one flag per Topology::body_pairs entry that enters a Result; empty: all. The topology outlives the
    /// object. `sides_known`: false where nothing is known about the first frame; every sample is then undecided
    /// towards an open sheet.
    DepthTruth(const Topology& topology, const Frame& first, std::span<const std::uint8_t> counted = {},
               Index area_samples = default_area_samples, bool sides_known = true);

    static constexpr Index default_area_samples = 1000;  ///< per body

    struct Result {
        double residual_penetration = 0.0;       ///< m, over the samples and edges of all counted body pairs
        double residual_penetration_mean = 0.0;  ///< m, area mean over penetrating area samples, 0 when none
        std::int64_t wrong_side = 0;   ///< samples inside a closed body or beyond a sheet, and parts of edges inside
        double wrong_side_area = 0.0;  ///< m², that area samples on a wrong side stand for
        std::int64_t wrong_side_vertices = 0;  ///< of these, vertices
        std::int64_t side_undecided = 0;       ///< samples of undecided side; in none of the above
    };
    /// Frames must come in order, since their sequence decides how often a body has gone round a rim. A frame with a
    /// non-finite number gives NaN and −1, and leaves the state unchanged.
    Result measure(const Frame& frame);
    /// Follows the frame as measure() does, without the Result; enough for depth_of_vertex().
    void follow(const Frame& frame);

    /// Depth of one vertex against body `into` on the last measured frame, m; 0 on the right side. NaN when its side is
    /// undecided, and when the two bodies are not tested against each other.
    [[nodiscard]] double depth_of_vertex(Index vertex, Index into) const;

    /// Smallest distance on the last measured frame between a sample of one body and the surface of the other. Over the
    /// counted pairs, m; infinite without one.
    [[nodiscard]] double clearance() const;
    /// The same between two bodies, counted or not; 0 where a sample of one is on the wrong side of the other.
    [[nodiscard]] double clearance(Index body_a, Index body_b) const;

    /// Result of one sample, which is at a vertex (`place.triangle` -1) or on a triangle.
    struct Judgement {
        Index from = -1;    ///< the sample's body
        Index into = -1;    ///< the body that it is judged against
        Index vertex = -1;  ///< -1: on a triangle
        AreaSample place = {};
        Side side = Side::right;
        double depth = 0.0;  ///< m; 0 on the right side, NaN where undecided
    };
    /// All samples of the counted pairs on the last measured frame, so that other code can judge the same points.
    void each_sample(const std::function<void(const Judgement&)>& visit) const;

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
