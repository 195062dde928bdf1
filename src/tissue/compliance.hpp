// Compliance of the tissue within one implicit step: columns of A⁻¹ (SpringSystem) at a few vertices. Conjugate
// gradients solves eight right sides at a time. Each iteration carries the impulses one ring of springs further, and
// only the rings reached are processed. The result equals that on the whole tissue.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tissue/spring_system.hpp"

namespace trocar {

/// Right sides solved together.
inline constexpr std::size_t compliance_lanes = 8;
/// One number per right side.
using Lanes = std::array<double, compliance_lanes>;

/// Part of the tissue that the impulses have reached, ring by ring, with the vectors of conjugate gradients. Each
/// vertex has x, y and z, compliance_lanes numbers each.
struct ReachedTissue {
    std::vector<Index> vertices;                     ///< of the state
    std::vector<std::size_t> ring_end;               ///< into `vertices`, one per ring
    std::vector<std::uint32_t> springs;              ///< in SpringArrays
    std::vector<std::array<std::uint32_t, 2>> ends;  ///< of `springs`, into `vertices`
    std::vector<std::size_t> spring_end;             ///< per ring: springs with an end in it or in one before
    std::vector<double> solution, residual, preconditioned, direction, image;
};

struct ComplianceKernels {
    /// image = A direction for the first `reached` vertices through the first `spring_count` springs. The direction is
    /// 0 beyond the first `inner` vertices. Returns direction · image.
    Lanes (*multiply)(const SpringSystem& system, std::size_t inner, std::size_t reached, std::size_t spring_count,
                      ReachedTissue& tissue);
    /// Steps the solution along the direction and updates both residuals. Returns residual · preconditioned.
    Lanes (*advance)(const SpringSystem& system, const Lanes& step, std::size_t inner, std::size_t reached,
                     ReachedTissue& tissue);
    /// direction = preconditioned + ratio direction.
    void (*turn)(const Lanes& ratio, std::size_t reached, ReachedTissue& tissue);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, best first; all give the same bits.
const std::vector<ComplianceKernels>& compliance_kernels();

class Compliance {
public:
    Compliance(std::size_t spring_count, std::size_t vertex_count);

    /// Restarts from these vertices of the state. The arguments must not change before the last solve.
    void begin(const SpringArrays& springs, const SpringSystem& system, std::span<const Index> touched);
    /// Sets all right sides to zero.
    void clear();
    /// Adds an impulse (N s) to the right side of a lane. `spot` is the index of the vertex in `touched`.
    void add(std::size_t lane, Index spot, const Vector3& impulse);
    /// Solves all lanes until each residual, in the norm of the preconditioner, is below `tolerance` times that of its
    /// right side, or for `iterations`.
    void solve(double tolerance, int iterations);
    /// m/s, velocity change of a touched vertex by the impulses of a lane.
    [[nodiscard]] Vector3 answer(std::size_t lane, Index spot) const;

private:
    void grow();

    const ComplianceKernels* kernels_;
    const SpringArrays* springs_ = nullptr;
    const SpringSystem* system_ = nullptr;
    ReachedTissue tissue_;
    std::vector<Index> number_;        ///< per vertex of the state: index in `vertices` or -1
    std::vector<std::uint8_t> is_in_;  ///< per spring
    std::size_t used_ = 0;             ///< number of vertices whose vectors may be nonzero
};

}  // namespace trocar
