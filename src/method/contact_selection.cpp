#include "method/contact_selection.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "method/entry.hpp"
#include "scene/vertex_springs.hpp"

namespace trocar {
namespace {

constexpr const char* look_ahead_name = "look_ahead";
constexpr const char* contact_offset_name = "contact_offset";

ContactSelection::Settings read_settings(const ParameterValues& values) {
    ContactSelection::Settings settings;
    if (values.is(look_ahead_name, "all")) {
        settings.rule = ContactSelection::Rule::all;
    } else if (values.is(look_ahead_name, "scripts")) {
        settings.rule = ContactSelection::Rule::scripts;
    } else {
        settings.look_ahead = values.number(look_ahead_name);
    }
    if (values.has(contact_offset_name)) settings.contact_offset = values.number(contact_offset_name);
    return settings;
}

/// Passes the selected contacts on to its response.
class SelectingResponse final : public Response {
public:
    SelectingResponse(std::unique_ptr<Response> response, const ContactSelection::Settings& settings)
        : response_(std::move(response)), selection_(settings) {}

    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override {
        return response_->values_in_force();
    }
    void prepare(const Topology& topology, const Materials& materials) override {
        selection_.prepare(topology, materials);
        response_->prepare(topology, materials);
    }
    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> contact_forces, ResponseOutput& output) override {
        const auto passes = [&](const Contact& contact) { return selection_.passes(frame, dt, contact); };
        const std::vector<Contact>& offered = contacts.contacts;
        const auto first_apart = std::find_if_not(offered.begin(), offered.end(), passes);
        if (first_apart == offered.end()) {
            response_->respond(frame, dt, contacts, contact_forces, output);
            return;
        }
        selected_.pairs = contacts.pairs;
        selected_.near = contacts.near;
        selected_.query_distance = contacts.query_distance;
        selected_.truncated = contacts.truncated;
        selected_.contacts.assign(offered.begin(), first_apart);
        std::copy_if(std::next(first_apart), offered.end(), std::back_inserter(selected_.contacts), passes);
        response_->respond(frame, dt, selected_, contact_forces, output);
        output.skip(SkipReason::apart, static_cast<std::int64_t>(offered.size() - selected_.contacts.size()));
    }

private:
    std::unique_ptr<Response> response_;
    ContactSelection selection_;
    ContactSet selected_;
};

}  // namespace

void ContactSelection::prepare(const Topology& topology, const Materials& materials) {
    edge_ = mean_spring_lengths(topology, materials);
}

bool ContactSelection::passes(const Frame& frame, double dt, const Contact& contact) const {
    const bool of_features = contact.kind == ContactCase::point_face || contact.kind == ContactCase::edge_edge;
    if (!of_features || settings_.rule == Rule::all) return true;
    if (settings_.rule == Rule::scripts) return !(contact.gap + contact.approach > 0.0);
    const double edge = edge_[static_cast<std::size_t>(contact.body_b)];
    const double closing =
        contact.on_a.blend(frame.velocity).dot(contact.normal) - contact.on_b.blend(frame.velocity).dot(contact.normal);
    const double gap = contact.gap - settings_.contact_offset * edge;
    return !(gap > settings_.look_ahead * edge + 2.0 * std::max(0.0, closing) * dt);
}

Parameter look_ahead_parameter() {
    return number_parameter(
        look_ahead_name, "1", "0.1", 0.0, 1e6,
        "gap up to which contacts are passed on beside what closes in the tick, in mean edges of the "
        "tissue; all: the whole query distance; scripts: what scripts alone close",
        {"all", "scripts"});
}

std::unique_ptr<Response> make_selecting(const ResponseEntry& entry, const ParameterValues& values) {
    return std::make_unique<SelectingResponse>(entry.make(values), read_settings(values));
}

}  // namespace trocar
