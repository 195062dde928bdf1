// Energy and momentum audit: compares the change of stored energy with the work of all forces, per tick. It reads
// trajectories, masses and contact forces.
#pragma once

#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "measure/metric.hpp"
#include "scene/scene.hpp"
#include "tissue/virtual_coupling.hpp"

namespace trocar {

/// Tissue energy: gain of kinetic and elastic energy = work of contacts, position corrections and held forces − losses
/// in dampers and drag. Tissue momentum: gain = impulse of contacts, held forces, drag and rest bias + impulse of
/// springs and dampers to pinned vertices. Operators: gain of kinetic energy = work of virtual coupling and damping +
/// work of the load.
///
/// Within a tick each velocity is a parabola through its end values that covers the tick's displacement. Integrals use
/// Simpson's rule. Contact work is ContactForce::work where the stepper gives it, else mean force times displacement.
///
/// The residual contains quadrature error, the integrator's own error and the losses of stiff contacts in implicit
/// steps. It is summed with its sign, so that energy returned later is no error; the figure is the largest absolute
/// sum. In a tick with an active strain limiter, a negative residual counts as the limiter's loss, a positive one as
/// error.
class EnergyMomentumAudit {
public:
    /// The scene outlives the object.
    explicit EnergyMomentumAudit(const Scene& scene);

    /// Audits one tick with outcome ok. `seen` is the frame that detect read, `after` the frame after the step.
    /// `contact_forces` has one entry per contact of the output, `body_load` one per body. `operators` are the
    /// operators after the tick; `limited`: the strain limiter acted. Allocates nothing.
    void observe(const Frame& seen, const Frame& after, const ResponseOutput& output,
                 std::span<const ContactForce> contact_forces, std::span<const Wrench> body_load,
                 std::span<const DrivenOperator> operators, bool limited);

    /// J, gain of kinetic and elastic energy of tissue since the start; damper losses are not added.
    [[nodiscard]] double tissue_gain() const { return energy_ - first_energy_; }
    /// J, sum over ticks of the absolute work of scripts and operators on contact forces and held position corrections.
    /// Forces on moving jaws cancel; such a tick adds an upper bound, the absolute work of all contacts, position
    /// corrections and held forces.
    [[nodiscard]] double absolute_work() const { return absolute_work_; }

    /// The figures energy_residual_…, momentum_residual_…, dissipated_energy_j, limiter_energy_j and absolute_work_j;
    /// NaN where nothing is audited.
    [[nodiscard]] Summary figures() const;

private:
    /// Signed residuals and the totals that scale them.
    struct Account {
        double error = 0.0;                        ///< J, signed sum
        double worst = 0.0;                        ///< J, largest |error|
        double turnover = 0.0;                     ///< J, sum of absolute work
        Vector3 momentum_error = Vector3::Zero();  ///< N s
        double momentum_worst = 0.0;
        double impulse = 0.0;  ///< N s, sum of absolute external impulses
        void enter(double energy_remainder, double energy_moved, const Vector3& momentum_remainder, double impulses);
    };

    void observe_tissue(const Frame& seen, const Frame& after, const ResponseOutput& output,
                        std::span<const ContactForce> contact_forces, bool limited);
    void observe_operator(std::size_t number, const DrivenOperator& coupling);
    void observe_tools(const Frame& seen, const Frame& after, std::span<const Wrench> body_load);
    [[nodiscard]] double tissue_energy(const Matrix3X& position, const Matrix3X& velocity) const;
    [[nodiscard]] Vector3 inner_force(const Matrix3X& position, const Matrix3X& velocity);
    double place(const ResponseOutput& output);

    const Scene* scene_;
    bool has_tissue_ = false;
    std::vector<std::uint8_t> free_;   ///< per vertex: 1 for free tissue
    std::vector<std::uint8_t> moves_;  ///< the same without vertices that a position correction holds in the tick
    Matrix3X start_, start_velocity_, middle_, middle_velocity_, force_;
    bool started_ = false;
    double first_energy_ = 0.0;
    double energy_ = 0.0;
    double dissipated_ = 0.0;
    double limited_ = 0.0;  ///< J
    double turned_ =
        0.0;  ///< J, absolute work of contacts, position corrections and held forces on tissue in the last tick
    double absolute_work_ = 0.0;
    std::vector<OperatorState> operator_before_;
    std::vector<Pose> pose_before_;
    Account tissue_;
    Account couplings_;
};

}  // namespace trocar
