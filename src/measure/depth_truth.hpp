// The independent answer about depth: how far points of one body lie inside another, or beyond an open sheet, from the
// frames alone. Never reads derive, a contact set or a method's state.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "measure/sheet_sides.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Judges sample points (all vertices of a body, plus points spread evenly over its area) of either body of a pair
/// against the other body of the pair, and all edges of either against the other where that is closed: a rim or a fold
/// may pass through a thin tool between the samples (edge_depth.hpp).
///
/// Which side a point is on is decided by exact predicates alone. Closed body: inside where the signed number of
/// surface crossings of the upward ray (the winding number) is not 0. Open sheet: beyond where the sheet cuts the point
/// off from the part of its body that is on the right side (sheet_sides.hpp). Where the sheet's rim is inside the body
/// that may be open: such a sample is undecided, has no depth, and is counted; what of the sheet is inside a closed
/// body is judged from the other side all the same. Depth is the distance to the nearest point of the surface.
class DepthTruth {
public:
    /// `counted` says which of Topology::body_pairs enter a Result (one flag each; empty = all).
    /// The topology outlives the object.
    DepthTruth(const Topology& topology, const Frame& first, std::span<const std::uint8_t> counted = {},
               Index area_samples = default_area_samples);

    static constexpr Index default_area_samples = 1000;  ///< per body

    struct Result {
        double residual_penetration = 0.0;       ///< m, over the samples and edges of all counted body pairs
        double residual_penetration_mean = 0.0;  ///< m, area mean over penetrating area samples, 0 when none
        std::int64_t wrong_side = 0;  ///< samples inside a closed body or beyond a sheet, stretches of edges inside
        std::int64_t wrong_side_vertices = 0;  ///< of these, vertices
        std::int64_t side_undecided = 0;       ///< samples whose side is open; in none of the above
    };
    /// Feed the frames in order: how often a body has gone round a rim is known from them alone. A frame with a
    /// non-finite number gives NaN and −1, and leaves what is known as it was.
    Result measure(const Frame& frame);
    /// Takes the frame as measure() does and leaves out the Result, for who asks for depths of vertices alone.
    void follow(const Frame& frame);

    /// Depth of one vertex against body `into` on the last measured frame, m; 0 when it is on the right side. NaN when
    /// its side is undecided, and when the two bodies are not tested against each other.
    [[nodiscard]] double depth_of_vertex(Index vertex, Index into) const;

    /// Smallest distance between a sample of one body and the surface of the other on the last measured frame, over the
    /// counted pairs, m; infinite when there is none.
    [[nodiscard]] double clearance() const;
    /// The same between two bodies, counted or not; 0 where a sample of one is on the wrong side of the other.
    [[nodiscard]] double clearance(Index body_a, Index body_b) const;

    /// What is said of one sample, and where it rides: at a vertex (`place.triangle` -1), or on a triangle.
    struct Judgement {
        Index from = -1;    ///< the sample's body
        Index into = -1;    ///< the body that it is judged against
        Index vertex = -1;  ///< -1: on a triangle
        AreaSample place = {};
        Side side = Side::right;
        double depth = 0.0;  ///< m; 0 on the right side, NaN where undecided
    };
    /// All samples of the counted pairs on the last measured frame, so that others can judge the same points.
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
