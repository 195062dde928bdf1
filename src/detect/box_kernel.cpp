// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "detect/box_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/box_kernel.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Up to 16 lanes; a cluster is 16 / Lanes vectors.
using Floats = hn::CappedTag<float, 16>;

std::uint32_t mask_of(const ClusterBoxes& boxes, const std::array<float, 3>& low, const std::array<float, 3>& high) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    std::uint32_t result = 0;
    for (std::size_t j = 0; j < 16; j += lanes) {
        auto overlap = hn::And(hn::Le(hn::Load(d, &boxes.low[0][j]), hn::Set(d, high[0])),
                               hn::Ge(hn::Load(d, &boxes.high[0][j]), hn::Set(d, low[0])));
        for (std::size_t axis = 1; axis < 3; ++axis) {
            overlap = hn::And(overlap, hn::And(hn::Le(hn::Load(d, &boxes.low[axis][j]), hn::Set(d, high[axis])),
                                               hn::Ge(hn::Load(d, &boxes.high[axis][j]), hn::Set(d, low[axis]))));
        }
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, overlap, bits);
        result |= static_cast<std::uint32_t>(bits[0] | (bits[1] << 8)) << j;
    }
    return result;
}

void overlaps(const ClusterBoxes& first, std::uint32_t first_mask, const ClusterBoxes& second,
              std::array<std::uint16_t, 16>& result) {
    result.fill(0);
    for (std::uint32_t rest = first_mask; rest != 0; rest &= rest - 1) {
        const auto i = static_cast<std::size_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
        result[i] = static_cast<std::uint16_t>(mask_of(second, {first.low[0][i], first.low[1][i], first.low[2][i]},
                                                       {first.high[0][i], first.high[1][i], first.high[2][i]}));
    }
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(overlaps);
HWY_EXPORT(mask_of);

std::vector<BoxKernels> all_box_kernels() {
    std::vector<BoxKernels> kernels;
    // Lower bits are better targets.
    for (std::int64_t rest = hwy::SupportedTargets() & HWY_TARGETS; rest != 0; rest &= rest - 1) {
        const std::int64_t target = rest & -rest;
        hwy::GetChosenTarget().Update(target);
        kernels.push_back({.overlaps = &HWY_DYNAMIC_DISPATCH(overlaps),
                           .mask = &HWY_DYNAMIC_DISPATCH(mask_of),
                           .target = hwy::TargetName(target)});
    }
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    return kernels;
}

const BoxKernels& box_kernels() {
    static const BoxKernels best = all_box_kernels().front();
    return best;
}

}  // namespace trocar
#endif
