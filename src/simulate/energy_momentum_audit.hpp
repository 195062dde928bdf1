// EnergyMomentumAudit of a run, tick by tick: where the energy and the momentum of tissue and hands came from and where
// they went, from trajectories, masses and the forces reported. What the books do not account for is a figure.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/scene.hpp"
#include "tissue/virtual_coupling.hpp"

namespace trocar {

/// Tissue: gain of motion and springs = work of contacts, position corrections and held forces - what dampers and drag
/// took. Momentum: gain = impulses of contacts and held forces + what springs, dampers and drag to pinned vertices,
/// drag and rest bias gave. Hands: gain of motion = work of their springs and dampers + work of the load.
///
/// Within a tick velocities are taken as the parabola with the tick's ends and way (integrals by Simpson's rule); the
/// work of contacts is what the stepper reported its sub-steps, else mean force times way. What that does not resolve,
/// the integrator's own error and what stiff contacts lose in implicit steps is the remainder. It is summed with its
/// sign, so that what comes back later is no error; its largest size is the figure. In a tick in which the strain
/// limiter acted, what is lost beyond the rest is the limiter's; what is gained is an error.
class EnergyMomentumAudit {
public:
    /// The scene outlives the object.
    explicit EnergyMomentumAudit(const Scene& scene);

    /// One tick that went well: the frame that detect saw, the one after the step, what acted (loads one per contact of
    /// the output, one load per body), the hands after it, and whether the strain limiter acted. Allocates nothing.
    void observe(const Frame& seen, const Frame& after, const ResponseOutput& output,
                 std::span<const ContactForce> loads, std::span<const Wrench> body_load,
                 std::span<const DrivenOperator> operators, bool limited);

    /// J, that tissue has more in motion and springs than at the start; what dampers took is not in it.
    [[nodiscard]] double tissue_gain() const { return energy_ - first_energy_; }
    /// J, sum over the ticks of the absolute work that scripts and operators did on what contact pressed on their bodies
    /// and on what they held. Where jaws open or close, whose forces cancel, at most so much: all that contacts,
    /// position corrections and held forces gave in the tick.
    [[nodiscard]] double absolute_work() const { return absolute_work_; }

    /// The book_… figures; NaN where nothing is kept.
    [[nodiscard]] std::map<std::string, double> figures() const;

private:
    /// Remainders and what they are a share of.
    struct Account {
        double error = 0.0;                        ///< J, summed with its sign
        double worst = 0.0;                        ///< J, largest size of that
        double turnover = 0.0;                     ///< J, sizes of all that was booked
        Vector3 momentum_error = Vector3::Zero();  ///< N s
        double momentum_worst = 0.0;
        double impulse = 0.0;  ///< N s, sizes of all forces from outside
        void enter(double energy_remainder, double energy_moved, const Vector3& momentum_remainder, double impulses);
    };

    void observe_tissue(const Frame& seen, const Frame& after, const ResponseOutput& output,
                        std::span<const ContactForce> loads, bool limited);
    void observe_operator(std::size_t number, const DrivenOperator& coupling);
    void observe_tools(const Frame& seen, const Frame& after, std::span<const Wrench> body_load);
    [[nodiscard]] double tissue_energy(const Matrix3X& position, const Matrix3X& velocity) const;
    [[nodiscard]] Vector3 inner_force(const Matrix3X& position, const Matrix3X& velocity);
    double place(const ResponseOutput& output);

    const Scene* scene_;
    bool has_tissue_ = false;
    std::vector<std::uint8_t> free_;   ///< per vertex: tissue that can move
    std::vector<std::uint8_t> moves_;  ///< the same less what a position correction holds in the tick
    Matrix3X start_, start_velocity_, middle_, middle_velocity_, force_;
    bool started_ = false;
    double first_energy_ = 0.0;
    double energy_ = 0.0;
    double dissipated_ = 0.0;
    double limited_ = 0.0;  ///< J
    double turned_ =
        0.0;  ///< J, sizes of what contacts, position corrections and held forces gave tissue in the last tick
    double absolute_work_ = 0.0;
    std::vector<OperatorState> operator_before_;
    std::vector<Pose> pose_before_;
    Account tissue_;
    Account couplings_;
};

}  // namespace trocar
