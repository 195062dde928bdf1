// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "tissue/hinge_kernels.hpp"

#include <cmath>
#include <numbers>

#include "geometry/dihedral.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tissue/hinge_kernels.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "geometry/simd_targets.hpp"
#include "tissue/four_points-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

HWY_INLINE double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// One hinge at a time: what is left over after the vectors, and CPUs without vectors of four doubles.
HWY_INLINE void add_one(const HingeArrays& hinges, std::size_t h, const double* position, double* force) {
    const double* corner[4];
    double* to[4];
    for (std::size_t c = 0; c < 4; ++c) {
        const std::ptrdiff_t column = 4 * static_cast<std::ptrdiff_t>(hinges.vertex[c][h]);
        corner[c] = position + column;
        to[c] = force + column;
    }
    double e[3], a[3], b[3], n1[3], n2[3];
    for (int axis = 0; axis < 3; ++axis) {
        e[axis] = corner[1][axis] - corner[0][axis];
        a[axis] = corner[2][axis] - corner[0][axis];
        b[axis] = corner[3][axis] - corner[0][axis];
    }
    for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3;
        const int last = (axis + 2) % 3;
        n1[axis] = e[next] * a[last] - e[last] * a[next];
        n2[axis] = b[next] * e[last] - b[last] * e[next];
    }
    const double q1 = dot(n1, n1);
    const double q2 = dot(n2, n2);
    if (!(q1 > 0.0) || !(q2 > 0.0)) return;
    const double square = dot(e, e);
    const double length = std::sqrt(square);
    double bend = angle_of(-(length * dot(n1, b)), dot(n1, n2)) - hinges.rest[h];
    if (bend > std::numbers::pi) bend -= 2.0 * std::numbers::pi;
    if (bend < -std::numbers::pi) bend += 2.0 * std::numbers::pi;
    const double moment = hinges.stiffness[h] * bend * length;
    const double scale1 = moment / q1;
    const double scale2 = moment / q2;
    const double foot1 = dot(a, e) / square;
    const double foot2 = dot(b, e) / square;
    for (int axis = 0; axis < 3; ++axis) {
        const double w1 = scale1 * n1[axis];
        const double w2 = scale2 * n2[axis];
        const double at_end = foot1 * w1 + foot2 * w2;
        to[0][axis] += at_end - (w1 + w2);
        to[1][axis] -= at_end;
        to[2][axis] += w1;
        to[3][axis] += w2;
    }
}

#if HWY_MAX_BYTES >= 32

struct Point {
    Vector x, y, z;
};

HWY_INLINE Point minus(const Point& p, const Point& q) {
    return {hn::Sub(p.x, q.x), hn::Sub(p.y, q.y), hn::Sub(p.z, q.z)};
}

HWY_INLINE Point cross(const Point& p, const Point& q) {
    return {hn::Sub(hn::Mul(p.y, q.z), hn::Mul(p.z, q.y)), hn::Sub(hn::Mul(p.z, q.x), hn::Mul(p.x, q.z)),
            hn::Sub(hn::Mul(p.x, q.y), hn::Mul(p.y, q.x))};
}

HWY_INLINE Vector dot(const Point& p, const Point& q) {
    return hn::Add(hn::Add(hn::Mul(p.x, q.x), hn::Mul(p.y, q.y)), hn::Mul(p.z, q.z));
}

/// angle_of in four lanes, operation by operation.
HWY_INLINE Vector angle_of_four(Vector y, Vector x) {
    const Four d;
    const auto one = hn::Set(d, 1.0);
    const auto halved = [&](Vector t)
                            HWY_ATTR { return hn::Div(t, hn::Add(one, hn::Sqrt(hn::Add(one, hn::Mul(t, t))))); };
    const auto r = hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Mul(y, y)));
    const auto v = halved(halved(hn::Div(hn::Abs(y), hn::Add(r, hn::Abs(x)))));
    const auto z = hn::Mul(v, v);
    auto sum = hn::Set(d, arctangent_series.back());
    for (std::size_t k = arctangent_series.size() - 1; k-- > 0;) {
        sum = hn::Add(hn::Mul(sum, z), hn::Set(d, arctangent_series[k]));
    }
    auto angle = hn::Mul(hn::Mul(hn::Set(d, 8.0), v), sum);
    angle = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Sub(hn::Set(d, std::numbers::pi), angle), angle);
    return hn::IfThenElse(hn::Lt(y, hn::Zero(d)), hn::Neg(angle), angle);
}

/// Hinges h to h + 3.
HWY_INLINE void add_four(const HingeArrays& hinges, std::size_t h, const double* position, double* force) {
    const Four d;
    const auto column = [&](std::size_t c, std::size_t n)
                            HWY_ATTR { return 4 * static_cast<std::ptrdiff_t>(hinges.vertex[c][h + n]); };
    Point corner[4];
    for (std::size_t c = 0; c < 4; ++c) {
        transpose(hn::LoadU(d, position + column(c, 0)), hn::LoadU(d, position + column(c, 1)),
                  hn::LoadU(d, position + column(c, 2)), hn::LoadU(d, position + column(c, 3)), corner[c].x,
                  corner[c].y, corner[c].z);
    }
    const Point e = minus(corner[1], corner[0]);
    const Point a = minus(corner[2], corner[0]);
    const Point b = minus(corner[3], corner[0]);
    const Point n1 = cross(e, a);
    const Point n2 = cross(b, e);
    const auto q1 = dot(n1, n1);
    const auto q2 = dot(n2, n2);
    const auto has_angle = hn::And(hn::Gt(q1, hn::Zero(d)), hn::Gt(q2, hn::Zero(d)));
    const auto square = dot(e, e);
    const auto length = hn::Sqrt(square);
    auto bend =
        hn::Sub(angle_of_four(hn::Neg(hn::Mul(length, dot(n1, b))), dot(n1, n2)), hn::LoadU(d, &hinges.rest[h]));
    const auto half_turn = hn::Set(d, std::numbers::pi);
    const auto turn = hn::Set(d, 2.0 * std::numbers::pi);
    bend = hn::IfThenElse(hn::Gt(bend, half_turn), hn::Sub(bend, turn), bend);
    bend = hn::IfThenElse(hn::Lt(bend, hn::Neg(half_turn)), hn::Add(bend, turn), bend);
    const auto moment = hn::Mul(hn::Mul(hn::LoadU(d, &hinges.stiffness[h]), bend), length);
    const auto scale1 = hn::Div(moment, q1);
    const auto scale2 = hn::Div(moment, q2);
    const auto foot1 = hn::Div(dot(a, e), square);
    const auto foot2 = hn::Div(dot(b, e), square);
    Vector by_hinge[4][4];  // force on corner c of hinge n in [n][c]
    Point on[4];
    const auto share = [&](Vector Point::*axis) HWY_ATTR {
        const auto w1 = hn::Mul(scale1, n1.*axis);
        const auto w2 = hn::Mul(scale2, n2.*axis);
        const auto at_end = hn::Add(hn::Mul(foot1, w1), hn::Mul(foot2, w2));
        on[0].*axis = hn::IfThenElseZero(has_angle, hn::Sub(at_end, hn::Add(w1, w2)));
        on[1].*axis = hn::IfThenElseZero(has_angle, hn::Neg(at_end));
        on[2].*axis = hn::IfThenElseZero(has_angle, w1);
        on[3].*axis = hn::IfThenElseZero(has_angle, w2);
    };
    share(&Point::x);
    share(&Point::y);
    share(&Point::z);
    for (std::size_t c = 0; c < 4; ++c) {
        transpose_back(on[c].x, on[c].y, on[c].z, by_hinge[0][c], by_hinge[1][c], by_hinge[2][c], by_hinge[3][c]);
    }
    // One hinge after the other, since they may share vertices.
    for (std::size_t n = 0; n < 4; ++n) {
        for (std::size_t c = 0; c < 4; ++c) {
            double* const to = force + column(c, n);
            hn::StoreU(hn::Add(hn::LoadU(d, to), by_hinge[n][c]), d, to);
        }
    }
}

#endif

void add_forces(const HingeArrays& hinges, const Matrix4X& position, Matrix4X& force) {
    std::size_t h = 0;
#if HWY_MAX_BYTES >= 32
    for (; h + 4 <= hinges.size(); h += 4) add_four(hinges, h, position.data(), force.data());
#endif
    for (; h < hinges.size(); ++h) add_one(hinges, h, position.data(), force.data());
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(add_forces);

HingeArrays hinge_arrays(std::span<const Hinge> hinges) {
    HingeArrays arrays;
    for (const Hinge& hinge : hinges) {
        for (std::size_t c = 0; c < 4; ++c) arrays.vertex[c].push_back(hinge.vertex[c]);
        arrays.rest.push_back(hinge.rest);
        arrays.stiffness.push_back(hinge.stiffness);
    }
    return arrays;
}

const std::vector<HingeKernels>& hinge_kernels() {
    static const std::vector<HingeKernels> kernels = versions_by_target([](const char* target) {
        return HingeKernels{.add_forces = &HWY_DYNAMIC_DISPATCH(add_forces), .target = target};
    });
    return kernels;
}

}  // namespace trocar
#endif
