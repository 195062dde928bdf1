// The plain penalty response with the tip of every instrument led over bone by a god-object (Zilles and Salisbury 1995;
// METHODS §8): what a haptic library adds to a simulator that has nothing but penalties. Without a rigid body in the
// scene it is `penalty`.
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
    double k = 0.0;        ///< N/m; NaN: auto
    double mu = 0.0;       ///< N s/m; NaN: auto
};

class GodObjectResponse final : public Response {
public:
    explicit GodObjectResponse(const Settings& settings) : settings_(settings) {}

    [[nodiscard]] bool holds_forces() const override { return false; }
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.k, settings_.mu);
        points_.prepare(topology);
        proxies_.prepare(topology, materials, settings_.radius);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, std::span<const ContactLoad> /*loads*/,
                 Effect& effect) override {
        effect.clear();
        proxies_.respond(*topology_, *materials_, laws_, frame, contacts, effect);
        for (LinearContact& tip : effect.contacts) tell_at_start(*topology_, frame, dt, tip);
        others_.contacts.clear();
        for (const Contact& contact : contacts.contacts) {
            if (!proxies_.takes(*topology_, frame, contact)) others_.contacts.push_back(contact);
        }
        effect.skipped = points_.gather(*topology_, frame, others_, true);
        for (const PointContact& contact : points_.list()) {
            effect.contacts.push_back(spring_damper(*topology_, *materials_, laws_, frame, dt, contact));
        }
    }

private:
    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    PairLaws laws_;
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
    entry.parameters = {
        stiffness_parameter("1000 between instruments and rigid bodies, on tissue the mean of the springs there"),
        damping_parameter(),
        {.name = "radius",
         .unit = "m",
         .default_value = "0.0005",
         .minimum = 1e-9,
         .maximum = 1.0,
         .meaning = "of the ball that stands for the tip; its front is the tip"}};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<GodObjectResponse>(
            Settings{.radius = values.number("radius"), .k = values.number("k"), .mu = values.number("mu")});
    };
    return entry;
}

}  // namespace trocar
