// Reflection with bump and friction (Policarpo and Watt; thesis ref. 34): the contact point is a particle, the other
// surface a plane. A particle behind the plane is projected onto it and its velocity reflected, one contact after the
// other. Two tissues at rest on each other bounce without end. Between non-deformable bodies, whose device mass a
// response lacks, it acts as `penalty`.
#include <memory>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

class ReflectionSolver final : public SubstepSolver {
public:
    struct Choice {
        double bump = 0.0;      ///< 0: no bounce, 1: the normal speed is kept
        double friction = 1.0;  ///< 1: no friction, 0: the particle sticks
    };
    explicit ReflectionSolver(const Choice& choice) : choice_(choice) {}

    void solve(PredictedStep& step) override {
        for (const SolvedContact& contact : step.contacts()) {
            if (step.depth_after(contact) < 0.0) continue;
            const Vector3 before = step.velocity(contact);
            const double speed = before.dot(contact.normal);
            if (speed < 0.0) {
                const Vector3 tangential = before - speed * contact.normal;
                const Vector3 after = choice_.friction * tangential - choice_.bump * speed * contact.normal;
                step.push(contact, (after - before) / contact.mobility);
            }
            // An initially open contact ends on the plane.
            const double depth = step.depth_after(contact);
            if (depth > 0.0 || contact.depth < 0.0) step.shift(contact, depth / contact.mobility * contact.normal);
        }
    }

private:
    Choice choice_;
};

}  // namespace

ResponseEntry reflection_response() {
    ResponseEntry entry;
    entry.name = "reflection";
    entry.version = "2";
    entry.table_row = "F. Policarpo et al";
    entry.own = true;
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {
        number_parameter("bump", "1", "0", 0.0, 1.0, "0: slides on, 1: bounces with its normal speed; on tissue"),
        number_parameter("friction", "1", "1", 0.0, 1.0, "1: none, 0: sticks"), reduction_parameter()};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<PointResponse>(
            PointResponse::Settings{.reduce = values.is("reduction", "vertex")},
            std::make_unique<ReflectionSolver>(
                ReflectionSolver::Choice{.bump = values.number("bump"), .friction = values.number("friction")}));
    };
    return entry;
}

}  // namespace trocar
