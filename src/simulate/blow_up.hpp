// Detects a run that contact has made unstable although every number in it is finite. The rule reads trajectories,
// masses and contact forces, and is the same for every method.
#pragma once

#include <span>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/outcome.hpp"
#include "contact/response_output.hpp"
#include "scene/scene.hpp"
#include "simulate/energy_momentum_audit.hpp"

namespace trocar {

/// A tick of tissue is `unstable` where one of these holds (METHODS §4):
/// - (a) Energy: for `energy_ticks` ticks in a row the gain of kinetic and elastic energy exceeds (1 + work_factor) ×
///   absolute work + `spare_energy` + start energy. The start energy is the static force of (c) times the
///   first depth. That is the depth of the deepest contact of the first tick, or of the first after an interval
///   without contact.
/// - (b) Strain: an edge is stretched beyond max(`most_strain`, the scene's limit) + path / max(its rest length, the
///   mean rest length). The path is that of kinematic bodies since first contact with tissue, plus the depth
///   of (a). The mean length bounds the divisor because a short edge shares the tension of its neighbours.
/// - (c) Force: tissue exerts more force on an instrument than all tissue can carry. Static part per tissue body: 2 Σ
///   (k s L + T) L / √A over its springs, with the strain limit s clamped to [1, 3]. It is the mean membrane tension
///   across a cut of length 4 √A, where A is the body's area. Dynamic part: the tissue mass times the acceleration to
///   the fastest kinematic vertex' speed within one tick.
class BlowUp {
public:
    /// The scene outlives the object.
    explicit BlowUp(const Scene& scene);

    /// Judges one tick before its frame replaces the last one; `audit` has observed it already. `reaction`: N, force of
    /// tissue on each body. Returns ok, or `unstable` with cause and figures. Allocates nothing while ok.
    Outcome judge(const Frame& seen, const Frame& after, const ContactSet& contacts, const ResponseOutput& output,
                  std::span<const ContactForce> contact_forces, std::span<const Wrench> reaction,
                  const EnergyMomentumAudit& audit);

    static constexpr double work_factor = 10.0;
    static constexpr double spare_energy = 10e-6;  ///< J
    static constexpr int energy_ticks = 10;
    static constexpr double most_strain = 3.0;

private:
    void follow(const Frame& seen, const ContactSet& contacts, const ResponseOutput& output,
                std::span<const ContactForce> contact_forces);
    Outcome judge_energy(const EnergyMomentumAudit& audit);
    [[nodiscard]] Outcome judge_strain(const Frame& after) const;
    [[nodiscard]] Outcome judge_force(const ResponseOutput& output, std::span<const Wrench> reaction) const;

    const Scene* scene_;
    std::vector<Range> driven_;
    double mean_rest_ = 0.0;    ///< m
    double most_force_ = 0.0;   ///< N, static part of bound (c)
    double mass_ = 0.0;         ///< kg, of tissue
    bool had_contact_ = false;  ///< in the tick before
    bool touched_ = false;
    double first_depth_ = 0.0;  ///< m
    double path_ = 0.0;         ///< m, path of kinematic bodies since first contact with tissue
    double move_ = 0.0;         ///< m, largest displacement of a kinematic vertex in this tick
    int rich_ticks_ = 0;
};

}  // namespace trocar
