// Level O of ohc's cascade: which triangles are near a place where two bodies may meet. It runs on every triangle in a
// few instructions each, without hashing and without computing the triangle's cells.
//
// * codes: every vertex gets its coarse cell, three small numbers in one word (occupancy_kernels.hpp).
// * fields: one bit per coarse cell and group of bodies marks that a vertex is there. Dilated by one cell, a field
//   covers every triangle whose corners are at most one cell apart. Other triangles are entered one by one. A margin
//   around the triangles adds the cells that it can cover.
// * shared: the bits that two groups have in common, dilated likewise, are read at the vertices.
// * marks: a triangle is ruled out when its first corner has no such bit and its corners are at most one cell apart.
//   This costs three loads and a few subtractions, without a branch.
//
// Bodies of a group share one field. They may collide with the same others and not with each other (parts of one
// instrument, all rigid bodies). No two bodies or groups are compared.
//
// The bits are conservative: coarse cells and dilation may set bits in excess and never miss one. A cell number is
// monotone in a coordinate, and so are coarse and clamped numbers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "detect/lattice.hpp"
#include "detect/occupancy_kernels.hpp"
#include "scene/world.hpp"

namespace trocar {

class Occupancy {
public:
    /// Reserves the codes of vertices and the largest fields, so that no tick allocates.
    void prepare(Index vertices);

    /// Empties the fields for cells in `range`, where two groups can meet. `around`: largest margin around the
    /// triangles of a group, m.
    void start(const Lattice& lattice, const CellRange& range, double around = 0.0);
    /// Cells by which vertices must be dilated to cover their triangles with margin `around` (m). A result above
    /// most_spread means that vertices do not suffice.
    [[nodiscard]] int spread_for(double around) const { return 1 + cells_within(around, window_.shift); }
    static constexpr int most_spread = 4;
    /// Computes the codes of vertices.
    void encode(const Frame& frame, Range vertices);

    /// Enters vertices into the current group's field.
    void add_vertices(Range vertices);
    /// Enters a range of cells into the current group's field. Returns the number of words written.
    std::int64_t add(const CellRange& range);
    /// Ends the field of a group whose cells all lie in `range`. Dilates it by `cells`, which is 0 where no vertices
    /// were entered.
    void merge(const CellRange& range, int cells);
    /// Replaces add and merge for the last group: marks cells of `range` that an earlier group holds as shared. Returns
    /// whether there are any.
    bool share(const CellRange& range);

    /// Prepares `mark` for vertices within `cells` of a cell of any merged group; of two of them.
    void search_for_any(int cells) { spread(once_, everything(), cells); }
    void search_for_shared(int cells) { spread(twice_, everything(), cells); }
    /// Marks the vertices near such cells.
    void mark(Range vertices);
    /// Appends the triangles that are marked or have corners more than one cell apart. `corners`: the topology's vertex
    /// numbers, three per triangle.
    void collect(const Index* corners, Range triangles, std::vector<Index>& found) const {
        collect_if(corners, triangles, cell_code::mark, found);
    }
    /// Appends the triangles with corners more than one cell apart.
    void collect_wide(const Index* corners, Range triangles, std::vector<Index>& found) const {
        collect_if(corners, triangles, 0U, found);
    }

    /// The lattice cells that hold all shared ones; empty (low > high) if there are none.
    [[nodiscard]] CellRange shared_range() const;
    [[nodiscard]] bool any_shared(const CellRange& range) const;
    /// Calls use(cell) for every lattice cell of `range` that is shared.
    template <typename Use>
    void for_each_shared(const CellRange& range, const Use& use) const {
        if (!range.overlaps(range_)) return;
        const CellRange inside{cell_max(range.low, range_.low), cell_min(range.high, range_.high)};
        for (std::int32_t z = inside.low[2]; z <= inside.high[2]; ++z) {
            for (std::int32_t y = inside.low[1]; y <= inside.high[1]; ++y) {
                const std::uint32_t* const row = &twice_[first_word(coarse(y, 1), coarse(z, 2))];
                for (std::int32_t x = inside.low[0]; x <= inside.high[0]; ++x) {
                    const std::uint32_t place = coarse(x, 0);
                    if (((row[place / 32] >> (place % 32)) & 1U) != 0) use(Cell{x, y, z, 0});
                }
            }
        }
    }

private:
    using Field = std::vector<std::uint32_t>;

    void collect_if(const Index* corners, Range triangles, std::uint32_t mark, std::vector<Index>& found) const;
    struct Block {
        std::uint32_t low[3];  ///< word along x, row, plane; inclusive
        std::uint32_t high[3];
    };
    [[nodiscard]] Block block_around(const CellRange& range) const;
    [[nodiscard]] Block everything() const { return {{0, 0, 0}, {row_words_ - 1, rows_ - 1, planes_ - 1}}; }
    void spread(const Field& field, const Block& block, int cells);
    void spread_once(const Field& field, const Block& block);
    [[nodiscard]] int cells_within(double distance, int shift) const;
    /// Coarse cell along an axis of a lattice cell inside the window.
    [[nodiscard]] std::uint32_t coarse(std::int32_t cell, int axis) const {
        return (static_cast<std::uint32_t>(cell) - static_cast<std::uint32_t>(origin_[axis])) >> window_.shift;
    }
    using Place = std::uint32_t __attribute__((vector_size(16)));
    /// Coarse cell; coordinates outside the window map to the outermost one.
    [[nodiscard]] Place coarse(Cell cell) const {
        const Cell inside = cell_min(cell_max(cell, first_), last_);
        // Unsigned: the window may span 2^31 cells and a little.
        return (reinterpret_cast<Place>(inside) - reinterpret_cast<Place>(origin_)) >>
               static_cast<std::uint32_t>(window_.shift);
    }
    [[nodiscard]] std::size_t first_word(std::uint32_t y, std::uint32_t z) const {
        return std::size_t{row_words_} * (std::size_t{rows_} * z + y);
    }
    /// Calls use(word, bits) for every word that holds cells of `range` until it returns true; returns whether it did.
    template <typename Use>
    bool for_each_word(const CellRange& range, const Use& use) const {
        const Place low = coarse(range.low);
        const Place high = coarse(range.high);
        const std::uint32_t x_low = low[0];
        const std::uint32_t x_high = high[0];
        for (std::uint32_t z = low[2]; z <= high[2]; ++z) {
            for (std::uint32_t y = low[1]; y <= high[1]; ++y) {
                const std::size_t row = first_word(y, z);
                for (std::uint32_t w = x_low / 32; w <= x_high / 32; ++w) {
                    std::uint32_t bits = ~0U;
                    if (w == x_low / 32) bits &= ~0U << (x_low % 32);
                    if (w == x_high / 32) bits &= ~0U >> (31 - x_high % 32);
                    if (use(row + w, bits)) return true;
                }
            }
        }
        return false;
    }
    void add_place(std::uint32_t place) { own_[place / 32] |= 1U << (place % 32); }

    OccupancyKernels kernels_ = occupancy_kernels().front();
    CellWindow window_;
    CellRange range_{};  ///< lattice cells where groups can meet; two coarse cells or more inside the window
    Cell first_{};       ///< the window's numbers as integers
    Cell last_{};
    Cell origin_{};
    std::uint32_t rows_ = 1;  ///< per plane
    std::uint32_t planes_ = 1;
    std::uint32_t row_words_ = 1;
    std::vector<std::uint32_t> codes_;  ///< per vertex
    Field own_;                         ///< current group; all zero between groups
    Field once_;                        ///< groups merged so far
    Field twice_;                       ///< at least two of them
    Field near_;                        ///< result of `spread`
    Field folded_;
};

}  // namespace trocar
