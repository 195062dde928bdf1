#include "tissue/spring_stencil.hpp"

#include <algorithm>

#include "tissue/spring_kernels.hpp"

namespace trocar {
namespace {

constexpr std::size_t most_offsets = 32;

std::size_t groups_of(std::size_t n) { return (n + SpringStencil::group - 1) / SpringStencil::group; }

std::size_t offset_of(const SpringArrays& springs, std::size_t s) {
    return static_cast<std::size_t>(springs.j[s]) - static_cast<std::size_t>(springs.i[s]);
}

/// Ascending offsets. Empty if they are too many or too long, or if a vertex's springs are not sorted by offset.
std::vector<std::size_t> offsets_of(const SpringArrays& springs) {
    std::vector<std::size_t> offsets;
    for (std::size_t s = 0; s < springs.size(); ++s) {
        const std::size_t offset = offset_of(springs, s);
        if (offset > SpringStencil::longest) return {};
        if (s > 0 && springs.i[s] == springs.i[s - 1] && offset <= offset_of(springs, s - 1)) return {};
        const auto place = std::lower_bound(offsets.begin(), offsets.end(), offset);
        if (place != offsets.end() && *place == offset) continue;
        if (offsets.size() == most_offsets) return {};
        offsets.insert(place, offset);
    }
    return offsets;
}

}  // namespace

SpringStencil spring_stencil(const SpringArrays& springs) {
    SpringStencil stencil;
    stencil.offsets = offsets_of(springs);
    if (stencil.empty()) return stencil;
    const std::size_t count = stencil.offsets.size();
    constexpr std::size_t group = SpringStencil::group;
    stencil.groups = groups_of(springs.first_out.size() - 1);
    stencil.constants.assign(count * stencil.groups * 3 * group, 0.0);
    stencil.present.assign(stencil.groups * 2 * count, 0);
    std::size_t columns = 0;  // to compute, padding included
    for (std::size_t s = 0; s < springs.size(); ++s) {
        const auto i = static_cast<std::size_t>(springs.i[s]);
        const auto j = static_cast<std::size_t>(springs.j[s]);
        const auto place = std::lower_bound(stencil.offsets.begin(), stencil.offsets.end(), j - i);
        const auto c = static_cast<std::size_t>(place - stencil.offsets.begin());
        double* const constants = &stencil.constants[(c * stencil.groups + i / group) * 3 * group + i % group];
        constants[0] = springs.k[s];
        constants[group] = springs.offset[s];
        constants[2 * group] = springs.damping[s];
        std::uint8_t& out = stencil.present[i / group * 2 * count + c];
        if (out == 0) columns += group;
        out = static_cast<std::uint8_t>(out | 1U << i % group);
        std::uint8_t& in = stencil.present[j / group * 2 * count + count + c];
        in = static_cast<std::uint8_t>(in | 1U << j % group);
    }
    constexpr double worthwhile = 1.5;
    if (static_cast<double>(columns) > worthwhile * static_cast<double>(springs.size())) return {};
    stencil.query_distance = groups_of(stencil.offsets.back()) * group;
    stencil.work.assign((6 + 3 * count) * SpringStencil::window, 0.0);
    return stencil;
}

}  // namespace trocar
