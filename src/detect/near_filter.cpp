// Compiled once per instruction set by Highway, which includes this file again for each of them.
//
// The closest points of two disjoint triangles lie on a corner and a face or on two edges (15 pairs of features, as in
// geometry/triangle_distance.cpp). The float search for them need not be exact, since each verdict has its own proof:
//
// * near: one point of each triangle has a distance of at most the query distance, with all rounding added. Its weights
//   are not negative and sum to 1.
// * far: along some axis the projections of the triangles are further apart than the query distance, with all rounding
//   subtracted. Axes: the normals of the two triangles, then the line between the closest points found.
//
// Correct closest points prove one or the other, unless the distance is within the error bound of the query distance.
//
// Error bounds, with e = 2^-24, S the sum of the largest magnitudes E1 in u1 v1, E2 in u2 v2, m in w:
//
// * Projection: a dot product of an axis n with a sum of two rounded differences. Relative to |n| times the vector's
//   length, rounded factors cost 1.001 e and the dot product 3 e. The sum costs e, and the distance of two projections
//   e. Together (1.001 + 3 + 1 + 1) e sqrt(3) S |n|, at most 11 e S |n|. Length and product round by 6 e. The code uses
//   20 e S |n| and a query distance that is 2^-19 larger, which is more.
// * Point: a corner plus weights times edges, of at most m + E1, E2 and 2 E1, 2 E2. The sum of magnitudes is at most
//   3 S per axis. Five roundings and rounded differences make 18.1 e S, over three axes 32 e S in all. Weights that sum
//   to 1 + 3 e are 3 e sqrt(3) S beside the triangle. The length rounds by 3 e of at most 3 sqrt(3) S here. The code
//   uses 64 e S and a query distance that is 2^-19 smaller, which is more.
//
// Underflow: as in triangle_filter.cpp, with magnitudes of at least 2^-30 and axes of at least that length. Overflow
// gives infinities and NaN, which prove nothing.
#include "detect/near_filter.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/near_filter.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "detect/triangle_lanes-inl.hpp"
#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

HWY_INLINE Vectors add(const Vectors& a, const Vectors& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Vectors subtract(const Vectors& a, const Vectors& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vectors negative(const Vectors& a) { return {hn::Neg(a.x), hn::Neg(a.y), hn::Neg(a.z)}; }
HWY_INLINE Vectors times(Float s, const Vectors& a) { return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)}; }
/// Clamps a place to the segment; NaN becomes one of its ends.
HWY_INLINE Float place(Float s) {
    const Floats d;
    return hn::IfThenElse(hn::Gt(s, hn::Zero(d)), hn::Min(s, hn::Set(d, 1.0F)), hn::Zero(d));
}

/// Lanes of pairs with the data of their bounds.
struct Lanes {
    Vectors u1;
    Vectors v1;
    Vectors u2;
    Vectors v2;
    Vectors w;
    Float size;            ///< S
    Float query_distance;  ///< 2^-19 larger than given
};

/// Whether the projections on an axis are certainly further apart than `query_distance`.
HWY_INLINE Mask parted(const Lanes& t, const Vectors& axis) {
    const Floats d;
    const Float a0 = dot(axis, t.w);
    const Float a1 = hn::Add(a0, dot(axis, t.u1));
    const Float a2 = hn::Add(a0, dot(axis, t.v1));
    const Float b1 = dot(axis, t.u2);
    const Float b2 = dot(axis, t.v2);
    const Float zero = hn::Zero(d);
    const Float above = hn::Sub(hn::Min(hn::Min(a0, a1), a2), hn::Max(hn::Max(zero, b1), b2));
    const Float below = hn::Sub(hn::Min(hn::Min(zero, b1), b2), hn::Max(hn::Max(a0, a1), a2));
    const Float square = dot(axis, axis);
    const Float bound =
        hn::Mul(hn::Add(t.query_distance, hn::Mul(hn::Set(d, 20.0F * 0x1p-24F), t.size)), hn::Sqrt(square));
    return hn::And(hn::Or(hn::Gt(above, bound), hn::Gt(below, bound)), hn::Ge(square, hn::Set(d, 0x1p-60F)));
}

/// Shortest vector found so far from the second triangle to the first.
struct Shortest {
    Float square;
    Vectors path;
    HWY_INLINE void take(Mask counts, const Vectors& other) {
        const Float here = dot(other, other);
        const Mask shorter = hn::And(counts, hn::Lt(here, square));
        square = hn::IfThenElse(shorter, here, square);
        path = {hn::IfThenElse(shorter, other.x, path.x), hn::IfThenElse(shorter, other.y, path.y),
                hn::IfThenElse(shorter, other.z, path.z)};
    }
};

/// Vectors between a triangle at the origin, with sides u and v, and three points whose projection is inside it.
template <bool to_first>
HWY_INLINE void take_feet(const Vectors& u, const Vectors& v, const Vectors (&points)[3], Shortest& shortest) {
    const Float uu = dot(u, u);
    const Float uv = dot(u, v);
    const Float vv = dot(v, v);
    const Float square = hn::Sub(hn::Mul(uu, vv), hn::Mul(uv, uv));
    const Float inverse = hn::Div(hn::Set(Floats(), 1.0F), square);
    const Float zero = hn::Zero(Floats());
    for (const Vectors& point : points) {
        const Float pu = dot(point, u);
        const Float pv = dot(point, v);
        const Float s = hn::Sub(hn::Mul(vv, pu), hn::Mul(uv, pv));
        const Float t = hn::Sub(hn::Mul(uu, pv), hn::Mul(uv, pu));
        const Mask inside = hn::And(hn::And(hn::Ge(s, zero), hn::Ge(t, zero)), hn::Le(hn::Add(s, t), square));
        const Vectors path = subtract(point, add(times(hn::Mul(s, inverse), u), times(hn::Mul(t, inverse), v)));
        shortest.take(inside, to_first ? path : negative(path));
    }
}

/// Vectors between the closest points of every two edges (Ericson, Real-Time Collision Detection, 5.1.9).
HWY_INLINE void take_edges(const Lanes& t, const Vectors (&p)[3], const Vectors (&q)[3], Shortest& shortest) {
    const Floats d;
    const Float one = hn::Set(d, 1.0F);
    const Float zero = hn::Zero(d);
    const Mask always = hn::Ge(one, zero);
    const Vectors first[3] = {t.u1, subtract(t.v1, t.u1), negative(t.v1)};
    const Vectors second[3] = {t.u2, subtract(t.v2, t.u2), negative(t.v2)};
    Float squares[3];
    Float inverses[3];
    for (int j = 0; j < 3; ++j) {
        squares[j] = dot(second[j], second[j]);
        inverses[j] = hn::Div(one, squares[j]);
    }
    for (int i = 0; i < 3; ++i) {
        const Float square = dot(first[i], first[i]);
        const Float inverse = hn::Div(one, square);
        for (int j = 0; j < 3; ++j) {
            const Vectors between = subtract(p[i], q[j]);
            const Float along = dot(first[i], second[j]);
            const Float a = dot(first[i], between);
            const Float b = dot(second[j], between);
            const Float product = hn::Mul(square, squares[j]);
            const Float sine = hn::Sub(product, hn::Mul(along, along));
            const Float across = hn::Div(hn::Sub(hn::Mul(along, b), hn::Mul(a, squares[j])), sine);
            const Float start = hn::IfThenElse(hn::Gt(sine, hn::Mul(hn::Set(d, 1e-5F), product)), place(across), zero);
            const Float there = place(hn::Mul(hn::Add(hn::Mul(along, start), b), inverses[j]));
            const Float here = place(hn::Mul(hn::Sub(hn::Mul(along, there), a), inverse));
            shortest.take(always, subtract(add(between, times(here, first[i])), times(there, second[j])));
        }
    }
}

/// Verdicts of the lanes from pair `from` on; only the bits in `asked` are needed.
HWY_INLINE void decide_near_lanes(const TriangleBatch& batch, std::size_t from, std::uint64_t asked,
                                  float query_distance, std::uint64_t& near, std::uint64_t& far) {
    const Floats d;
    Lanes t{load(batch.u1, from),
            load(batch.v1, from),
            load(batch.u2, from),
            load(batch.v2, from),
            load(batch.w, from),
            hn::Zero(d),
            hn::Set(d, query_distance * (1.0F + 0x1p-19F))};
    const Float e1 = hn::Max(largest(t.u1), largest(t.v1));
    const Float e2 = hn::Max(largest(t.u2), largest(t.v2));
    const Float m = largest(t.w);
    t.size = hn::Add(hn::Add(e1, e2), m);
    const Mask in_range = is_in_range(e1, e2, m);
    near = 0;
    far = bits_of(hn::And(in_range, hn::Or(parted(t, cross(t.u1, t.v1)), parted(t, cross(t.u2, t.v2)))));
    if ((asked & ~far) == 0) return;

    const Vectors p[3] = {t.w, add(t.w, t.u1), add(t.w, t.v1)};
    const Vectors q[3] = {{hn::Zero(d), hn::Zero(d), hn::Zero(d)}, t.u2, t.v2};
    const Vectors from_first[3] = {negative(t.w), subtract(t.u2, t.w), subtract(t.v2, t.w)};
    Shortest shortest{hn::Set(d, std::numeric_limits<float>::infinity()), t.w};
    take_edges(t, p, q, shortest);
    take_feet<true>(t.u2, t.v2, p, shortest);
    take_feet<false>(t.u1, t.v1, from_first, shortest);
    const Float least =
        hn::Sub(hn::Set(d, query_distance * (1.0F - 0x1p-19F)), hn::Mul(hn::Set(d, 64.0F * 0x1p-24F), t.size));
    near = bits_of(hn::And(in_range, hn::Le(hn::Sqrt(shortest.square), least)));
    far |= bits_of(hn::And(in_range, parted(t, shortest.path)));
}

NearVerdicts decide_near(const TriangleBatch& batch, std::uint64_t asked, float query_distance) {
    const std::size_t lanes = hn::Lanes(Floats());
    const std::uint64_t all = (std::uint64_t{1} << lanes) - 1;
    NearVerdicts verdicts;
    std::uint64_t far_of_all = 0;
    for (std::size_t from = 0; from < TriangleBatch::most; from += lanes) {
        const std::uint64_t asked_here = (asked >> from) & all;
        if (asked_here == 0) continue;
        std::uint64_t near = 0;
        std::uint64_t far = 0;
        decide_near_lanes(batch, from, asked_here, query_distance, near, far);
        verdicts.near |= near << from;
        far_of_all |= far << from;
    }
    verdicts.near &= asked;
    verdicts.undecided = asked & ~verdicts.near & ~far_of_all;
    return verdicts;
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(decide_near);

NearDecider near_decider_of(std::string_view target) {
    struct Version {
        NearDecider decide;
        const char* target;
    };
    static const std::vector<Version> versions = versions_by_target([](const char* name) {
        return Version{&HWY_DYNAMIC_DISPATCH(decide_near), name};
    });
    for (const Version& version : versions) {
        if (version.target == target) return version.decide;
    }
    return versions.back().decide;
}

}  // namespace trocar
#endif
