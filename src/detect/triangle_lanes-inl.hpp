// Vector functions on lanes of triangle pairs (triangle_filter.hpp), shared by the filters for meeting and for near
// pairs. Included once per instruction set, as Highway's own headers are.
#if defined(TROCAR_DETECT_TRIANGLE_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_DETECT_TRIANGLE_LANES_INL
#undef TROCAR_DETECT_TRIANGLE_LANES_INL
#else
#define TROCAR_DETECT_TRIANGLE_LANES_INL
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "detect/triangle_filter.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Float = hn::Vec<Floats>;
using Mask = hn::Mask<Floats>;

struct Vectors {
    Float x;
    Float y;
    Float z;
};

HWY_INLINE Vectors load(const TriangleBatch::Lanes& lanes, std::size_t first) {
    const Floats d;
    return {hn::Load(d, &lanes[0][first]), hn::Load(d, &lanes[1][first]), hn::Load(d, &lanes[2][first])};
}
HWY_INLINE Float dot(const Vectors& a, const Vectors& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vectors cross(const Vectors& a, const Vectors& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
HWY_INLINE Float largest(const Vectors& a) { return hn::Max(hn::Max(hn::Abs(a.x), hn::Abs(a.y)), hn::Abs(a.z)); }

/// Whether the largest magnitudes in u1 v1 (e1), in u2 v2 (e2) and in w (m) exclude float under- and overflow.
HWY_INLINE Mask is_in_range(Float e1, Float e2, Float m) {
    const Floats d;
    const Float least = hn::Set(d, 0x1p-30F);
    const Float most = hn::Set(d, 0x1p38F);
    return hn::And(hn::And(hn::Ge(hn::Min(e1, e2), least), hn::Le(hn::Max(e1, e2), most)), hn::Le(m, most));
}

HWY_INLINE std::uint64_t bits_of(Mask mask) {
    const Floats d;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return static_cast<std::uint64_t>(bytes[0] | (bytes[1] << 8));
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
