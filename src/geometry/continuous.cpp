#include "geometry/continuous.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

using Big = boost::multiprecision::cpp_int;

// ---- polynomials in time with integer coefficients ------------------------------------------------------------

/// coefficient[i] belongs to t^i; no leading zeros, so the zero polynomial is empty.
struct Polynomial {
    std::vector<Big> coefficient;

    [[nodiscard]] bool is_zero() const { return coefficient.empty(); }
    [[nodiscard]] std::size_t degree() const { return coefficient.size() - 1; }
    void trim() {
        while (!coefficient.empty() && coefficient.back() == 0) coefficient.pop_back();
    }
};

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

Polynomial greatest_common_divisor(Polynomial a, Polynomial b) {
    while (!b.is_zero()) {
        Polynomial rest = divide(a, b).second;
        a = std::move(b);
        b = std::move(rest);
    }
    make_primitive(a);
    return a;
}

/// numerator / 2^exponent.
struct Dyadic {
    Big numerator;
    unsigned exponent = 0;
};

/// p(at) · 2^(exponent · degree).
Big scaled_value(const Polynomial& p, const Dyadic& at) {
    Big value = 0;
    unsigned shift = 0;
    for (std::size_t i = p.coefficient.size(); i-- > 0; shift += at.exponent) {
        value = value * at.numerator + (p.coefficient[i] << shift);
    }
    return value;
}
int sign_at(const Polynomial& p, const Dyadic& at) { return scaled_value(p, at).sign(); }

/// A root of a square-free polynomial in [0, 1]: a dyadic number, or the only root between numerator / 2^exponent and
/// (numerator + 1) / 2^exponent, ends excluded.
class Root {
public:
    Root(const Polynomial& polynomial, Dyadic low, bool exact)
        : polynomial_(&polynomial), low_(std::move(low)), exact_(exact) {
        if (exact_) return;
        high_sign_ = sign_at(polynomial, high());
        while (!exact_ && sign_at(polynomial, low_) == 0) refine();
    }

    /// Sign of another polynomial at the root.
    [[nodiscard]] int sign_of(const Polynomial& other) {
        if (other.is_zero()) return 0;
        Big slope = 0;  // no value in [0, 1] changes faster
        for (std::size_t i = 1; i < other.coefficient.size(); ++i) slope += abs(other.coefficient[i]) * i;
        // A common factor is dear to find and rare: first see whether a fine interval tells the sign.
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

    /// The root rounded down to a multiple of 2^-53.
    [[nodiscard]] double rounded_down() {
        constexpr unsigned bits = 53;
        while (!exact_ && low_.exponent < bits) refine();
        const Big whole = low_.exponent > bits ? Big(low_.numerator >> (low_.exponent - bits))
                                               : Big(low_.numerator << (bits - low_.exponent));
        return std::ldexp(static_cast<double>(whole), -static_cast<int>(bits));
    }

private:
    [[nodiscard]] Dyadic high() const { return {low_.numerator + 1, low_.exponent}; }

    void refine() {
        low_.numerator *= 2;
        ++low_.exponent;
        const Dyadic middle = high();
        const int middle_sign = sign_at(*polynomial_, middle);
        if (middle_sign == 0) exact_ = true;
        if (middle_sign != high_sign_) low_ = middle;
    }

    const Polynomial* polynomial_;
    Dyadic low_;
    bool exact_;
    int high_sign_ = 0;
};

/// Roots in [0, 1] in ascending order, made one by one.
class Roots {
public:
    explicit Roots(Polynomial polynomial) : polynomial_(std::move(polynomial)) {
        make_chain();
        // The chain ends with the factors that occur more than once.
        if (!chain_.empty() && chain_.back().degree() > 0) {
            polynomial_ = divide(polynomial_, chain_.back()).first;
            make_chain();
        }
    }
    Roots(const Roots&) = delete;
    Roots& operator=(const Roots&) = delete;
    Roots(Roots&&) = delete;
    Roots& operator=(Roots&&) = delete;
    ~Roots() = default;

    /// The first root that `accepted` holds for, rounded down.
    template <typename Accepted>
    std::optional<double> first(const Accepted& accepted) const {
        if (polynomial_.is_zero() || polynomial_.degree() == 0) return std::nullopt;
        if (sign_at(polynomial_, {0, 0}) == 0) {
            Root zero(polynomial_, {0, 0}, true);
            if (accepted(zero)) return 0.0;
        }
        return first_between({0, 0}, accepted);
    }

private:
    void make_chain() {
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

    [[nodiscard]] int variations(const Dyadic& at) const {
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

    /// Among the roots r with low < r <= low + 2^-exponent.
    template <typename Accepted>
    std::optional<double> first_between(const Dyadic& low, const Accepted& accepted) const {
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

    Polynomial polynomial_;          ///< square-free
    std::vector<Polynomial> chain_;  ///< Sturm's
};

// ---- moving points on an integer grid ----------------------------------------------------------------------------

using PolynomialVector = std::array<Polynomial, 3>;

PolynomialVector operator-(const PolynomialVector& a, const PolynomialVector& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Polynomial dot(const PolynomialVector& a, const PolynomialVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
PolynomialVector cross(const PolynomialVector& a, const PolynomialVector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// All coordinates times the power of two that makes them whole, as polynomials in time.
std::array<PolynomialVector, 4> on_grid(const std::array<MovingPoint, 4>& points) {
    int lowest = std::numeric_limits<int>::max();
    const auto unit_of = [](double x) { return std::ilogb(x) - 52; };
    for (const MovingPoint& p : points) {
        for (const Vector3* x : {&p.start, &p.end}) {
            for (int i = 0; i < 3; ++i) {
                if ((*x)[i] != 0.0) lowest = std::min(lowest, unit_of((*x)[i]));
            }
        }
    }
    const auto whole = [&](double x) {
        if (x == 0.0) return Big(0);
        const Big mantissa = static_cast<std::int64_t>(std::scalbn(x, -unit_of(x)));
        return Big(mantissa << static_cast<unsigned>(unit_of(x) - lowest));
    };
    std::array<PolynomialVector, 4> result;
    for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t i = 0; i < 3; ++i) {
            const Big start = whole(points[k].start[static_cast<Eigen::Index>(i)]);
            const Big end = whole(points[k].end[static_cast<Eigen::Index>(i)]);
            result[k][i].coefficient = {start, end - start};
            result[k][i].trim();
        }
    }
    return result;
}

/// A component that does not vanish at the root, or -1.
int nonzero_component(Root& root, const PolynomialVector& v) {
    for (int i = 0; i < 3; ++i) {
        if (root.sign_of(v[static_cast<std::size_t>(i)]) != 0) return i;
    }
    return -1;
}

bool on_segment(Root& root, const PolynomialVector& p, const PolynomialVector& a, const PolynomialVector& b) {
    return nonzero_component(root, cross(b - a, p - a)) < 0 && root.sign_of(dot(a - p, b - p)) <= 0;
}

/// Point and segment of a motion that may be anything.
std::optional<double> point_meets_segment(const PolynomialVector& p, const PolynomialVector& a,
                                          const PolynomialVector& b) {
    const PolynomialVector off_line = cross(b - a, p - a);
    const Polynomial between = dot(a - p, b - p);  // <= 0 where p on the line lies between the ends
    Polynomial common;
    for (const Polynomial& component : off_line) common = greatest_common_divisor(common, component);
    if (common.is_zero()) {
        // On one line all the time.
        if (sign_at(between, {0, 0}) <= 0) return 0.0;
        return Roots(between).first([](Root& /*root*/) { return true; });
    }
    return Roots(common).first([&](Root& root) { return root.sign_of(between) <= 0; });
}

std::optional<double> earlier(std::optional<double> a, std::optional<double> b) {
    if (a && b) return std::min(*a, *b);
    return a ? a : b;
}

std::optional<double> exact_vertex_face(const std::array<MovingPoint, 4>& points) {
    const std::array<PolynomialVector, 4> grid = on_grid(points);
    const PolynomialVector& p = grid[0];
    const PolynomialVector& a = grid[1];
    const PolynomialVector& b = grid[2];
    const PolynomialVector& c = grid[3];
    const PolynomialVector normal = cross(b - a, c - a);
    const Polynomial volume = dot(p - a, normal);
    if (volume.is_zero()) {
        // In one plane all the time: inside at the start, or in through an edge.
        const Vector3& start = points[0].start;
        if (triangles_intersect({start, start, start}, {points[1].start, points[2].start, points[3].start})) return 0.0;
        return earlier(earlier(point_meets_segment(p, a, b), point_meets_segment(p, b, c)),
                       point_meets_segment(p, c, a));
    }
    return Roots(volume).first([&](Root& root) {
        const int axis = nonzero_component(root, normal);
        if (axis < 0) return on_segment(root, p, a, b) || on_segment(root, p, b, c) || on_segment(root, p, c, a);
        const auto k = static_cast<std::size_t>(axis);
        const int turn = root.sign_of(normal[k]);
        for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &c), std::pair(&c, &a)}) {
            if (root.sign_of(cross(*to - *from, p - *from)[k]) * turn < 0) return false;
        }
        return true;
    });
}

std::optional<double> exact_edge_edge(const std::array<MovingPoint, 4>& points) {
    const std::array<PolynomialVector, 4> grid = on_grid(points);
    const PolynomialVector& a = grid[0];
    const PolynomialVector& b = grid[1];
    const PolynomialVector& c = grid[2];
    const PolynomialVector& d = grid[3];
    const PolynomialVector normal = cross(b - a, d - c);
    const Polynomial volume = dot(c - a, normal);
    if (volume.is_zero()) {
        // In one plane all the time: crossing at the start, or from the moment an end arrives.
        if (triangles_intersect({points[0].start, points[1].start, points[1].start},
                                {points[2].start, points[3].start, points[3].start})) {
            return 0.0;
        }
        return earlier(earlier(point_meets_segment(a, c, d), point_meets_segment(b, c, d)),
                       earlier(point_meets_segment(c, a, b), point_meets_segment(d, a, b)));
    }
    return Roots(volume).first([&](Root& root) {
        const int axis = nonzero_component(root, normal);
        if (axis < 0) {
            return on_segment(root, a, c, d) || on_segment(root, b, c, d) || on_segment(root, c, a, b) ||
                   on_segment(root, d, a, b);
        }
        const auto k = static_cast<std::size_t>(axis);
        const auto side = [&](const PolynomialVector& from, const PolynomialVector& to, const PolynomialVector& x) {
            return root.sign_of(cross(to - from, x - from)[k]);
        };
        return side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0;
    });
}

// ---- exclusion in floating point ---------------------------------------------------------------------------------

/// gap(t, u, v) = base(t) + u · along_u(t) + v · along_v(t) over the unit cube: zero where the two sets touch. Linear
/// in each variable, so that its extremes over a box are among the box's corners.
struct Gap {
    MovingPoint base;
    MovingPoint along_u;
    MovingPoint along_v;
    bool triangle;           ///< only u + v <= 1 counts
    double tolerance = 0.0;  ///< bound on the rounding error of any value
};

/// True when the gap is nowhere zero, without doubt; false says nothing. Bisects a limited number of times.
bool certainly_apart(const Gap& gap) {
    struct Cell {
        std::array<double, 3> low;
        std::array<double, 3> size;
    };
    if (!(gap.tolerance < 1e280)) return false;  // sums might overflow
    constexpr std::size_t stack_size = 64;
    constexpr int cell_limit = 300;
    std::array<Cell, stack_size> stack;
    std::size_t depth = 0;
    stack[depth++] = {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
    for (int cells = 0; depth > 0; ++cells) {
        if (cells == cell_limit || depth + 2 > stack_size) return false;
        const Cell cell = stack[--depth];
        if (gap.triangle && cell.low[1] + cell.low[2] > 1.0) continue;
        std::array<Vector3, 8> value;
        for (std::size_t k = 0; k < 8; ++k) {
            const double t = cell.low[0] + ((k & 1U) != 0 ? cell.size[0] : 0.0);
            const double u = cell.low[1] + ((k & 2U) != 0 ? cell.size[1] : 0.0);
            const double v = cell.low[2] + ((k & 4U) != 0 ? cell.size[2] : 0.0);
            const auto at = [t](const MovingPoint& p) -> Vector3 { return (1.0 - t) * p.start + t * p.end; };
            value[k] = at(gap.base) + u * at(gap.along_u) + v * at(gap.along_v);
        }
        Vector3 low = value[0];
        Vector3 high = value[0];
        for (const Vector3& x : value) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        if ((low.array() > gap.tolerance).any() || (high.array() < -gap.tolerance).any()) continue;
        // Halve the variable that moves the gap most.
        std::array<double, 3> change{};
        for (std::size_t k = 0; k < 8; ++k) {
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t bit = std::size_t{1} << i;
                if ((k & bit) == 0) {
                    change[i] = std::max(change[i], (value[k | bit] - value[k]).cwiseAbs().maxCoeff());
                }
            }
        }
        const auto widest = static_cast<std::size_t>(std::max_element(change.begin(), change.end()) - change.begin());
        if (!(change[widest] > gap.tolerance)) return false;  // as small as rounding: let integers decide
        Cell half = cell;
        half.size[widest] *= 0.5;
        stack[depth] = half;
        stack[depth].low[widest] += half.size[widest];
        stack[depth + 1] = half;
        depth += 2;
    }
    return true;
}

MovingPoint minus(const MovingPoint& a, const MovingPoint& b) { return {a.start - b.start, a.end - b.end}; }

/// Finds the gap's tolerance. A difference of coordinates has one rounding error of its own size, so the largest
/// difference D bounds all that follow: three of them, five roundings each, and the sum make less than 25 · 2^-53 D.
Gap with_tolerance(Gap gap) {
    double largest = 0.0;
    for (const MovingPoint* p : {&gap.base, &gap.along_u, &gap.along_v}) {
        largest = std::max({largest, p->start.cwiseAbs().maxCoeff(), p->end.cwiseAbs().maxCoeff()});
    }
    gap.tolerance = 1e-14 * largest + std::numeric_limits<double>::min();
    return gap;
}

}  // namespace

std::optional<double> first_contact(const MovingPoint& vertex, const MovingTriangle& face) {
    const std::array<MovingPoint, 4> points{vertex, face[0], face[1], face[2]};
    const Gap gap = with_tolerance({.base = minus(face[0], vertex),
                                    .along_u = minus(face[1], face[0]),
                                    .along_v = minus(face[2], face[0]),
                                    .triangle = true});
    if (certainly_apart(gap)) return std::nullopt;
    return exact_vertex_face(points);
}

std::optional<double> first_contact(const MovingEdge& first, const MovingEdge& second) {
    const std::array<MovingPoint, 4> points{first[0], first[1], second[0], second[1]};
    const Gap gap = with_tolerance({.base = minus(first[0], second[0]),
                                    .along_u = minus(first[1], first[0]),
                                    .along_v = minus(second[0], second[1]),
                                    .triangle = false});
    if (certainly_apart(gap)) return std::nullopt;
    return exact_edge_edge(points);
}

std::optional<double> first_contact(const MovingTriangle& first, const MovingTriangle& second) {
    if (triangles_intersect({first[0].start, first[1].start, first[2].start},
                            {second[0].start, second[1].start, second[2].start})) {
        return 0.0;
    }
    std::array<Box, 2> swept;
    for (std::size_t i = 0; i < 3; ++i) {
        swept[0].add(first[i].start);
        swept[0].add(first[i].end);
        swept[1].add(second[i].start);
        swept[1].add(second[i].end);
    }
    if (!swept[0].overlaps(swept[1])) return std::nullopt;
    std::optional<double> time;
    for (std::size_t i = 0; i < 3; ++i) {
        time = earlier(time, first_contact(first[i], second));
        time = earlier(time, first_contact(second[i], first));
        for (std::size_t j = 0; j < 3; ++j) {
            time = earlier(time, first_contact(MovingEdge{first[i], first[(i + 1) % 3]},
                                               MovingEdge{second[j], second[(j + 1) % 3]}));
        }
    }
    return time;
}

}  // namespace trocar
