// Stepper `implicit`: linearly implicit Euler (Baraff and Witkin 1998) with one linearisation of the springs per step.
// Contacts are constraints with the full compliance of the tissue. The step size has no stability limit. Numerical
// damping suppresses motion that is faster than the step.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "method/entry.hpp"
#include "tissue/free_pieces.hpp"
#include "tissue/implicit_contacts.hpp"
#include "tissue/lagged_factor.hpp"
#include "tissue/spring_system.hpp"
#include "tissue/tissue_stepper.hpp"
#include "tissue/volume_system.hpp"

namespace trocar {
namespace {

/// Tolerance of the compliance between contacts: factor over that of the motion, and upper bound.
constexpr double roughly_by = 10.0;
constexpr double most_roughly = 1e-2;

/// Part of the velocity change of a step. Linear extrapolation of the last two steps is the initial guess of the next.
struct Trail {
    Matrix4X now;     ///< m/s
    Matrix4X before;  ///< m/s, in the last step
    Matrix4X change;  ///< m/s, from step to step

    void start(Eigen::Index vertices) {
        for (Matrix4X* part : {&now, &before, &change}) part->setZero(4, vertices);
    }
    void predict() {
        before = now;
        now += change;
    }
    void settle() { change = now - before; }
};

struct ImplicitSettings {
    int steps = 1;
    double tolerance = 1e-4;
    int iterations = 200;
    int factor = 0;  ///< ticks
};

class ImplicitStepper final : public TissueStepper {
public:
    explicit ImplicitStepper(const ImplicitSettings& settings) : TissueStepper(settings.steps), settings_(settings) {}

private:
    void prepare_steps() override {
        const std::size_t vertices = tissue().state().size();
        const std::size_t springs = tissue().springs().size();
        system_.emplace(springs, vertices);
        volumes_.emplace(tissue());
        gradients_.emplace(vertices);
        factor_.reset();
        if (settings_.factor > 0)
            gradients_->precondition_by(&factor_.emplace(tissue().spring_arrays(), *system_, tissue().state()));
        tick_ = 0;
        solver_.emplace(springs, vertices);
        pieces_.emplace(tissue().springs(), tissue().state());
        change_.setZero(4, static_cast<Eigen::Index>(vertices));
        start_ = change_;
        free_.start(change_.cols());
        pushed_.start(change_.cols());
    }

    void begin_tick() override { factor_is_due_ = factor_ && tick_++ % settings_.factor == 0; }

    double step(double h, bool known) override {
        TissueState& state = tissue().state();
        const SpringArrays& springs = tissue().spring_arrays();
        tissue().add_volume_force();
        system_kernels().front().linearise(h, springs, state, *system_);
        volumes_->add_to(h, *system_);
        if (factor_is_due_) factor_->renew(*system_);
        factor_is_due_ = false;
        system_kernels().front().invert_blocks(springs, *system_);
        volumes_->prepare_enclosures(h, *system_, settings_.tolerance, settings_.iterations, *gradients_);
        if (!pieces_->empty()) pieces_->begin(*system_, state);
        start_ = state.velocity;
        // First the free motion without contacts, then the motion with contact forces. The compliance between contacts
        // has a looser tolerance, because its error appears in the gaps of the next step. Each solve starts from the
        // extrapolated solution.
        free_.predict();
        gradients_->improve(springs, *system_, system_->right_side, settings_.tolerance, settings_.iterations,
                            free_.now);
        free_.settle();
        change_ = free_.now;
        volumes_->enclose(change_);
        state.velocity += change_;
        if (contacts().all().empty()) {
            pushed_.start(change_.cols());
        } else {
            const double roughly = std::min(most_roughly, roughly_by * settings_.tolerance);
            solver_->solve(h, known, springs, *system_, *volumes_, state, roughly, settings_.iterations, contacts());
            ImplicitContacts::add_impulses(h, contacts(), system_->right_side);
            pushed_.predict();
            change_ = free_.now + pushed_.now;
            gradients_->improve(springs, *system_, system_->right_side, settings_.tolerance, settings_.iterations,
                                change_, gradients_->size());
            pushed_.now = change_ - free_.now;
            pushed_.settle();
            volumes_->enclose(change_);
            state.velocity = start_ + change_;
        }
        if (!pieces_->empty()) close_momentum(h);
        if (!contacts().all().empty()) {
            stretch_slips(h);
            contacts().solve_impulses(h, steps(), state);
            contacts().finish_substep(h, steps(), state);
        }
        double furthest = 0.0;
        bool finite = true;
        for (std::size_t v = 0; v < state.size(); ++v) {
            if (state.inverse_mass[v] == 0.0) continue;
            const auto column = static_cast<Eigen::Index>(v);
            const Eigen::Vector4d path = h * state.velocity.col(column);
            state.position.col(column) += path;
            furthest = std::max(furthest, path.cwiseAbs().maxCoeff());
            finite = finite && state.position.col(column).allFinite();
        }
        furthest += contacts().shift(tissue());
        return finite ? furthest : std::numeric_limits<double>::quiet_NaN();
    }

    /// Corrects the momentum of free pieces for the residual of the iterations.
    void close_momentum(double h) {
        for (const TickContact& contact : contacts().all()) {
            const Vector3 impulse = h * (contact.force * contact.normal + contact.rubbed);
            for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
                pieces_->add(contact.vertex[i], contact.weight[i] * impulse);
            }
        }
        pieces_->close(*system_, start_, tissue().state());
    }

    /// Updates the stretch of the tangential springs after the step, see TickContacts::stretch.
    void stretch_slips(double h) {
        if (!contacts().any_has_friction()) return;
        contacts().gather_anchor(true);
        const TissueState& state = tissue().state();
        for (std::size_t c = 0; c < contacts().all().size(); ++c) {
            const TickContact& contact = contacts().all()[c];
            if (contact.has_friction && contacts().anchors(c))
                contacts().stretch(c, h * TickContacts::speed(contact, state));
        }
    }

    ImplicitSettings settings_;
    std::optional<SpringSystem> system_;
    std::optional<VolumeSystem> volumes_;
    std::optional<ConjugateGradients> gradients_;
    std::optional<LaggedFactor> factor_;
    std::int64_t tick_ = 0;
    bool factor_is_due_ = false;  ///< in the next step
    std::optional<ImplicitContacts> solver_;
    std::optional<FreePieces> pieces_;
    Trail free_;       ///< motion without contacts and enclosures
    Trail pushed_;     ///< contribution of contacts
    Matrix4X change_;  ///< m/s, velocity change of the step
    Matrix4X start_;   ///< m/s, velocities before the step
};

}  // namespace

StepperEntry implicit_stepper() {
    StepperEntry entry;
    entry.name = "implicit";
    entry.version = "1";
    entry.meaning = "linearly implicit Euler, one linearisation a step, contacts with the tissue's whole compliance";
    entry.takes_contact_force_laws = true;
    entry.takes_solved_contacts = true;
    entry.takes_position_corrections = true;
    entry.takes_held_forces = true;
    entry.parameters = {
        integer_parameter("steps", "1", 1, 1000, "steps a tick, each with a linearisation of its own"),
        number_parameter("tolerance", "1", "1e-4", 1e-14, 0.1,
                         "residual of a step's linear systems over their right side"),
        integer_parameter("iterations", "200", 1, 100000, "most iterations of conjugate gradients for one system"),
        integer_parameter("factor", "0", 0, 1000,
                          "ticks after which a sparse Cholesky factor of a step's system, made in a second "
                          "thread, is taken over as preconditioner of the steps from then on; 0: none, "
                          "3×3 blocks")};
    entry.make = [](const ParameterValues& values) {
        return std::make_unique<ImplicitStepper>(
            ImplicitSettings{.steps = static_cast<int>(values.integer("steps")),
                             .tolerance = values.number("tolerance"),
                             .iterations = static_cast<int>(values.integer("iterations")),
                             .factor = static_cast<int>(values.integer("factor"))});
    };
    return entry;
}

}  // namespace trocar
