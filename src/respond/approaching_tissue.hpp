// Tissue that tissue is about to meet: the crossing ledger holds a sample from the tick on in which it has crossed, and
// what both layers move in a tick is how deep it would then be. These contacts stand between them before that. They
// have a gap, so that the integrator lets them push only in sub-steps in which it would close.
#pragma once

#include <vector>

#include "respond/crossing_ledger.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class ApproachingTissue {
public:
    void prepare(const ThesisState& state);
    /// Replaces `approaching` by a layer, not crossed, for every vertex of tissue that other tissue may meet in this
    /// tick and that the ledger does not hold against it. `effect` tells what the tools give the tissue.
    void find(const ThesisState& state, const Frame& frame, const Effect& effect, CrossingLedger& ledger,
              std::vector<Penetration>& approaching);

private:
    /// Vertices of one body that may meet the tissue of another.
    struct Pair {
        Index body = -1;
        Index tissue = -1;
        std::vector<double> clearance;  ///< m, per vertex: at least as far off at the end of this tick
    };
    void measure_changes(const ThesisState& state, const Frame& frame, const Effect& effect);
    void find_in(const ThesisState& state, const Frame& frame, Pair& pair, CrossingLedger& ledger,
                 std::vector<Penetration>& approaching);

    std::vector<Pair> pairs_;      ///< both ways
    std::vector<Index> tissues_;   ///< that meet other tissue
    std::vector<double> fastest_;  ///< m/s, per body: as fast as it may get in the tick
    std::vector<double> pushed_;   ///< m/s, per vertex: by how much what pushes it may change its velocity in the tick
    std::vector<double> change_;   ///< m/s, per vertex: its neighbours counted, too
    SampleLayers layers_;
};

}  // namespace trocar
