// Impulse-based contact (Mirtich; thesis Table 2.1): closing points get the impulse that gives them the wanted
// separating speed, one contact after the other, a few sweeps per tick. It changes velocities only; overlap is worked
// off by a bias speed. Between non-deformable bodies, whose device mass a response does not know, it acts as `penalty`.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

struct Choice {
    double restitution = 0.0;
    double bias = 0.2;  ///< part of the depth that the bias speed removes per tick
    int sweeps = 10;
};

class Impulse final : public PointResponse {
public:
    Impulse(const Settings& settings, const Choice& choice) : PointResponse(settings), choice_(choice) {}

private:
    void resolve(const Frame& frame, double dt, Effect& effect) override {
        total_.reserve(list().capacity());
        target_.reserve(list().capacity());
        total_.assign(list().size(), 0.0);
        target_.assign(list().size(), 0.0);
        for (std::size_t c = 0; c < list().size(); ++c) {
            const PointContact& contact = list()[c];
            const double closing = std::min(relative_velocity(frame, contact).dot(contact.normal), 0.0);
            // An open contact may close, by its gap at most.
            target_[c] = contact.depth < 0.0
                             ? contact.depth / dt
                             : std::max(-choice_.restitution * closing, choice_.bias * contact.depth / dt);
        }
        for (int sweep = 0; sweep < choice_.sweeps; ++sweep) {
            for (std::size_t c = 0; c < list().size(); ++c) {
                const PointContact& contact = list()[c];
                if (mobility(contact) == 0.0) continue;
                const double speed = relative_velocity(frame, contact).dot(contact.normal);
                // The sum of a contact's impulses never pulls, a single correction may.
                const double next = std::max(total_[c] + (target_[c] - speed) / mobility(contact), 0.0);
                push_apart(frame, contact, (next - total_[c]) * contact.normal);
                total_[c] = next;
            }
        }
        for (std::size_t c = 0; c < list().size(); ++c) {
            if (total_[c] != 0.0) react(frame, list()[c], total_[c] / dt * list()[c].normal, effect);
        }
    }

    Choice choice_;
    std::vector<double> total_;   ///< N s, per contact
    std::vector<double> target_;  ///< m/s, per contact
};

}  // namespace

ResponseEntry impulse_response() {
    ResponseEntry entry;
    entry.name = "impulse";
    entry.version = "1";
    entry.table_row = "B. Mirtich et al";
    entry.own = true;
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {{.name = "e",
                         .unit = "1",
                         .default_value = "0",
                         .minimum = 0.0,
                         .maximum = 1.0,
                         .meaning = "restitution, on tissue"},
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
    entry.parameters.push_back(reduction_parameter());
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Impulse>(PointResponse::Settings{.reduce = values.is("reduction", "vertex")},
                                         Choice{.restitution = values.number("e"),
                                                .bias = values.number("bias"),
                                                .sweeps = static_cast<int>(values.integer("sweeps"))});
    };
    return entry;
}

}  // namespace trocar
