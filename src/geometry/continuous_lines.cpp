#include "geometry/continuous_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace trocar::continuous {

Cubic<DoubleDouble> fine_coplanarity(const Features& f) {
    return coplanarity_of(lines_of<DoubleDouble>(f, [&f](double x) -> DoubleDouble { return {x * f.scale, 0.0}; }));
}

/// A line's change is at most twice its size, so the coefficients sum to at most 6 · 27 sizes. A coefficient or a value
/// in [0, 1] takes at most twenty operations, each exact to 2^-100 of that.
double fine_tolerance(const Features& f) { return 1e-26 * (f.size_e * f.size_u * f.size_w); }

std::optional<Lines<Fixed>> whole_lines(const Features& f) {
    constexpr int most_bits = 200;
    int lowest = std::numeric_limits<int>::max();
    int highest = std::numeric_limits<int>::min();
    for (const MovingPoint* point : f.points) {
        for (const Vector3* x : {&point->start, &point->end}) {
            for (int i = 0; i < 3; ++i) {
                if ((*x)[i] == 0.0) continue;
                lowest = std::min(lowest, std::ilogb((*x)[i]) - 52);
                highest = std::max(highest, std::ilogb((*x)[i]) + 1);
            }
        }
    }
    if (highest - lowest > most_bits - 2) return std::nullopt;
    return lines_of<Fixed>(f, [lowest](double x) -> Fixed {
        if (x == 0.0) return 0;
        const int unit = std::ilogb(x) - 52;
        const Fixed size = std::abs(static_cast<std::int64_t>(std::scalbn(x, -unit)));
        const Fixed shifted = size << static_cast<unsigned>(unit - lowest);
        return x < 0.0 ? Fixed(-shifted) : shifted;
    });
}

}  // namespace trocar::continuous
