// Contact between non-deformable bodies, from crossed features. The force is the pair's k times the depth of the
// overlapping patch, independent of the mesh.
#pragma once

#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "contact/response_output.hpp"
#include "respond/common.hpp"
#include "respond/contact_laws.hpp"
#include "respond/surface.hpp"

namespace trocar {

class RigidPatches {
public:
    /// `laws` outlives its use here.
    void prepare(const Topology& topology, const ContactLaws& laws);
    /// Appends springs and dampers for features of instruments and rigid bodies that overlap at the end of the tick.
    /// Foremost features (vertices or edges beyond which their own surface does not extend) determine depth and normal
    /// of the patch. Feature i of depth d_i and area a_i has the weight d_i² a_i, so that a feature that just enters
    /// changes nothing. The force k × depth is distributed over all features that face the normal, by weight. Depths
    /// are predicted from the frame's velocities; a patch may be open at the start of the tick.
    void respond(const Frame& frame, double dt, std::span<const Contact> contacts, ResponseOutput& output);

private:
    struct Crossed {
        const Contact* contact = nullptr;
        double depth = 0.0;  ///< m, at the end of the tick
        double area = 0.0;   ///< m²
        bool foremost = false;
        [[nodiscard]] double share() const { return depth * depth * area; }
    };
    [[nodiscard]] bool is_foremost(const Frame& frame, const Contact& contact) const;
    [[nodiscard]] bool is_outermost(const Frame& frame, const ContactPoint& point, const Vector3& direction) const;
    [[nodiscard]] double area_of(const ContactPoint& point) const;
    void press(const Frame& frame, std::span<const Crossed> patch, ResponseOutput& output) const;

    const Topology* topology_ = nullptr;
    const ContactLaws* laws_ = nullptr;
    SurfaceNeighbours surface_;  ///< areas of the first frame
    std::vector<Crossed> crossed_;
};

}  // namespace trocar
