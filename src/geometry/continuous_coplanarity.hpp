// Third stage of the continuous test. For a root interval of the search (continuous_search.hpp) it finds the exact time
// of the root, and whether the features meet there. Double-double decides nearly all roots, integers of fixed size the
// boundary cases. Coordinates that do not fit, and conditions that are not linear near their root, go to the last
// stage.
#pragma once

#include <cstdint>
#include <optional>

#include "geometry/continuous_features.hpp"
#include "geometry/continuous_lines.hpp"
#include "geometry/time_polynomial.hpp"

namespace trocar::continuous {

inline constexpr int time_bits = 53;  ///< times are multiples of 2^-53

/// The coplanarity e · (u × w) of features over the tick; all its signs are exact.
class Coplanarity {
public:
    explicit Coplanarity(const Features& f);

    /// Sign at n / 2^53.
    [[nodiscard]] int sign(std::int64_t n);
    /// Whether the sight's root, rounded down, is before `moment` (a multiple of 2^-53).
    [[nodiscard]] bool root_is_before(double moment, const Sight& sight);
    /// The sight's root times 2^53, rounded down.
    [[nodiscard]] std::int64_t rounded_root(const Sight& sight);
    /// True when zero all the time; false also when the coordinates span too many bits to decide.
    [[nodiscard]] bool vanishes();
    /// Whether the features meet at the only root in [n, n + 1] / 2^53, with `before` as in Sight; empty when neither
    /// float nor linear conditions decide. With `in_pair`, edges that are parallel there count as not meeting. If they
    /// do meet, an end of one lies on the other, and the vertex-face test finds that at the same time.
    [[nodiscard]] std::optional<bool> meets(std::int64_t n, int before, bool in_pair);

private:
    void make_whole();
    [[nodiscard]] std::optional<int> sign_at_root(const Quadratic<Fixed>& q, std::int64_t n, bool exact,
                                                  int before) const;

    const Features* features_;
    Cubic<DoubleDouble> fine_;
    double tolerance_;  ///< error bound of a value of fine_; < 0: no bound exists
    bool made_ = false;
    std::optional<Lines<Fixed>> lines_;
    Cubic<Fixed> whole_;
    Polynomial polynomial_;  ///< set when lines_ is empty
};

}  // namespace trocar::continuous
