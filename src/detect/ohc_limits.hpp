// ohc under limits (`max_pairs`, `work_budget`): in which order pairs are tested until the pairs or the work run out,
// and, when incremental, when the last answer still holds. Which pairs there are is the cascade's business.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"
#include "detect/last_positions.hpp"
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
    /// When incremental: whether the last answer is this frame's, too, because nothing moved since and the reach
    /// stayed.
    bool is_at_rest(const Frame& frame);
    /// The last answer again.
    void repeat(ContactSet& contacts);
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
    double last_reach_ = 0.0;               ///< m, of the last look at what moved
    std::vector<TrianglePair> tested_;      ///< sorted, what was tested this tick
    bool last_truncated_ = false;           ///< of the last answer
    bool answered_ = true;                  ///< nothing moved since
    bool known_ = false;                    ///< the frame before was looked at
    LastPositions last_;                    ///< empty unless incremental
};

}  // namespace trocar
