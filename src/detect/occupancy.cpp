#include "detect/occupancy.hpp"

#include <array>
#include <bit>
#include <cmath>

namespace trocar {
namespace {

constexpr std::uint32_t field_bits = 1U << 20U;  ///< 128 KiB, which fit the second-level cache
constexpr std::int64_t least_border = 2;  ///< coarse cells around the range, so that vertices outside stay unmarked

}  // namespace

void Occupancy::prepare(Index vertices) {
    codes_.assign(static_cast<std::size_t>(vertices), 0);
    for (Field* const field : {&own_, &once_, &twice_, &near_, &folded_}) {
        field->reserve(static_cast<std::size_t>(field_bits) / 32);
    }
}

/// Largest difference in coarse cells of two points that are at most `distance` apart along an axis.
int Occupancy::cells_within(double distance, int shift) const {
    if (distance == 0.0) return 0;
    // The error before rounding is far below 0.01, except for numbers this large.
    constexpr double large = 0x1p40;
    const double cells = std::floor(distance * window_.inverse + 0.01) + 1.0;
    for (const double base : window_.base) {
        if (!(std::abs(base) < large)) return most_spread;
    }
    return static_cast<int>(std::min<double>(std::ceil(std::ldexp(cells, -shift)), most_spread));
}

void Occupancy::start(const Lattice& lattice, const CellRange& range, double around) {
    range_ = range;
    window_.inverse = lattice.inverse();
    for (std::size_t axis = 0; axis < 3; ++axis) window_.base[axis] = lattice.base(static_cast<int>(axis));
    std::int64_t border = least_border;
    std::array<std::int64_t, 3> count{};
    for (window_.shift = 0;; ++window_.shift) {
        bool fits = true;
        border = least_border + cells_within(around, window_.shift);
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t cells = static_cast<std::int64_t>(range.high[axis]) - range.low[axis];
            count[static_cast<std::size_t>(axis)] = (cells >> window_.shift) + 1 + 2 * border;
            fits = fits && count[static_cast<std::size_t>(axis)] <= cell_code::most + 1;
        }
        count[0] = (count[0] + 31) / 32 * 32;
        if (fits && count[0] * count[1] * count[2] <= field_bits) break;
    }
    constexpr double limit = Lattice::limit;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<int>(axis);
        const std::int64_t origin = range.low[k] - (border << window_.shift);
        const std::int64_t end = range.high[k] + (border << window_.shift);
        window_.origin[axis] = static_cast<double>(origin);
        window_.first[axis] = std::max(static_cast<double>(origin), -limit);
        window_.last[axis] = std::min(static_cast<double>(end), limit);
        origin_[k] = static_cast<std::int32_t>(origin);
        first_[k] = static_cast<std::int32_t>(window_.first[axis]);
        last_[k] = static_cast<std::int32_t>(window_.last[axis]);
    }
    rows_ = static_cast<std::uint32_t>(count[1]);
    planes_ = static_cast<std::uint32_t>(count[2]);
    window_.row = static_cast<std::uint32_t>(count[0]);
    window_.plane = window_.row * rows_;
    row_words_ = window_.row / 32;
    const std::size_t words = std::size_t{row_words_} * rows_ * planes_;
    once_.assign(words, 0);
    twice_.assign(words, 0);
    own_.assign(words, 0);
    near_.resize(words);
    folded_.resize(words);
}

void Occupancy::encode(const Frame& frame, Range vertices) {
    kernels_.encode(frame.position.data() + 3 * static_cast<std::size_t>(vertices.first), vertices.count, window_,
                    codes_.data() + vertices.first);
}

void Occupancy::add_vertices(Range vertices) {
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        add_place(cell_code::place(codes_[static_cast<std::size_t>(v)], window_));
    }
}

std::int64_t Occupancy::add(const CellRange& range) {
    if (!range.overlaps(range_)) return 0;
    std::int64_t written = 0;
    for_each_word(range, [&](std::size_t word, std::uint32_t bits) {
        own_[word] |= bits;
        ++written;
        return false;
    });
    return written;
}

bool Occupancy::share(const CellRange& range) {
    if (!range.overlaps(range_)) return false;
    std::uint32_t found = 0;
    for_each_word(range, [&](std::size_t word, std::uint32_t bits) {
        const std::uint32_t shared = once_[word] & bits;
        twice_[word] |= shared;
        found |= shared;
        return false;
    });
    return found != 0;
}

bool Occupancy::any_shared(const CellRange& range) const {
    return range.overlaps(range_) &&
           for_each_word(range, [this](std::size_t word, std::uint32_t bits) { return (twice_[word] & bits) != 0; });
}

/// near_ = field dilated by `cells` >= 1 along each axis, within a block of words.
void Occupancy::spread(const Field& field, const Block& block, int cells) {
    spread_once(field, block);
    for (int more = 1; more < cells; ++more) spread_once(near_, block);
}

/// Dilates by one cell, one axis after the other; `field` may be near_ itself.
void Occupancy::spread_once(const Field& field, const Block& block) {
    const std::size_t plane_words = std::size_t{row_words_} * rows_;
    const auto for_each_row = [&](const auto& use) {
        for (std::uint32_t z = block.low[2]; z <= block.high[2]; ++z) {
            for (std::uint32_t y = block.low[1]; y <= block.high[1]; ++y) {
                const std::size_t row = first_word(y, z);
                use(row + block.low[0], row + block.high[0] + 1, y, z);
            }
        }
    };
    for_each_row([&](std::size_t begin, std::size_t end, std::uint32_t /*y*/, std::uint32_t /*z*/) {
        std::uint32_t before = 0;
        for (std::size_t w = begin; w < end; ++w) {
            const std::uint32_t here = field[w];
            const std::uint32_t after = w + 1 < end ? field[w + 1] : 0;
            near_[w] = here | (here << 1U) | (here >> 1U) | (before >> 31U) | (after << 31U);
            before = here;
        }
    });
    // At the faces of the block a row is its own neighbour.
    for_each_row([&](std::size_t begin, std::size_t end, std::uint32_t y, std::uint32_t /*z*/) {
        const std::size_t below = y > block.low[1] ? row_words_ : 0;
        const std::size_t above = y < block.high[1] ? row_words_ : 0;
        for (std::size_t w = begin; w < end; ++w) folded_[w] = near_[w] | near_[w - below] | near_[w + above];
    });
    for_each_row([&](std::size_t begin, std::size_t end, std::uint32_t /*y*/, std::uint32_t z) {
        const std::size_t below = z > block.low[2] ? plane_words : 0;
        const std::size_t above = z < block.high[2] ? plane_words : 0;
        for (std::size_t w = begin; w < end; ++w) near_[w] = folded_[w] | folded_[w - below] | folded_[w + above];
    });
}

/// The words that hold `range`, dilated by one cell.
Occupancy::Block Occupancy::block_around(const CellRange& range) const {
    const std::uint32_t count[3] = {window_.row, rows_, planes_};
    Block block{};
    const Place lowest = coarse(range.low);
    const Place highest = coarse(range.high);
    for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t low = lowest[axis];
        const std::uint32_t high = highest[axis];
        block.low[axis] = low > 0 ? low - 1 : 0;
        block.high[axis] = std::min(high + 1, count[axis] - 1);
    }
    block.low[0] /= 32;
    block.high[0] /= 32;
    return block;
}

/// Skips cells outside the window's range: they hold everything outside, and nothing can be shared there.
void Occupancy::merge(const CellRange& range, int cells) {
    const Block block = block_around(range);
    if (cells > 0) {
        spread(own_, block, cells);
    } else {
        near_.swap(own_);
    }
    const CellRange wider{range.low - (1 << window_.shift), range.high + (1 << window_.shift)};
    if (wider.overlaps(range_)) {
        for_each_word({cell_max(wider.low, range_.low), cell_min(wider.high, range_.high)},
                      [this](std::size_t word, std::uint32_t inside) {
                          const std::uint32_t bits = near_[word] & inside;
                          twice_[word] |= once_[word] & bits;
                          once_[word] |= bits;
                          return false;
                      });
    }
    if (cells == 0) near_.swap(own_);
    for (std::uint32_t z = block.low[2]; z <= block.high[2]; ++z) {
        for (std::uint32_t y = block.low[1]; y <= block.high[1]; ++y) {
            const std::size_t row = first_word(y, z);
            std::fill(own_.begin() + static_cast<std::ptrdiff_t>(row + block.low[0]),
                      own_.begin() + static_cast<std::ptrdiff_t>(row + block.high[0] + 1), 0U);
        }
    }
}

CellRange Occupancy::shared_range() const {
    std::int64_t low[3] = {window_.row, rows_, planes_};
    std::int64_t high[3] = {-1, -1, -1};
    for (std::uint32_t z = 0; z < planes_; ++z) {
        for (std::uint32_t y = 0; y < rows_; ++y) {
            const std::size_t row = first_word(y, z);
            for (std::uint32_t w = 0; w < row_words_; ++w) {
                const std::uint32_t bits = twice_[row + w];
                if (bits == 0) continue;
                const std::int64_t ends[2][3] = {{32 * std::int64_t{w} + std::countr_zero(bits), y, z},
                                                 {32 * std::int64_t{w} + 31 - std::countl_zero(bits), y, z}};
                for (int axis = 0; axis < 3; ++axis) {
                    low[axis] = std::min(low[axis], ends[0][axis]);
                    high[axis] = std::max(high[axis], ends[1][axis]);
                }
            }
        }
    }
    if (high[0] < 0) return {Cell{1, 1, 1, 0}, Cell{0, 0, 0, 0}};
    CellRange result{};
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t begin = std::int64_t{origin_[axis]} + (low[axis] << window_.shift);
        const std::int64_t end = std::int64_t{origin_[axis]} + ((high[axis] + 1) << window_.shift) - 1;
        result.low[axis] = static_cast<std::int32_t>(std::max<std::int64_t>(begin, range_.low[axis]));
        result.high[axis] = static_cast<std::int32_t>(std::min<std::int64_t>(end, range_.high[axis]));
    }
    return result;
}

void Occupancy::mark(Range vertices) {
    kernels_.mark(near_.data(), vertices.count, window_, codes_.data() + vertices.first);
}

void Occupancy::collect_if(const Index* corners, Range triangles, std::uint32_t mark, std::vector<Index>& found) const {
    constexpr Index chunk = 1024;
    std::array<Index, chunk> list;
    for (Index begin = triangles.first; begin < triangles.end(); begin += chunk) {
        const Index count =
            kernels_.select(codes_.data(), corners, begin, std::min(chunk, triangles.end() - begin), mark, list.data());
        found.insert(found.end(), list.begin(), list.begin() + count);
    }
}

}  // namespace trocar
