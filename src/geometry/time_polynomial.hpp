// Polynomials in time with integer coefficients of any size, and their roots within a tick, isolated by Sturm
// sequences. The last stage of the continuous test (continuous_exact.hpp) decides on them. Nothing is rounded.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace trocar::continuous {

using Big = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>, boost::multiprecision::et_off>;

/// coefficient[i] belongs to t^i; trailing zeros are trimmed, so the zero polynomial is empty.
struct Polynomial {
    std::vector<Big> coefficient;

    [[nodiscard]] bool is_zero() const { return coefficient.empty(); }
    [[nodiscard]] std::size_t degree() const { return coefficient.size() - 1; }
    void trim() {
        while (!coefficient.empty() && coefficient.back() == 0) coefficient.pop_back();
    }
};

Polynomial operator+(const Polynomial& a, const Polynomial& b);
Polynomial operator-(const Polynomial& a, const Polynomial& b);
Polynomial operator*(const Polynomial& a, const Polynomial& b);
/// Primitive: its coefficients have no common factor. Zero only when both are zero.
Polynomial greatest_common_divisor(Polynomial a, Polynomial b);

/// numerator / 2^exponent.
struct Dyadic {
    Big numerator;
    unsigned exponent = 0;
};

int sign_at(const Polynomial& p, const Dyadic& at);

/// A root of a square-free polynomial in [0, 1]: a dyadic number, or the only root strictly between numerator /
/// 2^exponent and (numerator + 1) / 2^exponent.
class Root {
public:
    Root(const Polynomial& polynomial, Dyadic low, bool exact)
        : polynomial_(&polynomial), low_(std::move(low)), exact_(exact) {
        if (exact_) return;
        high_sign_ = sign_at(polynomial, high());
        while (!exact_ && sign_at(polynomial, low_) == 0) refine();
    }

    /// Sign of another polynomial at the root.
    [[nodiscard]] int sign_of(const Polynomial& other);
    /// The root rounded down to a multiple of 2^-53.
    [[nodiscard]] double rounded_down();

private:
    [[nodiscard]] Dyadic high() const { return {low_.numerator + 1, low_.exponent}; }
    void refine();

    const Polynomial* polynomial_;
    Dyadic low_;
    bool exact_;
    int high_sign_ = 0;
};

/// Roots in [0, 1] in ascending order, isolated one at a time.
class Roots {
public:
    using Accepted = std::function<bool(Root&)>;

    explicit Roots(Polynomial polynomial);
    Roots(const Roots&) = delete;
    Roots& operator=(const Roots&) = delete;
    Roots(Roots&&) = delete;
    Roots& operator=(Roots&&) = delete;
    ~Roots() = default;

    /// The first root for which `accepted` returns true, rounded down; empty if there is none.
    [[nodiscard]] std::optional<double> first(const Accepted& accepted) const;

private:
    void make_chain();
    [[nodiscard]] int variations(const Dyadic& at) const;
    [[nodiscard]] std::optional<double> first_between(const Dyadic& low, const Accepted& accepted) const;

    Polynomial polynomial_;          ///< square-free
    std::vector<Polynomial> chain_;  ///< Sturm chain
};

}  // namespace trocar::continuous
