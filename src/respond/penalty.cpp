// Penalty response: spring and damper along the contact normal, pressing only. It reads contacts of every generator, so
// that the generator can be a factor of a study.
//
// Limits of the method: at a corner of a faceted surface the force deviates by the angle between faces. Intersection
// contacts end where triangles no longer intersect, so that deep tissue oscillates. The force then varies by 5 to 10 %,
// and its mean depends on the tick.
#include <memory>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
ResponseEntry penalty_response() {
    ResponseEntry entry;
    entry.name = "penalty";
    entry.version = "1";
    entry.table_row = "B. Geiger et al";
    entry.own = true;
    entry.parameters = law_parameters_on_tissue(auto_stiffness, false);
    entry.parameters.push_back(reduction_parameter());
    entry.parameters.push_back(choice_parameter(
        "weight", "vertex", {"vertex", "area"},
        "on tissue k and mu act at every vertex alike; or times the pushed feature's area over the mean "
        "of a vertex, as an elastic foundation"));
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<PointResponse>(
            PointResponse::Settings{.law = read_law_settings(values), .reduce = values.is("reduction", "vertex")});
    };
    return entry;
}

}  // namespace trocar
