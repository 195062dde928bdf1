// Sixteen triangles' boxes against one box: the inner loop of ohc_clustered, in the widest vectors the CPU has.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace trocar {

/// Boxes of one cluster's triangles, axis by axis, rounded outward to float; relative to an origin that all share.
struct ClusterBoxes {
    alignas(64) std::array<std::array<float, 16>, 3> low;
    alignas(64) std::array<std::array<float, 16>, 3> high;
};

/// Bit j of result[i] is set when box i of `first` overlaps box j of `second`, closed boxes; for the boxes i in
/// `first_mask` only, the others' results are 0.
using OverlapKernel = void (*)(const ClusterBoxes& first, std::uint32_t first_mask, const ClusterBoxes& second,
                               std::array<std::uint16_t, 16>& result);
/// Mask of the boxes of `boxes` that overlap the box low … high.
using MaskKernel = std::uint32_t (*)(const ClusterBoxes& boxes, const std::array<float, 3>& low,
                                     const std::array<float, 3>& high);

struct BoxKernels {
    OverlapKernel overlaps = nullptr;
    MaskKernel mask = nullptr;
    const char* target = "";  ///< instruction set, as Highway names it
};

/// The best of this CPU, chosen at the first call.
const BoxKernels& box_kernels();
/// One for each instruction set that was built and that this CPU has, the plainest last.
std::vector<BoxKernels> all_box_kernels();

}  // namespace trocar
