// Contact of two bodies as an interval of time, from truth, and the time of its detection. Times are continuous: an
// event may begin and end between two frames.
#pragma once

#include "geometry/types.hpp"

namespace trocar {

/// From the first touch of two bodies' surfaces until they separate. Contact that is lost and found again within one
/// tick counts as lasting.
struct ContactEvent {
    Index body_a = -1;
    Index body_b = -1;
    double begin = not_known;  ///< s; the first frame's time when they touch there already
    double end = not_known;    ///< s; NaN: still in contact when the run ended
    double seen = not_known;   ///< s, time of the first frame at which the detector reported it; NaN: never
    [[nodiscard]] bool missed() const { return !(seen == seen); }
};

}  // namespace trocar
