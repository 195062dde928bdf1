// Levels H and C of the cascade: the thesis' three maps (§4.2). Cell map: cells with at least two bodies that may
// collide. Object map: these bodies. Primitive map: their triangles. Only triangles that the occupancy bits did not
// rule out are entered.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/collision_filter.hpp"
#include "detect/lattice.hpp"
#include "geometry/random.hpp"
#include "geometry/types.hpp"

namespace trocar {

enum class CellHash : std::uint8_t { fibonacci, teschner };

/// Slot of a cell in a table of 2^bits slots.
inline std::uint32_t cell_hash(const std::array<std::int32_t, 3>& cell, CellHash hash, int bits) {
    const std::uint64_t x = static_cast<std::uint32_t>(cell[0]);
    const std::uint64_t y = static_cast<std::uint32_t>(cell[1]);
    const std::uint64_t z = static_cast<std::uint32_t>(cell[2]);
    if (hash == CellHash::teschner) {
        // Teschner et al. 2003, table size a power of two.
        return static_cast<std::uint32_t>(((73856093 * x) ^ (19349663 * y) ^ (83492791 * z)) &
                                          ((std::uint64_t{1} << bits) - 1));
    }
    constexpr std::uint64_t low = (1U << 21) - 1;
    const std::uint64_t key = (x & low) | ((y & low) << 21) | ((z & low) << 42);
    return static_cast<std::uint32_t>(fibonacci_slot(key, bits));
}

class CellMap {
public:
    void prepare(const CollisionFilter& filter, CellHash hash, int first_bits) {
        filter_ = filter;
        hash_ = hash;
        bits_ = 0;
        grow(first_bits);
    }

    /// Reserves room for this many entries, so that a crowded tick allocates nothing. The table of cells grows only on
    /// demand, since a large one misses the cache.
    void reserve(std::size_t entries) {
        entries_.reserve(entries);
        used_.reserve(entries);
        objects_.reserve(entries);
        primitives_.reserve(entries);
    }

    /// Empties the maps for a tick with at most `entries` entries. A stamp per slot replaces clearing. The table grows
    /// here, outside the loops, to a load of at most one half.
    void start(std::size_t entries) {
        int bits = bits_;
        while ((std::size_t{1} << bits) < 2 * entries) ++bits;
        if (bits > bits_) grow(bits);
        if (++stamp_ == 0) {
            for (Slot& slot : slots_) slot.stamp = 0;
            stamp_ = 1;
        }
        used_.clear();
        entries_.clear();
        objects_.clear();
    }

    /// Fills cell and object maps: primitive `primitive` of `body` lies in `cell`.
    void add(Cell cell, Index body, Index primitive) {
        const std::size_t number = object(find_or_insert(cell), body);
        ++objects_[number].count;
        entries_.push_back({static_cast<std::int32_t>(number), primitive});
    }

    /// Fills the primitive map: each (cell, body) owns one run of primitive numbers.
    void cascade() {
        Index total = 0;
        for (Object& object : objects_) {
            object.first = total;
            total += object.count;
            object.count = 0;
        }
        primitives_.resize(static_cast<std::size_t>(total));
        for (const Entry& entry : entries_) {
            Object& object = objects_[static_cast<std::size_t>(entry.object)];
            primitives_[static_cast<std::size_t>(object.first) + static_cast<std::size_t>(object.count++)] =
                entry.primitive;
        }
    }

    /// Calls use(cell, primitives of the lower body, primitives of the other) for every two bodies that share a live
    /// cell and may collide. Cells come in order of first insertion. Ends when `use` returns false.
    template <typename Use>
    void for_each_meeting(const Use& use) const {
        for (const std::uint32_t number : used_) {
            const Slot& slot = slots_[number];
            if (!slot.live) continue;
            for (std::int32_t a = slot.first_object; a >= 0; a = objects_[static_cast<std::size_t>(a)].next) {
                for (std::int32_t b = objects_[static_cast<std::size_t>(a)].next; b >= 0;
                     b = objects_[static_cast<std::size_t>(b)].next) {
                    const Object* low = &objects_[static_cast<std::size_t>(a)];
                    const Object* high = &objects_[static_cast<std::size_t>(b)];
                    if (low->body > high->body) std::swap(low, high);
                    if (!filter_.may_hit(low->body, high->body)) continue;
                    if (!use(slot.cell, run(*low), run(*high))) return;
                }
            }
        }
    }

private:
    struct Slot {
        std::array<std::int32_t, 3> cell{};  ///< the full key: equal hashes cost time and give no false pair
        std::uint32_t stamp = 0;             ///< the tick in which the slot was last used
        std::int32_t first_object = -1;
        bool live = false;  ///< two bodies that may collide are here
    };
    struct Object {
        Index body = -1;
        std::int32_t next = -1;
        Index first = 0;
        Index count = 0;
    };
    struct Entry {
        std::int32_t object = -1;
        Index primitive = -1;
    };

    void grow(int bits) {
        bits_ = bits;
        slots_.assign(std::size_t{1} << bits, Slot{});
        stamp_ = 0;
    }

    [[nodiscard]] std::uint32_t home(const std::array<std::int32_t, 3>& cell) const {
        return cell_hash(cell, hash_, bits_);
    }

    /// Explicit, since comparing the arrays compiles to a call of memcmp.
    static bool same(const std::array<std::int32_t, 3>& a, const std::array<std::int32_t, 3>& b) {
        return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
    }

    std::uint32_t find_or_insert(Cell cell) {
        const std::array<std::int32_t, 3> key{cell[0], cell[1], cell[2]};
        const auto wrap = static_cast<std::uint32_t>(slots_.size() - 1);
        std::uint32_t number = home(key);
        while (slots_[number].stamp == stamp_ && !same(slots_[number].cell, key)) number = (number + 1) & wrap;
        Slot& slot = slots_[number];
        if (slot.stamp != stamp_) {
            slot = {.cell = key, .stamp = stamp_, .first_object = -1, .live = false};
            used_.push_back(number);
        }
        return number;
    }

    /// Object map entry of this body in this cell, inserted on first use. Sets `live` once two bodies may collide.
    std::size_t object(std::uint32_t slot, Index body) {
        Slot& cell = slots_[slot];
        bool meets = false;
        for (std::int32_t o = cell.first_object; o >= 0; o = objects_[static_cast<std::size_t>(o)].next) {
            const Object& object = objects_[static_cast<std::size_t>(o)];
            if (object.body == body) return static_cast<std::size_t>(o);
            meets = meets || filter_.may_hit(object.body, body);
        }
        objects_.push_back({.body = body, .next = cell.first_object});
        cell.first_object = static_cast<std::int32_t>(objects_.size()) - 1;
        cell.live = cell.live || meets;
        return objects_.size() - 1;
    }

    [[nodiscard]] std::span<const Index> run(const Object& object) const {
        return {primitives_.data() + object.first, static_cast<std::size_t>(object.count)};
    }

    CollisionFilter filter_;
    CellHash hash_ = CellHash::fibonacci;
    int bits_ = 0;
    std::uint32_t stamp_ = 0;
    std::vector<Slot> slots_;
    std::vector<std::uint32_t> used_;  ///< slots of this tick in order of insertion
    std::vector<Entry> entries_;
    std::vector<Object> objects_;
    std::vector<Index> primitives_;
};

}  // namespace trocar
