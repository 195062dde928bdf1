// ohc under limits (`max_pairs`, `work_budget`): in which order pairs are tested until the pairs or the work run out.
// Which pairs there are is the cascade's business.
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

    /// Forgets everything.
    void prepare();
    /// The pairs of the tick before are tested first, then whatever the cascade brings, what concerns an instrument
    /// first, since that is felt at once. `candidates` is scratch.
    void detect(const Frame& frame, OhcCandidates& candidates, ContactSet& contacts);

private:
    const OhcSettings& settings_;
    const OhcBodies& bodies_;
    OhcMaps& maps_;
    OhcWork& work_;
    std::vector<TrianglePair> last_pairs_;  ///< of the last answer, sorted
    std::vector<TrianglePair> last_near_;   ///< sorted
    std::vector<TrianglePair> tested_;      ///< sorted, what was tested this tick
};

}  // namespace trocar
