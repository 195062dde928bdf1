// When two things on straight ways can meet at all: at any time of a tick each lies in the box that goes linearly from
// its box at the start to its box at the end. A tool that jumps is then examined where it passes something, not in the
// whole box around its way.
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

    /// Leaves the times at which a number that goes linearly from `start` to `end` is not negative, and a little more
    /// for rounding; all of them where it is not known (NaN, or too large for a difference).
    void keep_not_negative(double start, double end) {
        if (!(start < 0.0) && !(end < 0.0)) return;
        if (start < 0.0 && end < 0.0) {
            last = -1.0;
            return;
        }
        const double change = start - end;
        if (!(std::abs(change) < std::numeric_limits<double>::infinity())) return;
        constexpr double rounding = 0x1p-50;  // of one subtraction and one division, and more
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

/// Times at which `p` and `q` may overlap. `relative`, `absolute`: how far the boxes' numbers may be from those they
/// stand for, at most.
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
