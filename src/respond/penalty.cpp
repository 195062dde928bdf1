// The plain penalty response that most simulators use: spring and damper along the contact normal, pressing only. It
// reads intersection contacts as well as a library's own, so that the contact generator can be a factor of a study.
// Of the method, not of this code: the normal is that of one face, so that near a corner of a faceted surface the force
// leans by the angle between faces; and on intersection contacts, which end where triangles no longer meet, deep tissue
// does not come to rest but lets go and is caught again (force to and fro by 5 to 10 %, whose mean depends on the
// tick).
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
    entry.parameters = law_parameters_on_tissue(
        "1000 between instruments and rigid bodies, on tissue the mean of the springs there", false);
    entry.parameters.push_back(reduction_parameter());
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<PointResponse>(
            PointResponse::Settings{.law = read_law_settings(values), .reduce = values.is("reduction", "vertex")});
    };
    return entry;
}

}  // namespace trocar
