// Which vertices of the tissue a stepper has changed of late, in blocks: what a frame that was written two ticks ago
// lacks, and what a detector has to examine.
#pragma once

#include <cstdint>
#include <vector>

#include "tissue/moving_tissue.hpp"

namespace trocar {

class WrittenVertices {
public:
    /// All count as changed.
    explicit WrittenVertices(const TissueState& state);

    /// A new tick: nothing has changed in it.
    void next_tick() { ++tick_; }
    void mark(Index local) { changed_[of_vertex_[static_cast<std::size_t>(local)]] = tick_; }
    void mark_all() { changed_.assign(changed_.size(), tick_); }
    /// Brings `to` up to date, which has what was given back at most three ticks ago: there a vertex that has changed
    /// in this tick or in one of the three before has another place, velocity or previous place.
    void give_back(const MovingTissue& tissue, const ResponseOutput& output, const Frame& from, Frame& to);
    /// Of the last give_back: changed in that tick, ascending, in numbers of the frame.
    [[nodiscard]] const std::vector<Range>& moved() const { return moved_; }

private:
    struct Block {
        Range vertices;    ///< of the frame
        Index local = -1;  ///< of the first, in the state
    };
    std::vector<Block> blocks_;
    std::vector<std::int64_t> changed_;     ///< per block: tick
    std::vector<std::uint32_t> of_vertex_;  ///< block, per vertex of the state
    std::vector<Range> moved_;
    std::int64_t tick_ = 0;
};

}  // namespace trocar
