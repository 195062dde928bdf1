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
#include "tissue/moving_tissue.hpp"
#include "tissue/spring_system.hpp"

namespace trocar {
namespace {

struct ImplicitSettings {
    int steps = 1;
    double tolerance = 1e-4;
    int iterations = 200;
};

class ImplicitStepper final : public Stepper {
public:
    explicit ImplicitStepper(const ImplicitSettings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        tissue_.emplace(topology, materials);
        const std::size_t vertices = tissue_->state().size();
        const std::size_t springs = tissue_->springs().size();
        contacts_.emplace(topology.vertex_count, vertices);
        const std::span<const Hinge> hinges = tissue_->shape().elements().hinges;
        system_.emplace(springs, vertices, hinges);
        shape_.emplace(*tissue_);
        gradients_.emplace(vertices);
        solver_.emplace(springs, vertices, hinges.size());
        pieces_.emplace(tissue_->springs(), tissue_->state());
        change_.setZero(4, static_cast<Eigen::Index>(vertices));
        start_ = change_;
        largest_move_ = 0.0;
    }

    [[nodiscard]] StepEstimate estimate(const Topology& /*topology*/, const Materials& materials,
                                        const Matrix3X& /*position*/, double /*dt*/, bool /*closely*/) const override {
        StepEstimate estimate;  // bears any step
        estimate.substeps = settings_.steps;
        estimate.springs = static_cast<std::int64_t>(materials.springs.size());
        return estimate;
    }
    Outcome advance(const Effect& effect, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction) override {
        tissue_->take_over(effect, from);
        contacts_->collect(effect, from, tissue_->state());
        Outcome outcome = steps(effect, dt, from);
        tissue_->release(effect);
        if (!outcome.ok()) return outcome;
        tissue_->give_back(effect, from, to);
        contacts_->react(reaction);
        return outcome;
    }

    [[nodiscard]] std::span<const ContactLoad> loads() const override { return contacts_->loads(); }
    [[nodiscard]] double max_strain() const override { return tissue_->max_strain(); }
    [[nodiscard]] std::int64_t limited_edges() const override { return tissue_->limited_edges(); }
    [[nodiscard]] double largest_move() const override { return largest_move_; }

private:
    Outcome steps(const Effect& effect, double dt, const Frame& from) {
        const double h = dt / settings_.steps;
        double bound = 0.0;  // m, no coordinate has gone further in this tick
        for (int step = 0; step < settings_.steps; ++step) {
            if (effect.contacts_explicit && !effect.contacts_held) contacts_->hold_current_force(tissue_->state());
            const bool known = effect.contacts_explicit || effect.contacts_held;
            if (!known) contacts_->turn(tissue_->state());
            const double furthest = one_step(h, known);
            bound += furthest;
            Outcome outcome = tissue_->check(std::isfinite(furthest), bound, effect, from);
            if (!outcome.ok()) return outcome;
        }
        tissue_->limit_strain();
        largest_move_ = tissue_->longest_way(from.position);
        return {};
    }

    /// Gives the furthest that a coordinate has gone, m; not finite where the numbers are not.
    double one_step(double h, bool known) {
        TissueState& state = tissue_->state();
        const SpringArrays& springs = tissue_->spring_arrays();
        tissue_->add_shape_force();
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
        if (!contacts_->all().empty()) {
            solver_->solve(h, known, springs, *system_, *shape_, state, settings_.tolerance, settings_.iterations,
                           *contacts_);
            solver_->correct(h, *shape_, settings_.tolerance, settings_.iterations, *contacts_, state);
        }
        if (!pieces_->empty()) close_momentum(h);
        if (!contacts_->all().empty()) {
            stretch_slips(h);
            contacts_->finish_substep(h, settings_.steps, state);
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
        for (const TickContact& contact : contacts_->all()) {
            const Vector3 impulse = h * (contact.force * contact.normal + contact.rubbed);
            for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
                pieces_->add(contact.vertex[i], contact.weight[i] * impulse);
            }
        }
        pieces_->close(*system_, start_, tissue_->state());
    }

    /// Tangential springs after the step: stretched by the way along the surface where they stick, as long as their
    /// force asks where they slide.
    void stretch_slips(double h) {
        if (!contacts_->any_rubs()) return;
        contacts_->gather_grip();
        const TissueState& state = tissue_->state();
        for (std::size_t c = 0; c < contacts_->all().size(); ++c) {
            const TickContact& contact = contacts_->all()[c];
            if (!contact.rubs) continue;
            const LinearContact& source = contacts_->given(contact);
            const TickContacts::Grip& grip = contacts_->grip(source.slip_key);
            auto slip = contacts_->slip(source.slip_key);
            if (grip.most <= 0.0) slip.setZero();
            if (grip.most <= 0.0 || grip.firmest != c) continue;
            constexpr double rounding = 1e-9;
            if (contact.rubbed.norm() >= grip.most * (1.0 - rounding)) {
                slip = source.tangent_k > 0.0 ? Vector3(-contact.rubbed / source.tangent_k) : Vector3(Vector3::Zero());
                continue;
            }
            Vector3 way = -h * contact.surface;
            for (int i = 0; i < contact.count; ++i) {
                const std::size_t place = static_cast<std::size_t>(i);
                way += h * contact.weight[place] * state.velocity.col(contact.vertex[place]).head<3>();
            }
            const Vector3 stretched = slip + way;
            slip = stretched - stretched.dot(contact.normal) * contact.normal;
        }
    }

    ImplicitSettings settings_;
    std::optional<MovingTissue> tissue_;
    std::optional<TickContacts> contacts_;
    std::optional<SpringSystem> system_;
    std::optional<ShapeSystem> shape_;
    std::optional<ConjugateGradients> gradients_;
    std::optional<ImplicitContacts> solver_;
    std::optional<FreePieces> pieces_;
    Matrix4X change_;  ///< m/s, of the velocities in a step
    Matrix4X start_;   ///< m/s, velocities before the step
    double largest_move_ = 0.0;
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
                         .default_value = "1e-4",
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
