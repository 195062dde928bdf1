// Sums of doubles that represent a value exactly (Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast
// robust geometric predicates"): last stage of the filtered predicates. Valid while no product over- or underflows and
// the compiler does not contract a*b+c.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace trocar::expansion {

/// Non-overlapping terms of increasing magnitude, without zeros; no terms = zero.
template <std::size_t Capacity>
struct Expansion {
    std::array<double, Capacity> term;
    std::size_t size = 0;

    void append(double value) {
        if (value != 0.0) term[size++] = value;
    }
    /// The largest term decides.
    [[nodiscard]] int sign() const {
        if (size == 0) return 0;
        return term[size - 1] > 0.0 ? 1 : -1;
    }
};

/// `value` is the rounded result of an operation, value + error the exact one.
struct Rounded {
    double value;
    double error;
};

inline Rounded exact_sum(double a, double b) {
    const double value = a + b;
    const double b_part = value - a;
    const double a_part = value - b_part;
    return {value, (a - a_part) + (b - b_part)};
}

inline Rounded exact_product(double a, double b) {
    constexpr double splitter = 134217729.0;  // 2^27 + 1 (Dekker); no fma: generic x86-64 would call a library for it
    const double a_big = splitter * a;
    const double a_high = a_big - (a_big - a);
    const double a_low = a - a_high;
    const double b_big = splitter * b;
    const double b_high = b_big - (b_big - b);
    const double b_low = b - b_high;
    const double value = a * b;
    return {value, a_low * b_low - (((value - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

inline Expansion<2> difference(double a, double b) {
    const Rounded d = exact_sum(a, -b);
    Expansion<2> result;
    result.append(d.error);
    result.append(d.value);
    return result;
}

template <std::size_t N, std::size_t M>
Expansion<N + M> operator+(const Expansion<N>& e, const Expansion<M>& f) {
    Expansion<N + M> result;
    double carry = 0.0;
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < e.size || j < f.size) {
        const bool take_e = j == f.size || (i < e.size && std::abs(e.term[i]) < std::abs(f.term[j]));
        const Rounded s = exact_sum(carry, take_e ? e.term[i++] : f.term[j++]);
        result.append(s.error);
        carry = s.value;
    }
    result.append(carry);
    return result;
}

template <std::size_t N>
Expansion<N> operator-(Expansion<N> e) {
    for (std::size_t i = 0; i < e.size; ++i) e.term[i] = -e.term[i];
    return e;
}

template <std::size_t N>
Expansion<2 * N> operator*(const Expansion<N>& e, double factor) {
    Expansion<2 * N> result;
    double carry = 0.0;
    for (std::size_t i = 0; i < e.size; ++i) {
        const Rounded p = exact_product(e.term[i], factor);
        const Rounded low = exact_sum(carry, p.error);
        result.append(low.error);
        const Rounded high = exact_sum(p.value, low.value);
        result.append(high.error);
        carry = high.value;
    }
    result.append(carry);
    return result;
}

template <std::size_t N>
Expansion<4 * N> operator*(const Expansion<N>& e, const Expansion<2>& f) {
    const Expansion<2 * N> low = f.size > 0 ? e * f.term[0] : Expansion<2 * N>{};
    const Expansion<2 * N> high = f.size > 1 ? e * f.term[1] : Expansion<2 * N>{};
    return low + high;
}

}  // namespace trocar::expansion
