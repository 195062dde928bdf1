// The switches of the response `thesis`: every correction of METHODS §13 is one of them. Here they are declared for
// users and read into plain values, `auto` replaced by what the profile stands for; thesis.cpp acts on them.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/effect.hpp"
#include "method/entry.hpp"
#include "respond/contact_laws.hpp"
#include "respond/grasp.hpp"

namespace trocar {

enum class GraspRule : std::uint8_t { off, follow, spring };

/// What the parameters come down to after `auto` has been replaced by the profile's choice.
struct ThesisSettings {
    bool printed_damper = false;    ///< sign of the damper in 3.6 as printed
    bool distribute = true;         ///< §4.3.1: force shared out over the face; false: on the vertex, §3.4
    bool reduce = false;            ///< one contact per vertex and other body, per edge pair, and one patch per pair of
                                    ///< bodies without tissue; false: per triangle pair
    bool closest_point = false;     ///< depth and velocity from the closest surface point; false: plane, nearest vertex
    bool blended_normal = false;    ///< vertex normals blended; false: face normal
    bool area_stiffness = false;    ///< kappa A_v on tissue; false: mean of springs
    bool clamp = false;             ///< force on contact between 0 and f_max; false: as the equation gives it
    bool edge_normal = false;       ///< edges pushed along their common normal; false: along the interval
    bool relative_path = false;     ///< 3.7: path seen from the face, else closest point; false: absolute path
    bool impulse_reaction = false;  ///< reaction of placed tissue from momentum; false: equilibrium of A2
    bool all_rigid_cases = false;   ///< R2T also where the bone enters the tissue
    bool impulse_tissue = false;    ///< T2T along the contact normal, closing only, with penalty; false: 3.12-3.17
    bool tip_proxy = true;          ///< tip against bone by a god-object; false: by 3.4 and 3.5 like the rest
    bool back_projection = false;   ///< §3.4.5
    GraspRule grasp = GraspRule::off;
    GraspSettings grasping;
    double restitution = 0.0;         ///< e in 3.8 and 3.11
    double tissue_restitution = 0.2;  ///< e between tissues, impulse_tissue only
    double kappa = 3e6;               ///< N/m³
    double f_max = 5.0;               ///< N
    double n_back = 10.0;             ///< ticks
    double l_max = 0.02;              ///< m
    LawSettings law;
    ContactTiming contact_timing = ContactTiming::implicit;
    bool operator==(const ThesisSettings&) const = default;
};

std::vector<Parameter> thesis_parameters();
ThesisSettings read_thesis_settings(const ParameterValues& values);

}  // namespace trocar
