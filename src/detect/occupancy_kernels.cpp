// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "detect/occupancy_kernels.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/occupancy_kernels.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Words = hn::CappedTag<std::uint32_t, 16>;

/// Adding and subtracting 1.5 × 2^52 rounds to the nearest integer, as Lattice::number does.
constexpr double rounder = 6755399441055744.0;

/// Writes one word per point: several points at a time by vectors(x, y, z), which returns a vector of words, the last
/// ones by single(point).
template <typename Vectors, typename Single>
HWY_INLINE void for_each_point(const double* points, Index count, std::uint32_t* words, const Vectors& vectors,
                               const Single& single) {
    const Doubles d;
    const hn::Rebind<std::uint32_t, Doubles> du;
    const auto lanes = static_cast<Index>(hn::Lanes(d));
    Index i = 0;
    for (; i + lanes <= count; i += lanes) {
        auto x = hn::Undefined(d);
        auto y = hn::Undefined(d);
        auto z = hn::Undefined(d);
        hn::LoadInterleaved3(d, points + 3 * static_cast<std::size_t>(i), x, y, z);
        hn::StoreU(vectors(x, y, z), du, words + i);
    }
    for (; i < count; ++i) words[i] = single(points + 3 * static_cast<std::size_t>(i));
}

/// Converts integers from 0 to below 2^31 to words.
template <typename Vector>
HWY_INLINE auto to_words(Vector whole) {
    const hn::Rebind<std::int32_t, Doubles> di;
    const hn::Rebind<std::uint32_t, Doubles> du;
    return hn::BitCast(du, hn::DemoteTo(di, whole));
}

void encode(const double* points, Index count, const CellWindow& window, std::uint32_t* codes) {
    const Doubles d;
    const auto inverse = hn::Set(d, window.inverse);
    const auto round = hn::Set(d, rounder);
    const auto along = [&](auto x, std::size_t k) {
        auto t = hn::Sub(hn::Mul(x, inverse), hn::Set(d, window.base[k]));
        t = hn::Min(hn::Max(t, hn::Set(d, window.first[k])), hn::Set(d, window.last[k]));
        t = hn::Sub(hn::Sub(hn::Add(t, round), round), hn::Set(d, window.origin[k]));
        return hn::ShiftRightSame(to_words(t), window.shift);
    };
    for_each_point(
        points, count, codes,
        [&](auto x, auto y, auto z) {
            return hn::Or(hn::Or(along(x, 0), hn::ShiftLeft<cell_code::bits>(along(y, 1))),
                          hn::ShiftLeft<2 * cell_code::bits>(along(z, 2)));
        },
        [&window](const double* point) {
            std::uint32_t code = 0;
            for (unsigned k = 0; k < 3; ++k) {
                double t = point[k] * window.inverse - window.base[k];
                t = std::min(std::max(t, window.first[k]), window.last[k]);
                t = (t + rounder) - rounder - window.origin[k];
                code |= (static_cast<std::uint32_t>(t) >> window.shift) << (cell_code::bits * k);
            }
            return code;
        });
}

void mark(const std::uint32_t* field, Index count, const CellWindow& window, std::uint32_t* codes) {
    const Words d;
    const hn::RebindToSigned<Words> di;
    const auto lanes = static_cast<Index>(hn::Lanes(d));
    const auto most = hn::Set(d, cell_code::most);
    const auto row = hn::Set(d, window.row);
    const auto plane = hn::Set(d, window.plane);
    const auto one = hn::Set(d, 1U);
    Index i = 0;
    for (; i + lanes <= count; i += lanes) {
        const auto code = hn::LoadU(d, codes + i);
        const auto x = hn::And(code, most);
        const auto y = hn::And(hn::ShiftRight<cell_code::bits>(code), most);
        const auto z = hn::And(hn::ShiftRight<2 * cell_code::bits>(code), most);
        const auto place = hn::Add(x, hn::Add(hn::Mul(y, row), hn::Mul(z, plane)));
        const auto word = hn::GatherIndex(d, field, hn::BitCast(di, hn::ShiftRight<5>(place)));
        const auto set = hn::And(hn::Shr(word, hn::And(place, hn::Set(d, 31U))), one);
        hn::StoreU(hn::Or(code, hn::ShiftLeft<31>(set)), d, codes + i);
    }
    for (; i < count; ++i) {
        const std::uint32_t place = cell_code::place(codes[i], window);
        if (((field[place / 32] >> (place % 32)) & 1U) != 0) codes[i] |= cell_code::mark;
    }
}

Index select(const std::uint32_t* codes, const Index* corners, Index first, Index count, std::uint32_t mark,
             Index* found) {
    using Numbers = hn::CappedTag<Index, 16>;
    const Words d;
    const Numbers di;
    const auto lanes = static_cast<Index>(hn::Lanes(d));
    const auto spare = hn::Set(d, cell_code::spare);
    const auto ones = hn::Set(d, cell_code::ones);
    const auto apart = [&](auto a, auto b) {
        const auto difference = hn::Sub(a, hn::AndNot(hn::Set(d, cell_code::mark), b));
        return hn::Or(hn::Xor(difference, spare), hn::Xor(hn::Add(difference, ones), spare));
    };
    Index n = 0;
    Index i = 0;
    for (; i + lanes <= count; i += lanes) {
        auto a = hn::Undefined(di);
        auto b = hn::Undefined(di);
        auto c = hn::Undefined(di);
        hn::LoadInterleaved3(di, corners + 3 * static_cast<std::size_t>(first + i), a, b, c);
        const auto code_a = hn::GatherIndex(d, codes, a);
        const auto code_b = hn::GatherIndex(d, codes, b);
        const auto code_c = hn::GatherIndex(d, codes, c);
        const auto from = hn::Add(hn::Or(code_a, spare), ones);
        const auto wide = hn::And(hn::Or(apart(from, code_b), apart(from, code_c)), hn::Set(d, cell_code::upper));
        const auto kept = hn::Ne(hn::Or(wide, hn::And(code_a, hn::Set(d, mark))), hn::Zero(d));
        if (hn::AllFalse(d, kept)) continue;
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, kept, bytes);
        for (auto bits = static_cast<std::uint32_t>(bytes[0] | (bytes[1] << 8)); bits != 0; bits &= bits - 1) {
            found[n++] = first + i + static_cast<Index>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
        }
    }
    for (; i < count; ++i) {
        const Index* const corner = corners + 3 * static_cast<std::size_t>(first + i);
        const std::uint32_t a = codes[corner[0]];
        found[n] = first + i;
        n += ((a & mark) | cell_code::apart(a, codes[corner[1]]) | cell_code::apart(a, codes[corner[2]])) != 0 ? 1 : 0;
    }
    return n;
}

void beside(const double* points, Index count, std::span<const Extent> boxes, std::uint32_t* words) {
    const Doubles d;
    std::uint32_t absent = 0;
    for (std::size_t k = boxes.size(); k < box_sides::most; ++k) absent |= box_sides::absent << (8 * k);
    for_each_point(
        points, count, words,
        [&](auto x, auto y, auto z) {
            // Bits are summed as doubles: all are different powers of two below 2^31.
            auto sum = hn::Set(d, static_cast<double>(absent));
            double bit = 1.0;
            for (const Extent& box : boxes) {
                const auto side = [&](auto along, std::size_t k) {
                    const double below = bit * static_cast<double>(1U << (2 * k));
                    sum = hn::Add(sum, hn::IfThenElseZero(hn::Lt(along, hn::Set(d, box.low[k])), hn::Set(d, below)));
                    sum = hn::Add(sum,
                                  hn::IfThenElseZero(hn::Gt(along, hn::Set(d, box.high[k])), hn::Set(d, 2.0 * below)));
                };
                side(x, 0);
                side(y, 1);
                side(z, 2);
                bit *= 256.0;
            }
            return to_words(sum);
        },
        [&](const double* point) {
            std::uint32_t word = absent;
            for (std::size_t b = 0; b < boxes.size(); ++b) {
                for (std::size_t k = 0; k < 3; ++k) {
                    word |= (point[k] < boxes[b].low[k] ? 1U : 0U) << (8 * b + 2 * k);
                    word |= (point[k] > boxes[b].high[k] ? 2U : 0U) << (8 * b + 2 * k);
                }
            }
            return word;
        });
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(encode);
HWY_EXPORT(mark);
HWY_EXPORT(select);
HWY_EXPORT(beside);

const std::vector<OccupancyKernels>& occupancy_kernels() {
    static const std::vector<OccupancyKernels> kernels = versions_by_target([](const char* target) {
        return OccupancyKernels{.encode = &HWY_DYNAMIC_DISPATCH(encode),
                                .mark = &HWY_DYNAMIC_DISPATCH(mark),
                                .select = &HWY_DYNAMIC_DISPATCH(select),
                                .beside = &HWY_DYNAMIC_DISPATCH(beside),
                                .target = target};
    });
    return kernels;
}

}  // namespace trocar
#endif
