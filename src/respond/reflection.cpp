// Reflection with bump and friction (Policarpo and Watt; thesis ref. 34): the colliding point is a particle, the other
// surface a plane; the particle is put on the plane and its velocity mirrored. It knows no forces: what the tool is
// shown is the momentum it gave. Two tissues that rest on each other bounce without end. Between non-deformable bodies,
// whose device mass a response does not know, it acts as `penalty`.
#include <memory>
#include <utility>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

struct Choice {
    double bump;      ///< 0: no bounce, 1: the normal speed is kept
    double friction;  ///< 1: no friction, 0: the particle sticks
};

class Reflection final : public PointResponse {
public:
    Reflection(const Settings& settings, const Choice& choice) : PointResponse(settings), choice_(choice) {}

private:
    void resolve(const Frame& frame, double dt, Effect& effect) override {
        for (const PointContact& contact : list()) {
            const double movable = mobility(contact);
            if (movable == 0.0) continue;
            const double depth = depth_left(frame, contact);
            if (depth < 0.0) {
                if (contact.depth < 0.0) effect.skip(SkipReason::not_handled);  // open: the particle meets no plane
                continue;
            }
            if (depth > 0.0) move_apart(frame, contact, depth / movable * contact.normal);
            const Vector3 relative = relative_velocity(frame, contact);
            const double speed = relative.dot(contact.normal);
            if (speed >= 0.0) continue;
            const Vector3 tangential = relative - speed * contact.normal;
            const Vector3 after = choice_.friction * tangential - choice_.bump * speed * contact.normal;
            const Vector3 impulse = (after - relative) / movable;
            push_apart(frame, contact, impulse);
            react(frame, contact, impulse / dt, effect);
        }
    }

    Choice choice_;
};

}  // namespace

ResponseEntry reflection_response() {
    ResponseEntry entry;
    entry.name = "reflection";
    entry.version = "1";
    entry.table_row = "F. Policarpo et al";
    entry.own = true;
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {{.name = "bump",
                         .unit = "1",
                         .default_value = "0",
                         .minimum = 0.0,
                         .maximum = 1.0,
                         .meaning = "0: slides on, 1: bounces with its normal speed; on tissue"},
                        {.name = "friction",
                         .unit = "1",
                         .default_value = "1",
                         .minimum = 0.0,
                         .maximum = 1.0,
                         .meaning = "1: none, 0: sticks"}};
    entry.parameters.push_back(reduction_parameter());
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Reflection>(
            PointResponse::Settings{.reduce = values.is("reduction", "vertex")},

            Choice{.bump = values.number("bump"), .friction = values.number("friction")});
    };
    return entry;
}

}  // namespace trocar
