// Contacts of extended position-based dynamics (Macklin, Müller, Chentanez 2016): constraints of compliance 1/k without
// damping. Intended for the stepper `xpbd`, which projects each contact once in every small step (Macklin et al. 2019).
// Between bodies without tissue it is `penalty`.
#include <memory>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {

ResponseEntry xpbd_contact_response() {
    ResponseEntry entry;
    entry.name = "xpbd_contact";
    entry.version = "2";
    entry.own = true;
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {
        number_parameter("k", "N/m", "1e9", 0.0, 1e12,
                         "on tissue, 1 / compliance; 1e9 is rigid there; scene: the scene's k and mu", {"scene"}),
        reduction_parameter()};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        PointResponse::Settings settings;
        settings.law.k = values.number("k");
        if (!values.is("k", "scene")) settings.law.mu = 0.0;
        settings.law.tissue_alone = true;
        settings.reduce = values.is("reduction", "vertex");
        return std::make_unique<PointResponse>(settings);
    };
    return entry;
}

}  // namespace trocar
