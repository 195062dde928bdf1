// Tissue that other tissue, or a point of a tool or bone, is about to meet: the crossing ledger holds a sample from the
// tick on in which it has crossed, and what both move in a tick is how deep it would then be. These contacts stand
// between them before that. They have a gap, so that the integrator lets them push only in sub-steps in which it would
// close.
#pragma once

#include <vector>

#include "respond/crossing_ledger.hpp"
#include "respond/thesis_state.hpp"
#include "respond/velocity_changes.hpp"

namespace trocar {

class ApproachingTissue {
public:
    void prepare(const ThesisState& state);
    /// Replaces `approaching` by a layer, not crossed, for every sample that tissue may meet in this tick and that the
    /// ledger does not hold against it. `effect` tells what the tools give the tissue.
    void find(const ThesisState& state, const Frame& frame, const Effect& effect, VelocityChanges& changes,
              CrossingLedger& ledger, std::vector<Penetration>& approaching);

private:
    /// Samples of one body that may meet a tissue.
    struct Pair {
        Index body = -1;
        Index tissue = -1;
        double travelled = 0.0;         ///< m, by both together since the samples were last gone through
        double least = 0.0;             ///< m, smallest clearance then
        std::vector<Index> sample;      ///< numbers in the ledger
        std::vector<double> clearance;  ///< m, per sample: at least as far off
    };
    void find_in(const ThesisState& state, const Frame& frame, Pair& pair, VelocityChanges& changes,
                 CrossingLedger& ledger, std::vector<Penetration>& approaching);
    void look_at(const ThesisState& state, const Frame& frame, Pair& pair, std::size_t number, double reach,
                 VelocityChanges& changes, CrossingLedger& ledger, std::vector<Penetration>& approaching);
    void list_samples(const CrossingLedger& ledger);

    std::vector<Pair> pairs_;  ///< of two tissues both ways
    bool listed_ = false;
    SampleLayers layers_;
};

}  // namespace trocar
