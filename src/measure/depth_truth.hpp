// The independent answer about depth: how far points of one body lie inside another, from the frame alone. Never reads
// derive, a contact set or a method's state.
#pragma once

#include <cstdint>
#include <memory>

#include "scene/world.hpp"

namespace trocar {

/// Depth of instrument (or first-body) vertices and area samples inside closed bodies: exact inside/outside by winding
/// number, then distance to the nearest surface point. For open sheets: side by the exact crossing history since the
/// side the scene declares; the object keeps that history, so feed it every frame in order.
class DepthTruth {
public:
    DepthTruth(const Topology& topology, const Frame& first);
    struct Result {
        double max_depth = 0.0;       ///< m, over all body pairs
        double mean_depth = 0.0;      ///< m, area mean over penetrating samples, 0 when none
        std::int64_t wrong_side = 0;  ///< samples on the wrong side
    };
    Result measure(const Frame& frame);
    /// True depth of one point of body `from` against body `into` on the current frame (0 when outside).
    double depth_of(const Vector3& point, Index from, Index into) const;
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
