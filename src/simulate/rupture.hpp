// When tissue counts as torn, reported for every response by the same code, from what its contacts gave: what presses
// for longer than a moment with all that it may, or deep inside tissue that is at its strain limit, passes through it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/vertex_springs.hpp"
#include "scene/world.hpp"

namespace trocar {

class Rupture {
public:
    /// Topology and materials outlive it.
    void prepare(const Topology& topology, const Materials& materials);
    /// Once per tick of dt (s), with the frame after it, its effect and what its contacts gave: how many features of
    /// tissue have torn in it. A feature counts at the vertex that carries most of it, once until it is no longer in
    /// contact.
    std::int64_t judge(const Frame& frame, const ResponseOutput& output, std::span<const ContactForce> loads,
                       double dt);

    static constexpr double tear_time = 0.005;  ///< s, without a break
    static constexpr double deep = 1e-4;        ///< m, what counts as clear no more

private:
    struct Strained {
        double time = 0.0;  ///< s, giving way so far
        std::int64_t tick = -1;
        bool torn = false;
        bool gives_way = false;
    };
    [[nodiscard]] bool is_at_strain_limit(const Frame& frame, Index vertex) const;

    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    VertexSprings springs_;
    std::vector<Strained> strained_;  ///< per vertex
    std::vector<Index> touched_;      ///< vertices in contact in the last tick
    std::vector<Index> touched_now_;
    std::int64_t tick_ = 0;
};

}  // namespace trocar
