#include "geometry/continuous.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "geometry/exact.hpp"
#include "geometry/expansion.hpp"

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

constexpr int many_cells = 300;
constexpr int few_cells = 32;  ///< where there are other ways to decide

/// True when the gap is nowhere zero, without doubt; false says nothing. Looks at `cell_limit` cells at most.
bool certainly_apart(const Gap& gap, int cell_limit) {
    struct Cell {
        std::array<double, 3> low;
        std::array<double, 3> size;
    };
    if (!(gap.tolerance < 1e280)) return false;  // sums might overflow
    constexpr std::size_t stack_size = 64;
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

/// Points in the order of exact_vertex_face.
bool vertex_face_apart(const std::array<MovingPoint, 4>& points, int cell_limit) {
    return certainly_apart(with_tolerance({.base = minus(points[1], points[0]),
                                           .along_u = minus(points[2], points[1]),
                                           .along_v = minus(points[3], points[1]),
                                           .triangle = true}),
                           cell_limit);
}
bool edge_edge_apart(const std::array<MovingPoint, 4>& points, int cell_limit) {
    return certainly_apart(with_tolerance({.base = minus(points[0], points[2]),
                                           .along_u = minus(points[1], points[0]),
                                           .along_v = minus(points[2], points[3]),
                                           .triangle = false}),
                           cell_limit);
}

std::optional<double> slow_vertex_face(const std::array<MovingPoint, 4>& points) {
    return vertex_face_apart(points, many_cells) ? std::nullopt : exact_vertex_face(points);
}
std::optional<double> slow_edge_edge(const std::array<MovingPoint, 4>& points) {
    return edge_edge_apart(points, many_cells) ? std::nullopt : exact_edge_edge(points);
}

// ---- decision in floating point ----------------------------------------------------------------------------------

/// Two features on their way, as offset + place on the one = place on the other: e = α u + β w (vertex and face, α and
/// β >= 0, α + β <= 1) or e = α u - β w (edges, α and β in [0, 1]). Coplanar where e · (u × w) = 0.
struct Features {
    const MovingPoint* points[4];  ///< vertex, face; or edge, edge
    bool edges = false;
    MovingPoint e;
    MovingPoint u;
    MovingPoint w;
    double size_e = 0.0;  ///< largest coordinate of the difference at either end
    double size_u = 0.0;
    double size_w = 0.0;
    std::array<double, 4> coplanarity{};  ///< Bernstein coefficients of e · (u × w) over the tick
    double tolerance = 0.0;               ///< bound on the rounding error of a coefficient; < 0: none can be given
    double scale = 1.0;                   ///< a power of two that e, u, w and what follows from them are scaled by

    [[nodiscard]] std::array<MovingPoint, 4> copy() const { return {*points[0], *points[1], *points[2], *points[3]}; }
    /// +1 or -1 when the coplanarity has this sign all the time, without doubt.
    [[nodiscard]] int sign() const {
        if (tolerance < 0.0) return 0;
        const auto [low, high] = std::minmax({coplanarity[0], coplanarity[1], coplanarity[2], coplanarity[3]});
        if (low > tolerance) return 1;
        return high < -tolerance ? -1 : 0;
    }
};

double size_of(const MovingPoint& p) { return std::max(p.start.cwiseAbs().maxCoeff(), p.end.cwiseAbs().maxCoeff()); }

void find_sizes(Features& f) {
    f.size_e = size_of(f.e);
    f.size_u = size_of(f.u);
    f.size_w = size_of(f.w);
}

void fill_coplanarity(Features& f) {
    find_sizes(f);
    const double largest = std::max({f.size_e, f.size_u, f.size_w});
    if (!(largest < 1e50 && largest > 1e-50) && largest > 0.0 && std::isfinite(largest)) {
        f.scale = std::ldexp(1.0, std::clamp(-std::ilogb(largest), -1000, 1000));
        for (MovingPoint* line : {&f.e, &f.u, &f.w}) *line = {line->start * f.scale, line->end * f.scale};
        find_sizes(f);
    }
    for (const double one : {f.size_e, f.size_u, f.size_w}) {
        if (one < 1e60 && one > 1e-60) continue;  // products neither over- nor underflow
        f.tolerance = -1.0;
        return;
    }
    const double size = f.size_e * f.size_u * f.size_w;
    // Each difference carries one relative rounding error of 2^-53, an entry of the normal at most 12 of size u·w, a
    // dot product at most 64 of size e·u·w.
    f.tolerance = 2e-14 * size;
    const Vector3 n0 = f.u.start.cross(f.w.start);
    const Vector3 n1 = 0.5 * (f.u.start.cross(f.w.end) + f.u.end.cross(f.w.start));
    const Vector3 n2 = f.u.end.cross(f.w.end);
    f.coplanarity = {f.e.start.dot(n0), (2.0 * f.e.start.dot(n1) + f.e.end.dot(n0)) / 3.0,
                     (f.e.start.dot(n2) + 2.0 * f.e.end.dot(n1)) / 3.0, f.e.end.dot(n2)};
}

Features vertex_face_features(const MovingPoint& vertex, const MovingTriangle& face) {
    Features f{.points = {&vertex, &face[0], &face[1], &face[2]},
               .edges = false,
               .e = minus(vertex, face[0]),
               .u = minus(face[1], face[0]),
               .w = minus(face[2], face[0])};
    fill_coplanarity(f);
    return f;
}

Features edge_edge_features(const MovingPoint& a, const MovingPoint& b, const MovingPoint& c, const MovingPoint& d) {
    Features f{.points = {&a, &b, &c, &d}, .edges = true, .e = minus(c, a), .u = minus(b, a), .w = minus(d, c)};
    fill_coplanarity(f);
    return f;
}

/// What floating point can tell of the next moment at which the features may meet.
struct Sight {
    enum class Verdict : std::uint8_t {
        apart,     ///< there is none
        hit,       ///< they meet at the only root of the coplanarity in [low, high]
        maybe,     ///< there is one such root, and they may meet there
        coplanar,  ///< all the time
        unknown    ///< not before low
    };
    Verdict verdict = Verdict::apart;
    double low = 0.0;
    double high = 1.0;
    int before = 0;  ///< hit, maybe: sign of the coplanarity before the root; the other one after it
};

/// Whether the features meet at a coplanar moment within `half` of `time`: +1 yes, -1 no, 0 not certain.
int meet_at(const Features& f, double time, double half) {
    const auto at = [time](const MovingPoint& p) -> Vector3 { return (1.0 - time) * p.start + time * p.end; };
    const Vector3 e = at(f.e);
    const Vector3 u = at(f.u);
    const Vector3 w = at(f.w);
    const Vector3 normal = u.cross(w);
    const double alpha = e.cross(w).dot(normal);  // these two times |normal|²
    const double beta = (f.edges ? e.cross(u) : u.cross(e)).dot(normal);
    const double one = normal.squaredNorm();
    // Sums of 12 products of four sizes, rounded 200 times at most; no factor changes faster than twice its size.
    const double relative = 5e-14 + 100.0 * half;
    const double u_w = f.size_u * f.size_w;
    const double alpha_error = relative * f.size_e * f.size_w * u_w;
    const double beta_error = relative * f.size_e * f.size_u * u_w;
    const double one_error = relative * u_w * u_w;
    struct Bounded {
        double value;
        double error;
    };
    const std::array<Bounded, 4> conditions{
        {{alpha, alpha_error},
         {beta, beta_error},
         {f.edges ? one - alpha : one - alpha - beta, one_error + alpha_error + (f.edges ? 0.0 : beta_error)},
         {f.edges ? one - beta : one, one_error + (f.edges ? beta_error : 0.0)}}};
    int answer = 1;
    for (const Bounded& condition : conditions) {
        if (condition.value < -condition.error) return -1;
        if (!(condition.value > condition.error)) answer = 0;
    }
    return answer;
}

// ---- more digits where the moment or a boundary case needs them ---------------------------------------------------

/// high + low, the latter at most half a unit in the last place of the former (Dekker 1971). An operation is exact to
/// some 2^-100 of its operands' size while nothing over- or underflows.
struct DoubleDouble {
    double high = 0.0;
    double low = 0.0;
};

DoubleDouble normalised(double value, double error) {
    const double sum = value + error;
    return {sum, error - (sum - value)};
}
DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
    const expansion::Rounded high = expansion::exact_sum(a.high, b.high);
    const expansion::Rounded low = expansion::exact_sum(a.low, b.low);
    const DoubleDouble sum = normalised(high.value, high.error + low.value);
    return normalised(sum.high, sum.low + low.error);
}
DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) { return a + DoubleDouble{-b.high, -b.low}; }
DoubleDouble operator*(const DoubleDouble& a, const DoubleDouble& b) {
    const expansion::Rounded product = expansion::exact_product(a.high, b.high);
    return normalised(product.value, product.error + (a.high * b.low + a.low * b.high));
}

/// Whole numbers without a heap: enough for nine factors of 201 bits, which the largest product below has.
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
/// coefficient [i] of t^i.
template <typename Number>
using Quadratic = std::array<Number, 3>;
template <typename Number>
using Cubic = std::array<Number, 4>;

/// number(x): a coordinate as a Number.
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

Cubic<DoubleDouble> fine_coplanarity(const Features& f) {
    return coplanarity_of(lines_of<DoubleDouble>(f, [&f](double x) -> DoubleDouble { return {x * f.scale, 0.0}; }));
}
/// A line's change is at most twice its size, so the coefficients sum to at most 6 · 27 sizes; twenty operations at
/// most lie on the way to any of them and to a value in [0, 1], each exact to 2^-100 of that.
double fine_tolerance(const Features& f) { return 1e-26 * (f.size_e * f.size_u * f.size_w); }

/// Lines times a power of two that makes them whole; nothing when the coordinates span more bits than Fixed has room
/// for.
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

constexpr int time_bits = 53;  ///< moments are told in multiples of 2^-53

/// Sign of the coplanarity of features at moments n / 2^53, without doubt: in double-double where that decides, which
/// is nearly always, in integers where not.
class Coplanarity {
public:
    explicit Coplanarity(const Features& f)
        : features_(&f), fine_(fine_coplanarity(f)), tolerance_(f.tolerance < 0.0 ? -1.0 : fine_tolerance(f)) {}

    [[nodiscard]] int sign(std::int64_t n) {
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

    /// Whether the root that the sight tells of, rounded down, is before this moment, a multiple of 2^-53.
    [[nodiscard]] bool root_is_before(double moment, const Sight& sight) {
        const auto n = static_cast<std::int64_t>(std::ldexp(moment, time_bits));
        if (n <= first_of(sight)) return false;
        return n > last_of(sight) || sign(n) == -sight.before;
    }

    /// That root times 2^53, rounded down.
    [[nodiscard]] std::int64_t rounded_root(const Sight& sight) {
        const int before = sight.before;
        const std::int64_t first = first_of(sight);
        const std::int64_t last = last_of(sight);
        // Newton's step from the middle is nearly always off by one at most.
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

    /// Zero all the time; false when the coordinates span too many bits to tell.
    [[nodiscard]] bool vanishes() {
        make_whole();
        return lines_ && std::ranges::all_of(whole_, [](const Fixed& c) { return c.is_zero(); });
    }

    /// Whether the features meet at the only root in [n, n + 1] / 2^53, with `before` as above; nothing when neither
    /// float nor linear conditions tell. In a pair of triangles edges that are parallel there count as not meeting:
    /// when they do, an end of one is on the other, which a vertex and a face see at the same moment.
    [[nodiscard]] std::optional<bool> meets(std::int64_t n, int before, bool in_pair) {
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

private:
    static std::int64_t first_of(const Sight& sight) {
        return static_cast<std::int64_t>(std::floor(std::ldexp(sight.low, time_bits)));
    }
    static std::int64_t last_of(const Sight& sight) {
        return static_cast<std::int64_t>(std::ceil(std::ldexp(sight.high, time_bits)));
    }
    void make_whole() {
        if (made_) return;
        made_ = true;
        lines_ = whole_lines(*features_);
        if (lines_) {
            whole_ = coplanarity_of(*lines_);
            return;
        }
        const std::array<PolynomialVector, 4> grid = on_grid(features_->copy());
        polynomial_ = features_->edges ? dot(grid[2] - grid[0], cross(grid[1] - grid[0], grid[3] - grid[2]))
                                       : dot(grid[0] - grid[1], cross(grid[2] - grid[1], grid[3] - grid[1]));
    }

    /// Sign of q at the only root in [n, n + 1] / 2^53, or exactly at n; nothing when q is not linear and may vanish
    /// near it.
    [[nodiscard]] std::optional<int> sign_at_root(const Quadratic<Fixed>& q, std::int64_t n, bool exact,
                                                  int before) const {
        // q in Bernstein form over these moments, times 2^107.
        const auto value = [&q](std::int64_t s, std::int64_t t) {
            return Fixed(q[2] * 2 * s * t + ((q[1] * (s + t)) << 53U) + (q[0] << 107U)).sign();
        };
        const int first = value(n, n);
        if (exact) return first;
        if (first != 0 && value(n, n + 1) == first && value(n + 1, n + 1) == first) return first;
        if (!q[2].is_zero()) return std::nullopt;
        if (q[1].is_zero()) return q[0].sign();
        // q vanishes at s = -q0 / q1, which is here: the sign of the cubic there, times |q1|³, tells on which side of s
        // the root is.
        const int rise = q[1].sign();
        const Fixed top = rise > 0 ? Fixed(-q[0]) : q[0];
        const Fixed bottom = abs(q[1]);
        const Cubic<Fixed>& c = whole_;
        const Fixed at_zero =
            ((c[3] * top + c[2] * bottom) * top + c[1] * bottom * bottom) * top + c[0] * bottom * bottom * bottom;
        if (at_zero.is_zero()) return 0;
        return at_zero.sign() == before ? rise : -rise;
    }

    const Features* features_;
    Cubic<DoubleDouble> fine_;
    double tolerance_;  ///< of a value of fine_; < 0: none can be given
    bool made_ = false;
    std::optional<Lines<Fixed>> lines_;
    Cubic<Fixed> whole_;
    Polynomial polynomial_;  ///< when there are no lines_
};

// ---- the moments at which features may meet, one after the other --------------------------------------------------

/// Bisects the tick until the cubic has no root or is monotone with one, which the slope then encloses.
class Look {
public:
    void start(const Features& features) {
        features_ = &features;
        coplanarity_.reset();
        fine_ = false;
        search_from(features.coplanarity, features.tolerance);
    }

    /// The next one. After apart, coplanar and unknown comes nothing.
    Sight next() {
        using Verdict = Sight::Verdict;
        Sight sight{.verdict = Verdict::unknown};
        if (features_->tolerance >= 0.0) sight = search();
        if (sight.verdict != Verdict::unknown || fine_) return sight;
        const std::array<MovingPoint, 4> points = features_->copy();
        if (features_->edges ? edge_edge_apart(points, few_cells) : vertex_face_apart(points, few_cells)) return {};
        if (features_->tolerance < 0.0) return sight;
        // Too flat for double: once more with coefficients that are exact to the last bits of their own size.
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

    /// Of the features.
    Coplanarity& coplanarity() {
        if (!coplanarity_) coplanarity_.emplace(*features_);
        return *coplanarity_;
    }

private:
    struct Piece {
        std::array<double, 4> c;
        double low;
        double width;
    };

    void search_from(const std::array<double, 4>& coplanarity, double tolerance) {
        // Halving adds at most three rounding errors of the largest coefficient per level.
        tolerance_ = 7.5 * tolerance;
        stack_[0] = {coplanarity, 0.0, 1.0};
        depth_ = 1;
    }
    Sight search();

    const Features* features_ = nullptr;
    double tolerance_ = 0.0;
    bool fine_ = false;
    std::size_t depth_ = 0;
    std::array<Piece, 24> stack_;
    std::optional<Coplanarity> coplanarity_;
};

Sight Look::search() {
    using Verdict = Sight::Verdict;
    constexpr double least_width = 1.0 / (1 << 20);
    const double tolerance = tolerance_;
    while (depth_ > 0) {
        const Piece piece = stack_[--depth_];
        const auto& c = piece.c;
        const auto [least, most] = std::minmax({c[0], c[1], c[2], c[3]});
        if (least > tolerance || most < -tolerance) continue;
        const auto [least_rise, most_rise] = std::minmax({c[1] - c[0], c[2] - c[1], c[3] - c[2]});
        // A third of the slope, from below in size; both signs of rise cannot be certain.
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
            // The root is an end itself; one at the end of a piece is at the start of the next, too.
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
            double left = 0.0;
            double right = 1.0;
            double value = 0.0;
            double s = c[0] / (c[0] - c[3]);
            for (int i = 0; i < 60; ++i) {
                const double r = 1.0 - s;
                value = ((c[0] * r + 3.0 * s * c[1]) * r + 3.0 * s * s * c[2]) * r + s * s * s * c[3];
                if (std::abs(value) <= tolerance || right - left < 1e-15) break;
                ((value > 0.0) == (c[0] > 0.0) ? left : right) = s;
                const double tangent =
                    3.0 * (r * r * (c[1] - c[0]) + 2.0 * r * s * (c[2] - c[1]) + s * s * (c[3] - c[2]));
                s -= value / tangent;
                if (!(s > left && s < right)) s = 0.5 * (left + right);
            }
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
    return {};
}

std::optional<double> exactly(const Features& f) {
    return f.edges ? slow_edge_edge(f.copy()) : slow_vertex_face(f.copy());
}

/// When features first meet, from `sight` on; nothing, too, when that is not before `known`. in_pair: a vertex and a
/// face that meet at the same moment as two edges are looked at anyway, and the sets are apart at the start. Edges in
/// one plane then need no look: they meet first where an end of one arrives at the other.
std::optional<double> first_moment(const Features& f, Look& look, Sight sight, std::optional<double> known,
                                   bool in_pair) {
    using Verdict = Sight::Verdict;
    for (;; sight = look.next()) {
        if (sight.verdict == Verdict::apart) return std::nullopt;
        if (sight.verdict == Verdict::coplanar && in_pair && f.edges) return std::nullopt;
        if (sight.verdict != Verdict::hit && sight.verdict != Verdict::maybe) {
            if (known && sight.low >= *known) return std::nullopt;
            return exactly(f);
        }
        if (known && !look.coplanarity().root_is_before(*known, sight)) return std::nullopt;
        const std::int64_t n = look.coplanarity().rounded_root(sight);
        if (sight.verdict == Verdict::maybe) {
            const std::optional<bool> meets = look.coplanarity().meets(n, sight.before, in_pair);
            if (!meets) return exactly(f);
            if (!*meets) continue;
        }
        return std::ldexp(static_cast<double>(n), -time_bits);
    }
}

std::optional<double> time_of(const Features& f) {
    Look look;
    look.start(f);
    const Sight sight = look.next();
    return first_moment(f, look, sight, std::nullopt, false);
}

bool swept_boxes_overlap(const MovingTriangle& first, const MovingTriangle& second) {
    std::array<Box, 2> swept;
    for (std::size_t i = 0; i < 3; ++i) {
        swept[0].add(first[i].start);
        swept[0].add(first[i].end);
        swept[1].add(second[i].start);
        swept[1].add(second[i].end);
    }
    return swept[0].overlaps(swept[1]);
}

bool overlap_at_start(const MovingTriangle& first, const MovingTriangle& second) {
    return triangles_intersect({first[0].start, first[1].start, first[2].start},
                               {second[0].start, second[1].start, second[2].start});
}

}  // namespace

std::optional<double> first_contact(const MovingPoint& vertex, const MovingTriangle& face) {
    return time_of(vertex_face_features(vertex, face));
}

std::optional<double> first_contact(const MovingEdge& first, const MovingEdge& second) {
    return time_of(edge_edge_features(first[0], first[1], second[0], second[1]));
}

std::optional<double> first_contact(const MovingTriangle& first, const MovingTriangle& second) {
    const std::optional<FirstMeeting> meeting = first_meeting(first, second);
    return meeting ? std::optional(meeting->time) : std::nullopt;
}

std::optional<FirstMeeting> first_meeting(const MovingTriangle& first, const MovingTriangle& second) {
    if (!swept_boxes_overlap(first, second)) return std::nullopt;
    // Six vertices against faces first: three on one side of a plane all the time keep the whole triangles apart.
    std::array<Features, 15> features;
    std::size_t count = 0;
    for (const bool swapped : {false, true}) {
        const MovingTriangle& vertices = swapped ? second : first;
        const MovingTriangle& face = swapped ? first : second;
        int sides = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            features[count] = vertex_face_features(vertices[i], face);
            sides += features[count++].sign();
        }
        if (sides == 3 || sides == -3) return std::nullopt;
    }
    if (overlap_at_start(first, second)) return FirstMeeting{0.0, Meeting::overlap_at_start};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            features[count++] = edge_edge_features(first[i], first[(i + 1) % 3], second[j], second[(j + 1) % 3]);
        }
    }
    // Only features that may be first are worth an exact time.
    std::array<Look, 15> looks;
    std::array<Sight, 15> sights;
    double latest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k) {
        if (features[k].sign() != 0) continue;
        looks[k].start(features[k]);
        sights[k] = looks[k].next();
        if (sights[k].verdict == Sight::Verdict::hit) latest = std::min(latest, sights[k].high);
    }
    std::optional<FirstMeeting> best;
    for (std::size_t k = 0; k < count; ++k) {
        if (sights[k].verdict == Sight::Verdict::apart || sights[k].low > latest) continue;
        const std::optional<double> known = best ? std::optional(best->time) : std::nullopt;
        const std::optional<double> time = first_moment(features[k], looks[k], sights[k], known, true);
        if (!time || (best && best->time <= *time)) continue;
        best = FirstMeeting{*time, features[k].edges ? Meeting::edge_edge : Meeting::vertex_face};
        latest = std::min(latest, *time);
    }
    return best;
}

std::optional<double> oracle_first_contact(const MovingPoint& vertex, const MovingTriangle& face) {
    return slow_vertex_face({vertex, face[0], face[1], face[2]});
}

std::optional<double> oracle_first_contact(const MovingEdge& first, const MovingEdge& second) {
    return slow_edge_edge({first[0], first[1], second[0], second[1]});
}

std::optional<double> oracle_first_contact(const MovingTriangle& first, const MovingTriangle& second) {
    if (overlap_at_start(first, second)) return 0.0;
    if (!swept_boxes_overlap(first, second)) return std::nullopt;
    std::optional<double> time;
    for (std::size_t i = 0; i < 3; ++i) {
        time = earlier(time, oracle_first_contact(first[i], second));
        time = earlier(time, oracle_first_contact(second[i], first));
        for (std::size_t j = 0; j < 3; ++j) {
            time = earlier(time, oracle_first_contact(MovingEdge{first[i], first[(i + 1) % 3]},
                                                      MovingEdge{second[j], second[(j + 1) % 3]}));
        }
    }
    return time;
}

}  // namespace trocar
