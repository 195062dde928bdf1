// The switches of the response `thesis`: every correction of METHODS §13 is one of them. Here they are declared for
// users and read into plain values, `auto` replaced by what the profile stands for; thesis.cpp acts on them.
#pragma once

#include <cstdint>
#include <vector>

#include "method/entry.hpp"
#include "respond/grasp.hpp"

namespace trocar {

enum class Resolution : std::uint8_t { none, back_projection, ledger };
enum class GraspRule : std::uint8_t { off, follow, spring };

/// What the parameters come down to after `auto` has been replaced by the profile's choice.
struct ThesisSettings {
    bool printed_damper = false;    ///< sign of the damper in 3.6 as printed
    bool distribute = true;         ///< §4.3.1: force shared out over the face; false: on the vertex, §3.4
    bool reduce = false;            ///< one contact per vertex and other body, per edge pair; false: per triangle pair
    bool closest_point = false;     ///< depth and velocity from the closest surface point; false: plane, nearest vertex
    bool blended_normal = false;    ///< vertex normals blended; false: face normal
    bool area_stiffness = false;    ///< kappa A_v on tissue; false: mean of springs
    bool clamp = false;             ///< force on contact between 0 and f_max; false: as the equation gives it
    bool edge_normal = false;       ///< edges pushed along their common normal; false: along the interval
    bool rigid_patch = false;       ///< between what does not deform: one contact per patch; false: each its own
    bool hold_rigid = false;        ///< with rigid_patch, where a hand yields: stiff; false: the pair's k
    bool constrain = false;         ///< tissue in an instrument or bone: held by a stiff contact; false: placed (3.8)
    bool share_squeeze = false;     ///< tissue between bodies that overlap: both give way; false: held hard by both
    bool relative_path = false;     ///< 3.7: path seen from the face, else closest point; false: absolute path
    bool impulse_reaction = false;  ///< reaction of placed tissue from momentum; false: equilibrium of A2
    bool all_rigid_cases = false;   ///< R2T also where the bone enters the tissue
    bool impulse_tissue = false;    ///< T2T along the contact normal, closing only, with penalty; false: 3.12-3.17
    bool tip_proxy = true;          ///< tip against bone by a god-object; false: by 3.4 and 3.5 like the rest
    Resolution resolution = Resolution::none;
    GraspRule grasp = GraspRule::off;
    GraspSettings grasping;
    double restitution = 0.0;         ///< e in 3.8 and 3.11
    double tissue_restitution = 0.2;  ///< e between tissues, impulse_tissue only
    double kappa = 3e6;               ///< N/m³
    double f_max = 5.0;               ///< N
    double n_back = 10.0;             ///< ticks
    double l_max = 0.02;              ///< m
    double k = 0.0;                   ///< NaN: auto
    double mu = 0.0;                  ///< NaN: auto
    double friction = 0.0;            ///< Coulomb coefficient on tissue
    double friction_k = 1000.0;       ///< N/m, of the tangential spring
    double rigid_settle = 0.0025;     ///< s, in which a stiff contact stops a hand
    double settle_time = 0.003;       ///< s, time constant with which a constraint clears a depth
    double clear_speed = 0.0;         ///< m/s, fastest at which a constraint clears a depth; NaN: auto
    bool anchor_faces = false;  ///< ledger pushes the faces that a sample touches; false: along the blended normal
    bool meet_tools = false;    ///< tissue that a tool or bone is about to meet is held before it has crossed
    bool edge_samples = false;  ///< ledger follows points on long edges of tools and bones too; false: vertices only
    double slip_damping = 4.0;  ///< 1, of the ledger, see steady()
    double tear_time = 0.0;     ///< s at the strain limit until rupture; NaN: auto
    double d_max = 0.0;         ///< m, rupture beyond; NaN: auto
    bool contacts_held = false;
    bool contacts_explicit = false;
};

std::vector<Parameter> thesis_parameters();
ThesisSettings read_thesis_settings(const ParameterValues& values);

}  // namespace trocar
