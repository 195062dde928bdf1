// The loops of the tissue's integrator that touch every spring or vertex in every sub-step, in the widest vectors the
// CPU has. Every version does the same operations in the same order: the answer is the same on every machine.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world.hpp"
#include "tissue/spring_stencil.hpp"

namespace trocar {

/// Four doubles per vertex, the fourth unused (0): one vertex is one vector of four lanes.
using Matrix4X = Eigen::Matrix<double, 4, Eigen::Dynamic>;

/// Springs of a MassSpring as flat arrays; i < j are positions in its state, and the springs stand in order of i: a
/// vertex has all its forces when the springs have passed it.
struct SpringArrays {
    std::vector<Index> i, j;
    std::vector<double> inverse_rest;      ///< 1/m; 0 where the rest length is 0
    std::vector<double> k;                 ///< N/m
    std::vector<double> offset;            ///< N, preload - k rest length: the tension is k length + offset
    std::vector<double> damping;           ///< N s/m
    std::vector<std::uint32_t> first_out;  ///< per vertex + 1: first spring whose i it is
    std::vector<std::uint32_t> first_in;   ///< per vertex + 1: into `in`
    std::vector<std::uint32_t> in;         ///< of each vertex, the springs whose j it is, ascending
    Matrix4X force;                        ///< N on i; spring s lies in column s mod the number of columns, 2^n
    SpringStencil stencil = {};            ///< the same springs once more where they repeat; filled by who sub-steps
    [[nodiscard]] std::size_t size() const { return i.size(); }
};

/// Arrays of springs between the vertices of a state; `springs` is brought into the order of the arrays.
SpringArrays spring_arrays(std::vector<Spring>& springs, const std::vector<Index>& place, std::size_t vertex_count);

/// What the integrator moves: free vertices, and the held ones that a spring ties to them.
struct TissueState {
    std::vector<Index> vertex;         ///< number in the frame, ascending
    std::vector<Range> ranges;         ///< the same as runs of consecutive numbers
    std::vector<Index> place;          ///< per vertex of the frame: position in these arrays, -1 = not here
    std::vector<double> inverse_mass;  ///< 1/kg; 0 = does not move
    std::vector<double> drag;          ///< kg/s
    Matrix4X position;                 ///< m
    Matrix4X velocity;                 ///< m/s
    Matrix4X constant;                 ///< N, forces that do not change in a tick
    [[nodiscard]] std::size_t size() const { return vertex.size(); }
    [[nodiscard]] bool moves(Index local) const { return inverse_mass[static_cast<std::size_t>(local)] != 0.0; }
};
/// m/s, of a vertex that is here: the column without its fourth row, which only fills a vector register.
inline auto velocity_of(const TissueState& state, Index local) { return state.velocity.col(local).head<3>(); }
inline auto velocity_of(TissueState& state, Index local) { return state.velocity.col(local).head<3>(); }

/// Bounds over all vertices after a sub-step.
struct SubStepCheck {
    double furthest = 0.0;  ///< m, no coordinate has gone further in the sub-step
    bool finite = true;     ///< false: a position or velocity is not a finite number
};

struct SpringKernels {
    /// Semi-implicit Euler over h (s): the forces of all springs (thesis eq. 3.1: spring, preload, damping; one of zero
    /// length has no direction and gives none), of drag and the constant ones change the velocities of what moves, and
    /// the new velocities the positions. A stencil makes it faster and changes no bit.
    SubStepCheck (*sub_step)(double h, SpringArrays& springs, TissueState& state);
    /// Largest length over rest length, 0 without springs that have one.
    double (*largest_stretch)(const SpringArrays& springs, const TissueState& state);
    /// Takes the columns of a range of a 3×N matrix over as those from `local` on, and writes them back.
    void (*take_over)(const Matrix3X& from, Range range, Index local, Matrix4X& to);
    void (*give_back)(const Matrix4X& from, Index local, Range range, Matrix3X& to);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, the best one first.
const std::vector<SpringKernels>& spring_kernels();

}  // namespace trocar
