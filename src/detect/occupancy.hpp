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
    [[nodiscard]] bool shared(Cell cell) const {
        return ((twice_[row(cell[1], cell[2]) + word_of(cell[0])] >> (static_cast<std::uint32_t>(cell[0]) & 63U)) &
                1U) != 0;
    }

private:
    [[nodiscard]] std::size_t row(std::int32_t y, std::int32_t z) const {
        return (static_cast<std::size_t>(static_cast<std::uint32_t>(z) & z_mask_) << z_shift_) |
               (static_cast<std::size_t>(static_cast<std::uint32_t>(y) & y_mask_) << y_shift_);
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
    std::uint32_t x_mask_ = 0;
    std::uint32_t y_mask_ = 0;
    std::uint32_t z_mask_ = 0;
    std::uint32_t y_shift_ = 0;
    std::uint32_t z_shift_ = 0;
};

}  // namespace trocar
