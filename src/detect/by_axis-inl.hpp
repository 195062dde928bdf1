// Transposition of four points to structure-of-arrays form, shared by the kernels. Included once per instruction set,
// as Highway's own headers are.
#if defined(TROCAR_DETECT_BY_AXIS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_DETECT_BY_AXIS_INL
#undef TROCAR_DETECT_BY_AXIS_INL
#else
#define TROCAR_DETECT_BY_AXIS_INL
#endif

#include <hwy/highway.h>

#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

#if HWY_TARGET != HWY_SCALAR

/// Writes four points (x, y, z, ignored) to result[axis][first … first+3], which must be aligned to 16 bytes.
template <typename Vector, typename Axes>
HWY_INLINE void store_by_axis(const Vector& a, const Vector& b, const Vector& c, const Vector& e, Axes& result,
                              std::size_t first) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::Full128<float> d;
    const auto xy_even = hn::InterleaveLower(d, a, c);
    const auto xy_odd = hn::InterleaveLower(d, b, e);
    const auto z_even = hn::InterleaveUpper(d, a, c);
    const auto z_odd = hn::InterleaveUpper(d, b, e);
    hn::Store(hn::InterleaveLower(d, xy_even, xy_odd), d, &result[0][first]);
    hn::Store(hn::InterleaveUpper(d, xy_even, xy_odd), d, &result[1][first]);
    hn::Store(hn::InterleaveLower(d, z_even, z_odd), d, &result[2][first]);
}

#endif

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
