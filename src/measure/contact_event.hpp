// A contact of two bodies as a stretch of time, from truth, and when a detector noticed it. Ticks are only its ruler:
// an event may begin and end between two frames, which is what a detector that examines frames alone misses.
#pragma once

#include <limits>

#include "geometry/types.hpp"

namespace trocar {

/// From the first touch of two bodies' surfaces to the moment they are apart again. Contact that is lost and found
/// again within one tick counts as lasting.
struct ContactEvent {
    static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    Index body_a = -1;
    Index body_b = -1;
    double begin = unknown;  ///< s; the first frame's time when they touch there already
    double end = unknown;    ///< s; NaN: still in contact when the run ended
    double seen = unknown;   ///< s, time of the first frame at which the detector reported it; NaN: never
    [[nodiscard]] bool missed() const { return !(seen == seen); }
};

}  // namespace trocar
