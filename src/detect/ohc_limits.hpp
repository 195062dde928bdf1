// Test order of ohc under a limit (`work_budget`), until the work runs out. The cascade finds the pairs.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"
#include "detect/ohc_bodies.hpp"
#include "detect/ohc_maps.hpp"
#include "detect/ohc_work.hpp"

namespace trocar {

class OhcLimits {
public:
    OhcLimits(const OhcSettings& settings, const OhcBodies& bodies, OhcMaps& maps, OhcWork& work)
        : settings_(settings), bodies_(bodies), maps_(maps), work_(work) {}

    void prepare();
    /// Tests the last tick's pairs first, then the cascade's candidates. Pairs with an instrument come first, since the
    /// user feels them at once. `candidates` is scratch.
    void detect(const Frame& frame, OhcCandidates& candidates, ContactSet& contacts);

private:
    const OhcSettings& settings_;
    const OhcBodies& bodies_;
    OhcMaps& maps_;
    OhcWork& work_;
    std::vector<TrianglePair> last_pairs_;  ///< of the last answer, sorted
    std::vector<TrianglePair> last_near_;   ///< sorted
    std::vector<TrianglePair> tested_;      ///< sorted pairs tested in this tick
};

}  // namespace trocar
