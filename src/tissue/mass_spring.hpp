// The preloaded mass-spring tissue of thesis eq. 3.1 and its integrator: sub-stepped semi-implicit Euler in which every
// contact of the Effect is re-evaluated in every sub-step (METHODS §4). Constructed only when a scene has tissue.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/effect.hpp"
#include "contact/outcome.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Force of the tissue on each vertex: springs, preload, rest bias, damping, drag; 3×N, N. Contacts not included.
/// `force` is resized only when its size is wrong.
void internal_force(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity, Matrix3X& force);

/// Spring, preload and damping force of one spring on its vertex i (its vertex j gets the opposite), N. A spring of
/// zero length has no direction and gives none.
Vector3 spring_force(const Spring& spring, const Matrix3X& position, const Matrix3X& velocity);

/// Largest angular frequency of the undamped system by Gershgorin rows of K/m over the free vertices (METHODS §4),
/// rad/s. `contact_stiffness` (N entries or empty, N/m) is added to the diagonal of its vertex.
/// The undamped step limit is 2/omega; with damping gamma: w² dt² + gamma dt · 2 < 4, see critical_time_step.
double gershgorin_bound_omega(const Materials& materials, const Matrix3X& position,
                              std::span<const double> contact_stiffness = {});

/// Stiffness of the linearised tissue applied to a displacement of the free vertices: K·displacement, 3×N, N. Pinned
/// and massless vertices count as fixed. K holds axial stiffness k and transverse stiffness tension/length per spring.
void apply_stiffness(const Materials& materials, const Matrix3X& position, const Matrix3X& displacement,
                     Matrix3X& force);

/// Largest natural frequency of the linearised tissue and its mode.
struct LargestMode {
    double omega = 0.0;  ///< rad/s
    Matrix3X shape;      ///< 3×N, displacement of each vertex, largest entry 1
};
/// The exact counterpart of gershgorin_bound_omega: Lanczos iteration on M^-1/2 K M^-1/2 with full
/// re-orthogonalisation, to about 1e-12 relative.
LargestMode largest_mode(const Materials& materials, const Matrix3X& position);

/// Largest stable step of semi-implicit Euler with explicit damping, s: the root of omega² dt² + 2 rate dt = 4 with
/// 2 rate = `damping_rate` doubled, that is dt = (-c/m + sqrt((c/m)² + 4 omega²)) / omega² with damping_rate = c/m in
/// 1/s (the data's stab cases). Infinite for omega = 0 without damping.
double critical_time_step(double omega, double damping_rate);

/// Fewest sub-steps of a tick of dt that stay below the step limit by Gershgorin's bounds on stiffness and damping,
/// with 5 % to spare. Contacts need none: they are implicit.
int stable_substeps(const Materials& materials, const Matrix3X& position, double dt);

/// Whether semi-implicit Euler with explicit damping and the step h (s) is unstable for certain at this place: power
/// iteration finds a displacement x with h² xᵀKx + 2 h xᵀCx > 4 xᵀMx. False close to the limit or below it.
bool surely_unstable(const Materials& materials, const Matrix3X& position, double h);

class MassSpring {
public:
    /// Materials outlive the object.
    MassSpring(const Topology& topology, const Materials& materials);

    /// Integrates the tissue vertices of `frame` over dt: applies the placements, then Materials::substeps sub-steps.
    /// Writes position and velocity; previous becomes the position the sub-steps started from. Adds to `reaction` (one
    /// per body) the mean over the tick of what each linear contact gave to its reaction body; moments are about the
    /// world origin. Outcome unstable or not_finite when it blows up, also when it is only the strain limiter that
    /// keeps it from doing so; the frame is then left as it was.
    ///
    /// Damping of springs and drag are explicit, as in eq. 3.1; contacts are implicit (backward Euler on velocity and
    /// gap): all contacts of a sub-step are solved together, so that many contacts on one vertex share the load and
    /// their order does not matter. A contact that is not adhesive drops out where it would pull; an adhesive one acts
    /// while it penetrates; a bilateral one always. A negative mu (eq. 3.6 as printed) is taken explicitly, because
    /// backward Euler with a large step would turn negative damping into positive. With Effect::contacts_held the force
    /// at the start of the tick acts throughout; with Effect::contacts_explicit it is re-evaluated in every sub-step
    /// but from the state at its start.
    /// Friction (LinearContact::friction) follows the normal force of the same sub-step: a tangential spring with a
    /// critical damper, implicit in its own vertices, that slides at friction × normal force. Its stretch is kept under
    /// slip_key for as long as a contact of that key is in every tick's effect.
    Outcome advance(const Effect& effect, double dt, Frame& frame, std::vector<Wrench>& reaction);

    /// Largest edge strain after the last advance (1 = doubled length), and edges the limiter acted on.
    [[nodiscard]] double max_strain() const { return max_strain_; }
    [[nodiscard]] std::int64_t limited_edges() const { return limited_edges_; }
    /// Mean force along the normal that contact i of the last advance's effect gave, N; 0 for contacts without tissue.
    [[nodiscard]] std::span<const double> contact_force() const { return {mean_force_.data(), mean_force_.size()}; }

private:
    /// One contact inside a tick: entries are the moving vertices with their signed weights.
    struct Active {
        std::size_t source = 0;
        int count = 0;
        std::array<Index, 6> vertex{};
        std::array<double, 6> weight{};
        Vector3 normal = Vector3::Zero();
        double depth = 0.0;           ///< m, now
        double stiffness = 0.0;       ///< N/m
        double damping = 0.0;         ///< N s/m, >= 0, implicit
        double explicit_damping = 0;  ///< N s/m, <= 0
        double fixed_rate = 0.0;      ///< m/s, normal velocity of P minus that of the face from what does not move here
        double held = 0.0;            ///< N, for contacts_held
        double force = 0.0;           ///< N, of the last sub-step
        Vector3 surface = Vector3::Zero();  ///< m/s, velocity of the other side from what does not move here
        Vector3 rubbed = Vector3::Zero();   ///< N, friction of the last sub-step on P
        bool adhesive = false;
        bool bilateral = false;
        bool on = false;
        bool rubs = false;
    };

    Outcome integrate(const Effect& effect, double dt, Frame& frame, std::vector<Wrench>& reaction);
    void collect(const Effect& effect, const Frame& frame);
    [[nodiscard]] double rate(const Active& contact, const Matrix3X& velocity) const;
    void push(const Active& contact, double impulse, Matrix3X& velocity) const;
    void solve_contacts(double h);
    void sweep_contacts(double h);
    void rub(double h, const Effect& effect);
    void solve_linear(double h);
    void limit_strain();
    bool blows_up(double dt);

    const Materials* materials_;
    std::vector<Index> free_;    ///< vertices with mass that are not pinned
    std::vector<Index> tissue_;  ///< vertices with mass
    std::vector<double> inverse_mass_;
    double extent_ = 0.0;  ///< m, sum of rest lengths: no vertex may move further in one tick
    Matrix3X position_;
    Matrix3X velocity_;
    Matrix3X start_;
    Matrix3X force_;
    // Contact solve: buffers grow to the largest number of contacts seen and are kept.
    std::vector<Active> active_;
    std::vector<double> mean_force_;
    std::vector<Vector3> mean_friction_;  ///< N, per contact of the effect
    Matrix3X slip_;                       ///< 3×N, m: tangential spring of the contact remembered under a vertex
    std::vector<std::uint8_t> rubbed_;    ///< N; 2: in contact in this tick, 1: in the last one, 0: not
    std::vector<Index> rubbing_;          ///< vertices with rubbed_ > 0
    std::vector<Index> touched_;
    std::vector<Index> local_;  ///< N; position in touched_ or -1
    std::vector<Matrix3> block_inverse_;
    Matrix3X right_side_, solution_, residual_, direction_, image_, preconditioned_;
    std::vector<std::uint8_t> limited_;
    double max_strain_ = 0.0;
    std::int64_t limited_edges_ = 0;
    std::int64_t limited_ticks_ = 0;
};

}  // namespace trocar
