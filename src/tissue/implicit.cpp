// The stepper `implicit`: linearly implicit Euler (Baraff and Witkin 1998), the springs linearised once a step, the
// contacts of the step as constraints with the whole compliance of the tissue. Bears any step; what it costs is
// damping: a motion that is faster than the step dies away instead of swinging.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "method/entry.hpp"
#include "tissue/free_pieces.hpp"
#include "tissue/implicit_contacts.hpp"
#include "tissue/shape_system.hpp"
#include "tissue/spring_system.hpp"
#include "tissue/tissue_stepper.hpp"

namespace trocar {
namespace {

struct ImplicitSettings {
    int steps = 1;
    double tolerance = 1e-3;
    int iterations = 200;
};

class ImplicitStepper final : public TissueStepper {
public:
    explicit ImplicitStepper(const ImplicitSettings& settings) : TissueStepper(settings.steps), settings_(settings) {}

private:
    void prepare_steps() override {
        const std::size_t vertices = tissue().state().size();
        const std::size_t springs = tissue().springs().size();
        const std::span<const Hinge> hinges = tissue().shape().elements().hinges;
        system_.emplace(springs, vertices, hinges);
        shape_.emplace(tissue());
        gradients_.emplace(vertices);
        solver_.emplace(springs, vertices, hinges.size());
        pieces_.emplace(tissue().springs(), tissue().state());
        change_.setZero(4, static_cast<Eigen::Index>(vertices));
        start_ = change_;
    }

    double step(double h, bool known) override {
        TissueState& state = tissue().state();
        const SpringArrays& springs = tissue().spring_arrays();
        tissue().add_shape_force();
        system_kernels().front().linearise(h, springs, state, *system_);
        shape_->add_to(h, *system_);
        system_kernels().front().invert_blocks(springs, *system_);
        shape_->prepare_enclosures(h, *system_, settings_.tolerance, settings_.iterations, *gradients_);
        if (!pieces_->empty()) {
            start_ = state.velocity;
            pieces_->begin(*system_, state);
        }
        // Free motion, without contacts.
        gradients_->solve(springs, *system_, system_->right_side, settings_.tolerance, settings_.iterations, change_);
        shape_->enclose(change_);
        state.velocity += change_;
        if (!contacts().all().empty()) {
            solver_->solve(h, known, springs, *system_, *shape_, state, settings_.tolerance, settings_.iterations,
                           contacts());
            solver_->correct(h, *shape_, settings_.tolerance, settings_.iterations, contacts(), state);
        }
        if (!pieces_->empty()) close_momentum(h);
        if (!contacts().all().empty()) {
            stretch_slips(h);
            contacts().finish_substep(h, steps(), state);
        }
        double furthest = 0.0;
        bool finite = true;
        for (std::size_t v = 0; v < state.size(); ++v) {
            if (state.inverse_mass[v] == 0.0) continue;
            const auto column = static_cast<Eigen::Index>(v);
            const Eigen::Vector4d way = h * state.velocity.col(column);
            state.position.col(column) += way;
            furthest = std::max(furthest, way.cwiseAbs().maxCoeff());
            finite = finite && state.position.col(column).allFinite();
        }
        return finite ? furthest : std::numeric_limits<double>::quiet_NaN();
    }

    /// Of pieces that nothing holds, what the iterations have left open.
    void close_momentum(double h) {
        for (const TickContact& contact : contacts().all()) {
            const Vector3 impulse = h * (contact.force * contact.normal + contact.rubbed);
            for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
                pieces_->add(contact.vertex[i], contact.weight[i] * impulse);
            }
        }
        pieces_->close(*system_, start_, tissue().state());
    }

    /// Tangential springs after the step: stretched by the way along the surface where they stick, as long as their
    /// force asks where they slide.
    void stretch_slips(double h) {
        if (!contacts().any_rubs()) return;
        contacts().gather_grip();
        const TissueState& state = tissue().state();
        for (std::size_t c = 0; c < contacts().all().size(); ++c) {
            const TickContact& contact = contacts().all()[c];
            if (!contact.rubs) continue;
            const LinearContact& source = contacts().given(contact);
            if (!contacts().grips(c)) continue;
            constexpr double rounding = 1e-9;
            if (contact.rubbed.norm() >= contacts().grip(source.slip_key).most * (1.0 - rounding)) {
                contacts().slide(c);
                continue;
            }
            Vector3 way = -h * contact.surface;
            for (int i = 0; i < contact.count; ++i) {
                const std::size_t place = static_cast<std::size_t>(i);
                way += h * contact.weight[place] * state.velocity.col(contact.vertex[place]).head<3>();
            }
            auto slip = contacts().slip(source.slip_key);
            const Vector3 stretched = slip + way;
            slip = stretched - stretched.dot(contact.normal) * contact.normal;
        }
    }

    ImplicitSettings settings_;
    std::optional<SpringSystem> system_;
    std::optional<ShapeSystem> shape_;
    std::optional<ConjugateGradients> gradients_;
    std::optional<ImplicitContacts> solver_;
    std::optional<FreePieces> pieces_;
    Matrix4X change_;  ///< m/s, of the velocities in a step
    Matrix4X start_;   ///< m/s, velocities before the step
};

}  // namespace

StepperEntry implicit_stepper() {
    StepperEntry entry;
    entry.name = "implicit";
    entry.version = "1";
    entry.meaning = "linearly implicit Euler, one linearisation a step, contacts with the tissue's whole compliance";
    entry.takes_linear_contacts = true;
    entry.takes_placements = true;
    entry.takes_held_forces = true;
    entry.parameters = {{.name = "steps",
                         .type = Parameter::Type::integer,
                         .unit = "1",
                         .default_value = "1",
                         .minimum = 1,
                         .maximum = 1000,
                         .meaning = "steps a tick, each with a linearisation of its own"},
                        {.name = "tolerance",
                         .unit = "1",
                         .default_value = "1e-3",
                         .minimum = 1e-14,
                         .maximum = 0.1,
                         .meaning = "residual of a step's linear systems over their right side"},
                        {.name = "iterations",
                         .type = Parameter::Type::integer,
                         .unit = "1",
                         .default_value = "200",
                         .minimum = 1,
                         .maximum = 100000,
                         .meaning = "most iterations of conjugate gradients for one system"}};
    entry.make = [](const ParameterValues& values) {
        return std::make_unique<ImplicitStepper>(
            ImplicitSettings{.steps = static_cast<int>(values.integer("steps")),
                             .tolerance = values.number("tolerance"),
                             .iterations = static_cast<int>(values.integer("iterations"))});
    };
    return entry;
}

}  // namespace trocar
