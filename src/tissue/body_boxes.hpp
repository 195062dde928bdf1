// One bounding box per body, for a conservative test whether a moving tissue vertex may meet another body. A stepper
// that updates the far field late uses it to bound the displacement that it reports.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

class BodyBoxes {
public:
    /// The topology outlives the object.
    explicit BodyBoxes(const Topology& topology);

    /// Computes the boxes of all bodies from the frame.
    void start(const Frame& frame);
    /// Updates the boxes of bodies other than tissue that the frame lists as possibly moved.
    void follow(const Frame& frame);
    /// True if the body is tested against tissue. Its vertices must then be reported with `extend`.
    [[nodiscard]] bool has_opposite_tissue(Index body) const { return has_opposite_tissue_[at(body)] != 0; }
    /// Extends the box of the body to a point (m, world).
    void extend(Index body, const Vector3& point);
    /// True if the box of the segment, grown by `distance` (all m), overlaps the box of an opposite body. Boxes are
    /// axis-aligned in that body's frame. Also true if the topology lists no opposite body.
    [[nodiscard]] bool may_meet(Index body, const Vector3& from, const Vector3& to, double distance) const;

private:
    struct Place {
        Box box;  ///< m, in the body's own frame
        Matrix3 to_own = Matrix3::Identity();
        Vector3 origin = Vector3::Zero();  ///< m, world
    };
    void take(Index body, const Frame& frame);

    const Topology* topology_;
    std::vector<Place> places_;                      ///< per body
    std::vector<std::vector<Index>> opposite_;       ///< per body: bodies that it is tested against
    std::vector<std::uint8_t> has_opposite_tissue_;  ///< per body
};

}  // namespace trocar
