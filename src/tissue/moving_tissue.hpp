// State shared by all steppers of the mass-spring tissue: flat arrays of the vertices that move, the strain limit, and
// the checks of a tick. Vertices are read from a frame with the position corrections of a response output, and written
// back to one.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/outcome.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"
#include "tissue/spring_kernels.hpp"
#include "tissue/volume_forces.hpp"

namespace trocar {

/// Passes of the strain limit over all springs.
constexpr int limit_passes = 2;
/// Provot's correction of one spring that is longer than `limit` (m). Moves its ends to that length by their inverse
/// masses (1/kg; 0: fixed) and removes their separating velocity. True if the spring was shortened.
bool shorten(Index i, Index j, double limit, double inverse_mass_i, double inverse_mass_j, TissueState& state);

class MovingTissue {
public:
    /// Materials outlive the object.
    MovingTissue(const Topology& topology, const Materials& materials);

    [[nodiscard]] const Materials& materials() const { return *materials_; }
    [[nodiscard]] const SpringKernels& kernels() const { return *kernels_; }
    [[nodiscard]] TissueState& state() { return state_; }
    [[nodiscard]] const TissueState& state() const { return state_; }
    /// Springs with at least one free end, as in the scene and as arrays in the same order.
    [[nodiscard]] const std::vector<Spring>& springs() const { return springs_; }
    [[nodiscard]] SpringArrays& spring_arrays() { return arrays_; }
    [[nodiscard]] const SpringArrays& spring_arrays() const { return arrays_; }

    /// Copies the frame and applies the output's position corrections; constant forces are the rest bias and
    /// ResponseOutput::held_force.
    void take_over(const ResponseOutput& output, const Frame& frame);
    /// Applies position corrections and constant forces only, for a state that already equals the frame.
    void take_output(const ResponseOutput& output, const Frame& frame);
    /// Recomputes the constant forces with the enclosures' forces at the current positions, for one step. Does nothing
    /// without enclosures.
    void add_volume_force();
    [[nodiscard]] VolumeForces& volumes() { return volumes_; }
    /// Displaces a vertex by `by` (m) and keeps its velocity. Returns the energy (J) gained by springs and rest bias;
    /// enclosures are not counted.
    double put_aside(Index local, const Vector3& by);
    /// Frees the vertices that position corrections held for the tick.
    void release(const ResponseOutput& output);
    /// Writes position and velocity; `previous` becomes the position at the start of the tick.
    void give_back(const ResponseOutput& output, const Frame& from, Frame& to) const;
    /// Writes only `vertices`, stored from index `local` of the state on. give_back_placed writes `previous` of placed
    /// vertices.
    void give_back_part(Range vertices, Index local, const Frame& from, Frame& to) const;
    void give_back_placed(const ResponseOutput& output, Frame& to) const;

    /// Applies the strain limit (METHODS §4) to the positions and measures the remaining strain.
    void limit_strain();
    [[nodiscard]] double max_strain() const { return max_strain_; }
    [[nodiscard]] std::int64_t limited_edges() const { return limited_edges_; }

    /// Returns unstable for a non-finite state or a displacement beyond the sum of all rest lengths; not_finite if the
    /// input was not finite. `bound` (m): bound on the displacement of any coordinate in the tick.
    [[nodiscard]] Outcome check(bool finite, double bound, const ResponseOutput& output, const Frame& frame) const;
    /// True if the last effect had a held force.
    [[nodiscard]] bool is_pushed() const { return pushed_; }
    /// m, largest displacement of a vertex from `start`.
    [[nodiscard]] double longest_path(const Matrix3X& start) const;
    /// m, largest displacement by a position correction.
    [[nodiscard]] double placed_move(const ResponseOutput& output, const Frame& frame) const;
    /// Positions of all vertices at the start of the tick, position corrections applied; 3×N, m.
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
    Matrix4X held_force_;                ///< N, constant over a tick; only with enclosures
    double extent_ = 0.0;                ///< m, sum of rest lengths
    std::vector<std::uint8_t> limited_;  ///< per spring
    bool pushed_ = false;
    double max_strain_ = 0.0;
    std::int64_t limited_edges_ = 0;
};

}  // namespace trocar
