#include "report/proportions.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {

Proportion wilson_interval(int successes, int all) {
    if (all <= 0) return {};
    constexpr double z = 1.959963984540054;  // 97.5 % quantile of the normal distribution
    const double n = all;
    const double share = successes / n;
    const double centre = share + z * z / (2.0 * n);
    const double half = z * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n));
    const double scale = 1.0 + z * z / n;
    return {std::max(0.0, (centre - half) / scale), std::min(1.0, (centre + half) / scale)};
}

double mcnemar_exact(int one, int other) {
    const int all = one + other;
    double term = std::ldexp(1.0, -all);  // of no success in `all` throws
    double sum = 0.0;
    for (int k = 0; k <= std::min(one, other); ++k) {
        sum += term;
        term *= static_cast<double>(all - k) / (k + 1);
    }
    return std::min(1.0, 2.0 * sum);
}

}  // namespace trocar
