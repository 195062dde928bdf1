// Extended position-based dynamics for contacts (Macklin, Müller, Chentanez 2016): positions are moved until no point
// overlaps, with the compliance of a contact spring, and the move becomes velocity. Between non-deformable bodies,
// whose device mass a response does not know, it acts as `penalty`.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Settings {
    double k = 0.0;  ///< N/m; NaN: auto
    int iterations = 10;
};

class Xpbd final : public Response {
public:
    explicit Xpbd(const Settings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.k, Contact::unset);
        points_.prepare(topology);
        edits_.prepare(topology, materials);
        moment_.assign(at(topology.body_count()), {});
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, Effect& effect) override {
        effect.clear();
        edits_.clear();
        effect.skipped = points_.gather(*topology_, frame, contacts, true);
        lambda_.assign(points_.list().size(), 0.0);
        for (const PointContact& contact : points_.list()) {
            if (topology_->bodies[at(contact.body_b)].kind != BodyKind::tissue) {
                effect.contacts.push_back(spring_damper(*topology_, *materials_, laws_, frame, contact));
            }
        }
        for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
            for (std::size_t c = 0; c < points_.list().size(); ++c) {
                const PointContact& contact = points_.list()[c];
                const double mobility = edits_.mobility(contact.a) + edits_.mobility(contact.b);
                if (mobility == 0.0) continue;
                const double k = laws_.k(contact.body_a, contact.body_b);
                const double compliance = std::isnan(k) || k == 0.0 ? 0.0 : 1.0 / (k * dt * dt);
                const Vector3 moved = edits_.position(frame, contact.b) - contact.b.blend(frame.position) -
                                      (edits_.position(frame, contact.a) - contact.a.blend(frame.position));
                const double overlap = contact.depth - moved.dot(contact.normal);
                const double wanted = lambda_[c] + (overlap - compliance * lambda_[c]) / (mobility + compliance);
                const double next = std::max(wanted, 0.0);
                const Vector3 change = (next - lambda_[c]) * contact.normal;
                lambda_[c] = next;
                edits_.change_position(frame, contact.b, change);
                edits_.change_position(frame, contact.a, -change);
                // The move is part of this tick's velocity.
                edits_.change_velocity(frame, contact.b, change / dt);
                edits_.change_velocity(frame, contact.a, -change / dt);
            }
        }
        for (std::size_t c = 0; c < points_.list().size(); ++c) {
            const PointContact& contact = points_.list()[c];
            if (lambda_[c] == 0.0 || topology_->bodies[at(contact.body_a)].kind != BodyKind::instrument) continue;
            const Vector3 force = -lambda_[c] / (dt * dt) * contact.normal;
            add_reaction(contact.body_a, contact.a.blend(frame.position), force, effect);
        }
        edits_.write(effect);
        show_tip_forces(*topology_, *materials_, frame, false, moment_, effect);
    }

private:
    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    PairLaws laws_;
    PointContacts points_;
    VertexEdits edits_;
    std::vector<double> lambda_;  ///< kg m, per contact
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry xpbd_response() {
    ResponseEntry entry;
    entry.name = "xpbd";
    entry.version = "1";
    entry.own = true;
    entry.parameters = {stiffness_parameter("rigid (no compliance) on tissue, 1000 elsewhere"),
                        {.name = "iterations",
                         .type = Parameter::Type::integer,
                         .unit = "1",
                         .default_value = "10",
                         .minimum = 1.0,
                         .maximum = 1000.0,
                         .meaning = "passes over all contacts per tick"}};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Xpbd>(
            Settings{.k = values.number("k"), .iterations = static_cast<int>(values.integer("iterations"))});
    };
    return entry;
}

}  // namespace trocar
