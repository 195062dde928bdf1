// Third stage of the continuous test, for the moments that the search (continuous_search.hpp) encloses: when exactly
// that is, and whether the features meet then. Double-double decides nearly all moments, integers of fixed size the
// boundary cases; where these have no room, or where a condition is not linear near its root, the last stage has to
// answer.
#pragma once

#include <cstdint>
#include <optional>

#include "geometry/continuous_features.hpp"
#include "geometry/continuous_lines.hpp"
#include "geometry/time_polynomial.hpp"

namespace trocar::continuous {

inline constexpr int time_bits = 53;  ///< moments are reported in multiples of 2^-53

/// The coplanarity e · (u × w) of features over the tick, reported without doubt.
class Coplanarity {
public:
    explicit Coplanarity(const Features& f);

    /// Its sign at n / 2^53.
    [[nodiscard]] int sign(std::int64_t n);
    /// Whether the root that the sight reports, rounded down, is before this moment, a multiple of 2^-53.
    [[nodiscard]] bool root_is_before(double moment, const Sight& sight);
    /// That root times 2^53, rounded down.
    [[nodiscard]] std::int64_t rounded_root(const Sight& sight);
    /// Zero all the time; false when the coordinates span too many bits to report.
    [[nodiscard]] bool vanishes();
    /// Whether the features meet at the only root in [n, n + 1] / 2^53, with `before` as in Sight; nothing when neither
    /// float nor linear conditions report. In a pair of triangles edges that are parallel there count as not meeting:
    /// when they do, an end of one is on the other, which a vertex and a face see at the same moment.
    [[nodiscard]] std::optional<bool> meets(std::int64_t n, int before, bool in_pair);

private:
    void make_whole();
    [[nodiscard]] std::optional<int> sign_at_root(const Quadratic<Fixed>& q, std::int64_t n, bool exact,
                                                  int before) const;

    const Features* features_;
    Cubic<DoubleDouble> fine_;
    double tolerance_;  ///< of a value of fine_; < 0: none can be given
    bool made_ = false;
    std::optional<Lines<Fixed>> lines_;
    Cubic<Fixed> whole_;
    Polynomial polynomial_;  ///< when there are no lines_
};

}  // namespace trocar::continuous
