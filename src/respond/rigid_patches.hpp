// Contact between bodies that do not deform, from features that have crossed: what two bodies press on each other with
// is the pair's k times the depth of the patch in which they overlap, however finely they are meshed.
#pragma once

#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "contact/effect.hpp"
#include "respond/common.hpp"

namespace trocar {

class RigidPatches {
public:
    /// k and mu are NaN where the method was given no number.
    void prepare(const Topology& topology, const Materials& materials, double k, double mu);
    /// Appends a spring and damper for every feature of instruments and rigid bodies that has crossed. Of one pair of
    /// bodies they add up to k times the largest depth along its normals: feature i of depth d_i and area a_i has the
    /// share d_i² a_i of that, so that a feature that just enters changes nothing.
    void respond(const Frame& frame, std::span<const Contact> contacts, Effect& effect);

private:
    struct Crossed {
        const Contact* contact = nullptr;
        double depth = 0.0;  ///< m, at the end of the tick
        double area = 0.0;   ///< m²
    };
    [[nodiscard]] double area_of(const ContactPoint& point) const;
    void press(const Frame& frame, double k, double mu, const Crossed& one, Effect& effect) const;

    const Topology* topology_ = nullptr;
    PairLaws laws_;
    bool measured_ = false;
    std::vector<double> area_;  ///< m², per vertex, a third of its faces at the first frame
    std::vector<Crossed> crossed_;
};

}  // namespace trocar
