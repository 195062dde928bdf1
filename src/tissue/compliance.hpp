// How tissue answers to pushes at a few of its vertices within one implicit step: columns of A⁻¹ (SpringSystem), found
// by conjugate gradients for eight right sides at a time. A push has gone one ring of springs further with every
// iteration, so that only the rings it has reached are worked on: the same numbers as on the whole tissue.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tissue/spring_system.hpp"

namespace trocar {

/// Right sides that are solved for together.
inline constexpr std::size_t compliance_lanes = 8;
/// One number per right side.
using Lanes = std::array<double, compliance_lanes>;

/// The part of the tissue that pushes have reached, ring by ring, and the vectors of the method on it: per vertex three
/// coordinates of compliance_lanes numbers.
struct ReachedTissue {
    std::vector<Index> vertices;                     ///< of the state
    std::vector<std::size_t> ring_end;               ///< into `vertices`, one per ring
    std::vector<std::uint32_t> springs;              ///< in SpringArrays
    std::vector<std::array<std::uint32_t, 2>> ends;  ///< of `springs`, into `vertices`
    std::vector<std::size_t> spring_end;             ///< per ring: springs with an end in it or in one before
    std::vector<double> solution, residual, preconditioned, direction, image;
};

struct ComplianceKernels {
    /// image = A direction for the first `reached` vertices, of which the first `inner` have a direction other than 0,
    /// through the first `spring_count` springs; gives direction · image.
    Lanes (*multiply)(const SpringSystem& system, std::size_t inner, std::size_t reached, std::size_t spring_count,
                      ReachedTissue& tissue);
    /// A step of the solution along the direction, the residual after it; gives residual · preconditioned.
    Lanes (*advance)(const SpringSystem& system, const Lanes& step, std::size_t inner, std::size_t reached,
                     ReachedTissue& tissue);
    /// direction = preconditioned + ratio direction.
    void (*turn)(const Lanes& ratio, std::size_t reached, ReachedTissue& tissue);
    const char* target;  ///< name of the instruction set
};

/// One version per instruction set of this CPU, the best one first; all give the same bits.
const std::vector<ComplianceKernels>& compliance_kernels();

class Compliance {
public:
    Compliance(std::size_t spring_count, std::size_t vertex_count);

    /// Starts over from these vertices of the state. The three stay as they are until the last solve.
    void begin(const SpringArrays& springs, const SpringSystem& system, std::span<const Index> touched);
    /// Sets all right sides to zero.
    void clear();
    /// Adds to a right side, N s, at a touched vertex given by its position among them.
    void add(std::size_t lane, Index spot, const Vector3& impulse);
    /// Solves for all lanes until every residual, measured by the preconditioner, is below `tolerance` of that of its
    /// right side, for at most `iterations`.
    void solve(double tolerance, int iterations);
    /// m/s, how a lane's impulses change the velocity of a touched vertex.
    [[nodiscard]] Vector3 answer(std::size_t lane, Index spot) const;

private:
    void grow();

    const ComplianceKernels* kernels_;
    const SpringArrays* springs_ = nullptr;
    const SpringSystem* system_ = nullptr;
    ReachedTissue tissue_;
    std::vector<Index> number_;        ///< per vertex of the state: position in vertices or -1
    std::vector<std::uint8_t> is_in_;  ///< per spring
    std::size_t used_ = 0;             ///< vertices that may hold numbers other than 0
};

}  // namespace trocar
