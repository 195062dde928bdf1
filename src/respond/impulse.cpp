// Impulse-based contact (Mirtich; thesis Table 2.1): closing points get the impulse that gives them the wanted
// separating speed, one contact after the other, a few sweeps per tick. It changes velocities only; overlap is worked
// off by a bias speed. Between non-deformable bodies, whose device mass a response does not know, it acts as `penalty`.
#include <algorithm>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Settings {
    double restitution = 0.0;
    double bias = 0.2;  ///< part of the depth that the bias speed removes per tick
    int sweeps = 10;
};

class Impulse final : public Response {
public:
    explicit Impulse(const Settings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, Contact::unset, Contact::unset);
        points_.prepare(topology);
        edits_.prepare(topology, materials);
        moment_.assign(at(topology.body_count()), {});
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, Effect& effect) override {
        effect.clear();
        edits_.clear();
        effect.skipped = points_.gather(*topology_, frame, contacts, true);
        total_.assign(points_.list().size(), 0.0);
        target_.assign(points_.list().size(), 0.0);
        for (std::size_t c = 0; c < points_.list().size(); ++c) {
            const PointContact& contact = points_.list()[c];
            if (topology_->bodies[at(contact.body_b)].kind != BodyKind::tissue) {
                effect.contacts.push_back(spring_damper(*topology_, *materials_, laws_, frame, contact));
                continue;
            }
            const double closing = std::min(separating_speed(frame, contact), 0.0);
            target_[c] = std::max(-settings_.restitution * closing, settings_.bias * contact.depth / dt);
        }
        for (int sweep = 0; sweep < settings_.sweeps; ++sweep) {
            for (std::size_t c = 0; c < points_.list().size(); ++c) {
                const PointContact& contact = points_.list()[c];
                const double mobility = edits_.mobility(contact.a) + edits_.mobility(contact.b);
                if (mobility == 0.0) continue;
                // The sum of a contact's impulses never pulls, a single correction may.
                const double wanted = total_[c] + (target_[c] - separating_speed(frame, contact)) / mobility;
                const double next = std::max(wanted, 0.0);
                const Vector3 change = (next - total_[c]) * contact.normal;
                total_[c] = next;
                edits_.change_velocity(frame, contact.b, change);
                edits_.change_velocity(frame, contact.a, -change);
            }
        }
        for (std::size_t c = 0; c < points_.list().size(); ++c) {
            const PointContact& contact = points_.list()[c];
            if (total_[c] == 0.0 || topology_->bodies[at(contact.body_a)].kind != BodyKind::instrument) continue;
            add_reaction(contact.body_a, contact.a.blend(frame.position), -total_[c] / dt * contact.normal, effect);
        }
        edits_.write(effect);
        show_tip_forces(*topology_, *materials_, frame, false, moment_, effect);
    }

private:
    [[nodiscard]] double separating_speed(const Frame& frame, const PointContact& contact) const {
        return (edits_.velocity(frame, contact.b) - edits_.velocity(frame, contact.a)).dot(contact.normal);
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    PairLaws laws_;
    PointContacts points_;
    VertexEdits edits_;
    std::vector<double> total_;   ///< N s, per contact
    std::vector<double> target_;  ///< m/s, per contact
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry impulse_response() {
    ResponseEntry entry;
    entry.name = "impulse";
    entry.version = "1";
    entry.table_row = "B. Mirtich et al";
    entry.own = true;
    entry.parameters = {
        {.name = "e", .unit = "1", .default_value = "0", .minimum = 0.0, .maximum = 1.0, .meaning = "restitution"},
        {.name = "bias",
         .unit = "1",
         .default_value = "0.2",
         .minimum = 0.0,
         .maximum = 1.0,
         .meaning = "part of the depth worked off per tick"},
        {.name = "sweeps",
         .type = Parameter::Type::integer,
         .unit = "1",
         .default_value = "10",
         .minimum = 1.0,
         .maximum = 1000.0,
         .meaning = "passes over all contacts per tick"}};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Impulse>(Settings{.restitution = values.number("e"),
                                                  .bias = values.number("bias"),
                                                  .sweeps = static_cast<int>(values.integer("sweeps"))});
    };
    return entry;
}

}  // namespace trocar
