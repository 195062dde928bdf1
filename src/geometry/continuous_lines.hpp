// The features of the continuous test (continuous_features.hpp) and their coplanarity polynomial in more digits than a
// double has. Number types: double-double, and integers of fixed size without heap. continuous_coplanarity.hpp chooses
// between them.
#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstddef>
#include <optional>

#include "geometry/continuous_features.hpp"
#include "geometry/expansion.hpp"

namespace trocar::continuous {

/// high + low, with |low| at most half a unit in the last place of high (Dekker 1971). Relative error of an operation:
/// about 2^-100 of the operands' size, while nothing over- or underflows.
struct DoubleDouble {
    double high = 0.0;
    double low = 0.0;
};

inline DoubleDouble normalised(double value, double error) {
    const double sum = value + error;
    return {sum, error - (sum - value)};
}
inline DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
    const expansion::Rounded high = expansion::exact_sum(a.high, b.high);
    const expansion::Rounded low = expansion::exact_sum(a.low, b.low);
    const DoubleDouble sum = normalised(high.value, high.error + low.value);
    return normalised(sum.high, sum.low + low.error);
}
inline DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) {
    return a + DoubleDouble{-b.high, -b.low};
}
inline DoubleDouble operator*(const DoubleDouble& a, const DoubleDouble& b) {
    const expansion::Rounded product = expansion::exact_product(a.high, b.high);
    return normalised(product.value, product.error + (a.high * b.low + a.low * b.high));
}

/// Integers without heap: room for nine factors of 201 bits, the largest product below.
using Fixed = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<
    2048, 2048, boost::multiprecision::signed_magnitude, boost::multiprecision::unchecked, void>>;

/// e, u and w of features as start + t change, in any arithmetic.
template <typename Number>
struct Lines {
    struct Line {
        std::array<Number, 3> start;
        std::array<Number, 3> change;
    };
    Line e;
    Line u;
    Line w;
};
/// Element [i] is the coefficient of t^i.
template <typename Number>
using Quadratic = std::array<Number, 3>;
template <typename Number>
using Cubic = std::array<Number, 4>;

/// number(x) converts a coordinate to a Number.
template <typename Number, typename Convert>
Lines<Number> lines_of(const Features& f, const Convert& number) {
    const auto difference = [&](const MovingPoint& to, const MovingPoint& from) {
        typename Lines<Number>::Line line;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto k = static_cast<Eigen::Index>(i);
            line.start[i] = number(to.start[k]) - number(from.start[k]);
            line.change[i] = number(to.end[k]) - number(from.end[k]) - line.start[i];
        }
        return line;
    };
    const auto& p = f.points;
    if (f.edges) return {difference(*p[2], *p[0]), difference(*p[1], *p[0]), difference(*p[3], *p[2])};
    return {difference(*p[0], *p[1]), difference(*p[2], *p[1]), difference(*p[3], *p[1])};
}

/// Component i of a × b.
template <typename Number>
Quadratic<Number> cross(const typename Lines<Number>::Line& a, const typename Lines<Number>::Line& b, std::size_t i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    return {
        a.start[j] * b.start[k] - a.start[k] * b.start[j],
        (a.start[j] * b.change[k] - a.start[k] * b.change[j]) + (a.change[j] * b.start[k] - a.change[k] * b.start[j]),
        a.change[j] * b.change[k] - a.change[k] * b.change[j]};
}

template <typename Number>
Cubic<Number> coplanarity_of(const Lines<Number>& lines) {
    Cubic<Number> c;
    for (std::size_t i = 0; i < 3; ++i) {
        const Quadratic<Number> n = cross<Number>(lines.u, lines.w, i);
        const Number& start = lines.e.start[i];
        const Number& change = lines.e.change[i];
        const Cubic<Number> part{start * n[0], start * n[1] + change * n[0], start * n[2] + change * n[1],
                                 change * n[2]};
        for (std::size_t k = 0; k < 4; ++k) c[k] = i == 0 ? part[k] : Number(c[k] + part[k]);
    }
    return c;
}

/// Polynomial of the features times their scale.
Cubic<DoubleDouble> fine_coplanarity(const Features& f);
/// Bound on the error of a value of fine_coplanarity in [0, 1]. Precondition: the features have a tolerance.
double fine_tolerance(const Features& f);

/// Lines times a power of two that makes them integer; empty when the coordinates span more bits than Fixed holds.
std::optional<Lines<Fixed>> whole_lines(const Features& f);

}  // namespace trocar::continuous
