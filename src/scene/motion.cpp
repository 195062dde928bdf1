#include "scene/motion.hpp"

#include <algorithm>

#include "scene/rotation.hpp"

namespace trocar {

Pose Motion::pose_at(double time) const {
    const auto pose_of = [](const MotionKey& key) {
        return Pose{
            .translation = key.translation, .rotation = rotation_from_degrees(key.rotation_degrees), .jaw = key.jaw};
    };
    if (keys.empty()) return {};
    const auto after = std::upper_bound(keys.begin(), keys.end(), time,
                                        [](double value, const MotionKey& key) { return value < key.time; });
    if (after == keys.begin()) return pose_of(keys.front());
    const MotionKey& from = *(after - 1);
    if (after == keys.end() || time == from.time) return pose_of(from);
    const MotionKey& to = *after;
    const double u = (time - from.time) / (to.time - from.time);
    return {.translation = from.translation + u * (to.translation - from.translation),
            .rotation = shortest_arc(rotation_from_degrees(from.rotation_degrees),
                                     rotation_from_degrees(to.rotation_degrees), u),
            .jaw = from.jaw + u * (to.jaw - from.jaw)};
}

}  // namespace trocar
