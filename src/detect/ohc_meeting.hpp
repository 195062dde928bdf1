// Regions where bodies can meet: intersections of a body's box with the boxes of those it may hit. A triangle outside
// all of them is in no pair. The test takes six comparisons and is far sharper than cells.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "detect/occupancy_kernels.hpp"
#include "detect/triangle_cells.hpp"
#include "detect/vertex_kernels.hpp"
#include "geometry/types.hpp"

namespace trocar {

class MeetingBoxes {
public:
    void prepare(std::size_t bodies) {
        parts_.assign(bodies, Parts{});
        sorted_.reserve(bodies);
    }

    /// Computes the regions of `bodies`. `boxes` (m) holds those of all bodies and covers every box queried later.
    /// may_hit(a, b) selects the pairs. A sweep along x limits the pairs examined.
    template <typename MayHit>
    void find(std::span<const Index> bodies, std::span<const Extent> boxes, const MayHit& may_hit) {
        sorted_.assign(bodies.begin(), bodies.end());
        for (Parts& parts : parts_) parts.count = 0;
        std::sort(sorted_.begin(), sorted_.end(), [boxes](Index a, Index b) {
            return boxes[at(a)].low[0] != boxes[at(b)].low[0] ? boxes[at(a)].low[0] < boxes[at(b)].low[0] : a < b;
        });
        for (std::size_t i = 0; i < sorted_.size(); ++i) {
            const Extent& box = boxes[at(sorted_[i])];
            for (std::size_t j = i + 1; j < sorted_.size(); ++j) {
                const Extent& other = boxes[at(sorted_[j])];
                if (other.low[0] > box.high[0]) break;
                if (!box.overlaps(other) || !may_hit(sorted_[i], sorted_[j])) continue;
                const Extent part = common(box, other);
                parts_[at(sorted_[i])].add(part);
                parts_[at(sorted_[j])].add(part);
            }
        }
    }

    [[nodiscard]] bool any(Index body) const { return parts_[at(body)].count != 0; }
    /// At most `most` boxes, m.
    [[nodiscard]] std::span<const Extent> of(Index body) const {
        return {parts_[at(body)].box.data(), parts_[at(body)].count};
    }
    /// False for a triangle that meets no other body.
    [[nodiscard]] bool may_meet(const Primitive& p) const {
        unsigned meets = 0;
        for (const Extent& part : of(p.body)) {
            unsigned overlap = 1;
            for (std::size_t k = 0; k < 3; ++k) {
                overlap &=
                    static_cast<unsigned>(p.low[k] <= part.high[k]) & static_cast<unsigned>(part.low[k] <= p.high[k]);
            }
            meets |= overlap;
        }
        return meets != 0;
    }

private:
    static constexpr std::size_t most = box_sides::most;  ///< limit, since a triangle is tested against all of them
    struct Parts {
        std::array<Extent, most> box;
        std::size_t count = 0;

        /// Without room, merges `part` into the box that grows least.
        void add(const Extent& part) {
            if (count < most) {
                box[count++] = part;
                return;
            }
            std::size_t best = 0;
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t k = 0; k < most; ++k) {
                Extent both = box[k];
                both.add(part);
                const double growth = size(both) - size(box[k]);
                if (growth < least) {
                    least = growth;
                    best = k;
                }
            }
            box[best].add(part);
        }
    };
    static double size(const Extent& box) {
        return (box.high[0] - box.low[0]) + (box.high[1] - box.low[1]) + (box.high[2] - box.low[2]);
    }
    static Extent common(const Extent& a, const Extent& b) {
        Extent result;
        for (std::size_t k = 0; k < 4; ++k) {
            result.low[k] = std::max(a.low[k], b.low[k]);
            result.high[k] = std::min(a.high[k], b.high[k]);
        }
        return result;
    }

    std::vector<Parts> parts_;   ///< per body
    std::vector<Index> sorted_;  ///< bodies by the lows of their boxes along x
};

}  // namespace trocar
