// The plain penalty response that most simulators use: spring and damper along the contact normal, pressing only. It
// reads canonical contacts as well as a library's own, so that the contact source can be a factor of a study.
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Settings {
    bool reduce = true;  ///< one contact per vertex and other body, the deepest
    bool fulcrum = false;
    double k = 0.0;   ///< NaN: auto
    double mu = 0.0;  ///< NaN: auto
};

class Penalty final : public Response {
public:
    explicit Penalty(const Settings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.k, settings_.mu);
        points_.prepare(topology);
        moment_.assign(at(topology.body_count()), {});
    }

    void respond(const Frame& frame, double /*dt*/, const ContactSet& contacts, Effect& effect) override {
        effect.clear();
        effect.skipped = points_.gather(*topology_, frame, contacts, settings_.reduce);
        for (const PointContact& contact : points_.list()) {
            effect.contacts.push_back(spring_damper(*topology_, *materials_, laws_, frame, contact));
        }
        show_tip_forces(*topology_, *materials_, frame, settings_.fulcrum, moment_, effect);
    }

private:
    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    PairLaws laws_;
    PointContacts points_;
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry penalty_response() {
    ResponseEntry entry;
    entry.name = "penalty";
    entry.version = "1";
    entry.table_row = "B. Geiger et al";
    entry.own = true;
    entry.parameters = {
        stiffness_parameter("1000 between instruments and rigid bodies, on tissue the mean of the springs there"),
        damping_parameter(),
        {.name = "reduction",
         .type = Parameter::Type::choice,
         .default_value = "vertex",
         .choices = {"pair", "vertex"},
         .meaning = "one contact per triangle pair, or per vertex and other body (the deepest)"},
        tip_parameter("sum")};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Penalty>(Settings{.reduce = values.is("reduction", "vertex"),
                                                  .fulcrum = values.is("tip", "fulcrum"),
                                                  .k = values.number("k"),
                                                  .mu = values.number("mu")});
    };
    return entry;
}

}  // namespace trocar
