// The positions that a detector compares a frame with to find out what moved, for the options of ohc that remember
// something from tick to tick. What moved is decided per vertex, by comparing numbers, never by a tolerance.
#pragma once

#include <algorithm>

#include "scene/world.hpp"

namespace trocar {

/// Calls use(body, vertices) for the parts of the ranges that the frame tells to have moved, body by body.
/// Precondition: frame.moved.
template <typename Use>
void for_each_told(const Topology& topology, const Frame& frame, const Use& use) {
    for (const Range& range : *frame.moved) {
        for (std::size_t body = 0; body < topology.bodies.size(); ++body) {
            const Range own = topology.bodies[body].vertices;
            const Index first = std::max(range.first, own.first);
            const Index end = std::min(range.end(), own.end());
            if (first < end) use(static_cast<Index>(body), Range{first, end - first});
        }
    }
}

class LastPositions {
public:
    [[nodiscard]] bool empty() const { return position_.cols() == 0; }
    void clear() { position_.resize(3, 0); }
    void remember_all(const Frame& frame) { position_ = frame.position; }
    void remember(const Frame& frame, Range vertices) {
        position_.middleCols(vertices.first, vertices.count) =
            frame.position.middleCols(vertices.first, vertices.count);
    }
    void remember(const Frame& frame, Index vertex) {
        std::copy_n(here(frame, vertex), 3, position_.data() + at(vertex));
    }

    /// Since the vertex was remembered; a coordinate that is no number has always moved. Precondition: not empty.
    [[nodiscard]] bool moved(const Frame& frame, Index vertex) const {
        const double* const x = here(frame, vertex);
        const double* const before = position_.data() + at(vertex);
        return !(x[0] == before[0] && x[1] == before[1] && x[2] == before[2]);
    }
    /// x, y, z as remembered, m. Precondition: not empty.
    [[nodiscard]] const double* before(Index vertex) const { return position_.data() + at(vertex); }
    /// A look at some vertices, spread evenly, which is all that a moving body pays for the question.
    [[nodiscard]] bool most_samples_moved(const Frame& frame, Range vertices) const {
        Index count = 0;
        Index samples = 0;
        for (Index v = vertices.first; v < vertices.end(); v += stride(vertices), ++samples) {
            count += moved(frame, v) ? 1 : 0;
        }
        return 2 * count > samples;
    }
    /// How many vertices moved since they were last remembered, which they are; all of them when most samples moved,
    /// and then only these are remembered.
    Index count_moved(const Frame& frame, Range vertices) {
        if (most_samples_moved(frame, vertices)) {
            for (Index v = vertices.first; v < vertices.end(); v += stride(vertices)) remember(frame, v);
            return vertices.count;
        }
        Index count = 0;
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            if (!moved(frame, v)) continue;
            ++count;
            remember(frame, v);
        }
        return count;
    }

private:
    static std::size_t at(Index vertex) { return 3 * static_cast<std::size_t>(vertex); }
    static const double* here(const Frame& frame, Index vertex) { return frame.position.data() + at(vertex); }
    static Index stride(Range vertices) { return std::max(1, vertices.count / 32); }

    Matrix3X position_;  ///< 3×N, m
};

}  // namespace trocar
