// The interface of a collision detector: three calls, of which two run per tick. The harness does the timing and the
// judging; a detector only answers.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

/// A detector answers with all intersecting triangle pairs of the body pairs that the topology lists and, asked within
/// a query distance, with those that come as near as that. The topology outlives the detector's use of it. A failure is
/// written to contacts.outcome; nothing is thrown during update or detect. A non-finite vertex in the frame is outcome
/// not_finite; a query distance that the detector cannot answer within (DetectorEntry::reach) is outcome unsupported.
class Detector {
public:
    Detector() = default;
    Detector(const Detector&) = delete;
    Detector& operator=(const Detector&) = delete;
    Detector(Detector&&) = delete;
    Detector& operator=(Detector&&) = delete;
    virtual ~Detector() = default;

    /// Once per run: build what depends on topology and the first frame. May allocate.
    virtual void prepare(const Topology& topology, const Frame& frame) = 0;
    /// Once per tick: follow the moved vertices (refit, rebuild, re-hash). Charged apart from detect. reach: m, >= 0,
    /// finite; 0 asks for pairs that meet and no others. It may differ from tick to tick, but callers keep it as long
    /// as they can, so that what is built for it lasts.
    virtual void update(const Frame& frame, double query_distance) = 0;
    /// Once per tick, after update with the same frame: the pairs that meet, and those that do not and are at most the
    /// reach apart, each list sorted by (a, b), each pair once, a < b. `contacts` is cleared by the callee.
    virtual void detect(const Frame& frame, ContactSet& contacts) = 0;
};

}  // namespace trocar
