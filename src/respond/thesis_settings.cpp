#include "respond/thesis_settings.hpp"

#include <string>
#include <utility>

#include "respond/common.hpp"

namespace trocar {
namespace {

Parameter choice(const std::string& name, std::vector<std::string> choices, const std::string& meaning) {
    choices.insert(choices.begin(), "auto");
    return {.name = name,
            .type = Parameter::Type::choice,
            .default_value = "auto",
            .choices = std::move(choices),
            .meaning = meaning};
}

}  // namespace

std::vector<Parameter> thesis_parameters() {
    Parameter restitution = number_parameter(
        "e", "1", "0", 0.0, 1.0, "restitution in 3.8 and 3.11: 0 the printed equation, 1 the printed words");
    std::vector<Parameter> list{
        {.name = "profile",
         .type = Parameter::Type::choice,
         .default_value = "faithful",
         .choices = {"faithful", "corrected", "printed"},
         .meaning = "what auto means below: the equations with the damper sign of 3.6 put right, all corrections, or "
                    "3.6 as printed as well"},
        choice("distribute", {"force_alpha", "force_at_vertex"},
               "force on a face: shared out by barycentric weights (§4.3.1, auto), or on the nearest vertex (§3.4)"),
        choice("reduction", {"pair", "vertex"},
               "one response per triangle pair in sorted order (faithful), or one per vertex and other body, per "
               "pair of edges and, with the pair's k once, per pair of bodies without tissue (corrected)"),
        choice(
            "closest_point", {"off", "on"},
            "depth and velocity of a face: plane and nearest vertex (faithful), or at the closest point (corrected)"),
        choice("normal", {"face", "blend"}, "normal of the face (faithful), or blended vertex normals (corrected)"),
        choice("stiffness", {"springs", "area"},
               "on tissue: mean of the springs (faithful), or kappa times the vertex' own area (corrected)"),
        number_parameter("kappa", "N/m3", "3e6", 0.0, 1e12, "elastic foundation for stiffness=area"),
        choice("clamp", {"off", "on"}, "contact force may pull (faithful), or lies between 0 and f_max (corrected)"),
        number_parameter("f_max", "N", "5", 0.0, 1e6, "largest spring force of one contact with clamp=on"),
        choice("edges", {"interval", "normal"},
               "crossing edges: along the interval by its length (faithful), or along their common normal (corrected)"),
        choice("path", {"absolute", "relative"},
               "contact position of a tissue vertex: its own path (faithful), or as seen from the face, else "
               "the closest point (corrected)"),
        choice("reaction", {"equilibrium", "impulse"},
               "force on the tool of a placed vertex: equilibrium of A2 (faithful), or momentum (corrected)"),
        restitution,
        choice("rigid_tissue", {"vertex", "all"},
               "bone: only tissue vertices in bone (faithful), or also bone in tissue and edges (corrected)"),
        choice("tissue_tissue", {"exchange", "impulse"},
               "two tissues: elastic exchange along V_R per pair (faithful), or impulse along the normal and penalty "
               "(corrected)"),
        number_parameter("e_tissue", "1", "0.2", 0.0, 1.0, "restitution with tissue_tissue=impulse"),
        choice("resolution", {"none", "back_projection"},
               "interpenetration: left, or velocity back-projection (auto, §3.4.5)"),
        number_parameter("n_back", "1", "10", 0.0, 1e6, "ticks that back-projection looks back"),
        number_parameter("l_max", "m", "0.02", 0.0, 1e3, "longest back-projection"),
        choice("grasp", {"off", "follow", "spring"},
               "grasped tissue: follows the tool (faithful), or on springs that slip at 2 N (corrected)"),
        number_parameter("grasp_k", "N/m", "300", 0.0, 1e6, "stiffness that holds a vertex with grasp=spring"),
        number_parameter("grasp_slip", "N", "2", 0.0, 1e6, "force on one vertex at which it slips with grasp=spring"),
        number_parameter(
            "jaw_length", "m", "0.012", 0.0, 1e3,
            "how far from the tip towards the shaft a grasp may hold tissue, and 2.5/12 of it to the sides; in a "
            "scene of another size grasp_k and grasp_slip want another value too"),
        number_parameter(
            "release_time", "s", "0.05", 0.0, 10.0,
            "with grasp=spring, time in which the force on a vertex that slips or is let go falls evenly to zero "
            "(eight vertices at 2 N each: 0.32 N per tick of 1 ms); 0: at once, as grasp=follow always does"),
        choice("tip_proxy", {"on", "off"},
               "tip against bone: by a god-object, as the thesis leaves it to GHOST (faithful, §3.4.2), or by the "
               "equations "
               "(corrected)"),
        {.name = "contacts",
         .type = Parameter::Type::choice,
         .default_value = "implicit",
         .choices = {"implicit", "explicit", "hold"},
         .meaning = "contact forces in the tissue's sub-steps: implicit, explicit, or held over the tick"}};
    const std::vector<Parameter> law =
        law_parameters("1000 between instruments and rigid bodies, on tissue as `stiffness` says");
    list.insert(list.begin() + 1, law.begin(), law.end());
    return list;
}

ThesisSettings read_thesis_settings(const ParameterValues& values) {
    const bool corrected = values.is("profile", "corrected");
    const auto on = [&](const char* name, const char* word) {
        return values.is(name, "auto") ? corrected : values.is(name, word);
    };
    ThesisSettings s;
    s.printed_damper = values.is("profile", "printed");
    s.distribute = !values.is("distribute", "force_at_vertex");
    s.reduce = on("reduction", "vertex");
    s.closest_point = on("closest_point", "on");
    s.blended_normal = on("normal", "blend");
    s.area_stiffness = on("stiffness", "area");
    s.clamp = on("clamp", "on");
    s.edge_normal = on("edges", "normal");
    s.relative_path = on("path", "relative");
    s.impulse_reaction = on("reaction", "impulse");
    s.all_rigid_cases = on("rigid_tissue", "all");
    s.impulse_tissue = on("tissue_tissue", "impulse");
    s.tip_proxy = values.is("tip_proxy", "auto") ? !corrected : values.is("tip_proxy", "on");
    s.back_projection = !values.is("resolution", "none");
    if (values.is("grasp", "auto")) {
        s.grasp = corrected ? GraspRule::spring : GraspRule::follow;
    } else if (!values.is("grasp", "off")) {
        s.grasp = values.is("grasp", "spring") ? GraspRule::spring : GraspRule::follow;
    }
    s.grasping = {.both_jaws = s.grasp == GraspRule::spring,
                  .stiffness = values.number("grasp_k"),
                  .slip_force = values.number("grasp_slip"),
                  .jaw_length = values.number("jaw_length"),
                  .release_time = s.grasp == GraspRule::spring ? values.number("release_time") : 0.0};
    s.restitution = values.number("e");
    s.tissue_restitution = values.number("e_tissue");
    s.kappa = values.number("kappa");
    s.f_max = values.number("f_max");
    s.n_back = values.number("n_back");
    s.l_max = values.number("l_max");
    s.law = read_law_settings(values);
    s.contact_timing = values.is("contacts", "hold")       ? ContactTiming::at_tick_start
                       : values.is("contacts", "explicit") ? ContactTiming::at_substep_start
                                                           : ContactTiming::implicit;
    return s;
}

}  // namespace trocar
