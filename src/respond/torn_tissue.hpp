// Where tissue cannot give way, held by pins or stretched as far as it can be, stiff contacts would answer with
// whatever force they reach before they give up: here they yield by as much as the tissue cannot follow, and what stays
// inside for the tear time is torn, told once, and left alone until nothing touches it.
#pragma once

#include <cstdint>
#include <vector>

#include "respond/thesis_state.hpp"

namespace trocar {

class TornTissue {
public:
    void prepare(const Topology& topology);
    /// Looks at the stiff contacts of the effect on tissue. Contacts of torn vertices are taken out; every new tear is
    /// one rupture.
    void judge(const ThesisState& state, const Frame& frame, Effect& effect);
    /// True when a corner of this triangle was torn in the last tick.
    [[nodiscard]] bool holds(const Topology& topology, Index triangle) const {
        return (torn_[static_cast<std::size_t>(topology.triangles(0, triangle))] |
                torn_[static_cast<std::size_t>(topology.triangles(1, triangle))] |
                torn_[static_cast<std::size_t>(topology.triangles(2, triangle))]) != 0;
    }

private:
    static double lever(const ThesisState& state, const LinearContact& contact);
    void count(const ThesisState& state, const Frame& frame, const LinearContact& contact, double lever);
    void tear(const ThesisState& state, Effect& effect);
    [[nodiscard]] bool on_torn(const LinearContact& contact) const;

    std::vector<std::uint8_t> torn_;   ///< per vertex
    std::vector<std::int64_t> stuck_;  ///< per vertex, ticks in a row for which it could not give way
    std::vector<std::uint8_t> seen_;   ///< per vertex, what this tick has found
    std::vector<Index> marked_;        ///< vertices that something touches
};

}  // namespace trocar
