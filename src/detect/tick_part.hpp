// Times at which two linearly moving things can meet. At any time of a tick each lies in the linear interpolation of
// its boxes at start and end. A fast tool is then examined only where it passes something, not in the box of its whole
// path.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace trocar {

/// Part of a tick, which goes from 0 to 1.
struct TickPart {
    double first = 0.0;
    double last = 1.0;

    [[nodiscard]] bool empty() const { return !(first <= last); }

    /// Keeps the times at which a number that goes linearly from `start` to `end` is not negative, with a margin for
    /// rounding. Keeps all times where that is unknown (NaN, or too large for a difference).
    void keep_not_negative(double start, double end) {
        if (!(start < 0.0) && !(end < 0.0)) return;
        if (start < 0.0 && end < 0.0) {
            last = -1.0;
            return;
        }
        const double change = start - end;
        if (!(std::abs(change) < std::numeric_limits<double>::infinity())) return;
        constexpr double rounding = 0x1p-50;  // error of one subtraction and one division, with margin
        const double zero = start / change;
        if (start < 0.0) {
            first = std::max(first, zero - rounding);
        } else {
            last = std::min(last, zero + rounding);
        }
    }
};

/// A box at both ends of a tick.
template <typename Box>
struct BoxOnPath {
    Box start;
    Box end;
};

/// Times at which `p` and `q` may overlap. `relative`, `absolute`: error bounds of the boxes' numbers.
template <typename Box>
TickPart part_of_meeting(const BoxOnPath<Box>& p, const BoxOnPath<Box>& q, double relative = 0.0,
                         double absolute = 0.0) {
    TickPart part;
    const auto gap = [relative, absolute](double high, double low) {
        return high - low + (relative * (std::abs(high) + std::abs(low)) + absolute);
    };
    for (std::size_t k = 0; k < 3 && !part.empty(); ++k) {
        part.keep_not_negative(gap(q.start.high[k], p.start.low[k]), gap(q.end.high[k], p.end.low[k]));
        part.keep_not_negative(gap(p.start.high[k], q.start.low[k]), gap(p.end.high[k], q.end.low[k]));
    }
    return part;
}

}  // namespace trocar
