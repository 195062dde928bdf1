// Methods that fail their promises, for tests of what the program says of them. They take the place of the library's
// two controls: a symbol of the program comes before the same one of a shared library.
#include <memory>
#include <stdexcept>

#include "method/entry.hpp"

namespace trocar {

DetectorEntry blind_detector();
ResponseEntry none_response();

namespace {

/// Knows of no pair, or of the first triangle of each of the first two bodies alone, or refuses every frame.
class Liar final : public Detector {
public:
    Liar(bool invents, bool refuses) : invents_(invents), refuses_(refuses) {}
    void prepare(const Topology& topology, const Frame& /*frame*/) override { topology_ = &topology; }
    void update(const Frame& /*frame*/, double /*query_distance*/) override {}
    void detect(const Frame& /*frame*/, ContactSet& contacts) override {
        contacts.clear();
        if (refuses_) contacts.outcome = {OutcomeKind::unsupported, "not this frame"};
        if (!invents_) return;
        contacts.pairs.push_back({topology_->bodies[0].triangles.first, topology_->bodies[1].triangles.first});
    }

private:
    bool invents_;
    bool refuses_;
    const Topology* topology_ = nullptr;
};

/// Gives up at tick 5.
class Quitter final : public Response {
public:
    void prepare(const Topology& /*topology*/, const Materials& /*materials*/) override {}
    void respond(const Frame& frame, double /*dt*/, const ContactSet& /*contacts*/,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        if (frame.tick == 5) throw std::runtime_error("had enough");
    }
};

}  // namespace

DetectorEntry blind_detector() {
    return {.name = "liar",
            .configuration = "claims to be exact and answers nothing, or one pair that nobody has asked for",
            .claims_exact = true,
            .parameters =
                {{.name = "invent", .type = Parameter::Type::choice, .default_value = "off", .choices = {"off", "on"}},
                 {.name = "refuse", .type = Parameter::Type::choice, .default_value = "off", .choices = {"off", "on"}}},
            .make = [](const ParameterValues& values) {
                return std::make_unique<Liar>(values.is("invent", "on"), values.is("refuse", "on"));
            }};
}

ResponseEntry none_response() {
    ResponseEntry entry;
    entry.name = "quitter";
    entry.configuration = "gives up at tick 5";
    entry.make = [](const ParameterValues&) { return std::make_unique<Quitter>(); };
    return entry;
}

}  // namespace trocar
