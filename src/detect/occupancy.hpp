// Level O of the cascade: one bit per cell and nothing else, so that the many triangles that lie alone cost a few
// instructions and no hash look-up. Bits say "some body is here" and "a second body is here too"; both may say yes too
// often (the lattice is wrapped into a fixed number of bits), never too rarely.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "detect/lattice.hpp"

namespace trocar {

class Occupancy {
public:
    /// Sizes the bit field for cells in `range` and empties it. Allocates only when a larger field than ever is needed.
    void start(const CellRange& range) {
        // A row of 64 cells along x is one word; numbers wrap at powers of two. At most 2^20 bits, which stay in cache.
        std::uint32_t bits[3];
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t cells = static_cast<std::int64_t>(range.high[axis]) - range.low[axis] + 1;
            bits[axis] =
                static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(cells > 1 ? cells - 1 : 0)));
        }
        bits[0] = std::max(bits[0], 6U);
        while (bits[0] + bits[1] + bits[2] > 20) {
            int longest = 0;
            for (int axis = 1; axis < 3; ++axis) {
                if (bits[axis] > bits[longest]) longest = axis;
            }
            --bits[longest];
        }
        bits[0] = std::max(bits[0], 6U);
        x_mask_ = (1U << (bits[0] - 6)) - 1;
        y_mask_ = (1U << bits[1]) - 1;
        z_mask_ = (1U << bits[2]) - 1;
        y_shift_ = bits[0] - 6;
        z_shift_ = y_shift_ + bits[1];
        const std::size_t words = std::size_t{1} << (z_shift_ + bits[2]);
        once_.assign(words, 0);
        twice_.assign(words, 0);
        own_.resize(words, 0);
        near_.resize(words);
        folded_.resize(words);
    }

    /// Marks cells for the body at hand. Returns the number of words written.
    int mark(const CellRange& range) {
        return for_each_word(range, [this](std::size_t word, std::uint64_t mask) {
            own_[word] |= mask;
            return false;
        });
    }
    /// Ends the marking of a body whose cells all lie in `range`: where others were before, the cell is shared.
    void merge(const CellRange& range) {
        for_each_word(range, [this](std::size_t word, std::uint64_t) {
            twice_[word] |= once_[word] & own_[word];
            once_[word] |= own_[word];
            own_[word] = 0;
            return false;
        });
    }
    /// Prepares near(): afterwards one bit tells whether any cell of a block of `reach` + 1 cells on each axis is
    /// marked. Used on the cells of the bodies merged so far, then on the shared cells.
    void spread_once() { spread(once_); }
    void spread_shared() { spread(twice_); }
    /// True when a marked cell lies in the block whose lowest cell is this one. One look instead of one per cell.
    [[nodiscard]] bool near(Cell low) const { return bit(near_, low); }
    static constexpr std::int32_t reach = 2;

    /// True when one of the bodies before is in one of these cells.
    [[nodiscard]] bool any_once(const CellRange& range) const { return any(once_, range); }
    /// Marks the cells of `range` that a body before holds as shared.
    void share(const CellRange& range) {
        for_each_word(range, [this](std::size_t word, std::uint64_t mask) {
            twice_[word] |= once_[word] & mask;
            return false;
        });
    }
    [[nodiscard]] bool any_shared(const CellRange& range) const { return any(twice_, range); }
    [[nodiscard]] bool shared(Cell cell) const { return bit(twice_, cell); }

private:
    [[nodiscard]] std::size_t row(std::int32_t y, std::int32_t z) const {
        return (static_cast<std::size_t>(static_cast<std::uint32_t>(z) & z_mask_) << z_shift_) |
               (static_cast<std::size_t>(static_cast<std::uint32_t>(y) & y_mask_) << y_shift_);
    }
    [[nodiscard]] bool bit(const std::vector<std::uint64_t>& bits, Cell cell) const {
        const std::uint64_t word = bits[row(cell[1], cell[2]) + word_of(cell[0])];
        return ((word >> (static_cast<std::uint32_t>(cell[0]) & 63U)) & 1U) != 0;
    }

    /// near_(c) = any of bits(c + (0…reach)³), one axis after the other.
    void spread(const std::vector<std::uint64_t>& bits) {
        const std::size_t row_words = std::size_t{x_mask_} + 1;
        for (std::size_t start = 0; start < bits.size(); start += row_words) {
            for (std::size_t w = 0; w < row_words; ++w) {
                const std::uint64_t here = bits[start + w];
                const std::uint64_t next = bits[start + ((w + 1) & x_mask_)];
                near_[start + w] = here | (here >> 1) | (next << 63) | (here >> 2) | (next << 62);
            }
        }
        const std::size_t plane_words = row_words * (std::size_t{y_mask_} + 1);
        const auto fold = [](std::size_t stride, std::size_t count, const std::uint64_t* from, std::uint64_t* to) {
            // `count` groups of `stride` words, wrapped: each takes in the two after it.
            for (std::size_t k = 0; k < count; ++k) {
                const std::uint64_t* const a = from + k * stride;
                const std::uint64_t* const b = from + (k + 1) % count * stride;
                const std::uint64_t* const c = from + (k + 2) % count * stride;
                for (std::size_t w = 0; w < stride; ++w) to[k * stride + w] = a[w] | b[w] | c[w];
            }
        };
        for (std::size_t start = 0; start < bits.size(); start += plane_words) {
            fold(row_words, std::size_t{y_mask_} + 1, &near_[start], &folded_[start]);
        }
        fold(plane_words, std::size_t{z_mask_} + 1, folded_.data(), near_.data());
    }

    [[nodiscard]] std::size_t word_of(std::int32_t x) const { return static_cast<std::uint32_t>(x >> 6) & x_mask_; }

    bool any(const std::vector<std::uint64_t>& bits, const CellRange& range) const {
        bool found = false;
        for_each_word(range, [&](std::size_t word, std::uint64_t mask) {
            found = (bits[word] & mask) != 0;
            return found;
        });
        return found;
    }

    /// Calls use(word, mask) for each word of the wrapped range until it returns true; an axis that is longer than the
    /// field is walked once around. Returns the number of calls.
    template <typename Use>
    int for_each_word(const CellRange& range, const Use& use) const {
        const std::int32_t z_last = last(range, 2, z_mask_);
        const std::int32_t y_last = last(range, 1, y_mask_);
        const std::int32_t x_low = range.low[0];
        const std::int32_t x_high = range.high[0];
        const std::int32_t word_first = x_low >> 6;
        std::int32_t word_last = x_high >> 6;
        const bool around = static_cast<std::int64_t>(word_last) - word_first > static_cast<std::int64_t>(x_mask_) + 1;
        if (around) word_last = word_first + static_cast<std::int32_t>(x_mask_);
        const std::uint64_t first_mask = around ? ~0ULL : ~0ULL << (static_cast<std::uint32_t>(x_low) & 63U);
        const std::uint64_t last_mask = around ? ~0ULL : ~0ULL >> (63U - (static_cast<std::uint32_t>(x_high) & 63U));
        int calls = 0;
        for (std::int32_t z = range.low[2]; z <= z_last; ++z) {
            for (std::int32_t y = range.low[1]; y <= y_last; ++y) {
                const std::size_t start = row(y, z);
                for (std::int32_t w = word_first; w <= word_last; ++w) {
                    std::uint64_t mask = ~0ULL;
                    if (w == word_first) mask &= first_mask;
                    if (w == word_last) mask &= last_mask;
                    ++calls;
                    if (use(start + (static_cast<std::uint32_t>(w) & x_mask_), mask)) return calls;
                }
            }
        }
        return calls;
    }
    static std::int32_t last(const CellRange& range, int axis, std::uint32_t mask) {
        const std::int64_t around = static_cast<std::int64_t>(range.low[axis]) + mask;
        return static_cast<std::int32_t>(std::min<std::int64_t>(range.high[axis], around));
    }

    std::vector<std::uint64_t> once_;   ///< cells of the bodies merged so far
    std::vector<std::uint64_t> twice_;  ///< cells of at least two of them
    std::vector<std::uint64_t> own_;    ///< cells of the body being marked; all zero between bodies
    std::vector<std::uint64_t> near_;
    std::vector<std::uint64_t> folded_;
    std::uint32_t x_mask_ = 0;
    std::uint32_t y_mask_ = 0;
    std::uint32_t z_mask_ = 0;
    std::uint32_t y_shift_ = 0;
    std::uint32_t z_shift_ = 0;
};

}  // namespace trocar
