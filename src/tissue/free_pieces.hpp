// Pieces of tissue that nothing holds: springs between their vertices change no sum of momenta, so that what an
// iteration has left open of it can be put right exactly.
#pragma once

#include <vector>

#include "tissue/spring_system.hpp"

namespace trocar {

class FreePieces {
public:
    FreePieces(const std::vector<Spring>& springs, const TissueState& state);

    /// No piece: every vertex is tied to something that is held.
    [[nodiscard]] bool empty() const { return momentum_.cols() == 0; }
    /// What the system's right side says of each piece's momentum, and what pushes of contacts add to it.
    void begin(const SpringSystem& system, const TissueState& state);
    void add(Index local, const Vector3& impulse);
    /// Shifts every piece's velocity such that it has gained just that since `start` (m/s, 4 × vertices).
    void close(const SpringSystem& system, const Matrix4X& start, TissueState& state);

private:
    std::vector<Index> piece_;  ///< per vertex of the state; -1: tied to a held one
    Matrix3X momentum_;         ///< N s, per piece
    Eigen::VectorXd inertia_;   ///< kg, per piece; 0 while one of its vertices is held
};

}  // namespace trocar
