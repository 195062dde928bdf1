// The three maps of ohc kept from tick to tick (option `incremental`): a triangle is hashed again only when its cells
// changed. Cells, the bodies in them and their triangles are linked lists in pools, so that one triangle can leave
// without the others moving, and nothing is allocated once the pools have grown.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "detect/cell_map.hpp"
#include "detect/lattice.hpp"
#include "geometry/types.hpp"

namespace trocar {

class StandingMap {
public:
    /// Empties the maps for triangles 0 … triangles-1.
    void start(Index triangles, CellHash hash, int first_bits) {
        hash_ = hash;
        first_of_triangle_.assign(static_cast<std::size_t>(triangles), none);
        cells_.clear();
        objects_.clear();
        entries_.clear();
        free_cell_ = free_object_ = free_entry_ = none;
        used_ = 0;
        is_used_.clear();
        resize(first_bits);
    }

    /// Triangle `triangle` of `body` lies in `cell`, too.
    void insert(Cell where, Index body, Index triangle) {
        const std::int32_t cell = find_or_make(where);
        const std::int32_t object = object_in(cell, body);
        const std::int32_t number = take(entries_, free_entry_);
        Object& owner = objects_[at(object)];
        std::int32_t& first = first_of_triangle_[at(triangle)];
        entries_[at(number)] = {
            .object = object, .triangle = triangle, .next = owner.first, .previous = none, .next_of_triangle = first};
        if (owner.first != none) entries_[at(owner.first)].previous = number;
        owner.first = number;
        first = number;
    }

    /// The triangle leaves all of its cells; cells and bodies without triangles leave the maps. Returns their number.
    std::int64_t remove(Index triangle) {
        return remove_if(triangle, [](const std::array<std::int32_t, 3>& /*cell*/) { return true; });
    }
    /// The triangle leaves those of its cells that `leaves` tells of. Returns the number of cells it was in.
    template <typename Leaves>
    std::int64_t remove_if(Index triangle, const Leaves& leaves) {
        std::int64_t count = 0;
        std::int32_t* link = &first_of_triangle_[at(triangle)];
        for (; *link != none; ++count) {
            const std::int32_t number = *link;
            Entry& entry = entries_[at(number)];
            Object& object = objects_[at(entry.object)];
            if (!leaves(cells_[at(object.cell)].key)) {
                link = &entry.next_of_triangle;
                continue;
            }
            *link = entry.next_of_triangle;
            (entry.previous == none ? object.first : entries_[at(entry.previous)].next) = entry.next;
            if (entry.next != none) entries_[at(entry.next)].previous = entry.previous;
            if (object.first == none) drop_object(entry.object);
            entry.next = free_entry_;
            free_entry_ = number;
        }
        return count;
    }

    /// Calls use(cell numbers, body, first entry) for every body with triangles in a cell of this triangle, its own
    /// included; returns the number of its cells.
    template <typename Use>
    std::int64_t for_each_neighbour(Index triangle, const Use& use) const {
        std::int64_t count = 0;
        for (std::int32_t n = first_of_triangle_[at(triangle)]; n != none; n = entries_[at(n)].next_of_triangle) {
            const CellRecord& cell = cells_[at(objects_[at(entries_[at(n)].object)].cell)];
            ++count;
            for (std::int32_t o = cell.first_object; o != none; o = objects_[at(o)].next) {
                use(cell.key, objects_[at(o)].body, objects_[at(o)].first);
            }
        }
        return count;
    }
    /// As above for a cell of one's own choice.
    template <typename Use>
    void for_each_at(Cell where, const Use& use) const {
        const std::array<std::int32_t, 3> key{where[0], where[1], where[2]};
        const std::int32_t number = find(key);
        if (number == none) return;
        for (std::int32_t o = cells_[at(number)].first_object; o != none; o = objects_[at(o)].next) {
            use(key, objects_[at(o)].body, objects_[at(o)].first);
        }
    }
    /// Walks the triangles of one body in one cell from the first entry on.
    template <typename Use>
    void for_each_triangle(std::int32_t entry, const Use& use) const {
        for (; entry != none; entry = entries_[at(entry)].next) use(entries_[at(entry)].triangle);
    }

private:
    static constexpr std::int32_t none = -1;
    struct CellRecord {
        std::array<std::int32_t, 3> key{};
        std::int32_t first_object = none;  ///< of a free record: the next free one
    };
    struct Object {
        Index body = -1;
        std::int32_t cell = none;
        std::int32_t next = none;
        std::int32_t first = none;
    };
    struct Entry {
        std::int32_t object = none;
        Index triangle = -1;
        std::int32_t next = none;
        std::int32_t previous = none;
        std::int32_t next_of_triangle = none;
    };

    static std::size_t at(std::int32_t number) { return static_cast<std::size_t>(number); }
    static std::int32_t& next_free(CellRecord& record) { return record.first_object; }
    static std::int32_t& next_free(Object& object) { return object.next; }
    static std::int32_t& next_free(Entry& entry) { return entry.next; }

    template <typename Record>
    static std::int32_t take(std::vector<Record>& pool, std::int32_t& free) {
        if (free == none) {
            pool.emplace_back();
            return static_cast<std::int32_t>(pool.size()) - 1;
        }
        const std::int32_t number = free;
        free = next_free(pool[at(number)]);
        return number;
    }

    [[nodiscard]] std::size_t home(const std::array<std::int32_t, 3>& key) const {
        return cell_hash(key, hash_, bits_);
    }
    [[nodiscard]] std::size_t wrap() const { return table_.size() - 1; }

    void resize(int bits) {
        bits_ = bits;
        table_.assign(std::size_t{1} << bits, none);
        for (std::size_t c = 0; c < cells_.size(); ++c) {
            if (is_used_[c] != 0) place(static_cast<std::int32_t>(c));
        }
    }
    void place(std::int32_t cell) {
        std::size_t slot = home(cells_[at(cell)].key);
        while (table_[slot] != none) slot = (slot + 1) & wrap();
        table_[slot] = cell;
    }

    /// Written out: comparing the arrays is a call of memcmp.
    static bool same(const std::array<std::int32_t, 3>& a, const std::array<std::int32_t, 3>& b) {
        return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
    }
    [[nodiscard]] std::int32_t find(const std::array<std::int32_t, 3>& key) const {
        for (std::size_t slot = home(key); table_[slot] != none; slot = (slot + 1) & wrap()) {
            if (same(cells_[at(table_[slot])].key, key)) return table_[slot];
        }
        return none;
    }

    std::int32_t find_or_make(Cell where) {
        const std::array<std::int32_t, 3> key{where[0], where[1], where[2]};
        if (const std::int32_t known = find(key); known != none) return known;
        if (2 * (++used_) > table_.size()) resize(bits_ + 1);
        const std::int32_t cell = take(cells_, free_cell_);
        is_used_.resize(cells_.size(), 0);
        is_used_[at(cell)] = 1;
        cells_[at(cell)] = {.key = key, .first_object = none};
        place(cell);
        return cell;
    }

    std::int32_t object_in(std::int32_t cell, Index body) {
        for (std::int32_t o = cells_[at(cell)].first_object; o != none; o = objects_[at(o)].next) {
            if (objects_[at(o)].body == body) return o;
        }
        const std::int32_t object = take(objects_, free_object_);
        objects_[at(object)] = {.body = body, .cell = cell, .next = cells_[at(cell)].first_object, .first = none};
        cells_[at(cell)].first_object = object;
        return object;
    }

    void drop_object(std::int32_t number) {
        const std::int32_t cell = objects_[at(number)].cell;
        std::int32_t* link = &cells_[at(cell)].first_object;
        while (*link != number) link = &objects_[at(*link)].next;
        *link = objects_[at(number)].next;
        objects_[at(number)].next = free_object_;
        free_object_ = number;
        if (cells_[at(cell)].first_object == none) drop_cell(cell);
    }

    /// Takes the cell out of the table and closes the gap in its run (Knuth 6.4, algorithm R).
    void drop_cell(std::int32_t cell) {
        std::size_t gap = home(cells_[at(cell)].key);
        while (table_[gap] != cell) gap = (gap + 1) & wrap();
        for (std::size_t slot = (gap + 1) & wrap(); table_[slot] != none; slot = (slot + 1) & wrap()) {
            const std::size_t wanted = home(cells_[at(table_[slot])].key);
            if (((slot - wanted) & wrap()) < ((slot - gap) & wrap())) continue;  // is found without the gap
            table_[gap] = table_[slot];
            gap = slot;
        }
        table_[gap] = none;
        --used_;
        is_used_[at(cell)] = 0;
        cells_[at(cell)].first_object = free_cell_;
        free_cell_ = cell;
    }

    CellHash hash_ = CellHash::fibonacci;
    int bits_ = 0;
    std::size_t used_ = 0;
    std::vector<std::int32_t> table_;    ///< hash slot -> cell; -1 = empty
    std::vector<CellRecord> cells_;      ///< cell map
    std::vector<std::uint8_t> is_used_;  ///< per cell
    std::vector<Object> objects_;        ///< object map
    std::vector<Entry> entries_;         ///< primitive map
    std::vector<std::int32_t> first_of_triangle_;
    std::int32_t free_cell_ = none;
    std::int32_t free_object_ = none;
    std::int32_t free_entry_ = none;
};

}  // namespace trocar
