// The contacts of a response output as a stepper sees them in one tick: which of them touch something that moves, where
// they stand now, the stretch of their tangential springs, and what they have given, for the loads and the reactions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/world.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/spring_kernels.hpp"

namespace trocar {

/// One contact inside a tick: entries are the moving vertices with their signed weights.
struct TickContact {
    std::size_t source = 0;  ///< number in the output
    int count = 0;
    std::array<Index, 6> vertex{};  ///< positions in the state
    std::array<double, 6> weight{};
    Vector3 normal = Vector3::Zero();
    double depth = 0.0;           ///< m, now
    double stiffness = 0.0;       ///< N/m
    double damping = 0.0;         ///< N s/m, >= 0, implicit
    double explicit_damping = 0;  ///< N s/m, <= 0
    double fixed_rate = 0.0;      ///< m/s, normal velocity of P minus that of the face from what does not move here
    double mobility = 0.0;        ///< 1/kg, velocity of P per impulse
    double held = 0.0;            ///< N, known before the sub-step
    double limit = 0.0;           ///< N, largest force
    double force = 0.0;           ///< N, of the last sub-step
    Vector3 surface = Vector3::Zero();  ///< m/s, velocity of the other side from what does not move here
    Vector3 rubbed = Vector3::Zero();   ///< N, along the surface, of the last sub-step on P
    bool adhesive = false;
    bool bilateral = false;
    bool solved = false;  ///< ResponseOutput::solver finds its impulse
    bool on = false;
    bool capped = false;  ///< on, and with the force `force` that its limit leaves it instead of its spring's
    bool has_friction = false;
    bool turns = false;

    [[nodiscard]] Vector3 along_surface(const Vector3& vector) const { return vector - vector.dot(normal) * normal; }
    /// Over a step of h (s) from here; the damper below 0 is not in it.
    [[nodiscard]] StepLaw law(double h) const { return {stiffness, damping, depth, h, bilateral || adhesive}; }
    [[nodiscard]] double within_limit(double given) const { return std::clamp(given, -limit, limit); }
};

class TickContacts {
public:
    /// A solved contact that has less of its weight on what moves gets no impulse: that vertex would be thrown.
    static constexpr double least_weight = 1e-4;

    /// `vertex_count` is that of the frame, `moving` how many of its vertices the tissue can move.
    TickContacts(Index vertex_count, std::size_t moving);

    /// Takes over the output's contacts that touch at least one vertex that moves; what does not move acts by its
    /// velocity. The output must live until `react` of the same tick. `late`: m, per vertex of the state how far it had
    /// been left behind in the frame that gaps are reported for; empty: none was.
    void collect(const ResponseOutput& output, const Frame& frame, const TissueState& state,
                 std::span<const Vector3> late = {});
    [[nodiscard]] std::span<TickContact> all() { return contacts_; }
    [[nodiscard]] std::span<const TickContact> all() const { return contacts_; }
    [[nodiscard]] const ContactForceLaw& given(const TickContact& contact) const {
        return output_->contacts[contact.source];
    }
    /// Positions in the state of the vertices that contacts act on, and of a vertex of the state its position among
    /// them, -1 = none acts on it.
    [[nodiscard]] std::span<const Index> touched() const { return touched_; }
    [[nodiscard]] Index spot(Index local) const { return spot_[static_cast<std::size_t>(local)]; }

    /// At the start of a sub-step, as the output's ContactTiming asks: at_substep_start makes `held` the force of the
    /// state as it stands (at_tick_start leaves that of the frame); implicit has constraints of a face or edge of
    /// tissue follow how it has turned and where on it the contact is by now. What is linearised once a tick lags
    /// behind light vertices, and feeds their swinging.
    void begin_substep(const TissueState& state);
    /// m/s, at which the gap opens.
    [[nodiscard]] static double rate(const TickContact& contact, const TissueState& state);
    /// m/s, of P against the other side.
    [[nodiscard]] static Vector3 speed(const TickContact& contact, const TissueState& state);

    /// The contacts that share one tangential spring: a vertex that several faces hold has one stretch, at the face
    /// that presses most, and slides at the sum of what all of them allow.
    struct Anchor {
        double most = 0.0;          ///< N
        std::size_t strongest = 0;  ///< position in all()
        bool stays = false;         ///< with the contact that was strongest before
    };
    /// Grips of the contacts' forces as they are now. `keep`: of the contacts that share a grip the one that was
    /// strongest at the last call of this step stays it while it presses, else two that press alike take turns for
    /// ever.
    void gather_anchor(bool keep = false);
    /// N s/m, critical, of the tangential spring of a contact that rubs.
    [[nodiscard]] double tangent_damping(const TickContact& contact) const {
        return 2.0 * std::sqrt(given(contact).tangent_k / contact.mobility);
    }
    [[nodiscard]] bool any_has_friction() const { return !rubbing_.empty(); }
    [[nodiscard]] const Anchor& anchor(Index key) const { return anchor_[static_cast<std::size_t>(key)]; }
    /// m, stretch of the tangential spring under a slip key.
    [[nodiscard]] auto slip(Index key) { return slip_.col(key); }
    /// Whether a contact that rubs is the one that holds its tangential spring, after `gather_anchor`; the spring of a
    /// grip that presses nowhere loses its stretch.
    [[nodiscard]] bool anchors(std::size_t number);
    /// Coulomb friction of a contact that grips, over h (s) from the speed (m/s) of P against the other side without
    /// it: a tangential spring with a critical damper, implicit, that slides at friction × normal force. Sets `rubbed`
    /// and the stretch of the spring; who calls pushes.
    void rub(std::size_t number, double h, const Vector3& speed);
    /// After a step whose friction `rubbed` was found otherwise: the spring of a contact that grips slides where it is
    /// at the most that friction allows; else it is longer by `path` (m), that of P against the other side.
    void stretch(std::size_t number, const Vector3& path);
    /// The spring of a contact that slides with the friction `rubbed` is as long as that asks.
    void slide(std::size_t number);

    /// Of a tick whose effect has a solver: has it find the impulses of the contacts of role `solved` and adds them to
    /// the velocities. Called in each of the tick's sub-steps of h (s), when all other contacts have acted on the
    /// velocities of its end and before these move anything.
    void solve_impulses(double h, int substeps, TissueState& state);
    [[nodiscard]] bool has_solver() const { return output_->solver != nullptr && !contacts_.empty(); }
    /// Moves the vertices that the solver has shifted in this sub-step, after the velocities have; gives how far a
    /// coordinate has gone, m. What tissue gains by it is work of the contacts.
    double shift(MovingTissue& tissue);

    /// Moves the gaps by the new velocities and adds up what each contact gave in a sub-step of h (s).
    void finish_substep(double h, int substeps, const TissueState& state);
    /// After the last sub-step: adds to the bodies that take reactions what the contacts gave, mean over the tick.
    void react(std::vector<Wrench>& reaction);
    /// Per contact of the output, complete after `react`; zero for contacts without tissue.
    [[nodiscard]] std::span<const ContactForce> loads() const { return loads_; }

private:
    bool enter(const ContactForceLaw& contact, const Frame& frame, const TissueState& state,
               std::span<const Vector3> late, TickContact& entry);
    void hold_current_force(const TissueState& state);
    void predict(double h, int substeps, const TissueState& state);
    [[nodiscard]] Vector3 shift_of(const TickContact& contact) const;
    void turn(const TissueState& state);
    void turn_tissues(const TissueState& state, TickContact& contact) const;
    void take_weights(const TissueState& state, const Vector3& weights, const Vector3& other_weights,
                      const Vector3& normal, TickContact& contact) const;
    void remember_slip(const ContactForceLaw& contact, TickContact& entry);

    const ResponseOutput* output_ = nullptr;
    double elapsed_ = 0.0;  ///< s, since the start of the tick
    // Buffers grow to the largest number of contacts seen and are kept.
    std::vector<TickContact> contacts_;
    std::vector<Vector3> mean_normal_;    ///< N, per contact of the output: mean force as a vector
    std::vector<Vector3> mean_friction_;  ///< N, per contact of the output
    std::vector<ContactForce> loads_;     ///< per contact of the output
    Matrix3X slip_;                       ///< per slip key (N at first), m: tangential spring of the contact
    std::vector<std::uint8_t> rubbed_;    ///< per slip key; 2: in contact in this tick, 1: in the last one, 0: not
    std::vector<Index> rubbing_;          ///< slip keys with rubbed_ > 0
    std::vector<Anchor> anchor_;          ///< of the sub-step, per slip key
    std::vector<Index> touched_;
    std::vector<Index> spot_;               ///< per vertex of the state: position in touched_ or -1
    PredictedStep predicted_;               ///< that the solver has been asked about last; its columns are touched_
    std::vector<Vector3> velocity_before_;  ///< m/s, of touched_ as the sub-step begins; only with a solver
    bool shifts_ = false;                   ///< its shifts are this sub-step's
};

}  // namespace trocar
