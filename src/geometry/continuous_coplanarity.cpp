#include "geometry/continuous_coplanarity.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/continuous_exact.hpp"

namespace trocar::continuous {
namespace {

std::int64_t first_of(const Sight& sight) {
    return static_cast<std::int64_t>(std::floor(std::ldexp(sight.low, time_bits)));
}
std::int64_t last_of(const Sight& sight) {
    return static_cast<std::int64_t>(std::ceil(std::ldexp(sight.high, time_bits)));
}

}  // namespace

Coplanarity::Coplanarity(const Features& f)
    : features_(&f), fine_(fine_coplanarity(f)), tolerance_(f.tolerance < 0.0 ? -1.0 : fine_tolerance(f)) {}

int Coplanarity::sign(std::int64_t n) {
    if (tolerance_ >= 0.0) {
        const DoubleDouble t{std::ldexp(static_cast<double>(n), -time_bits), 0.0};
        const DoubleDouble value = ((fine_[3] * t + fine_[2]) * t + fine_[1]) * t + fine_[0];
        if (value.high > tolerance_) return 1;
        if (value.high < -tolerance_) return -1;
    }
    make_whole();
    if (lines_) {
        const Cubic<Fixed>& c = whole_;
        return Fixed(((c[3] * n + (c[2] << 53U)) * n + (c[1] << 106U)) * n + (c[0] << 159U)).sign();
    }
    return sign_at(polynomial_, {Big(n), time_bits});
}

bool Coplanarity::root_is_before(double moment, const Sight& sight) {
    const auto n = static_cast<std::int64_t>(std::ldexp(moment, time_bits));
    if (n <= first_of(sight)) return false;
    return n > last_of(sight) || sign(n) == -sight.before;
}

std::int64_t Coplanarity::rounded_root(const Sight& sight) {
    const int before = sight.before;
    const std::int64_t first = first_of(sight);
    const std::int64_t last = last_of(sight);
    // Newton's step from the middle is nearly always off by at most one.
    const double t = 0.5 * (sight.low + sight.high);
    const double value = ((fine_[3].high * t + fine_[2].high) * t + fine_[1].high) * t + fine_[0].high;
    const double slope = (3.0 * fine_[3].high * t + 2.0 * fine_[2].high) * t + fine_[1].high;
    double guess = std::ldexp(t - value / slope, time_bits);
    if (!(guess > static_cast<double>(first))) guess = static_cast<double>(first);
    if (!(guess < static_cast<double>(last))) guess = static_cast<double>(last);
    auto not_after = static_cast<std::int64_t>(std::floor(guess));
    std::int64_t step = 1;
    std::int64_t after = not_after;
    while (not_after > first && sign(not_after) == -before) {
        after = not_after;
        not_after = std::max(first, not_after - step);
        step *= 2;
    }
    for (; after == not_after; step *= 2) {
        if (not_after == last) return last;  // the root itself
        after = std::min(last, not_after + step);
        if (sign(after) != -before) not_after = after;
    }
    while (after - not_after > 1) {
        const std::int64_t middle = not_after + (after - not_after) / 2;
        (sign(middle) == -before ? after : not_after) = middle;
    }
    return not_after;
}

bool Coplanarity::vanishes() {
    make_whole();
    return lines_ && std::ranges::all_of(whole_, [](const Fixed& c) { return c.is_zero(); });
}

std::optional<bool> Coplanarity::meets(std::int64_t n, int before, bool in_pair) {
    make_whole();
    if (!lines_) return std::nullopt;
    const auto& [e, u, w] = *lines_;
    const bool exact = sign(n) == 0;
    bool parallel = true;
    for (std::size_t k = 0; k < 3; ++k) {
        const Quadratic<Fixed> normal = cross<Fixed>(u, w, k);
        const std::optional<int> turn = sign_at_root(normal, n, exact, before);
        if (!turn) parallel = false;
        if (!turn || *turn == 0) continue;
        const Quadratic<Fixed> alpha = cross<Fixed>(e, w, k);
        const Quadratic<Fixed> beta = features_->edges ? cross<Fixed>(e, u, k) : cross<Fixed>(u, e, k);
        const auto without = [](const Quadratic<Fixed>& a, const Quadratic<Fixed>& b) -> Quadratic<Fixed> {
            return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
        };
        const std::array<Quadratic<Fixed>, 4> conditions{
            alpha, beta, features_->edges ? without(normal, alpha) : without(without(normal, alpha), beta),
            features_->edges ? without(normal, beta) : normal};
        bool certain = true;
        for (const Quadratic<Fixed>& condition : conditions) {
            const std::optional<int> side = sign_at_root(condition, n, exact, before);
            if (side && *side * *turn < 0) return false;
            certain = certain && side;
        }
        if (certain) return true;
        return std::nullopt;
    }
    if (parallel && in_pair && features_->edges) return false;
    return std::nullopt;
}

void Coplanarity::make_whole() {
    if (made_) return;
    made_ = true;
    lines_ = whole_lines(*features_);
    if (lines_) {
        whole_ = coplanarity_of(*lines_);
        return;
    }
    polynomial_ = volume_of(features_->copy(), features_->edges);
}

/// Sign of q at the only root in [n, n + 1] / 2^53, or exactly at n; empty when q is not linear and may vanish near it.
std::optional<int> Coplanarity::sign_at_root(const Quadratic<Fixed>& q, std::int64_t n, bool exact, int before) const {
    // q in Bernstein form over this interval, times 2^107.
    const auto value = [&q](std::int64_t s, std::int64_t t) {
        return Fixed(q[2] * 2 * s * t + ((q[1] * (s + t)) << 53U) + (q[0] << 107U)).sign();
    };
    const int first = value(n, n);
    if (exact) return first;
    if (first != 0 && value(n, n + 1) == first && value(n + 1, n + 1) == first) return first;
    if (!q[2].is_zero()) return std::nullopt;
    if (q[1].is_zero()) return q[0].sign();
    // q vanishes at s = -q0 / q1 in this interval. The sign of the cubic at s, times |q1|³, gives the side of s on
    // which the root is.
    const int rise = q[1].sign();
    const Fixed top = rise > 0 ? Fixed(-q[0]) : q[0];
    const Fixed bottom = abs(q[1]);
    const Cubic<Fixed>& c = whole_;
    const Fixed at_zero =
        ((c[3] * top + c[2] * bottom) * top + c[1] * bottom * bottom) * top + c[0] * bottom * bottom * bottom;
    if (at_zero.is_zero()) return 0;
    return at_zero.sign() == before ? rise : -rise;
}

}  // namespace trocar::continuous
