// Penalty response whose instrument tips follow a god-object over bone (Zilles and Salisbury 1995; METHODS §8), as a
// haptic library adds it to a penalty-based simulator. Without a rigid body in the scene it is `penalty`.
#include <memory>
#include <utility>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"
#include "respond/tip_proxy.hpp"

namespace trocar {
namespace {

struct Settings {
    double radius = 5e-4;  ///< m
    LawSettings law = {};
    bool reduce = true;  ///< one closed contact per vertex and other body
};

class GodObjectResponse final : public Response {
public:
    explicit GodObjectResponse(const Settings& settings) : settings_(settings) {}

    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override { return laws_.values_in_force(); }
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.law);
        points_.prepare(topology);
        proxies_.prepare(topology, materials, settings_.radius);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        proxies_.respond(*topology_, *materials_, laws_, frame, contacts, output);
        for (ContactForceLaw& tip : output.contacts) report_at_start(*topology_, frame, dt, tip);
        others_.contacts.clear();
        for (const Contact& contact : contacts.contacts) {
            if (!proxies_.takes(*topology_, frame, contact)) others_.contacts.push_back(contact);
        }
        points_.gather(*topology_, frame, others_, settings_.reduce, output);
        for (const PointContact& contact : points_.list()) {
            output.contacts.push_back(spring_damper(*topology_, laws_, frame, dt, contact));
        }
    }

private:
    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
    TipProxies proxies_;
    ContactSet others_;
};

}  // namespace

ResponseEntry god_object_response() {
    ResponseEntry entry;
    entry.name = "god_object";
    entry.version = "1";
    entry.own = true;
    entry.same_as = "is penalty, on tissue and wherever no instrument's tip is at a rigid body";
    entry.parameters = law_parameters_on_tissue(auto_stiffness, false);
    entry.parameters.push_back(reduction_parameter());
    entry.parameters.push_back(number_parameter("radius", "m", "0.0005", 1e-9, 1.0,
                                                "of the ball that stands for the tip; its front is the tip"));
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<GodObjectResponse>(Settings{.radius = values.number("radius"),
                                                            .law = read_law_settings(values),
                                                            .reduce = values.is("reduction", "vertex")});
    };
    return entry;
}

}  // namespace trocar
