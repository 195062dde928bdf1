// The forces of a scene's hinges in every sub-step, in the widest vectors that the CPU has. Every version does the same
// operations in the same order: the answer is the same on every machine.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "scene/world.hpp"
#include "tissue/spring_kernels.hpp"

namespace trocar {

/// Hinges as flat arrays, numbers of vertices being columns of a state.
struct HingeArrays {
    std::array<std::vector<Index>, 4> vertex;  ///< as Hinge::vertex
    std::vector<double> rest;                  ///< rad
    std::vector<double> stiffness;             ///< N m
    [[nodiscard]] std::size_t size() const { return rest.size(); }
};

HingeArrays hinge_arrays(std::span<const Hinge> hinges);

struct HingeKernels {
    /// Adds the forces of all hinges, N: stiffness × bend × gradient of the angle (dihedral), against the bend. A hinge
    /// at a triangle without area gives none.
    void (*add_forces)(const HingeArrays& hinges, const Matrix4X& position, Matrix4X& force);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, the best one first.
const std::vector<HingeKernels>& hinge_kernels();

}  // namespace trocar
