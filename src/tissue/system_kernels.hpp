// Inner loops of conjugate gradients on a region, per instruction set. Vectors have four numbers per node, the last 0.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Edge of the system: block (4×3 by columns, kg) between two nodes. Edges with the same `own` should be contiguous.
struct SystemEdge {
    Index own = -1;  ///< active
    Index other = -1;
    std::array<float, 12> block{};
};

struct SystemKernels {
    /// image += Σ block (direction_own - direction_other) on own, its opposite on other.
    void (*multiply)(std::span<const SystemEdge> edges, const double* direction, double* image);
    /// For the first `count` nodes: change += by direction, residual -= by image, preconditioned = inverse residual.
    /// The inverse has 12 numbers per node (4×3 by columns). Returns residual · preconditioned.
    double (*improve)(std::size_t count, double by, const double* direction, const double* image, const double* inverse,
                      double* change, double* residual, double* preconditioned);
    /// direction = preconditioned + by direction, image = inertia direction.
    void (*turn)(std::size_t count, double by, const double* preconditioned, const double* inertia, double* direction,
                 double* image);
    double (*dot)(std::size_t count, const double* a, const double* b);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, best first; all give the same bits.
const std::vector<SystemKernels>& system_kernels();

}  // namespace trocar
