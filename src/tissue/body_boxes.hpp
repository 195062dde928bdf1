// Where the bodies of a scene are, one box for each: whether a vertex of tissue that goes somewhere else can have met
// any of them. A stepper that leaves the far field behind asks before it says how far the tissue has gone.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

class BodyBoxes {
public:
    /// The topology outlives the object.
    explicit BodyBoxes(const Topology& topology);

    /// All bodies as the frame has them.
    void start(const Frame& frame);
    /// Bodies that are not tissue, as the frame has them, where it says that they may have moved.
    void follow(const Frame& frame);
    /// Whether other tissue may meet that body's: then it has to be reported with `extend`.
    [[nodiscard]] bool has_opposite_tissue(Index body) const { return has_opposite_tissue_[at(body)] != 0; }
    /// Tissue of that body gets as far as this point (m).
    void extend(Index body, const Vector3& point);
    /// Whether the straight way from one point to the other comes within a distance (all m) of the box of a body that
    /// is tested against that one; true where nothing is: who meets it is not in the topology. Boxes lie along the axes
    /// of a body's own frame.
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
    std::vector<std::vector<Index>> opposite_;       ///< per body: those that it is tested against
    std::vector<std::uint8_t> has_opposite_tissue_;  ///< per body
};

}  // namespace trocar
