// The stepper `xpbd` solves springs, strain limit and contacts in one loop of small steps, each constraint once per
// step. Source: Macklin, Storey, Lu, Terdiman, Chentanez, Jeschke, Müller 2019, "Small steps in physics simulation".
// Compliance and damping are those of Macklin, Müller, Chentanez 2016, eq. 18 and 26. Any step length is stable; a step
// that is too long makes the springs softer.
#include <memory>
#include <span>
#include <vector>

#include "method/entry.hpp"
#include "tissue/stability.hpp"
#include "tissue/tissue_stepper.hpp"

namespace trocar {
namespace {

class XpbdStepper final : public TissueStepper {
public:
    explicit XpbdStepper(int substeps) : TissueStepper(substeps) {}

private:
    void prepare_steps() override {
        before_ = tissue().state().position;
        counter_.setZero(3, static_cast<Eigen::Index>(tissue().springs().size()));
        own_bias_.resize(4, 0);
        if (!tissue().volumes().enclosures().empty()) gradient_.setZero(3, before_.cols());
    }

    /// The rest bias of both ends balances a preload. As one force per vertex it would act before the springs and move
    /// tissue at rest. Each spring's part is therefore applied together with the spring. The parts are known if the run
    /// starts from the rest shape: they then sum to the bias.
    void begin_run(const Frame& start) override {
        const Matrix3X& bias = tissue().materials().rest_bias;
        if (bias.cols() != start.position.cols()) return;
        TissueState& state = tissue().state();
        own_bias_.setZero(4, static_cast<Eigen::Index>(state.size()));
        double largest = 0.0;
        for (std::size_t s = 0; s < tissue().springs().size(); ++s) {
            const Spring& spring = tissue().springs()[s];
            const Vector3 d = start.position.col(spring.j) - start.position.col(spring.i);
            if (d.norm() == 0.0) continue;
            const Vector3 tension = spring.preload * d.normalized();
            counter_.col(static_cast<Eigen::Index>(s)) = tension;
            own_bias_.col(state.place[at(spring.i)]).head<3>() -= tension;
            own_bias_.col(state.place[at(spring.j)]).head<3>() += tension;
            largest = std::max(largest, spring.preload);
        }
        constexpr double rounding = 1e-9;
        for (std::size_t v = 0; v < state.size(); ++v) {
            if (!tissue().materials().is_free(state.vertex[v])) continue;
            const auto column = static_cast<Eigen::Index>(v);
            if ((own_bias_.col(column).head<3>() - bias.col(state.vertex[v])).norm() <= rounding * largest) continue;
            counter_.setZero();
            own_bias_.setZero();
            return;
        }
    }

    double step(double h, bool known) override {
        TissueState& state = tissue().state();
        before_ = state.position;
        for (std::size_t v = 0; v < state.size(); ++v) {
            const double w = state.inverse_mass[v];
            if (w == 0.0) continue;
            const auto column = static_cast<Eigen::Index>(v);
            Eigen::Vector4d constant = state.constant.col(column);
            if (own_bias_.cols() > 0) constant -= own_bias_.col(column);
            state.velocity.col(column) = state.velocity.col(column) / (1.0 + h * w * state.drag[v]) + h * w * constant;
            state.position.col(column) += h * state.velocity.col(column);
        }
        for (std::size_t s = 0; s < tissue().springs().size(); ++s) draw_together(s, h);
        for (const Enclosure& enclosure : tissue().volumes().enclosures()) restore(enclosure, h);
        for (TickContact& contact : contacts().all()) press(contact, h, known);
        if (contacts().any_has_friction()) {
            contacts().gather_anchor();
            for (std::size_t c = 0; c < contacts().all().size(); ++c) rub(c, h);
        }
        for (std::size_t v = 0; v < state.size(); ++v) {
            const auto column = static_cast<Eigen::Index>(v);
            if (state.inverse_mass[v] != 0.0) {
                state.velocity.col(column) = (state.position.col(column) - before_.col(column)) / h;
            }
        }
        if (contacts().has_solver()) {
            contacts().solve_impulses(h, steps(), state);
            for (const Index local : contacts().touched()) {
                state.position.col(local) = before_.col(local) + h * state.velocity.col(local);
            }
            contacts().shift(tissue());
        }
        contacts().finish_substep(h, steps(), state);
        const auto path = (state.position - before_).cwiseAbs();
        return path.size() > 0 ? path.maxCoeff<Eigen::PropagateNaN>() : 0.0;
    }

    /// Thesis eq. 3.1 as a constraint of compliance 1/k: tension k (l - rest) + preload + c dl/dt, minus the spring's
    /// part of the rest bias. The strain limit bounds the length.
    void draw_together(std::size_t number, double h) {
        const Spring& spring = tissue().springs()[number];
        TissueState& state = tissue().state();
        const Index i = state.place[at(spring.i)];
        const Index j = state.place[at(spring.j)];
        const double wi = state.inverse_mass[at(i)];
        const double wj = state.inverse_mass[at(j)];
        const Vector3 d = (state.position.col(j) - state.position.col(i)).head<3>();
        const double length = d.norm();
        if (length == 0.0) return;
        const Vector3 u = d / length;
        const Vector3 before = (before_.col(j) - before_.col(i)).head<3>();
        const Vector3 counter = h * h * counter_.col(static_cast<Eigen::Index>(number));
        const double countered = counter.dot(u);
        const double slope = spring.k * h * h;
        const double damped = spring.damping * h;
        double drawn =
            (slope * (length - spring.rest) + spring.preload * h * h - countered + damped * (d - before).dot(u)) /
            (1.0 + (slope + damped) * (wi + wj));
        const double longest = (1.0 + tissue().materials().strain_limit) * spring.rest;
        if (spring.rest > 0.0 && length - drawn * (wi + wj) > longest) drawn = (length - longest) / (wi + wj);
        const Vector3 by = drawn * u - (counter - countered * u);
        state.position.col(i).head<3>() += wi * by;
        state.position.col(j).head<3>() -= wj * by;
    }

    /// An enclosure as a volume constraint of compliance V0/K.
    void restore(const Enclosure& enclosure, double h) {
        TissueState& state = tissue().state();
        const double volume = enclosed_volume(enclosure.triangles, state.position.topRows<3>());
        gradient_.setZero();
        add_volume_gradient(enclosure.triangles, state.position.topRows<3>(), 1.0, gradient_);
        double mobility = 0.0;
        for (std::size_t v = 0; v < state.size(); ++v) {
            mobility += state.inverse_mass[v] * gradient_.col(static_cast<Eigen::Index>(v)).squaredNorm();
        }
        const double stiff = h * h * enclosure.bulk_modulus / enclosure.volume;
        const double back = stiff * (volume - enclosure.volume) / (1.0 + stiff * mobility);
        for (std::size_t v = 0; v < state.size(); ++v) {
            const auto column = static_cast<Eigen::Index>(v);
            state.position.col(column).head<3>() -= back * state.inverse_mass[v] * gradient_.col(column);
        }
    }

    /// m, displacement of the contact point in this small step by free vertices.
    [[nodiscard]] Vector3 path(const TickContact& contact) const {
        Vector3 sum = Vector3::Zero();
        for (int i = 0; i < contact.count; ++i) {
            const Index v = contact.vertex[at(i)];
            sum += contact.weight[at(i)] * (tissue().state().position.col(v) - before_.col(v)).head<3>();
        }
        return sum;
    }

    void push(const TickContact& contact, const Vector3& by) {
        TissueState& state = tissue().state();
        for (int i = 0; i < contact.count; ++i) {
            const Index v = contact.vertex[at(i)];
            state.position.col(v).head<3>() += contact.weight[at(i)] * state.inverse_mass[at(v)] * by;
        }
    }

    /// Backward Euler: the force law at the rate (moved + F h² mobility) / h.
    void press(TickContact& contact, double h, bool known) {
        contact.force = contact.held;
        if (!known) {
            const double moved = path(contact).dot(contact.normal) + contact.fixed_rate * h;
            const StepLaw law = contact.law(h);
            double force = law.force(moved / h) / (1.0 + law.slope * h * contact.mobility);
            const bool on = contact.bilateral || contact.depth >= (contact.pulls ? 0.0 : moved);
            // Negative damping (eq. 3.6 as printed) is explicit.
            force -= contact.explicit_damping * TickContacts::rate(contact, tissue().state());
            if (!contact.pulls) force = std::max(force, 0.0);
            contact.force = on ? contact.within_limit(force) : 0.0;
        }
        push(contact, contact.force * h * h * contact.normal);
    }

    void rub(std::size_t number, double h) {
        TickContact& contact = contacts().all()[number];
        if (!contact.has_friction) return;
        contact.rubbed.setZero();
        if (!contacts().anchors(number)) return;
        contacts().rub(number, h, path(contact) / h - contact.surface);
        push(contact, h * h * contact.rubbed);
    }

    Matrix3X counter_;   ///< N, per spring, on i: force that balances its preload at rest
    Matrix4X own_bias_;  ///< N, per vertex of the state: sum of counter_; no columns without a rest bias
    Matrix3X gradient_;  ///< m², volume gradient per vertex of the state; only with enclosures
    Matrix4X before_;    ///< m, positions at the start of the small step
};

}  // namespace

StepperEntry xpbd_stepper() {
    StepperEntry entry;
    entry.name = "xpbd";
    entry.version = "1";
    entry.meaning = "springs, strain limit and contacts as compliant constraints, each once in every small step";
    entry.takes_contact_force_laws = true;
    entry.takes_solved_contacts = true;
    entry.takes_position_corrections = true;
    entry.takes_held_forces = true;
    entry.parameters = {
        integer_parameter("substeps", "10", 1, 1000, "small steps a tick; fewer make stiff tissue softer")};
    entry.make = [](const ParameterValues& values) {
        return std::make_unique<XpbdStepper>(static_cast<int>(values.integer("substeps")));
    };
    return entry;
}

}  // namespace trocar
