// What every stepper of the mass-spring tissue needs beside its rule: the vertices that move as flat arrays, taken over
// from a frame with the position corrections of a response output and given back to one, the strain limit, and the
// checks of a tick.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/outcome.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"
#include "tissue/spring_kernels.hpp"
#include "tissue/volume_forces.hpp"

namespace trocar {

/// Passes over all springs in which the strain limit shortens those that are too long.
constexpr int limit_passes = 2;
/// Provot's correction of one spring: where it is longer than `limit` (m) its ends are brought back to that by their
/// inverse masses (1/kg; 0: stays), and lose the part of their relative velocity that would lengthen it again. Says
/// whether it was too long and could be shortened.
bool shorten(Index i, Index j, double limit, double inverse_mass_i, double inverse_mass_j, TissueState& state);

class MovingTissue {
public:
    /// Materials outlive the object.
    MovingTissue(const Topology& topology, const Materials& materials);

    [[nodiscard]] const Materials& materials() const { return *materials_; }
    [[nodiscard]] const SpringKernels& kernels() const { return *kernels_; }
    [[nodiscard]] TissueState& state() { return state_; }
    [[nodiscard]] const TissueState& state() const { return state_; }
    /// Those with an end that moves, as the scene gives them and as arrays in the same order.
    [[nodiscard]] const std::vector<Spring>& springs() const { return springs_; }
    [[nodiscard]] SpringArrays& spring_arrays() { return arrays_; }

    /// Takes over the frame with the output's position corrections; the constant forces become rest bias and held
    /// forces.
    void take_over(const ResponseOutput& output, const Frame& frame);
    /// The same where the state already is the frame: position corrections and constant forces.
    void take_output(const ResponseOutput& output, const Frame& frame);
    /// What kernels take as constant is so for one step: the forces of enclosures come anew from where it begins.
    /// Nothing to do where the scene names none.
    void add_volume_force();
    [[nodiscard]] VolumeForces& volumes() { return volumes_; }
    /// Puts a vertex aside by `by` (m), its velocity as it is. Gives what springs and rest bias gain, J; what
    /// enclosures do is left out.
    double put_aside(Index local, const Vector3& by);
    /// Lets go of the vertices that were held for the tick.
    void release(const ResponseOutput& output);
    /// Writes position and velocity; previous becomes the place from which the tick started.
    void give_back(const ResponseOutput& output, const Frame& from, Frame& to) const;
    /// The same for a part of the vertices alone, from the place `local` in the state on; and what position corrections
    /// ask for.
    void give_back_part(Range vertices, Index local, const Frame& from, Frame& to) const;
    void give_back_placed(const ResponseOutput& output, Frame& to) const;

    /// Strain limit (METHODS §4) on the positions as they are, and the strain that is left.
    void limit_strain();
    [[nodiscard]] double max_strain() const { return max_strain_; }
    [[nodiscard]] std::int64_t limited_edges() const { return limited_edges_; }

    /// Named outcome of numbers that were not finite, or of a vertex further than all springs are long; `bound` (m): no
    /// coordinate has gone further since the tick began. Ok otherwise.
    [[nodiscard]] Outcome check(bool finite, double bound, const ResponseOutput& output, const Frame& frame) const;
    /// The last effect taken over held a force.
    [[nodiscard]] bool is_pushed() const { return pushed_; }
    /// m, largest way of a vertex since then.
    [[nodiscard]] double longest_path(const Matrix3X& start) const;
    /// m, furthest way to where a vertex was put before the tick.
    [[nodiscard]] double placed_move(const ResponseOutput& output, const Frame& frame) const;
    /// All vertices where the tick starts from.
    [[nodiscard]] Matrix3X start_of(const ResponseOutput& output, const Frame& frame) const;

private:
    template <typename Act>
    void each_placed(const ResponseOutput& output, const Act& act) const;
    void set_constant_force(const Matrix3X* held);
    void limit_every_spring(double longest);
    [[nodiscard]] double furthest(const Matrix3X& start) const;

    const Materials* materials_;
    const SpringKernels* kernels_;
    std::vector<Spring> springs_;
    SpringArrays arrays_;
    TissueState state_;
    VolumeForces volumes_;
    Matrix4X held_force_;                ///< N, what does not change in a tick; only with enclosures
    double extent_ = 0.0;                ///< m, sum of rest lengths
    std::vector<std::uint8_t> limited_;  ///< per spring
    bool pushed_ = false;                ///< the last tick's effect held a force
    double max_strain_ = 0.0;
    std::int64_t limited_edges_ = 0;
};

}  // namespace trocar
