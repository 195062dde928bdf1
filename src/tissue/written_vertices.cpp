#include "tissue/written_vertices.hpp"

#include <algorithm>

namespace trocar {

WrittenVertices::WrittenVertices(const TissueState& state) {
    constexpr Index size = 32;
    of_vertex_.resize(state.size());
    for (const Range& range : state.ranges) {
        for (Index v = range.first; v < range.end(); ++v) {
            if ((v - range.first) % size == 0) {
                blocks_.push_back({{v, 0}, state.place[static_cast<std::size_t>(v)]});
            }
            ++blocks_.back().vertices.count;
            of_vertex_[static_cast<std::size_t>(state.place[static_cast<std::size_t>(v)])] =
                static_cast<std::uint32_t>(blocks_.size() - 1);
        }
    }
    changed_.assign(blocks_.size(), tick_);
    moved_.reserve(blocks_.size());
}

void WrittenVertices::give_back(const MovingTissue& tissue, const ResponseOutput& output, const Frame& from,
                                Frame& to) {
    constexpr std::int64_t behind = 3;  // ticks
    moved_.clear();
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
        if (changed_[b] + behind < tick_) continue;
        const Block& block = blocks_[b];
        tissue.give_back_part(block.vertices, block.local, from, to);
        if (changed_[b] != tick_) continue;
        if (!moved_.empty() && moved_.back().end() == block.vertices.first) {
            moved_.back().count += block.vertices.count;
        } else {
            moved_.push_back(block.vertices);
        }
    }
    tissue.give_back_placed(output, to);
}

}  // namespace trocar
