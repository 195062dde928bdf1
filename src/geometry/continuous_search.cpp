#include "geometry/continuous_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/continuous_exclusion.hpp"

namespace trocar::continuous {
namespace {

/// A place in [0, 1] and the value there.
struct NearRoot {
    double s;
    double value;
};

/// Root of a monotone cubic in Bernstein form that changes sign: Newton's method, clamped to the interval.
NearRoot near_root(const std::array<double, 4>& c, double tolerance) {
    double left = 0.0;
    double right = 1.0;
    NearRoot near{c[0] / (c[0] - c[3]), 0.0};
    for (int i = 0; i < 60; ++i) {
        const double s = near.s;
        const double r = 1.0 - s;
        near.value = ((c[0] * r + 3.0 * s * c[1]) * r + 3.0 * s * s * c[2]) * r + s * s * s * c[3];
        if (std::abs(near.value) <= tolerance || right - left < 1e-15) break;
        ((near.value > 0.0) == (c[0] > 0.0) ? left : right) = s;
        const double tangent = 3.0 * (r * r * (c[1] - c[0]) + 2.0 * r * s * (c[2] - c[1]) + s * s * (c[3] - c[2]));
        near.s -= near.value / tangent;
        if (!(near.s > left && near.s < right)) near.s = 0.5 * (left + right);
    }
    return near;
}

}  // namespace

Sight RootSearch::next() {
    using Verdict = Sight::Verdict;
    Sight sight{.verdict = Verdict::unknown};
    if (features_->tolerance >= 0.0) sight = search();
    if (sight.verdict != Verdict::unknown || fine_) return sight;
    const std::array<MovingPoint, 4> points = features_->copy();
    if (features_->edges ? edge_edge_apart(points, few_cells) : vertex_face_apart(points, few_cells)) return {};
    if (features_->tolerance < 0.0) return sight;
    // Too flat for double: repeat with coefficients in double-double.
    fine_ = true;
    constexpr DoubleDouble third{1.0 / 3.0, 1.850371707708594e-17};
    const Cubic<DoubleDouble> c = fine_coplanarity(*features_);
    const DoubleDouble c1 = c[1] * third;
    const DoubleDouble c2 = c[2] * third;
    const std::array<double, 4> bernstein{c[0].high, (c[0] + c1).high, (c[0] + c1 + c1 + c2).high,
                                          (c[0] + c[1] + c[2] + c[3]).high};
    double largest = 0.0;
    for (const double x : bernstein) largest = std::max(largest, std::abs(x));
    const double error = fine_tolerance(*features_);
    if (largest <= error) {
        return {.verdict = coplanarity().vanishes() ? Verdict::coplanar : Verdict::unknown};
    }
    search_from(bernstein, 2e-15 * largest + error);
    return search();
}

/// Puts both halves on the stack, the earlier one on top.
void RootSearch::halve(const Piece& piece) {
    const auto& c = piece.c;
    const double c01 = 0.5 * (c[0] + c[1]);
    const double c12 = 0.5 * (c[1] + c[2]);
    const double c23 = 0.5 * (c[2] + c[3]);
    const double c012 = 0.5 * (c01 + c12);
    const double c123 = 0.5 * (c12 + c23);
    const double middle = 0.5 * (c012 + c123);
    const double width = 0.5 * piece.width;
    stack_[depth_++] = {{middle, c123, c23, c[3]}, piece.low + width, width};
    stack_[depth_++] = {{c[0], c01, c012, middle}, piece.low, width};
}

Sight RootSearch::search() {
    using Verdict = Sight::Verdict;
    constexpr double least_width = 1.0 / (1 << 20);
    const double tolerance = tolerance_;
    while (depth_ > 0) {
        const Piece piece = stack_[--depth_];
        const auto& c = piece.c;
        const auto [least, most] = std::minmax({c[0], c[1], c[2], c[3]});
        if (least > tolerance || most < -tolerance) continue;
        const auto [least_rise, most_rise] = std::minmax({c[1] - c[0], c[2] - c[1], c[3] - c[2]});
        // Lower bound on a third of the slope's size; both signs of rise cannot be certain.
        const double slope = std::max(least_rise, -most_rise) - 2.0 * tolerance;
        const auto end_sign = [&](double value, double time) {
            if (std::abs(value) > tolerance) return value > 0.0 ? 1 : -1;
            return fine_ ? coplanarity().sign(static_cast<std::int64_t>(std::ldexp(time, time_bits))) : 2;
        };
        if (!fine_ && std::max(-least, most) <= tolerance) {
            depth_ = 0;
            return {.verdict = Verdict::unknown, .low = piece.low};
        }
        const int before = slope > 0.0 ? end_sign(c[0], piece.low) : 2;
        const int after = before != 2 ? end_sign(c[3], piece.low + piece.width) : 2;
        if (before == 0 || (after == 0 && before != 2)) {
            // The root is an end of the piece; one at the end is also at the start of the next piece.
            if (after == 0 && piece.low + piece.width < 1.0) continue;
            const double time = before == 0 ? piece.low : 1.0;
            return {Verdict::maybe, time, time, before != 0 ? before : -after};
        }
        if (!fine_ && slope > 0.0 && (before == 2 || after == 2)) {
            depth_ = 0;
            return {.verdict = Verdict::unknown, .low = piece.low};
        }
        if (before != 2 && after != 2) {
            if (before == after) continue;
            const auto [s, value] = near_root(c, tolerance);
            const double off = (std::abs(value) + 2.0 * tolerance) / (3.0 * slope) + 1e-15;
            const double half = off * piece.width + 1e-15;
            const double time = piece.low + s * piece.width;
            const int meets = meet_at(*features_, time, half);
            if (meets < 0) continue;
            if (meets > 0 || half < 1e-9) {
                return {meets > 0 ? Verdict::hit : Verdict::maybe, std::max(piece.low, time - half),
                        std::min(piece.low + piece.width, time + half), before};
            }
        }
        if (piece.width <= least_width || depth_ + 2 > stack_.size()) {
            depth_ = 0;
            return {.verdict = Verdict::unknown, .low = piece.low};
        }
        halve(piece);
    }
    return {};
}

}  // namespace trocar::continuous
