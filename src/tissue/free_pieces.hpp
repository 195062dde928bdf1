// Connected pieces of tissue without a fixed vertex. Springs within a piece conserve its momentum, so the error that an
// iterative solver leaves in it is corrected exactly.
#pragma once

#include <vector>

#include "tissue/spring_system.hpp"

namespace trocar {

class FreePieces {
public:
    FreePieces(const std::vector<Spring>& springs, const TissueState& state);

    /// True if every vertex is connected to a fixed one.
    [[nodiscard]] bool empty() const { return momentum_.cols() == 0; }
    /// Sets the momentum change (N s) of each piece from the system's right side; `add` adds impulses of contacts.
    void begin(const SpringSystem& system, const TissueState& state);
    void add(Index local, const Vector3& impulse);
    /// Shifts each piece's velocity so that its momentum has changed by that since `start` (m/s, 4 × vertices).
    void close(const SpringSystem& system, const Matrix4X& start, TissueState& state);

private:
    std::vector<Index> piece_;  ///< per vertex of the state; -1: connected to a fixed one
    Matrix3X momentum_;         ///< N s, per piece
    Eigen::VectorXd inertia_;   ///< kg, per piece; 0: a vertex is fixed in this step
};

}  // namespace trocar
