// The stepper `semi_implicit`: sub-stepped semi-implicit Euler of the mass-spring tissue of thesis eq. 3.1, with
// implicit contacts (METHODS §4). An adapter of MassSpring.
#include <memory>
#include <optional>

#include "method/entry.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

class SemiImplicit final : public Stepper {
public:
    void prepare(const Topology& topology, const Materials& materials) override {
        tissue_.emplace(topology, materials);
    }
    [[nodiscard]] StepEstimate estimate(const Topology& /*topology*/, const Materials& materials,
                                        const Matrix3X& position, double dt, bool closely) const override {
        return explicit_step(materials, position, dt, closely);
    }
    Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction) override {
        return tissue_->advance(output, dt, from, to, reaction);
    }
    [[nodiscard]] std::span<const ContactForce> contact_forces() const override { return tissue_->contact_forces(); }
    [[nodiscard]] double max_strain() const override { return tissue_->max_strain(); }
    [[nodiscard]] std::int64_t limited_edges() const override { return tissue_->limited_edges(); }
    [[nodiscard]] double largest_move() const override { return tissue_ ? tissue_->largest_move() : 0.0; }

private:
    std::optional<MassSpring> tissue_;
};

}  // namespace

StepperEntry semi_implicit_stepper() {
    StepperEntry entry;
    entry.name = "semi_implicit";
    entry.version = "1";
    entry.meaning = "springs by sub-stepped semi-implicit Euler, the contacts of a sub-step together and implicit";
    entry.is_default = true;
    entry.takes_contact_force_laws = true;
    entry.takes_solved_contacts = true;
    entry.takes_position_corrections = true;
    entry.takes_held_forces = true;
    entry.make = [](const ParameterValues&) { return std::make_unique<SemiImplicit>(); };
    return entry;
}

}  // namespace trocar
