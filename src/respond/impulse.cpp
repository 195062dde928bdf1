// Impulse-based contact (Mirtich; thesis Table 2.1), solved by sequential impulses: each contact in turn gets the
// impulse for its target separating speed, in a few sweeps per sub-step. Only velocities change; a bias speed removes
// overlap. Between non-deformable bodies, whose device mass a response lacks, it acts as `penalty`.
#include <algorithm>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

class ImpulseSolver final : public SubstepSolver {
public:
    struct Choice {
        double restitution = 0.0;
        double bias = 0.2;  ///< fraction of the depth that the bias speed removes
        int sweeps = 10;
    };
    explicit ImpulseSolver(const Choice& choice) : choice_(choice) {
        total_.reserve(usual_contacts);
        target_.reserve(usual_contacts);
    }

    void solve(PredictedStep& step) override {
        const std::span<const SolvedContact> contacts = step.contacts();
        total_.assign(contacts.size(), 0.0);
        target_.clear();
        for (const SolvedContact& contact : contacts) target_.push_back(target(step, contact));
        for (int sweep = 0; sweep < choice_.sweeps; ++sweep) {
            for (std::size_t c = 0; c < contacts.size(); ++c) {
                // The accumulated impulse is clamped to >= 0; a single correction may be negative.
                const double change = (target_[c] - step.rate(contacts[c])) / contacts[c].mobility;
                const double next = std::max(total_[c] + change, 0.0);
                step.push(contacts[c], (next - total_[c]) * contacts[c].normal);
                total_[c] = next;
            }
        }
    }

private:
    /// m/s, least opening rate of the gap. An open contact may close within the step. Beyond that it bounces, or stops
    /// there without restitution.
    [[nodiscard]] double target(const PredictedStep& step, const SolvedContact& contact) const {
        const double bounce = -choice_.restitution * std::min(step.rate(contact), 0.0);
        if (contact.depth >= 0.0) return std::max(bounce, choice_.bias * contact.depth / step.time());
        return bounce > 0.0 && step.depth_after(contact) > 0.0 ? bounce : contact.depth / step.time();
    }

    Choice choice_;
    std::vector<double> total_;   ///< N s, per contact
    std::vector<double> target_;  ///< m/s, per contact
};

}  // namespace

ResponseEntry impulse_response() {
    ResponseEntry entry;
    entry.name = "impulse";
    entry.version = "2";
    entry.table_row = "B. Mirtich et al";
    entry.own = true;
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {
        number_parameter("e", "1", "0", 0.0, 1.0, "restitution, on tissue"),
        number_parameter("bias", "1", "0.2", 0.0, 1.0, "part of the depth worked off each time it acts"),
        integer_parameter("sweeps", "10", 1.0, 1000.0, "passes over all contacts each time it acts"),
        reduction_parameter()};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<PointResponse>(PointResponse::Settings{.reduce = values.is("reduction", "vertex")},
                                               std::make_unique<ImpulseSolver>(ImpulseSolver::Choice{
                                                   .restitution = values.number("e"),
                                                   .bias = values.number("bias"),
                                                   .sweeps = static_cast<int>(values.integer("sweeps"))}));
    };
    return entry;
}

}  // namespace trocar
