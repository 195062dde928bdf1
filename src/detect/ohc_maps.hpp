// Third level of ohc's cascade, the thesis' three maps. Triangles in shared cells are hashed. Those of two bodies in a
// live cell become candidates where their boxes overlap. cell_map.hpp stores the maps. No triangle test is made here.
//
// * cell map: a cell with two bodies that may collide is live.
// * object map: the bodies in each live cell.
// * primitive map: their triangles in each live cell.
// * boxes: a pair counts in one cell only, per axis the larger of the two triangles' lowest cell numbers. Triangles in
//   pieces (triangle_cells.hpp) come repeatedly and a sort removes duplicates. Huge ones are paired with every
//   triangle.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "detect/cell_map.hpp"
#include "detect/ohc_bodies.hpp"
#include "detect/ohc_occupancy.hpp"
#include "detect/ohc_work.hpp"

namespace trocar {

/// Pairs whose boxes overlap; one or both boxes include the query distance.
struct OhcCandidates {
    std::vector<TrianglePair> once;      ///< each pair once
    std::vector<TrianglePair> repeated;  ///< pairs of cut or huge triangles, any number of times

    void reserve(std::size_t room) {
        once.reserve(room);
        repeated.reserve(room);
    }
    void clear() {
        once.clear();
        repeated.clear();
    }
    /// Moves all to `once` without duplicates.
    void settle() {
        std::sort(repeated.begin(), repeated.end());
        repeated.erase(std::unique(repeated.begin(), repeated.end()), repeated.end());
        once.insert(once.end(), repeated.begin(), repeated.end());
        repeated.clear();
    }
    /// Adds a pair to `list` when the boxes overlap.
    static void add(const Primitive& p, const Primitive& q, std::vector<TrianglePair>& list) {
        if (boxes_overlap(p, q)) {
            list.push_back({std::min(p.triangle, q.triangle), std::max(p.triangle, q.triangle)});
        }
    }
};

class OhcMaps {
public:
    OhcMaps(const OhcBodies& bodies, const OhcOccupancy& occupancy, OhcWork& work)
        : bodies_(bodies), occupancy_(occupancy), work_(work) {}

    /// Reserves room for `room` triangles; more are allocated on demand.
    void prepare(const OhcSettings& settings, std::size_t room);

    /// Fills the maps with the occupancy's primitives.
    void hash(const Frame& frame);

    static bool any_bodies(Index /*a*/, Index /*b*/) { return true; }

    /// Adds the candidates of bodies with wanted(a, b), except huge triangles. `after_meeting` is called after each two
    /// bodies in one cell; false ends the search.
    template <typename Wanted, typename AfterMeeting>
    void gather(const Wanted& wanted, const AfterMeeting& after_meeting, OhcCandidates& found) const {
        const std::vector<Primitive>& primitives = occupancy_.primitives();
        map_.for_each_meeting(
            [&](const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second) {
                if (!wanted(primitives[at(first.front())].body, primitives[at(second.front())].body)) return true;
                if (!work_.spend(work_.counters.box_tests, static_cast<std::int64_t>(first.size() * second.size()))) {
                    return false;
                }
                meet(cell, first, second, found);
                return after_meeting();
            });
    }

    /// Pairs triangles too large for the lattice with every triangle of every body they may hit.
    template <typename Wanted>
    void gather_huge(const Frame& frame, const Wanted& wanted, OhcCandidates& found) const {
        const TriangleCells& cells = bodies_.cells();
        for (const Index t : occupancy_.huge()) {
            const Primitive p = cells.primitive(frame, t);
            for (const Index body : bodies_.order()) {
                if (!bodies_.filter().may_hit(p.body, body) || !wanted(p.body, body)) continue;
                const Range triangles = bodies_.body(body).triangles;
                if (!work_.spend(work_.counters.box_tests, triangles.count)) return;
                for (Index other = triangles.first; other < triangles.end(); ++other) {
                    OhcCandidates::add(p, cells.primitive(frame, other), found.repeated);
                }
            }
        }
    }

private:
    /// A triangle in the primitive map, one cache line. Boxes overlap when each low of one is at most the other's high.
    /// With highs negated this is one comparison of six numbers with six.
    struct alignas(64) Member {
        std::array<Two, 3> ends;  ///< low x y z, then −high x y z, m
        Cell first;               ///< lowest cell numbers; the fourth entry is the triangle's number

        static Member of(const Primitive& p) {
            return {{Two{p.low[0], p.low[1]}, Two{p.low[2], -p.high[0]}, Two{-p.high[1], -p.high[2]}},
                    Cell{p.range.low[0], p.range.low[1], p.range.low[2], p.triangle}};
        }
        [[nodiscard]] Index triangle() const { return first[3]; }
    };
    struct Question;

    /// Adds the candidates of two bodies in one cell.
    void meet(const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second,
              OhcCandidates& found) const;

    const OhcBodies& bodies_;
    const OhcOccupancy& occupancy_;
    OhcWork& work_;
    CellMap map_;
    std::vector<Member> members_;  ///< per primitive
    bool any_cut_ = false;
};

}  // namespace trocar
