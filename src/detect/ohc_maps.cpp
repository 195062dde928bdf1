#include "detect/ohc_maps.hpp"

namespace trocar {

/// A Member prepared for comparison with others in one cell.
struct OhcMaps::Question {
    std::array<Two, 3> ends;  ///< high x y z, then −low x y z, m
    Cell first;
    Cell cell;

    Question(const Member& p, Cell where)
        : ends{Two{-p.ends[1][1], -p.ends[2][0]}, Two{-p.ends[2][1], -p.ends[0][0]}, Two{-p.ends[0][1], -p.ends[1][0]}},
          first(p.first),
          cell(where) {}
    using Answer = std::int64_t __attribute__((vector_size(16)));
    [[nodiscard]] Answer overlap(const Member& q) const {
        return (q.ends[0] <= ends[0]) & (q.ends[1] <= ends[1]) & (q.ends[2] <= ends[2]);
    }
    /// Whether this is the one cell in which the pair counts: per axis the larger of both lowest numbers.
    [[nodiscard]] Answer counts(const Member& q) const {
        return reinterpret_cast<Answer>((cell_max(first, q.first) == cell) | Cell{0, 0, 0, -1});
    }
    static bool yes(Answer answer) { return (answer[0] & answer[1]) == -1; }
};

void OhcMaps::prepare(const OhcSettings& settings, std::size_t room) {
    map_.prepare(bodies_.filter(), settings.hash, 12);
    map_.reserve(room);
    members_.reserve(room);
}

void OhcMaps::hash(const Frame& frame) {
    map_.start(occupancy_.entries());
    members_.clear();
    any_cut_ = false;
    const std::vector<Primitive>& primitives = occupancy_.primitives();
    for (std::size_t k = 0; k < primitives.size(); ++k) {
        const Primitive& primitive = primitives[k];
        members_.push_back(Member::of(primitive));
        any_cut_ = any_cut_ || primitive.cut;
        occupancy_.for_each_shared_cell(frame, primitive, [&](Cell cell) {
            if (work_.spend(work_.counters.cells_visited, 1)) {
                map_.add(cell, primitive.body, static_cast<Index>(k));
            }
        });
    }
    map_.cascade();
}

void OhcMaps::meet(const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second,
                   OhcCandidates& found) const {
    const std::vector<Primitive>& primitives = occupancy_.primitives();
    for (const Index i : first) {
        const Question p(members_[at(i)], Cell{cell[0], cell[1], cell[2], 0});
        const Index triangle = members_[at(i)].triangle();
        if (any_cut_) {
            // A triangle in pieces comes once per cell.
            for (const Index j : second) {
                const Member& q = members_[at(j)];
                if (!Question::yes(p.overlap(q))) continue;
                if (primitives[at(i)].cut || primitives[at(j)].cut) {
                    found.repeated.push_back({triangle, q.triangle()});
                } else if (Question::yes(p.counts(q))) {
                    found.once.push_back({triangle, q.triangle()});
                }
            }
            continue;
        }
        // Without branches, since overlap and counting cell are unpredictable.
        std::size_t count = found.once.size();
        found.once.resize(count + second.size());
        for (const Index j : second) {
            const Member& q = members_[at(j)];
            found.once[count] = {triangle, q.triangle()};
            count += Question::yes(p.overlap(q) & p.counts(q)) ? 1 : 0;
        }
        found.once.resize(count);
    }
}

}  // namespace trocar
