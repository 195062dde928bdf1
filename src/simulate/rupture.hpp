// When tissue counts as torn, told for every response by the same code, from what its contacts gave: a constraint that
// gives its limit for longer than a moment no longer holds, so that something passes through the tissue.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/effect.hpp"
#include "scene/world.hpp"

namespace trocar {

class Rupture {
public:
    void prepare(const Topology& topology);
    /// Once per tick of dt (s), with the effect of the tick and what its contacts gave: how many features of tissue
    /// have torn in it. A feature counts at the vertex that carries most of it, once until it is no longer in contact.
    std::int64_t judge(const Effect& effect, std::span<const ContactLoad> loads, double dt);

    static constexpr double tear_time = 0.005;  ///< s, at the limit without a break

private:
    struct Strained {
        double time = 0.0;  ///< s, at the limit so far
        std::int64_t tick = -1;
        bool torn = false;
        bool at_limit = false;
    };
    std::vector<Strained> strained_;  ///< per vertex
    std::vector<Index> touched_;      ///< vertices in contact in the last tick
    std::vector<Index> touched_now_;
    std::int64_t tick_ = 0;
};

}  // namespace trocar
