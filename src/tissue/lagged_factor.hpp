// A sparse Cholesky factor of the system of some ticks ago, made in a second thread, as preconditioner of the conjugate
// gradients of the steps since then. Who owns it counts ticks and says when it is renewed; the clock is never asked, so
// that a run has the same bits however long a factor takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tissue/side_thread.hpp"
#include "tissue/spring_system.hpp"

namespace trocar {

/// Which blocks of L there are; the same for every system of a tissue. A place is a vertex in the order of elimination.
struct FactorPattern {
    std::vector<Index> vertex;             ///< per place, of the state: what is free to move
    std::vector<std::size_t> first_block;  ///< per place + 1: blocks of its columns
    std::vector<Index> row;                ///< per block: place of its rows
};

/// A = L D Lᵀ in 3×3 blocks of vertices, L with ones on its diagonal.
struct FactorValues {
    std::vector<double> block;            ///< 9 per block, column after column
    std::vector<double> corner;           ///< 3 per place: L below the diagonal of its own block, (1,0), (2,0), (2,1)
    std::vector<double> inverse_pivot;    ///< 1/kg, 3 per place: 1 / D
    std::vector<std::uint8_t> was_still;  ///< per place: was held in that step; its rows are those of a unit matrix
};

class LaggedFactor {
public:
    /// For systems of these springs. What the state holds now never moves.
    LaggedFactor(const SpringArrays& springs, const SpringSystem& system, const TissueState& state);
    ~LaggedFactor();
    LaggedFactor(const LaggedFactor&) = delete;
    LaggedFactor& operator=(const LaggedFactor&) = delete;
    LaggedFactor(LaggedFactor&&) = delete;
    LaggedFactor& operator=(LaggedFactor&&) = delete;

    /// Waits for the factor of the system of the last call and takes it over, if that system has one, else keeps what
    /// is in use; then a second thread begins with a copy of this system.
    void renew(const SpringSystem& system);
    /// A factor is in use.
    [[nodiscard]] bool is_ready() const { return is_ready_; }
    /// preconditioned = (L D Lᵀ)⁻¹ residual, both 4 × vertices of the state; `system` is that of the step. It has to
    /// come with what the blocks make of the residual: that stays where the factor says nothing, since a vertex is held
    /// or was so then. Gives residual · preconditioned.
    double precondition(const SpringSystem& system, const Matrix4X& residual, Matrix4X& preconditioned);

private:
    class Factorization;
    /// What the second thread is to do.
    struct Work {
        LaggedFactor* factor;
        void operator()() const { factor->make(); }
    };
    void make();
    void solve_in_place(double* numbers) const;

    SpringSystem snapshot_;  ///< `inverse` and `right_side` are not kept up
    std::unique_ptr<Factorization> factorization_;
    FactorPattern pattern_;
    FactorValues used_;
    FactorValues made_;
    bool is_made_ = false;         ///< `made_` is that of the snapshot
    bool is_ready_ = false;        ///< `used_` may be used
    std::vector<double> numbers_;  ///< 3 per place
    Work work_{this};
    SideThread thread_;  ///< last: it ends before what it works on
};

}  // namespace trocar
