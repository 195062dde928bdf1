// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "detect/vertex_kernels.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/vertex_kernels.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "detect/clusters.hpp"
#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;

#if HWY_TARGET == HWY_SCALAR

/// Box of `count` points in two arrays of lows and highs.
HWY_INLINE void fold(const double* low, const double* high, std::size_t count, Extent& box) {
    box = Extent();
    for (std::size_t i = 0; i < 3 * count; ++i) {
        box.low[i % 3] = std::min(box.low[i % 3], low[i]);
        box.high[i % 3] = std::max(box.high[i % 3], high[i]);
    }
}

#else

using Two = hn::Full128<double>;

/// Box of `count` points, an even number, in two arrays of lows and highs. Two points are (x, y) (z, x) (y, z).
HWY_INLINE void fold(const double* low, const double* high, std::size_t count, Extent& box) {
    const Two d;
    auto low_xy = hn::Load(d, low);
    auto low_zx = hn::Load(d, low + 2);
    auto low_yz = hn::Load(d, low + 4);
    auto high_xy = hn::Load(d, high);
    auto high_zx = hn::Load(d, high + 2);
    auto high_yz = hn::Load(d, high + 4);
    for (std::size_t i = 6; i < 3 * count; i += 6) {
        low_xy = hn::Min(low_xy, hn::Load(d, low + i));
        low_zx = hn::Min(low_zx, hn::Load(d, low + i + 2));
        low_yz = hn::Min(low_yz, hn::Load(d, low + i + 4));
        high_xy = hn::Max(high_xy, hn::Load(d, high + i));
        high_zx = hn::Max(high_zx, hn::Load(d, high + i + 2));
        high_yz = hn::Max(high_yz, hn::Load(d, high + i + 4));
    }
    // (x, y) with (x of zx, y of yz); z of both others.
    hn::Store(hn::Min(low_xy, hn::ConcatLowerUpper(d, low_yz, low_zx)), d, box.low.data());
    hn::Store(hn::Max(high_xy, hn::ConcatLowerUpper(d, high_yz, high_zx)), d, box.high.data());
    hn::Store(hn::Min(low_zx, hn::Shuffle01(low_yz)), d, box.low.data() + 2);
    hn::Store(hn::Max(high_zx, hn::Shuffle01(high_yz)), d, box.high.data() + 2);
}

#endif

/// Points are read in memory order, x y z x y z …. With L lanes, three vectors hold L points, and number i of the 3L
/// belongs to axis i mod 3. Minima are therefore taken vector by vector, and the axes are separated at the end.
bool box_of_run(const double* points, Index count, Extent& result) {
    const Doubles d;
    const std::size_t lanes = hn::Lanes(d);
    const std::size_t total = 3 * static_cast<std::size_t>(count);
    // A finite number times zero is zero; infinities and NaN give NaN.
    if (total < 3 * lanes) {
        Extent box;
        double not_finite = 0.0;
        for (std::size_t i = 0; i < total; ++i) {
            box.low[i % 3] = std::min(box.low[i % 3], points[i]);
            box.high[i % 3] = std::max(box.high[i % 3], points[i]);
            not_finite += points[i] * 0.0;
        }
        result = box;
        return not_finite == 0.0;
    }
    auto low_0 = hn::LoadU(d, points);
    auto low_1 = hn::LoadU(d, points + lanes);
    auto low_2 = hn::LoadU(d, points + 2 * lanes);
    auto high_0 = low_0;
    auto high_1 = low_1;
    auto high_2 = low_2;
    const auto zero = hn::Zero(d);
    auto check_0 = hn::Mul(low_0, zero);
    auto check_1 = hn::Mul(low_1, zero);
    auto check_2 = hn::Mul(low_2, zero);
    const auto add = [&](const double* from) HWY_ATTR {
        const auto a = hn::LoadU(d, from);
        const auto b = hn::LoadU(d, from + lanes);
        const auto c = hn::LoadU(d, from + 2 * lanes);
        low_0 = hn::Min(low_0, a);
        low_1 = hn::Min(low_1, b);
        low_2 = hn::Min(low_2, c);
        high_0 = hn::Max(high_0, a);
        high_1 = hn::Max(high_1, b);
        high_2 = hn::Max(high_2, c);
        check_0 = hn::MulAdd(a, zero, check_0);
        check_1 = hn::MulAdd(b, zero, check_1);
        check_2 = hn::MulAdd(c, zero, check_2);
    };
    std::size_t i = 3 * lanes;
    for (; i + 3 * lanes <= total; i += 3 * lanes) add(points + i);
    // The last step overlaps the one before, so that it is a whole one.
    if (i < total) add(points + total - 3 * lanes);
    alignas(64) double low[24];
    alignas(64) double high[24];
    hn::Store(low_0, d, low);
    hn::Store(low_1, d, low + lanes);
    hn::Store(low_2, d, low + 2 * lanes);
    hn::Store(high_0, d, high);
    hn::Store(high_1, d, high + lanes);
    hn::Store(high_2, d, high + 2 * lanes);
    fold(low, high, lanes, result);
    return hn::GetLane(hn::SumOfLanes(d, hn::Add(hn::Add(check_0, check_1), check_2))) == 0.0;
}

#if HWY_TARGET == HWY_SCALAR

bool box_of_some(const double* position, const Index* number, Index count, Index /*known*/, Extent& result) {
    Extent box;
    double not_finite = 0.0;
    for (Index k = 0; k < count; ++k) {
        const double* const point = position + 3 * static_cast<std::size_t>(number[k]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.low[axis] = std::min(box.low[axis], point[axis]);
            box.high[axis] = std::max(box.high[axis], point[axis]);
            not_finite += point[axis] * 0.0;
        }
    }
    result = box;
    return not_finite == 0.0;
}

#elif HWY_MAX_BYTES >= 32

using FourDoubles = hn::FixedTag<double, 4>;

/// (x, y, z, 0). Other points are read together with the next number in memory, which the last point does not have.
HWY_INLINE hn::Vec<FourDoubles> load_last(const double* point) {
    alignas(32) const double copy[4] = {point[0], point[1], point[2], 0.0};
    return hn::Load(FourDoubles(), copy);
}

bool box_of_some(const double* position, const Index* number, Index count, Index known, Extent& result) {
    const FourDoubles d;
    const auto point_of = [position](Index v) { return position + 3 * static_cast<std::size_t>(v); };
    const auto zero = hn::Zero(d);
    auto low = load_last(point_of(number[count - 1]));
    auto high = low;
    // A finite number times zero is ±0, any other NaN, and bits of a NaN stay when others are added.
    auto check = hn::Mul(low, zero);
    const auto add = [&](Index k) {
        const auto point = hn::LoadU(d, point_of(number[k]));
        low = hn::Min(low, point);
        high = hn::Max(high, point);
        check = hn::Or(check, hn::Mul(point, zero));
    };
    // Prefetches, since the hardware cannot predict these places.
    const Index foreseen = std::min(count - 1, known - block_size);
    Index k = 0;
    for (; k < foreseen; ++k) {
        hwy::Prefetch(point_of(number[k + block_size]));
        add(k);
    }
    for (; k < count - 1; ++k) add(k);
    hn::Store(low, d, result.low.data());
    hn::Store(high, d, result.high.data());
    alignas(32) double not_finite[4];
    hn::Store(check, d, not_finite);
    return not_finite[0] + not_finite[1] + not_finite[2] == 0.0;
}

#else

/// A point is read as (x, y) and (y, z), so that no memory behind the last one is touched.
bool box_of_some(const double* position, const Index* number, Index count, Index /*known*/, Extent& result) {
    const Two d;
    auto low_xy = hn::Set(d, Extent::infinity);
    auto low_yz = low_xy;
    auto high_xy = hn::Neg(low_xy);
    auto high_yz = high_xy;
    const auto zero = hn::Zero(d);
    auto check = zero;
    for (Index k = 0; k < count; ++k) {
        const double* const point = position + 3 * static_cast<std::size_t>(number[k]);
        const auto xy = hn::LoadU(d, point);
        const auto yz = hn::LoadU(d, point + 1);
        low_xy = hn::Min(low_xy, xy);
        low_yz = hn::Min(low_yz, yz);
        high_xy = hn::Max(high_xy, xy);
        high_yz = hn::Max(high_yz, yz);
        check = hn::Add(check, hn::Mul(hn::Add(xy, yz), zero));
    }
    alignas(16) double low_end[2];
    alignas(16) double high_end[2];
    hn::Store(low_xy, d, result.low.data());
    hn::Store(high_xy, d, result.high.data());
    hn::Store(low_yz, d, low_end);
    hn::Store(high_yz, d, high_end);
    result.low[2] = low_end[1];
    result.high[2] = high_end[1];
    // x + y may overflow where both are huge and finite; the check is then repeated number by number.
    if (hn::GetLane(hn::SumOfLanes(d, check)) == 0.0) return true;
    double not_finite = 0.0;
    for (Index k = 0; k < count; ++k) {
        const double* const point = position + 3 * static_cast<std::size_t>(number[k]);
        not_finite += point[0] * 0.0 + point[1] * 0.0 + point[2] * 0.0;
    }
    return not_finite == 0.0;
}

#endif

/// Prefetch distance in runs: the hardware predicts a stream of lines only up to the end of a page.
constexpr Index foreseen_runs = 42;

Index boxes_of_moved_runs(const double* points, const Index* begin, Index count, std::array<double, 3>* first,
                          Extent* boxes, bool& finite) {
    const auto point = [points, begin](Index k) { return points + 3 * static_cast<std::size_t>(begin[k]); };
    for (Index k = 0; k < count; ++k) {
        hwy::Prefetch(point(std::min(k + foreseen_runs, count - 1)));
        std::array<std::uint64_t, 3> bits{};
        std::array<std::uint64_t, 3> known{};
        std::memcpy(bits.data(), point(k), sizeof bits);
        std::memcpy(known.data(), first[k].data(), sizeof known);
        if (((bits[0] ^ known[0]) | (bits[1] ^ known[1]) | (bits[2] ^ known[2])) == 0) return k;
        std::memcpy(first[k].data(), bits.data(), sizeof bits);
        finite &= box_of_run(point(k), begin[k + 1] - begin[k], boxes[k]);
    }
    return count;
}

#if HWY_TARGET == HWY_SCALAR || HWY_MAX_BYTES < 32

void box_of_boxes(const Extent* boxes, const Index* number, Index count, Extent& result) {
    Extent box;
    for (Index k = 0; k < count; ++k) box.add(boxes[number[k]]);
    result = box;
}

#else

void box_of_boxes(const Extent* boxes, const Index* number, Index count, Extent& result) {
    const FourDoubles d;
    auto low = hn::Set(d, Extent::infinity);
    auto high = hn::Neg(low);
    for (Index k = 0; k < count; ++k) {
        const Extent& box = boxes[number[k]];
        low = hn::Min(low, hn::Load(d, box.low.data()));
        high = hn::Max(high, hn::Load(d, box.high.data()));
    }
    hn::Store(low, d, result.low.data());
    hn::Store(high, d, result.high.data());
}

#endif

#if HWY_TARGET == HWY_SCALAR

void to_floats(const double* position, const Index* number, Index count, const FloatFrame& frame, FloatPoint* result,
               FloatBox& box) {
    for (Index k = 0; k < count; ++k) {
        const double* const point = position + 3 * static_cast<std::size_t>(number[k]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto x = static_cast<float>((point[axis] - frame.origin[axis]) * frame.scale);
            result[k].x[axis] = x;
            box.low[axis] = k == 0 ? x : std::min(box.low[axis], x);
            box.high[axis] = k == 0 ? x : std::max(box.high[axis], x);
        }
    }
}

#elif HWY_MAX_BYTES >= 32

void to_floats(const double* position, const Index* number, Index count, const FloatFrame& frame, FloatPoint* result,
               FloatBox& box) {
    const FourDoubles d;
    const hn::FixedTag<float, 4> floats;
    const auto point_of = [position](Index v) { return position + 3 * static_cast<std::size_t>(v); };
    const auto origin = load_last(frame.origin.data());
    const auto scale = hn::Set(d, frame.scale);
    const auto rounded = [&](const auto& point) {
        return hn::DemoteTo(floats, hn::Mul(hn::Sub(point, origin), scale));
    };
    const Index last = count - 1;
    auto low = rounded(load_last(point_of(number[last])));
    auto high = low;
    hn::Store(low, floats, result[last].x.data());
    const auto take = [&](Index k) {
        const auto point = rounded(hn::LoadU(d, point_of(number[k])));
        low = hn::Min(low, point);
        high = hn::Max(high, point);
        hn::Store(point, floats, result[k].x.data());
    };
    constexpr Index ahead = 16;
    Index k = 0;
    for (; k < last - ahead; ++k) {
        hwy::Prefetch(point_of(number[k + ahead]));
        take(k);
    }
    for (; k < last; ++k) take(k);
    alignas(16) float corners[8];
    hn::Store(low, floats, corners);
    hn::Store(high, floats, corners + 4);
    std::copy_n(corners, 3, box.low.data());
    std::copy_n(corners + 4, 3, box.high.data());
}

#else

void to_floats(const double* position, const Index* number, Index count, const FloatFrame& frame, FloatPoint* result,
               FloatBox& box) {
    const Two d;
    const hn::Half<hn::Full128<float> > two_floats;
    const auto origin_xy = hn::LoadU(d, frame.origin.data());
    const auto origin_yz = hn::LoadU(d, frame.origin.data() + 1);
    const auto scale = hn::Set(d, frame.scale);
    auto low_xy = hn::Set(d, Extent::infinity);
    auto low_yz = low_xy;
    auto high_xy = hn::Neg(low_xy);
    auto high_yz = high_xy;
    for (Index k = 0; k < count; ++k) {
        const double* const point = position + 3 * static_cast<std::size_t>(number[k]);
        const auto xy = hn::Mul(hn::Sub(hn::LoadU(d, point), origin_xy), scale);
        const auto yz = hn::Mul(hn::Sub(hn::LoadU(d, point + 1), origin_yz), scale);
        low_xy = hn::Min(low_xy, xy);
        low_yz = hn::Min(low_yz, yz);
        high_xy = hn::Max(high_xy, xy);
        high_yz = hn::Max(high_yz, yz);
        hn::StoreU(hn::DemoteTo(two_floats, xy), two_floats, result[k].x.data());
        hn::StoreU(hn::DemoteTo(two_floats, yz), two_floats, result[k].x.data() + 1);
    }
    // Rounding is monotone: the box of the floats is the rounded box.
    hn::StoreU(hn::DemoteTo(two_floats, low_xy), two_floats, box.low.data());
    hn::StoreU(hn::DemoteTo(two_floats, low_yz), two_floats, box.low.data() + 1);
    hn::StoreU(hn::DemoteTo(two_floats, high_xy), two_floats, box.high.data());
    hn::StoreU(hn::DemoteTo(two_floats, high_yz), two_floats, box.high.data() + 1);
}

#endif

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(box_of_run);
HWY_EXPORT(box_of_some);
HWY_EXPORT(boxes_of_moved_runs);
HWY_EXPORT(box_of_boxes);
HWY_EXPORT(to_floats);

const std::vector<VertexKernels>& vertex_kernels() {
    static const std::vector<VertexKernels> kernels = versions_by_target([](const char* target) {
        return VertexKernels{.box_of_run = &HWY_DYNAMIC_DISPATCH(box_of_run),
                             .box_of_some = &HWY_DYNAMIC_DISPATCH(box_of_some),
                             .boxes_of_moved_runs = &HWY_DYNAMIC_DISPATCH(boxes_of_moved_runs),
                             .box_of_boxes = &HWY_DYNAMIC_DISPATCH(box_of_boxes),
                             .to_floats = &HWY_DYNAMIC_DISPATCH(to_floats),
                             .target = target};
    });
    return kernels;
}

}  // namespace trocar
#endif
