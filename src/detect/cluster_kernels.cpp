// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "detect/cluster_kernels.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/cluster_kernels.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "detect/by_axis-inl.hpp"
#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void box_of_places(const FloatPoint* points, const std::uint16_t* place, Index count, std::size_t i,
                   SixteenBoxes& result) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        float low = points[place[0]].x[axis];
        float high = low;
        for (Index k = 1; k < count; ++k) {
            low = std::min(low, points[place[k]].x[axis]);
            high = std::max(high, points[place[k]].x[axis]);
        }
        result.low[axis][i] = low;
        result.high[axis][i] = high;
    }
}

void boxes_of_triangles(const FloatPoint* points, const ClusterCorners& corners, SixteenBoxes& result) {
    for (std::size_t t = 0; t < fan; ++t) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float a = points[corners[t][0]].x[axis];
            const float b = points[corners[t][1]].x[axis];
            const float c = points[corners[t][2]].x[axis];
            result.low[axis][t] = std::min(std::min(a, b), c);
            result.high[axis][t] = std::max(std::max(a, b), c);
        }
    }
}

#else

using Four = hn::Full128<float>;

void box_of_places(const FloatPoint* points, const std::uint16_t* place, Index count, std::size_t i,
                   SixteenBoxes& result) {
    const Four d;
    auto low = hn::Load(d, points[place[0]].x.data());
    auto high = low;
    for (Index k = 1; k < count; ++k) {
        const auto point = hn::Load(d, points[place[k]].x.data());
        low = hn::Min(low, point);
        high = hn::Max(high, point);
    }
    alignas(16) float numbers[8];
    hn::Store(low, d, numbers);
    hn::Store(high, d, numbers + 4);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        result.low[axis][i] = numbers[axis];
        result.high[axis][i] = numbers[4 + axis];
    }
}

void boxes_of_triangles(const FloatPoint* points, const ClusterCorners& corners, SixteenBoxes& result) {
    const Four d;
    const auto corner = [&](std::size_t t, std::size_t k) { return hn::Load(d, points[corners[t][k]].x.data()); };
    const auto low = [&](std::size_t t) { return hn::Min(hn::Min(corner(t, 0), corner(t, 1)), corner(t, 2)); };
    const auto high = [&](std::size_t t) { return hn::Max(hn::Max(corner(t, 0), corner(t, 1)), corner(t, 2)); };
    for (std::size_t t = 0; t < fan; t += 4) {
        store_by_axis(low(t), low(t + 1), low(t + 2), low(t + 3), result.low, t);
        store_by_axis(high(t), high(t + 1), high(t + 2), high(t + 3), result.high, t);
    }
}

#endif

using Floats = hn::CappedTag<float, fan>;

std::uint32_t overlaps(const SixteenBoxes& boxes, const FloatBox& box) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    std::uint32_t result = 0;
    for (std::size_t j = 0; j < fan; j += lanes) {
        auto overlap = hn::And(hn::Le(hn::Load(d, &boxes.low[0][j]), hn::Set(d, box.high[0])),
                               hn::Ge(hn::Load(d, &boxes.high[0][j]), hn::Set(d, box.low[0])));
        for (std::size_t axis = 1; axis < 3; ++axis) {
            overlap = hn::And(overlap, hn::And(hn::Le(hn::Load(d, &boxes.low[axis][j]), hn::Set(d, box.high[axis])),
                                               hn::Ge(hn::Load(d, &boxes.high[axis][j]), hn::Set(d, box.low[axis]))));
        }
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, overlap, bits);
        result |= static_cast<std::uint32_t>(bits[0] | (bits[1] << 8)) << j;
    }
    return result;
}

void rows(const SixteenBoxes& first, std::uint32_t first_mask, const SixteenBoxes& second, SixteenRows& result) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    for (std::size_t j = 0; j < fan; j += lanes) {
        const auto low_x = hn::Load(d, &second.low[0][j]);
        const auto low_y = hn::Load(d, &second.low[1][j]);
        const auto low_z = hn::Load(d, &second.low[2][j]);
        const auto high_x = hn::Load(d, &second.high[0][j]);
        const auto high_y = hn::Load(d, &second.high[1][j]);
        const auto high_z = hn::Load(d, &second.high[2][j]);
        for (std::uint32_t rest = first_mask; rest != 0; rest &= rest - 1) {
            const auto i = static_cast<std::size_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
            const auto x =
                hn::And(hn::Le(low_x, hn::Set(d, first.high[0][i])), hn::Ge(high_x, hn::Set(d, first.low[0][i])));
            const auto y =
                hn::And(hn::Le(low_y, hn::Set(d, first.high[1][i])), hn::Ge(high_y, hn::Set(d, first.low[1][i])));
            const auto z =
                hn::And(hn::Le(low_z, hn::Set(d, first.high[2][i])), hn::Ge(high_z, hn::Set(d, first.low[2][i])));
            std::uint8_t bytes[8] = {};
            hn::StoreMaskBits(d, hn::And(hn::And(x, y), z), bytes);
            const auto bits = static_cast<std::uint32_t>(bytes[0] | (bytes[1] << 8)) << j;
            result[i] = static_cast<std::uint16_t>(j == 0 ? bits : result[i] | bits);
        }
    }
}

void grow(const SixteenBoxes& boxes, float query_distance, SixteenBoxes& result) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    const auto infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    const auto wider = hn::Set(d, query_distance * (1.0F + 0x1p-20F) + std::numeric_limits<float>::min());
    const auto slack = hn::Set(d, 0x1p-21F);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t j = 0; j < fan; j += lanes) {
            const auto low = hn::Load(d, &boxes.low[axis][j]);
            const auto high = hn::Load(d, &boxes.high[axis][j]);
            const auto below = hn::Sub(low, hn::Add(hn::Mul(hn::Abs(low), slack), wider));
            const auto above = hn::Add(high, hn::Add(hn::Mul(hn::Abs(high), slack), wider));
            hn::Store(hn::IfThenElse(hn::Eq(hn::Abs(low), infinity), hn::Neg(infinity), below), d,
                      &result.low[axis][j]);
            hn::Store(hn::IfThenElse(hn::Eq(hn::Abs(high), infinity), infinity, above), d, &result.high[axis][j]);
        }
    }
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(box_of_places);
HWY_EXPORT(boxes_of_triangles);
HWY_EXPORT(overlaps);
HWY_EXPORT(rows);
HWY_EXPORT(grow);

const std::vector<ClusterKernels>& cluster_kernels() {
    static const std::vector<ClusterKernels> kernels = versions_by_target([](const char* target) {
        return ClusterKernels{.box_of_places = &HWY_DYNAMIC_DISPATCH(box_of_places),
                              .boxes_of_triangles = &HWY_DYNAMIC_DISPATCH(boxes_of_triangles),
                              .overlaps = &HWY_DYNAMIC_DISPATCH(overlaps),
                              .rows = &HWY_DYNAMIC_DISPATCH(rows),
                              .grow = &HWY_DYNAMIC_DISPATCH(grow),
                              .target = target};
    });
    return kernels;
}

}  // namespace trocar
#endif
