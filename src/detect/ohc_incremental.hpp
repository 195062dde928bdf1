// Option `incremental` of ohc: what is kept from tick to tick and who goes through the cascade. A body of which most
// moves goes through it at every tick. A body that rests, or of which less than half moves, is kept: its triangles stay
// hashed (kept_triangles.hpp), those that moved are looked around, and what moves elsewhere asks the maps that are
// there. Pairs of two triangles that did not move are taken over from the tick before. Another reach is a new start.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/contact_set.hpp"
#include "detect/kept_triangles.hpp"
#include "detect/last_positions.hpp"
#include "detect/ohc_bodies.hpp"
#include "detect/ohc_maps.hpp"
#include "detect/ohc_occupancy.hpp"
#include "detect/ohc_work.hpp"

namespace trocar {

class OhcIncremental {
public:
    OhcIncremental(const OhcSettings& settings, OhcBodies& bodies, OhcOccupancy& occupancy, OhcMaps& maps,
                   OhcWork& work)
        : settings_(settings), bodies_(bodies), occupancy_(occupancy), maps_(maps), work_(work) {}

    /// Forgets everything and hashes all triangles as the frame has them, if it can be answered.
    void prepare(const Frame& frame);
    /// Finds out what moved, among the ranges that the frame tells or among all, puts kept triangles into other cells
    /// where need be and sends the others through the occupancy. False when the frame cannot be answered.
    bool follow(const Frame& frame);
    /// The pairs of the followed frame, not sorted. `candidates` is scratch.
    void detect(const Frame& frame, OhcCandidates& candidates, ContactSet& contacts);

private:
    static constexpr int patience = 8;  ///< ticks of rest, or nearly, after which a body is kept

    /// What is known of a body's motion.
    struct Following {
        bool moved = false;      ///< not kept: since the last answer
        int calm = 0;            ///< ticks since it last moved as a whole
        std::int64_t asked = 0;  ///< vertices that may have moved
    };

    [[nodiscard]] bool is_kept(Index body) const { return bodies_.is_kept(body); }
    void list_triangles_of_vertices();
    bool look_at_bodies(const Frame& frame, bool told);
    void forget_leaving(const Frame& frame);
    bool look_at_vertices(const Frame& frame, bool told);
    bool look_at_range(const Frame& frame, Index body, Range range);
    [[nodiscard]] bool changes_cell(const Frame& frame, Index vertex, double around) const;
    void change(Index triangle);
    void hash_again(Index triangle);
    void keep_all(const Frame& frame);
    bool rehash(const Frame& frame);
    [[nodiscard]] bool changed_near_moving() const;
    void ask_kept(const Frame& frame, OhcCandidates& candidates);
    void ask_kept(const Frame& frame, Index triangle, OhcCandidates& candidates);
    void meet_kept(const Frame& frame, const Primitive& p, const std::array<std::int32_t, 3>& cell, Index other,
                   OhcCandidates& candidates);
    void look_around_changed(const Frame& frame, OhcCandidates& candidates);
    template <typename Stays>
    void look_around_huge(const Frame& frame, const Stays& stays, OhcCandidates& candidates);

    const OhcSettings& settings_;
    OhcBodies& bodies_;
    OhcOccupancy& occupancy_;
    OhcMaps& maps_;
    OhcWork& work_;
    bool known_ = false;    ///< the frame before was followed
    bool answered_ = true;  ///< detect has seen the changes; until then they add up
    bool moving_ = false;   ///< a body that is not kept moved since
    bool redo_ = false;     ///< such bodies are looked at again in this tick
    KeptTriangles kept_;
    LastPositions last_;
    double kept_reach_ = 0.0;               ///< m, that the kept triangles are hashed for
    std::vector<TrianglePair> last_pairs_;  ///< what the tick before reported
    std::vector<TrianglePair> last_near_;
    std::vector<Following> following_;          ///< per body
    std::vector<Index> leaving_;                ///< bodies
    std::vector<Index> first_triangle_;         ///< N + 1; where the triangles of a vertex start
    std::vector<Index> triangles_of_vertices_;  ///< 3 T
    std::vector<std::uint32_t> changed_at_;     ///< per triangle: the change in which it last moved
    std::vector<Index> changed_;
    std::uint32_t change_ = 0;
    std::vector<std::uint8_t> to_hash_;  ///< per triangle: is in hash_again_
    std::vector<Index> hash_again_;      ///< those of which the cells may have changed since they were hashed
};

}  // namespace trocar
