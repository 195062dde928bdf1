#include "respond/thesis_settings.hpp"

#include "respond/common.hpp"

namespace trocar {

std::vector<Parameter> thesis_parameters() {
    std::vector<Parameter> list{
        choice_parameter("profile", "faithful", {"faithful", "corrected", "printed"},
                         "the equations with the damper sign of 3.6 put right, with all corrections, or as printed"),
        choice_parameter(
            "distribute", "force_alpha", {"force_alpha", "force_at_vertex"},
            "force on a face: shared out by barycentric weights (§4.3.1), or on the nearest vertex (§3.4)"),
        number_parameter("n_back", "1", "10", 0.0, 1e6, "ticks that back-projection (§3.4.5) goes back; 0: none"),
        number_parameter("l_max", "m", "0.02", 0.0, 1e3, "longest back-projection"),
        choice_parameter("contacts", "implicit", {"implicit", "explicit", "zero_order_hold"},
                         "contact forces in the tissue's sub-steps: implicit, explicit, or held over the tick")};
    const std::vector<Parameter> law = law_parameters(
        "the scene's, else 1000 between instruments and rigid bodies; on tissue the mean of the springs, corrected "
        "3e6 N/m3 times the vertex' own area");
    list.insert(list.begin() + 1, law.begin(), law.end());
    return list;
}

ThesisSettings read_thesis_settings(const ParameterValues& values) {
    ThesisSettings s;
    s.profile = values.is("profile", "printed")     ? Profile::printed
                : values.is("profile", "corrected") ? Profile::corrected
                                                    : Profile::faithful;
    s.distribute = values.is("distribute", "force_alpha");
    s.n_back = values.number("n_back");
    s.l_max = values.number("l_max");
    s.law = read_law_settings(values);
    s.contact_timing = values.is("contacts", "zero_order_hold") ? ContactTiming::at_tick_start
                       : values.is("contacts", "explicit")      ? ContactTiming::at_substep_start
                                                                : ContactTiming::implicit;
    return s;
}

}  // namespace trocar
