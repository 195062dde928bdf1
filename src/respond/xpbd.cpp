// Extended position-based dynamics for contacts (Macklin, Müller, Chentanez 2016): positions are moved until no point
// overlaps, with the compliance of a contact spring, and the move becomes velocity. Between non-deformable bodies,
// whose device mass a response does not know, it acts as `penalty`.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

class Xpbd final : public PointResponse {
public:
    Xpbd(const Settings& settings, int iterations) : PointResponse(settings), iterations_(iterations) {}

private:
    void resolve(const Frame& frame, double dt, Effect& effect) override {
        lambda_.reserve(list().capacity());
        lambda_.assign(list().size(), 0.0);
        for (int iteration = 0; iteration < iterations_; ++iteration) {
            for (std::size_t c = 0; c < list().size(); ++c) {
                const PointContact& contact = list()[c];
                const double movable = mobility(contact);
                if (movable == 0.0) continue;
                const double k = laws().k(contact.body_a, contact.body_b);
                const double compliance = std::isnan(k) || k == 0.0 ? 0.0 : 1.0 / (k * dt * dt);
                const double overlap = depth_left(frame, contact);
                const double next =
                    std::max(lambda_[c] + (overlap - compliance * lambda_[c]) / (movable + compliance), 0.0);
                const Vector3 change = (next - lambda_[c]) * contact.normal;
                lambda_[c] = next;
                move_apart(frame, contact, change);
                push_apart(frame, contact, change / dt);  // the move is part of this tick's velocity
            }
        }
        for (std::size_t c = 0; c < list().size(); ++c) {
            if (lambda_[c] != 0.0) react(frame, list()[c], lambda_[c] / (dt * dt) * list()[c].normal, effect);
        }
    }

    int iterations_;
    std::vector<double> lambda_;  ///< kg m, per contact
};

}  // namespace

ResponseEntry xpbd_response() {
    ResponseEntry entry;
    entry.name = "xpbd";
    entry.version = "1";
    entry.own = true;
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {stiffness_parameter("rigid (no compliance) on tissue, 1000 elsewhere"),
                        {.name = "iterations",
                         .type = Parameter::Type::integer,
                         .unit = "1",
                         .default_value = "10",
                         .minimum = 1.0,
                         .maximum = 1000.0,
                         .meaning = "passes over all contacts per tick, on tissue"}};
    entry.parameters.push_back(reduction_parameter());
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Xpbd>(
            PointResponse::Settings{.law = read_law_settings(values), .reduce = values.is("reduction", "vertex")},
            static_cast<int>(values.integer("iterations")));
    };
    return entry;
}

}  // namespace trocar
