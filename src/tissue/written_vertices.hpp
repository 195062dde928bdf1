// Blocks of tissue vertices that a stepper changed recently. They bring frames of earlier ticks up to date and report
// moved ranges to detectors.
#pragma once

#include <cstdint>
#include <vector>

#include "tissue/moving_tissue.hpp"

namespace trocar {

class WrittenVertices {
public:
    /// All vertices start as changed.
    explicit WrittenVertices(const TissueState& state);

    /// Begins a tick without changes.
    void next_tick() { ++tick_; }
    void mark(Index local) { changed_[of_vertex_[static_cast<std::size_t>(local)]] = tick_; }
    void mark_all() { changed_.assign(changed_.size(), tick_); }
    /// Updates `to`, which holds a result of at most three ticks ago. Writes every block that changed in this tick or
    /// in the three before.
    void give_back(const MovingTissue& tissue, const ResponseOutput& output, const Frame& from, Frame& to);
    /// Ranges of frame vertices changed in the tick of the last give_back, ascending.
    [[nodiscard]] const std::vector<Range>& moved() const { return moved_; }

private:
    struct Block {
        Range vertices;    ///< in the frame
        Index local = -1;  ///< index of the first in the state
    };
    std::vector<Block> blocks_;
    std::vector<std::int64_t> changed_;     ///< per block: last tick with a change
    std::vector<std::uint32_t> of_vertex_;  ///< per vertex of the state: its block
    std::vector<Range> moved_;
    std::int64_t tick_ = 0;
};

}  // namespace trocar
