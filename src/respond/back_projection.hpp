// Velocity back-projection of thesis §3.4.5 as METHODS §9.1 makes it executable: from each instrument vertex back along
// its velocity; tissue vertices at the surfaces it has passed attract it and are attracted. Says nothing for a tool at
// rest, and on withdrawal looks the wrong way.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "respond/thesis_state.hpp"

namespace trocar {

class BackProjection {
public:
    void prepare(const Topology& topology);
    void respond(const ThesisState& state, const Frame& frame, Effect& effect);

private:
    /// Where an instrument vertex came from, straight back along its velocity.
    struct Path {
        Index body = -1;
        Index vertex = -1;
        Vector3 from = Vector3::Zero();
        Box box = {};
        Index first_met = -1;  ///< in met_
        Index last_met = -1;
    };
    /// A triangle whose box meets a path's.
    struct Met {
        Index triangle = -1;
        Index next = -1;  ///< of the same path, in ascending order of triangles; -1 for none
    };
    struct NearTriangle {
        Index triangle = -1;
        Box box = {};
    };
    /// Consecutive tissue vertices, their box, and the sides of the paths' bounds that all of them are beyond.
    struct VertexBlock {
        Range vertices;
        Box box = {};
        std::uint8_t beyond = 0;
    };
    /// Consecutive tissue triangles and the blocks of their vertices, a run of blocks_of_triangles_.
    struct TriangleBlock {
        Range triangles;
        Range blocks;
    };

    /// Which of some paths are in the same slabs as a box, on every axis: a bit for each path.
    class PathSlabs {
    public:
        static constexpr std::size_t most_paths = 256;
        void prepare(std::span<const Path> paths);
        [[nodiscard]] const Box& bounds() const { return bounds_; }
        /// Calls act(position of a path).
        template <typename Act>
        void visit(const Box& box, const Act& act) const {
            Bits both;
            both.fill(~std::uint64_t{0});
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Bits& begun = begun_[axis][slab_of(axis, box.max)];
                const Bits& ended = ended_[axis][slab_of(axis, box.min)];
                std::uint64_t any = 0;
                for (std::size_t w = 0; w < used_; ++w) any |= both[w] &= begun[w] & ~ended[w];
                if (any == 0) return;
            }
            for (std::size_t w = 0; w < used_; ++w) {
                for (std::uint64_t left = both[w]; left != 0; left &= left - 1) {
                    act(64 * w + static_cast<std::size_t>(std::countr_zero(left)));
                }
            }
        }

    private:
        static constexpr std::size_t slabs = 64;
        static constexpr std::size_t words = most_paths / 64;
        using Bits = std::array<std::uint64_t, words>;
        /// Places beyond the bounds, and NaN, count to the slab at an end.
        [[nodiscard]] std::size_t slab_of(std::size_t axis, const Vector3& place) const {
            const auto i = static_cast<Eigen::Index>(axis);
            const double inside = std::max(0.0, (place[i] - bounds_.min[i]) * per_slab_[i]);
            return static_cast<std::size_t>(static_cast<std::int32_t>(std::min(slabs - 1.0, inside)));
        }

        Box bounds_;
        std::size_t used_ = 0;                                ///< words with paths
        Vector3 per_slab_ = Vector3::Zero();                  ///< 1/m
        std::array<std::array<Bits, slabs>, 3> begun_{};      ///< paths that begin in this slab or before it
        std::array<std::array<Bits, slabs + 1>, 3> ended_{};  ///< paths that end before this slab
    };

    void collect_paths(const ThesisState& state, const Frame& frame);
    void collect_near(const Topology& topology, const Frame& frame);
    void meet_triangles(std::span<Path> paths);
    void attract(const ThesisState& state, const Frame& frame, const Path& path, Index triangle, Effect& effect);

    std::vector<VertexBlock> vertex_blocks_;
    std::vector<TriangleBlock> triangle_blocks_;
    std::vector<Index> blocks_of_triangles_;
    std::vector<Path> paths_;
    Box bounds_;                        ///< of all paths
    std::vector<std::uint8_t> beyond_;  ///< N; on which sides of the bounds a tissue vertex lies, one bit each
    std::vector<NearTriangle> near_;
    PathSlabs slabs_;
    std::vector<Met> met_;
    std::vector<Index> attracted_;
};

}  // namespace trocar
