// Reflection with bump and friction (Policarpo and Watt; thesis ref. 34): the colliding point is a particle, the other
// surface a plane; the particle is put on the plane and its velocity mirrored. It knows no forces: what the tool is
// shown is the momentum it gave. Between non-deformable bodies, whose device mass a response does not know, it acts as
// `penalty`.
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Settings {
    double bump = 0.0;      ///< 0: no bounce, 1: the normal speed is kept
    double friction = 1.0;  ///< 1: no friction, 0: the particle sticks
};

class Reflection final : public Response {
public:
    explicit Reflection(const Settings& settings) : settings_(settings) {}

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
        for (const PointContact& contact : points_.list()) {
            if (topology_->bodies[at(contact.body_b)].kind != BodyKind::tissue) {
                effect.contacts.push_back(spring_damper(*topology_, *materials_, laws_, frame, contact));
                continue;
            }
            const double mobility = edits_.mobility(contact.a) + edits_.mobility(contact.b);
            if (mobility == 0.0) continue;
            // What is left of the depth after earlier contacts have moved the same vertices.
            const Vector3 moved = edits_.position(frame, contact.b) - contact.b.blend(frame.position) -
                                  (edits_.position(frame, contact.a) - contact.a.blend(frame.position));
            const double depth = contact.depth - moved.dot(contact.normal);
            if (depth > 0.0) {
                edits_.change_position(frame, contact.b, depth / mobility * contact.normal);
                edits_.change_position(frame, contact.a, -depth / mobility * contact.normal);
            }
            const Vector3 relative = edits_.velocity(frame, contact.b) - edits_.velocity(frame, contact.a);
            const double speed = relative.dot(contact.normal);
            if (speed >= 0.0) continue;
            const Vector3 tangential = relative - speed * contact.normal;
            const Vector3 after = settings_.friction * tangential - settings_.bump * speed * contact.normal;
            const Vector3 impulse = (after - relative) / mobility;
            edits_.change_velocity(frame, contact.b, impulse);
            edits_.change_velocity(frame, contact.a, -impulse);
            if (topology_->bodies[at(contact.body_a)].kind == BodyKind::instrument) {
                add_reaction(contact.body_a, contact.a.blend(frame.position), -impulse / dt, effect);
            }
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
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry reflection_response() {
    ResponseEntry entry;
    entry.name = "reflection";
    entry.version = "1";
    entry.table_row = "F. Policarpo et al";
    entry.own = true;
    entry.parameters = {{.name = "bump",
                         .unit = "1",
                         .default_value = "0",
                         .minimum = 0.0,
                         .maximum = 1.0,
                         .meaning = "0: slides on, 1: bounces with its normal speed"},
                        {.name = "friction",
                         .unit = "1",
                         .default_value = "1",
                         .minimum = 0.0,
                         .maximum = 1.0,
                         .meaning = "1: none, 0: sticks"}};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Reflection>(
            Settings{.bump = values.number("bump"), .friction = values.number("friction")});
    };
    return entry;
}

}  // namespace trocar
