// Last stage of ohc_clustered's cascade: candidates become the tick's pairs. It contains the exact test, the test order
// under a limit (`work_budget`), and the reuse of the last tick's pairs where nothing moved. The descent
// finds the candidates.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"
#include "detect/clustered_bodies.hpp"
#include "detect/clustered_work.hpp"
#include "detect/ohc_work.hpp"
#include "detect/triangle_filter.hpp"

namespace trocar {

class ClusteredAnswer {
public:
    ClusteredAnswer(const ClusteredSettings& settings, const TriangleFilter& filter, const ClusteredBodies& bodies,
                    const ClusteredClock& clock, OhcWork& work)
        : settings_(settings), filter_(filter), bodies_(bodies), clock_(clock), work_(work) {}

    void prepare() {
        last_pairs_.clear();
        last_near_.clear();
    }
    /// Reserves room for an ordinary contact.
    void build();

    /// Tests the last tick's pairs; under limits they come first.
    void test_last_pairs(const Frame& frame, ContactSet& contacts);
    void test_candidates(const Frame& frame, const std::vector<TrianglePair>& candidates, ContactSet& contacts);
    /// Adds the pairs of the last answer whose two groups did not move.
    void keep_unmoved_pairs(ContactSet& contacts) const;
    /// Sorts the answer and stores it for the next tick.
    void close(ContactSet& contacts);

private:
    bool test_one(const Frame& frame, const TrianglePair& pair, ContactSet& contacts);
    [[nodiscard]] bool was_tested(const TrianglePair& pair) const;

    const ClusteredSettings& settings_;
    const TriangleFilter& filter_;
    const ClusteredBodies& bodies_;
    const ClusteredClock& clock_;
    OhcWork& work_;
    std::vector<TrianglePair> sorting_;     ///< scratch
    std::vector<TrianglePair> last_pairs_;  ///< sorted pairs of the last tick
    std::vector<TrianglePair> last_near_;   ///< sorted
};

}  // namespace trocar
