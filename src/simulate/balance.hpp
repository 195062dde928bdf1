// Books of one run: what momentum and energy the contacts took from one body and did not give to the other, and what
// work they did on the tool. Kept from trajectories, masses and the forces shown, so that no response can flatter
// itself.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "contact/tip_force.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// A contact spell is a stretch of ticks with pairs or a force on the tool, with gaps of at most `bridged_ticks`.
///
/// Momentum: what tissue gained beyond its own springs, damping, drag and pins (mass times change of velocity less the
/// mean of these forces at both ends of the tick) plus what the instruments gained (the force shown, which for an
/// operator is its own change of momentum). Between two bodies the sum is 0. Not kept in scenes with rigid bodies,
/// whose reaction nobody tells.
/// Energy: what the tissue has gained in motion and springs since the spell began, plus the work of the contact force
/// on the instruments: the largest value in the spell. Dampers only take energy, and what they took within a tick
/// cannot be told from its ends, so they are left out: a positive sum surely came from nowhere, and a little that did
/// may hide behind them. Not kept where an instrument turns or opens its jaws, since a force without its moment does
/// not tell the work then.
class Balance {
public:
    /// The scene outlives the object.
    explicit Balance(const Scene& scene);

    /// One tick: whether anything touched, the frame that detect saw, the frame after the step, the force on each body.
    void observe(bool in_contact, const Frame& seen, const Frame& after, std::span<const Wrench> body_load);

    /// momentum_error_worst_n_s, momentum_error_share_worst, energy_created_worst_j, energy_created_share_worst,
    /// contact_spells, net_work_j, energy_given_worst_j; NaN where not kept.
    [[nodiscard]] std::map<std::string, double> figures() const;

    static constexpr int bridged_ticks = 5;

private:
    /// Forces that act on free tissue besides contact, and its energy, on one frame.
    struct TissueState {
        Vector3 force = Vector3::Zero();     ///< N, summed
        Vector3 momentum = Vector3::Zero();  ///< N s
        double energy = 0.0;                 ///< J
    };
    TissueState state_of(const Frame& frame);
    void end_contact();

    const Scene* scene_;
    std::vector<Index> tools_;  ///< one body for each force that counts: instruments, each operator once
    Index shown_ = -1;
    bool has_rigid_ = false;
    bool has_tissue_ = false;
    bool turns_ = false;
    Matrix3X force_;
    TissueState before_;
    bool before_is_known_ = false;

    int free_ticks_ = 0;
    bool open_ = false;
    Vector3 momentum_ = Vector3::Zero();
    double impulse_ = 0.0;      ///< N s, sum of lengths
    double energy_ = 0.0;       ///< J, now
    double energy_most_ = 0.0;  ///< J, largest in the spell
    double work_ = 0.0;         ///< J, sum of absolute values

    double contacts_ = 0.0;
    double momentum_worst_ = 0.0;
    double momentum_share_worst_ = 0.0;
    double energy_worst_ = 0.0;
    double energy_share_worst_ = 0.0;

    Vector3 path_ = Vector3::Zero();  ///< m, from start to now, of the shown tool
    double path_length_ = 0.0;
    double given_ = 0.0;
    double given_worst_ = 0.0;
};

}  // namespace trocar
