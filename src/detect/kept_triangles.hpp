// What ohc remembers with `incremental=on`: the three maps of the triangles of bodies that rest or move only in part. A
// triangle is hashed again only when its cells changed. One bit per coarse cell tells where any of them is, so that
// what moves past them costs a look at the bits and no hash look-up.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "detect/occupancy.hpp"
#include "detect/standing_map.hpp"
#include "detect/triangle_cells.hpp"

namespace trocar {

class KeptTriangles {
public:
    /// Empties everything for triangles 0 … triangles-1.
    void start(Index triangles, CellHash hash, int first_bits) {
        map_.start(triangles, hash, first_bits);
        ranges_.resize(static_cast<std::size_t>(triangles));
        places_.assign(static_cast<std::size_t>(triangles), Place::nowhere);
        huge_.clear();
        covered_ = false;
    }

    /// Hashes a triangle where its cells are other than before; a step on mostly stays in the same cells, which are
    /// left alone. Returns the number of cells that were looked at.
    std::int64_t put(const Frame& frame, const TriangleCells& cells, const Primitive& p) {
        const std::size_t t = at(p.triangle);
        const bool stays = !p.cut && places_[t] == Place::cells;
        const CellRange before = ranges_[t];
        if (stays && p.range == before) return 0;
        std::int64_t visited = stays ? map_.remove_if(p.triangle,
                                                      [&p](const std::array<std::int32_t, 3>& cell) {
                                                          return !holds(p.range, cell[0], cell[1], cell[2]);
                                                      })
                                     : take(p.triangle);
        ranges_[t] = p.range;
        places_[t] = p.cut ? Place::pieces : Place::cells;
        const bool placed = cells.for_each_range(frame, p, [&](const CellRange& part) {
            for_each_cell(part, [&](Cell cell) {
                if (stays && holds(before, cell[0], cell[1], cell[2])) return;
                ++visited;
                map_.insert(cell, p.body, p.triangle);
            });
        });
        if (!placed) {
            places_[t] = Place::huge;
            huge_.push_back(p.triangle);
        } else if (covered_ && cover_.contains(p.range)) {
            field_.add(p.range);
        } else {
            covered_ = false;
        }
        return visited;
    }
    /// Forgets a triangle. Returns the number of cells that it left.
    std::int64_t take(Index triangle) {
        const Place place = std::exchange(places_[at(triangle)], Place::nowhere);
        if (place == Place::huge) huge_.erase(std::find(huge_.begin(), huge_.end(), triangle));
        return place == Place::cells || place == Place::pieces ? map_.remove(triangle) : 0;
    }

    /// Triangles with too many pieces, which are in no cell.
    [[nodiscard]] const std::vector<Index>& huge() const { return huge_; }
    [[nodiscard]] bool is_huge(Index triangle) const { return places_[at(triangle)] == Place::huge; }
    /// In pieces: its cells are not a full range.
    [[nodiscard]] bool is_cut(Index triangle) const { return places_[at(triangle)] == Place::pieces; }
    /// In all cells of its box, so that these change only when a corner's cell does.
    [[nodiscard]] bool is_whole(Index triangle) const { return places_[at(triangle)] == Place::cells; }
    [[nodiscard]] const CellRange& range(Index triangle) const { return ranges_[at(triangle)]; }

    /// Makes the bits fit for any_near after triangles were put in.
    void cover(const Lattice& lattice) {
        if (covered_) return;
        covered_ = true;
        bool first = true;
        for (std::size_t t = 0; t < places_.size(); ++t) {
            if (!is_hashed(t)) continue;
            cover_.low = first ? ranges_[t].low : cell_min(cover_.low, ranges_[t].low);
            cover_.high = first ? ranges_[t].high : cell_max(cover_.high, ranges_[t].high);
            first = false;
        }
        any_ = !first;
        if (first) {
            covered_ = false;
            return;
        }
        // Room for what moves a little, so that this is rare.
        const Cell room = (cover_.high - cover_.low) / 8 + 4;
        cover_ = {cover_.low - room, cover_.high + room};
        field_.start(lattice, cover_);
        for (std::size_t t = 0; t < places_.size(); ++t) {
            if (is_hashed(t)) field_.add(ranges_[t]);
        }
    }
    /// False only when no kept triangle is in these cells. Precondition: cover.
    [[nodiscard]] bool any_near(const CellRange& range) const {
        return any_ && range.overlaps(cover_) && field_.any_added(range);
    }

    /// Calls use(cell numbers, body, first entry) for every body with triangles in a cell of this kept triangle, its
    /// own included; returns the number of its cells.
    template <typename Use>
    std::int64_t for_each_neighbour(Index triangle, const Use& use) const {
        return map_.for_each_neighbour(triangle, use);
    }
    /// As above for the cells of a range, which needs not be a kept triangle's. Precondition: cover.
    template <typename Use>
    std::int64_t for_each_in(const CellRange& range, const Use& use) const {
        if (!range.overlaps(cover_)) return 0;
        std::int64_t looks = 0;
        for_each_cell({cell_max(range.low, cover_.low), cell_min(range.high, cover_.high)}, [&](Cell cell) {
            ++looks;
            if (field_.any_added({cell, cell})) map_.for_each_at(cell, use);
        });
        return looks;
    }
    /// Walks the triangles of one body in one cell from the first entry on.
    template <typename Use>
    void for_each_triangle(std::int32_t entry, const Use& use) const {
        map_.for_each_triangle(entry, use);
    }

private:
    enum class Place : std::uint8_t { nowhere, cells, pieces, huge };

    [[nodiscard]] bool is_hashed(std::size_t t) const {
        return places_[t] == Place::cells || places_[t] == Place::pieces;
    }
    static bool holds(const CellRange& range, std::int32_t x, std::int32_t y, std::int32_t z) {
        return range.low[0] <= x && x <= range.high[0] && range.low[1] <= y && y <= range.high[1] &&
               range.low[2] <= z && z <= range.high[2];
    }
    template <typename Use>
    static void for_each_cell(const CellRange& range, const Use& use) {
        for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
            for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
                for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) use(Cell{x, y, z, 0});
            }
        }
    }

    StandingMap map_;
    std::vector<CellRange> ranges_;  ///< per triangle
    std::vector<Place> places_;      ///< per triangle
    std::vector<Index> huge_;
    Occupancy field_;       ///< bits where hashed triangles are, or were
    CellRange cover_{};     ///< holds the cells of all of them
    bool covered_ = false;  ///< field_ is up to date
    bool any_ = false;
};

}  // namespace trocar
