// Rupture of tissue, by one rule for every response, from its contact forces. Tissue tears under a contact that, for
// longer than `tear_time`, is at its force limit or is `deep` in tissue at its strain limit.
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
    /// Call once per tick of `dt` (s) with the frame after it, its effect and its contact forces. Returns the number of
    /// tissue features torn in this tick. A feature counts at the vertex with the largest weight, once until it is out
    /// of contact.
    std::int64_t judge(const Frame& frame, const ResponseOutput& output, std::span<const ContactForce> contact_forces,
                       double dt);

    static constexpr double tear_time = 0.005;  ///< s, uninterrupted
    static constexpr double deep = 1e-4;        ///< m, depth above which a contact counts as deep

private:
    struct Strained {
        double time = 0.0;  ///< s, at a limit without interruption
        std::int64_t tick = -1;
        bool torn = false;
        bool yields = false;
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
