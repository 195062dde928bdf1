// Inner loops of the tissue's integrator over springs and vertices, in the widest vectors of the CPU. Every version
// does the same operations in the same order, so results are equal on every machine.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world.hpp"
#include "tissue/spring_stencil.hpp"

namespace trocar {

/// Four doubles per vertex, the fourth 0: one vertex is one vector of four lanes.
using Matrix4X = Eigen::Matrix<double, 4, Eigen::Dynamic>;

/// Springs as flat arrays. Indices i < j are those of the state. Springs are sorted by i, so that the loop has all
/// forces on a vertex once it has passed it.
struct SpringArrays {
    std::vector<Index> i, j;
    std::vector<double> inverse_rest;      ///< 1/m; 0 where the rest length is 0
    std::vector<double> k;                 ///< N/m
    std::vector<double> offset;            ///< N, preload - k rest length; tension = k length + offset
    std::vector<double> damping;           ///< N s/m
    std::vector<std::uint32_t> first_out;  ///< per vertex + 1: first spring with this vertex as i
    std::vector<std::uint32_t> first_in;   ///< per vertex + 1: index into `in`
    std::vector<std::uint32_t> in;         ///< per vertex: springs with this vertex as j, ascending
    /// N on i; spring s is in column s mod the number of columns, a power of two
    Matrix4X force;
    SpringStencil stencil = {};  ///< the same springs where they repeat; filled by the caller that sub-steps
    [[nodiscard]] std::size_t size() const { return i.size(); }
};

/// Arrays of springs between vertices of a state; sorts `springs` into the order of the arrays.
SpringArrays spring_arrays(std::vector<Spring>& springs, const std::vector<Index>& place, std::size_t vertex_count);

/// Vertices of the integrator: free ones, and fixed ones that share a spring or enclosure with a free one.
struct TissueState {
    std::vector<Index> vertex;         ///< vertex in the frame, ascending
    std::vector<Range> ranges;         ///< the same as ranges of consecutive vertices
    std::vector<Index> place;          ///< per vertex of the frame: index in these arrays, -1 = absent
    std::vector<double> inverse_mass;  ///< 1/kg; 0 = fixed
    std::vector<double> drag;          ///< kg/s
    Matrix4X position;                 ///< m
    Matrix4X velocity;                 ///< m/s
    Matrix4X constant;                 ///< N, forces that are constant over a tick
    [[nodiscard]] std::size_t size() const { return vertex.size(); }
    [[nodiscard]] bool moves(Index local) const { return inverse_mass[static_cast<std::size_t>(local)] != 0.0; }
};
/// m/s, the column without its fourth row, which only pads a vector register.
inline auto velocity_of(const TissueState& state, Index local) { return state.velocity.col(local).head<3>(); }
inline auto velocity_of(TissueState& state, Index local) { return state.velocity.col(local).head<3>(); }

/// Bounds over all vertices after a sub-step.
struct SubStepCheck {
    double furthest = 0.0;  ///< m, bound on the displacement of any coordinate
    bool finite = true;
};

struct SpringKernels {
    /// One step of semi-implicit Euler over h (s): velocities from spring forces (thesis eq. 3.1: elastic, preload,
    /// damping), drag and constant forces, then positions. A spring of zero length gives no force. A stencil changes no
    /// bit of the result.
    SubStepCheck (*sub_step)(double h, SpringArrays& springs, TissueState& state);
    /// Largest length over rest length; 0 without springs of positive rest length.
    double (*largest_stretch)(const SpringArrays& springs, const TissueState& state);
    /// Copy a range of columns of a 3×N matrix to the columns from `local` on, and back.
    void (*take_over)(const Matrix3X& from, Range range, Index local, Matrix4X& to);
    void (*give_back)(const Matrix4X& from, Index local, Range range, Matrix3X& to);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, best first.
const std::vector<SpringKernels>& spring_kernels();

}  // namespace trocar
