// Interface of a collision detector. The harness does timing and validation.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Finds all intersecting triangle pairs of the topology's body pairs and, for a query distance > 0, the disjoint pairs
/// within it. The topology outlives the detector. A failure is written to contacts.outcome; update and detect do not
/// throw. not_finite: a vertex of the frame is not finite. unsupported: the query distance is > 0 and
/// DetectorEntry::query_distance is false.
class Detector {
public:
    Detector() = default;
    Detector(const Detector&) = delete;
    Detector& operator=(const Detector&) = delete;
    Detector(Detector&&) = delete;
    Detector& operator=(Detector&&) = delete;
    virtual ~Detector() = default;

    /// Once per run: builds what depends on topology and the first frame. May allocate.
    virtual void prepare(const Topology& topology, const Frame& frame) = 0;
    /// Once per tick: adapts to the moved vertices (refit, rebuild, re-hash). Timed separately from detect.
    /// `query_distance`: m, >= 0, finite; 0: intersecting pairs only. Callers change it rarely, since acceleration
    /// structures may depend on it.
    virtual void update(const Frame& frame, double query_distance) = 0;
    /// Once per tick, after update with the same frame. Clears `contacts` and fills `pairs` and `near`, each sorted by
    /// (a, b) and unique, a < b.
    virtual void detect(const Frame& frame, ContactSet& contacts) = 0;
};

}  // namespace trocar
