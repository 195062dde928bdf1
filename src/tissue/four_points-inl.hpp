// Shared by the tissue kernels: columns of a 4×N matrix, and transpositions between four points and vectors by axis.
// Included once per instruction set, as Highway's own headers are.
#if defined(TROCAR_TISSUE_FOUR_POINTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_TISSUE_FOUR_POINTS_INL
#undef TROCAR_TISSUE_FOUR_POINTS_INL
#else
#define TROCAR_TISSUE_FOUR_POINTS_INL
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "tissue/spring_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

template <typename Number>
HWY_INLINE const double* column(const Matrix4X& matrix, Number vertex) {
    return matrix.data() + 4 * static_cast<std::ptrdiff_t>(vertex);
}
template <typename Number>
HWY_INLINE double* column(Matrix4X& matrix, Number vertex) {
    return matrix.data() + 4 * static_cast<std::ptrdiff_t>(vertex);
}

#if HWY_MAX_BYTES >= 32

namespace hn = hwy::HWY_NAMESPACE;

using Four = hn::FixedTag<double, 4>;
using Vector = hn::Vec<Four>;

/// Transposes four points (x y z _ each) into vectors by axis.
HWY_INLINE void transpose(Vector p0, Vector p1, Vector p2, Vector p3, Vector& x, Vector& y, Vector& z) {
    const Four d;
    const auto low_01 = hn::InterleaveLower(d, p0, p1);  // x0 x1 z0 z1
    const auto low_23 = hn::InterleaveLower(d, p2, p3);
    x = hn::ConcatLowerLower(d, low_23, low_01);
    y = hn::ConcatLowerLower(d, hn::InterleaveUpper(d, p2, p3), hn::InterleaveUpper(d, p0, p1));
    z = hn::ConcatUpperUpper(d, low_23, low_01);
}

/// Inverse of transpose: point n is lane n of x, y, z, then 0.
HWY_INLINE void transpose_back(Vector x, Vector y, Vector z, Vector& p0, Vector& p1, Vector& p2, Vector& p3) {
    const Four d;
    const auto zero = hn::Zero(d);
    const auto xy_even = hn::InterleaveLower(d, x, y);  // x0 y0 x2 y2
    const auto xy_odd = hn::InterleaveUpper(d, x, y);
    const auto z_even = hn::InterleaveLower(d, z, zero);
    const auto z_odd = hn::InterleaveUpper(d, z, zero);
    p0 = hn::ConcatLowerLower(d, z_even, xy_even);
    p1 = hn::ConcatLowerLower(d, z_odd, xy_odd);
    p2 = hn::ConcatUpperUpper(d, z_even, xy_even);
    p3 = hn::ConcatUpperUpper(d, z_odd, xy_odd);
}

#endif

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
