// Sparse Cholesky factor of the system of an earlier tick, computed in a second thread. It preconditions the conjugate
// gradients of later steps. The owner renews it by tick count, never by the clock, so that the bits of a run do not
// depend on timing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tissue/side_thread.hpp"
#include "tissue/spring_system.hpp"

namespace trocar {

/// Block sparsity of L, the same for all systems of a tissue. A place is a vertex's index in the elimination order.
struct FactorPattern {
    std::vector<Index> vertex;             ///< per place: free vertex of the state
    std::vector<std::size_t> first_block;  ///< per place + 1: first block of its columns
    std::vector<Index> row;                ///< per block: place of its rows
};

/// A = L D Lᵀ in 3×3 blocks of vertices; L has a unit diagonal.
struct FactorValues {
    std::vector<double> block;            ///< 9 per block, column-major
    std::vector<double> corner;           ///< 3 per place: L below the diagonal of its own block, (1,0), (2,0), (2,1)
    std::vector<double> inverse_pivot;    ///< 1/kg, 3 per place: 1 / D
    std::vector<std::uint8_t> was_still;  ///< per place: fixed in that step; its rows are those of the identity
};

class LaggedFactor {
public:
    /// For systems of these springs. Vertices that are fixed in `state` must stay fixed.
    LaggedFactor(const SpringArrays& springs, const SpringSystem& system, const TissueState& state);
    ~LaggedFactor();
    LaggedFactor(const LaggedFactor&) = delete;
    LaggedFactor& operator=(const LaggedFactor&) = delete;
    LaggedFactor(LaggedFactor&&) = delete;
    LaggedFactor& operator=(LaggedFactor&&) = delete;

    /// Waits for the factor of the system of the last call and takes it into use if it exists. Then starts the second
    /// thread with a copy of this system.
    void renew(const SpringSystem& system);
    /// True once a factor is in use.
    [[nodiscard]] bool is_ready() const { return is_ready_; }
    /// preconditioned = (L D Lᵀ)⁻¹ residual, both 4 × vertices of the state; `system` is that of the step. On entry
    /// `preconditioned` holds the block-preconditioned residual. This remains at vertices that are fixed now or were
    /// fixed in the factored system. Returns residual · preconditioned.
    double precondition(const SpringSystem& system, const Matrix4X& residual, Matrix4X& preconditioned);

private:
    class Factorization;
    /// Task of the second thread.
    struct Work {
        LaggedFactor* factor;
        void operator()() const { factor->make(); }
    };
    void make();
    void solve_in_place(double* numbers) const;

    SpringSystem snapshot_;  ///< `inverse` and `right_side` are not updated
    std::unique_ptr<Factorization> factorization_;
    FactorPattern pattern_;
    FactorValues used_;
    FactorValues made_;
    bool is_made_ = false;         ///< `made_` is the factor of `snapshot_`
    bool is_ready_ = false;        ///< `used_` is valid
    std::vector<double> numbers_;  ///< 3 per place
    Work work_{this};
    SideThread thread_;  ///< last member: it ends before its data
};

}  // namespace trocar
