// Contact between bodies that do not deform, from features that have crossed: what two bodies press on each other with
// is the pair's k times the depth of the patch in which they overlap, however finely they are meshed.
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
    /// Appends springs and dampers for the features of instruments and rigid bodies that cross by the tick's end. Two
    /// surfaces press where they meet with their foremost features, a vertex or edges from which its own surface leads
    /// away from the other body: those say how deep the patch is and which way leads out. Feature i of depth d_i and
    /// area a_i has the share d_i² a_i in that, so that one that just enters changes nothing. All that has crossed and
    /// faces that way carries its share of the force, k times the depth, so that its centre moves evenly, too.
    /// Depths are those at the end of the tick, by the velocities of the frame; a patch may be open at its start.
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
    SurfaceNeighbours surface_;  ///< areas as at the first frame
    std::vector<Crossed> crossed_;
};

}  // namespace trocar
