// Contacts of a response output within one tick of a stepper: those with free vertices, their current state, tangential
// springs and accumulated forces.
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

/// One contact within a tick. Its entries are the free vertices with signed weights; P is the weighted contact point.
struct TickContact {
    std::size_t source = 0;  ///< index in ResponseOutput::contacts
    int count = 0;
    std::array<Index, 6> vertex{};  ///< indices in the state
    std::array<double, 6> weight{};
    Vector3 normal = Vector3::Zero();
    double depth = 0.0;           ///< m, current
    double stiffness = 0.0;       ///< N/m
    double damping = 0.0;         ///< N s/m, >= 0, implicit part
    double explicit_damping = 0;  ///< N s/m, <= 0, explicit part
    /// m/s, part of the relative normal velocity of P from vertices and bodies that are not free
    double fixed_rate = 0.0;
    double mobility = 0.0;              ///< 1/kg, velocity of P per impulse
    double held = 0.0;                  ///< N, prescribed force, known before the sub-step
    double limit = 0.0;                 ///< N, largest force
    double force = 0.0;                 ///< N, in the last sub-step
    Vector3 surface = Vector3::Zero();  ///< m/s, velocity of the other side from vertices and bodies that are not free
    Vector3 rubbed = Vector3::Zero();   ///< N, tangential force on P in the last sub-step
    bool bilateral = false;
    bool pulls = false;
    bool solved = false;  ///< impulse computed by ResponseOutput::solver
    bool on = false;
    bool capped = false;  ///< on, with `force` at its limit instead of the spring's force
    bool has_friction = false;
    bool turns = false;

    [[nodiscard]] Vector3 along_surface(const Vector3& vector) const { return vector - vector.dot(normal) * normal; }
    /// Force law over a step of h (s) from the current state, without the explicit damping.
    [[nodiscard]] StepLaw law(double h) const { return {stiffness, damping, depth, h, pulls}; }
    [[nodiscard]] double within_limit(double given) const { return std::clamp(given, -limit, limit); }
};

class TickContacts {
public:
    /// Smallest weight on a free vertex for a solved contact; below it the impulse would eject that vertex.
    static constexpr double least_weight = 1e-4;

    /// `vertex_count`: vertices of the frame. `moving`: free vertices of the tissue.
    TickContacts(Index vertex_count, std::size_t moving);

    /// Reads the output's contacts with at least one free vertex; other vertices act by their velocity. The output must
    /// live until `react` of the same tick. `late`: m, per vertex of the state, its lag in the frame that gaps refer
    /// to; empty: none.
    void collect(const ResponseOutput& output, const Frame& frame, const TissueState& state,
                 std::span<const Vector3> late = {});
    [[nodiscard]] std::span<TickContact> all() { return contacts_; }
    [[nodiscard]] std::span<const TickContact> all() const { return contacts_; }
    [[nodiscard]] const ContactForceLaw& given(const TickContact& contact) const {
        return output_->contacts[contact.source];
    }
    /// Vertices of the state in contact, and the index of a state vertex among them, -1 = not in contact.
    [[nodiscard]] std::span<const Index> touched() const { return touched_; }
    [[nodiscard]] Index spot(Index local) const { return spot_[static_cast<std::size_t>(local)]; }

    /// Starts a sub-step by the output's ContactTiming. at_substep_start sets `held` to the force at the current state;
    /// at_tick_start keeps that of the frame. implicit updates normal and weights of constraints on a tissue face or
    /// edge. Linearisation once per tick would lag behind light vertices and excite their oscillation.
    void begin_substep(const TissueState& state);
    /// m/s, normal velocity of P relative to the other side, positive when the gap opens.
    [[nodiscard]] static double rate(const TickContact& contact, const TissueState& state);
    /// m/s, velocity of P relative to the other side.
    [[nodiscard]] static Vector3 speed(const TickContact& contact, const TissueState& state);

    /// Anchor: contacts that share one tangential spring, such as a vertex on several faces. Its stretch lies in the
    /// face of the strongest contact. It slides at the sum of all friction limits.
    struct Anchor {
        double most = 0.0;          ///< N, sum of friction limits
        std::size_t strongest = 0;  ///< index in all() of the strongest contact
        bool stays = false;         ///< keeps the strongest contact of the last call
    };
    /// Computes the anchors from the current contact forces. `keep`: the strongest contact of the last call in this
    /// step stays while it presses, because two equal contacts could alternate forever.
    void gather_anchor(bool keep = false);
    /// N s/m, critical damping of the tangential spring of a contact with friction.
    [[nodiscard]] double tangent_damping(const TickContact& contact) const {
        return 2.0 * std::sqrt(given(contact).tangent_k / contact.mobility);
    }
    [[nodiscard]] bool any_has_friction() const { return !rubbing_.empty(); }
    [[nodiscard]] const Anchor& anchor(Index key) const { return anchor_[static_cast<std::size_t>(key)]; }
    /// m, stretch of the tangential spring under a slip key.
    [[nodiscard]] auto slip(Index key) { return slip_.col(key); }
    /// True if this contact with friction is the strongest of its anchor, after `gather_anchor`. Clears the stretch of
    /// an anchor without normal force.
    [[nodiscard]] bool anchors(std::size_t number);
    /// Coulomb friction of the strongest contact over h (s), given the relative velocity of P without friction (m/s).
    /// An implicit tangential spring with a critical damper slides at friction × normal force. Sets `rubbed` and the
    /// stretch; the caller applies the force.
    void rub(std::size_t number, double h, const Vector3& speed);
    /// Updates the stretch after `rubbed` was computed elsewhere. At the friction limit the spring slides; below it the
    /// stretch grows by `path` (m), the relative displacement of P.
    void stretch(std::size_t number, const Vector3& path);
    /// Sets the stretch of a sliding spring to `rubbed` over its stiffness.
    void slide(std::size_t number);

    /// If the output has a solver: computes the impulses of contacts of role `solved` and adds them to the velocities.
    /// Called in each sub-step of h (s), after all other contacts have changed the velocities and before positions
    /// change.
    void solve_impulses(double h, int substeps, TissueState& state);
    [[nodiscard]] bool has_solver() const { return output_->solver != nullptr && !contacts_.empty(); }
    /// Applies the solver's position shifts of this sub-step, after the velocities. Returns a bound on the displacement
    /// of any coordinate, m. The tissue's energy gain counts as contact work.
    double shift(MovingTissue& tissue);

    /// Advances the gaps by the new velocities and accumulates the contact forces of a sub-step of h (s).
    void finish_substep(double h, int substeps, const TissueState& state);
    /// After the last sub-step: adds the opposite of the mean contact forces over the tick to `reaction`.
    void react(std::vector<Wrench>& reaction);
    /// Per contact of the output, complete after `react`; zero for contacts without tissue.
    [[nodiscard]] std::span<const ContactForce> contact_forces() const { return contact_forces_; }

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
    // Buffers keep the capacity of the largest contact count.
    std::vector<TickContact> contacts_;
    std::vector<Vector3> mean_normal_;          ///< N, per contact of the output: vector mean of the normal force
    std::vector<Vector3> mean_friction_;        ///< N, per contact of the output: vector mean of the friction
    std::vector<ContactForce> contact_forces_;  ///< per contact of the output
    Matrix3X slip_;                             ///< m, per slip key (N at first): stretch of the tangential spring
    std::vector<std::uint8_t> rubbed_;  ///< per slip key; 2: in contact in this tick, 1: in the last one, 0: neither
    std::vector<Index> rubbing_;        ///< slip keys with rubbed_ > 0
    std::vector<Anchor> anchor_;        ///< per slip key, of the sub-step
    std::vector<Index> touched_;
    std::vector<Index> spot_;               ///< per vertex of the state: index in touched_ or -1
    PredictedStep predicted_;               ///< last input of the solver; its columns are touched_
    std::vector<Vector3> velocity_before_;  ///< m/s, of touched_ at the start of the sub-step; only with a solver
    bool shifts_ = false;                   ///< the shifts in predicted_ belong to this sub-step
};

}  // namespace trocar
