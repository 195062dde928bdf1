// Compiled once per instruction set by Highway, which includes this file again for each of them.
//
// Two closed triangles meet if and only if an edge of one of them meets the other triangle. Any corner of the
// intersection lies on an edge of one and in the other, also for coplanar and degenerate triangles. Orientation signs
// decide an edge and a triangle:
//
// * meets: the edge's ends lie strictly on different sides of the plane, and its line passes the triangle's directed
//   edges strictly on the same side.
// * does not meet: the ends lie strictly on one side, or the line passes two edges strictly on different sides.
//
// Uncertain signs decide nothing. The signs are 6 sides of planes and 9 of edges. All 15 determinants are sums of ten
// triple products of u1 v1 u2 v2 w (triangle_filter.hpp), with n1 = u1 × v1, n2 = u2 × v2:
//
// * sides of q0 q1 q2 of the first plane: n1·(−w), n1·(u2 − w), n1·(v2 − w)
// * sides of p0 p1 p2 of the second plane: n2·w, n2·(u1 + w), n2·(v1 + w)
// * edge d at x against edge g at y: det[d, g, y − x]. Its terms: det[a, b, w], a in {u1, v1}, b in {u2, v2}
//
// Error bound. Let E1, E2, m be the largest magnitudes in u1 v1, in u2 v2 and in w, and e = 2^-24. A triple product has
// six products of three factors, together at most 6ABC if A, B, C bound the factors. Relative to that sum of
// magnitudes, three rounded factors cost 3.003 e and the two roundings of a cross product's component 2 e. Product and
// two sums of the dot product cost 3 e. The total is 8.01 e, an error of at most 48.1 e ABC.
//
// * A side is the sum of two: (48.1 + 6.1) e E1² (m + E2), for the second plane e E2² (m + E1). The code uses 64 e.
// * An edge sign is a sum of at most eight triple products: four with w, two with n1, two with n2. Their errors and
//   seven roundings of their sum of magnitudes make (48.1 + 42.1) e E1 E2 (4m + 2 E1 + 2 E2). The code uses
//   400 e E1 E2 (m + E1 + E2), which also covers second-order terms and the rounding of the bounds.
//
// Underflow: results below 2^-126 lose up to 2^-150 each. With E1 and E2 at least 2^-30 every bound exceeds 2^-24 times
// a product of magnitudes that is at least 2^-90. The losses (at most 2^-143 times two magnitudes) are far below the
// slack. With all magnitudes at most 2^38 nothing overflows. Pairs outside that range, NaN included, stay undecided.
#include "detect/triangle_filter.hpp"

#include "detect/near_filter.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/triangle_filter.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "detect/by_axis-inl.hpp"
#include "detect/triangle_lanes-inl.hpp"
#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Certain signs of a determinant; neither where it is within the bound or NaN.
struct Sign {
    Mask above;
    Mask below;
};
HWY_INLINE Sign sign(Float determinant, Float bound) {
    return {hn::Gt(determinant, bound), hn::Lt(determinant, hn::Neg(bound))};
}
HWY_INLINE Sign opposite(const Sign& s) { return {s.below, s.above}; }

/// Certain facts about an edge and a triangle.
struct EdgeVerdict {
    Mask meets;
    Mask apart;
};
/// ends: sides of the edge's ends; a, b, c: how its line passes the triangle's edges, in order around the triangle.
HWY_INLINE EdgeVerdict judge(const Sign& end, const Sign& other_end, const Sign& a, const Sign& b, const Sign& c) {
    const Mask all_above = hn::And(hn::And(a.above, b.above), c.above);
    const Mask all_below = hn::And(hn::And(a.below, b.below), c.below);
    const Mask some_above = hn::Or(hn::Or(a.above, b.above), c.above);
    const Mask some_below = hn::Or(hn::Or(a.below, b.below), c.below);
    const Mask parted = hn::Or(hn::And(end.above, other_end.below), hn::And(end.below, other_end.above));
    const Mask one_side = hn::Or(hn::And(end.above, other_end.above), hn::And(end.below, other_end.below));
    return {hn::And(parted, hn::Or(all_above, all_below)), hn::Or(one_side, hn::And(some_above, some_below))};
}

/// Verdicts of the lanes from pair `first` on; `apart` is certain too.
HWY_INLINE void decide_lanes(const TriangleBatch& batch, std::size_t first, std::uint64_t& meet, std::uint64_t& apart) {
    const Floats d;
    const Vectors u1 = load(batch.u1, first);
    const Vectors v1 = load(batch.v1, first);
    const Vectors u2 = load(batch.u2, first);
    const Vectors v2 = load(batch.v2, first);
    const Vectors w = load(batch.w, first);

    const Float e1 = hn::Max(largest(u1), largest(v1));
    const Float e2 = hn::Max(largest(u2), largest(v2));
    const Float m = largest(w);
    const Mask in_range = is_in_range(e1, e2, m);

    const Vectors n1 = cross(u1, v1);
    const Vectors n2 = cross(u2, v2);
    const Float n1_w = dot(n1, w);
    const Float n1_u2 = dot(n1, u2);
    const Float n1_v2 = dot(n1, v2);
    const Float n2_w = dot(n2, w);
    const Float n2_u1 = dot(n2, u1);
    const Float n2_v1 = dot(n2, v1);

    const Float first_bound = hn::Mul(hn::Set(d, 64.0F * 0x1p-24F), hn::Mul(hn::Mul(e1, e1), hn::Add(m, e2)));
    const Float second_bound = hn::Mul(hn::Set(d, 64.0F * 0x1p-24F), hn::Mul(hn::Mul(e2, e2), hn::Add(m, e1)));
    const Sign q0 = sign(hn::Neg(n1_w), first_bound);
    const Sign q1 = sign(hn::Sub(n1_u2, n1_w), first_bound);
    const Sign q2 = sign(hn::Sub(n1_v2, n1_w), first_bound);
    const Sign p0 = sign(n2_w, second_bound);
    const Sign p1 = sign(hn::Add(n2_u1, n2_w), second_bound);
    const Sign p2 = sign(hn::Add(n2_v1, n2_w), second_bound);
    const auto one_side = [](const Sign& a, const Sign& b, const Sign& c) {
        return hn::Or(hn::And(hn::And(a.above, b.above), c.above), hn::And(hn::And(a.below, b.below), c.below));
    };
    const Mask separated = hn::And(in_range, hn::Or(one_side(q0, q1, q2), one_side(p0, p1, p2)));
    if (hn::AllTrue(d, separated)) {
        meet = 0;
        apart = bits_of(separated);
        return;
    }

    // Names: edge of the first triangle, edge of the second; "o" is the edge from corner 1 to corner 2.
    const Vectors u2_w = cross(u2, w);
    const Vectors v2_w = cross(v2, w);
    const Float uu = dot(u1, u2_w);
    const Float uv = dot(u1, v2_w);
    const Float vu = dot(v1, u2_w);
    const Float vv = dot(v1, v2_w);
    const Float n1_o2 = hn::Sub(n1_v2, n1_u2);
    const Float n2_o1 = hn::Sub(n2_v1, n2_u1);
    const Float uo = hn::Sub(hn::Sub(uu, uv), n2_u1);
    const Float vo = hn::Sub(hn::Sub(vu, vv), n2_v1);
    // det[v1 − u1, g, −w − u1] = det[v1, g, −w] − det[u1, g, −w] − n1·g
    const Float ou = hn::Sub(hn::Sub(uu, vu), n1_u2);
    const Float ov = hn::Sub(hn::Sub(uv, vv), n1_v2);
    const Float oo = hn::Sub(hn::Sub(hn::Add(hn::Sub(vu, vv), hn::Sub(uv, uu)), n2_o1), n1_o2);
    const Float edge_bound =
        hn::Mul(hn::Set(d, 400.0F * 0x1p-24F), hn::Mul(hn::Mul(e1, e2), hn::Add(hn::Add(m, e1), e2)));
    // Directed around each triangle: u from 0 to 1, o from 1 to 2, and back along −v.
    const Sign s_uu = sign(hn::Neg(uu), edge_bound);
    const Sign s_uo = sign(uo, edge_bound);
    const Sign s_uv = sign(uv, edge_bound);
    const Sign s_ou = sign(ou, edge_bound);
    const Sign s_oo = sign(oo, edge_bound);
    const Sign s_ov = opposite(sign(ov, edge_bound));
    const Sign s_vu = sign(vu, edge_bound);
    const Sign s_vo = opposite(sign(vo, edge_bound));
    const Sign s_vv = sign(hn::Neg(vv), edge_bound);

    const EdgeVerdict verdicts[6] = {judge(p0, p1, s_uu, s_uo, s_uv), judge(p1, p2, s_ou, s_oo, s_ov),
                                     judge(p2, p0, s_vu, s_vo, s_vv), judge(q0, q1, s_uu, s_ou, s_vu),
                                     judge(q1, q2, s_uo, s_oo, s_vo), judge(q2, q0, s_uv, s_ov, s_vv)};
    Mask some_meet = verdicts[0].meets;
    Mask all_apart = verdicts[0].apart;
    for (std::size_t k = 1; k < 6; ++k) {
        some_meet = hn::Or(some_meet, verdicts[k].meets);
        all_apart = hn::And(all_apart, verdicts[k].apart);
    }
    meet = bits_of(hn::And(in_range, some_meet));
    apart = bits_of(hn::Or(separated, hn::And(in_range, all_apart)));
}

#if HWY_TARGET == HWY_SCALAR || HWY_MAX_BYTES < 32

/// Difference of two corners, rounded once in double and once to float.
void put_difference(const double* to, const double* from, std::size_t lane, TriangleBatch::Lanes& lanes) {
    lanes[0][lane] = static_cast<float>(to[0] - from[0]);
    lanes[1][lane] = static_cast<float>(to[1] - from[1]);
    lanes[2][lane] = static_cast<float>(to[2] - from[2]);
}

void gather(const double* position, const Index* corners, const TrianglePair* pairs, std::size_t count,
            TriangleBatch& batch) {
    const auto corner = [position, corners](Index triangle, std::size_t k) {
        return position + 3 * static_cast<std::size_t>(corners[3 * static_cast<std::size_t>(triangle) + k]);
    };
    for (std::size_t lane = 0; lane < count; ++lane) {
        const auto [first, second] = pairs[lane];
        const double* const p = corner(first, 0);
        const double* const q = corner(second, 0);
        put_difference(corner(first, 1), p, lane, batch.u1);
        put_difference(corner(first, 2), p, lane, batch.v1);
        put_difference(corner(second, 1), q, lane, batch.u2);
        put_difference(corner(second, 2), q, lane, batch.v2);
        put_difference(p, q, lane, batch.w);
    }
}

#else

void gather(const double* position, const Index* corners, const TrianglePair* pairs, std::size_t count,
            TriangleBatch& batch) {
    const hn::FixedTag<double, 4> d;
    const hn::FixedTag<float, 4> floats;
    const auto xyz = hn::FirstN(d, 3);
    const auto corner = [&](Index triangle, std::size_t k) HWY_ATTR {
        const auto vertex = static_cast<std::size_t>(corners[3 * static_cast<std::size_t>(triangle) + k]);
        return hn::MaskedLoad(xyz, d, position + 3 * vertex);
    };
    for (std::size_t first = 0; first < count; first += 4) {
        hn::Vec<hn::FixedTag<float, 4> > u1[4];
        hn::Vec<hn::FixedTag<float, 4> > v1[4];
        hn::Vec<hn::FixedTag<float, 4> > u2[4];
        hn::Vec<hn::FixedTag<float, 4> > v2[4];
        hn::Vec<hn::FixedTag<float, 4> > w[4];
        for (std::size_t k = 0; k < 4; ++k) {
            const auto [a, b] = pairs[HWY_MIN(first + k, count - 1)];
            const auto p = corner(a, 0);
            const auto q = corner(b, 0);
            u1[k] = hn::DemoteTo(floats, hn::Sub(corner(a, 1), p));
            v1[k] = hn::DemoteTo(floats, hn::Sub(corner(a, 2), p));
            u2[k] = hn::DemoteTo(floats, hn::Sub(corner(b, 1), q));
            v2[k] = hn::DemoteTo(floats, hn::Sub(corner(b, 2), q));
            w[k] = hn::DemoteTo(floats, hn::Sub(p, q));
        }
        store_by_axis(u1[0], u1[1], u1[2], u1[3], batch.u1, first);
        store_by_axis(v1[0], v1[1], v1[2], v1[3], batch.v1, first);
        store_by_axis(u2[0], u2[1], u2[2], u2[3], batch.u2, first);
        store_by_axis(v2[0], v2[1], v2[2], v2[3], batch.v2, first);
        store_by_axis(w[0], w[1], w[2], w[3], batch.w, first);
    }
}

#endif

TriangleVerdicts decide(const TriangleBatch& batch, std::size_t count) {
    const Floats d;
    TriangleVerdicts verdicts;
    std::uint64_t apart_of_all = 0;
    for (std::size_t first = 0; first < count; first += hn::Lanes(d)) {
        std::uint64_t meet = 0;
        std::uint64_t apart = 0;
        decide_lanes(batch, first, meet, apart);
        verdicts.meet |= meet << first;
        apart_of_all |= apart << first;
    }
    const std::uint64_t asked = count < 64 ? (std::uint64_t{1} << count) - 1 : ~std::uint64_t{0};
    verdicts.meet &= asked;
    verdicts.undecided = asked & ~verdicts.meet & ~apart_of_all;
    return verdicts;
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(gather);
HWY_EXPORT(decide);

const std::vector<TriangleFilter>& triangle_filters() {
    static const std::vector<TriangleFilter> filters = [] {
        std::vector<TriangleFilter> versions = versions_by_target([](const char* target) {
            return TriangleFilter{
                .gather = &HWY_DYNAMIC_DISPATCH(gather), .decide = &HWY_DYNAMIC_DISPATCH(decide), .target = target};
        });
        for (TriangleFilter& version : versions) version.decide_near = near_decider_of(version.target);
        return versions;
    }();
    return filters;
}

}  // namespace trocar
#endif
