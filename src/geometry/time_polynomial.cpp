#include "geometry/time_polynomial.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::continuous {

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
    Polynomial sum = a;
    sum.coefficient.resize(std::max(a.coefficient.size(), b.coefficient.size()));
    for (std::size_t i = 0; i < b.coefficient.size(); ++i) sum.coefficient[i] += b.coefficient[i];
    sum.trim();
    return sum;
}

Polynomial operator-(const Polynomial& a, const Polynomial& b) {
    Polynomial difference = a;
    difference.coefficient.resize(std::max(a.coefficient.size(), b.coefficient.size()));
    for (std::size_t i = 0; i < b.coefficient.size(); ++i) difference.coefficient[i] -= b.coefficient[i];
    difference.trim();
    return difference;
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
    Polynomial product;
    if (a.is_zero() || b.is_zero()) return product;
    product.coefficient.resize(a.degree() + b.degree() + 1);
    for (std::size_t i = 0; i < a.coefficient.size(); ++i) {
        for (std::size_t j = 0; j < b.coefficient.size(); ++j) {
            product.coefficient[i + j] += a.coefficient[i] * b.coefficient[j];
        }
    }
    return product;
}

namespace {

Polynomial derivative(const Polynomial& p) {
    Polynomial result;
    for (std::size_t i = 1; i < p.coefficient.size(); ++i) result.coefficient.push_back(p.coefficient[i] * i);
    return result;
}

/// Divides all coefficients by their greatest common divisor (positive: signs stay).
void make_primitive(Polynomial& p) {
    Big common = 0;
    for (const Big& c : p.coefficient) common = gcd(common, c);
    if (common > 1) {
        for (Big& c : p.coefficient) c /= common;
    }
}

/// Quotient and remainder of a positive multiple of `a` divided by `b`, both primitive.
std::pair<Polynomial, Polynomial> divide(const Polynomial& a, const Polynomial& b) {
    const Big scale = abs(b.coefficient.back());
    Polynomial quotient;
    Polynomial rest = a;
    if (!a.is_zero() && a.degree() >= b.degree()) quotient.coefficient.resize(a.degree() - b.degree() + 1);
    while (!rest.is_zero() && rest.degree() >= b.degree()) {
        const std::size_t shift = rest.degree() - b.degree();
        const Big factor = b.coefficient.back() < 0 ? Big(-rest.coefficient.back()) : rest.coefficient.back();
        for (Big& c : quotient.coefficient) c *= scale;
        for (Big& c : rest.coefficient) c *= scale;
        quotient.coefficient[shift] += factor;
        for (std::size_t i = 0; i < b.coefficient.size(); ++i) {
            rest.coefficient[i + shift] -= factor * b.coefficient[i];
        }
        rest.trim();
    }
    make_primitive(quotient);
    make_primitive(rest);
    return {std::move(quotient), std::move(rest)};
}

/// p(at) · 2^(exponent · degree).
Big scaled_value(const Polynomial& p, const Dyadic& at) {
    Big value = 0;
    unsigned shift = 0;
    for (std::size_t i = p.coefficient.size(); i-- > 0; shift += at.exponent) {
        value = value * at.numerator + (p.coefficient[i] << shift);
    }
    return value;
}

}  // namespace

Polynomial greatest_common_divisor(Polynomial a, Polynomial b) {
    while (!b.is_zero()) {
        Polynomial rest = divide(a, b).second;
        a = std::move(b);
        b = std::move(rest);
    }
    make_primitive(a);
    return a;
}

int sign_at(const Polynomial& p, const Dyadic& at) { return scaled_value(p, at).sign(); }

int Root::sign_of(const Polynomial& other) {
    if (other.is_zero()) return 0;
    Big slope = 0;  // no value in [0, 1] changes faster
    for (std::size_t i = 1; i < other.coefficient.size(); ++i) slope += abs(other.coefficient[i]) * i;
    // A common factor is rare and costly to find: first test whether a fine interval decides the sign.
    constexpr unsigned fine = 60;
    for (bool may_vanish = true;;) {
        const Big value = scaled_value(other, low_);
        if (exact_ || other.degree() == 0) return value.sign();
        const auto shift = static_cast<unsigned>(low_.exponent * (other.degree() - 1));
        if (abs(value) > (slope << shift)) return value.sign();
        if (may_vanish && low_.exponent >= fine) {
            const Polynomial common = greatest_common_divisor(*polynomial_, other);
            if (common.degree() > 0 && sign_at(common, low_) * sign_at(common, high()) < 0) return 0;
            may_vanish = false;
        }
        refine();
    }
}

double Root::rounded_down() {
    constexpr unsigned bits = 53;
    while (!exact_ && low_.exponent < bits) refine();
    const Big whole = low_.exponent > bits ? Big(low_.numerator >> (low_.exponent - bits))
                                           : Big(low_.numerator << (bits - low_.exponent));
    return std::ldexp(static_cast<double>(whole), -static_cast<int>(bits));
}

void Root::refine() {
    low_.numerator *= 2;
    ++low_.exponent;
    const Dyadic middle = high();
    const int middle_sign = sign_at(*polynomial_, middle);
    if (middle_sign == 0) exact_ = true;
    if (middle_sign != high_sign_) low_ = middle;
}

Roots::Roots(Polynomial polynomial) : polynomial_(std::move(polynomial)) {
    make_chain();
    // The chain ends with the repeated factors.
    if (!chain_.empty() && chain_.back().degree() > 0) {
        polynomial_ = divide(polynomial_, chain_.back()).first;
        make_chain();
    }
}

std::optional<double> Roots::first(const Accepted& accepted) const {
    if (polynomial_.is_zero() || polynomial_.degree() == 0) return std::nullopt;
    if (sign_at(polynomial_, {0, 0}) == 0) {
        Root zero(polynomial_, {0, 0}, true);
        if (accepted(zero)) return 0.0;
    }
    return first_between({0, 0}, accepted);
}

void Roots::make_chain() {
    chain_.clear();
    for (Polynomial next = polynomial_; !next.is_zero();) {
        chain_.push_back(next);
        if (chain_.size() == 1) {
            next = derivative(polynomial_);
            continue;
        }
        next = divide(chain_[chain_.size() - 2], chain_.back()).second;
        for (Big& c : next.coefficient) c = -c;
    }
}

int Roots::variations(const Dyadic& at) const {
    int count = 0;
    int last = 0;
    for (const Polynomial& p : chain_) {
        const int sign = sign_at(p, at);
        if (sign == 0) continue;
        if (last * sign < 0) ++count;
        last = sign;
    }
    return count;
}

/// The first accepted root r with low < r <= low + 2^-exponent.
std::optional<double> Roots::first_between(const Dyadic& low, const Accepted& accepted) const {
    const Dyadic high{low.numerator + 1, low.exponent};
    const int count = variations(low) - variations(high);
    if (count == 0) return std::nullopt;
    if (count == 1) {
        const bool at_high = sign_at(polynomial_, high) == 0;
        Root root(polynomial_, at_high ? high : low, at_high);
        if (!accepted(root)) return std::nullopt;
        return root.rounded_down();
    }
    const Dyadic left{low.numerator * 2, low.exponent + 1};
    const Dyadic right{left.numerator + 1, left.exponent};
    if (const std::optional<double> time = first_between(left, accepted)) return time;
    return first_between(right, accepted);
}

}  // namespace trocar::continuous
