// Truth between two frames: which triangle pairs begin to touch within the tick, and when two bodies are in contact. A
// discrete detector misses contacts that begin and end between frames. Candidates come from boxes over both frames; the
// integer oracle decides.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "contact/contact_set.hpp"
#include "geometry/box_pairs.hpp"
#include "measure/contact_event.hpp"
#include "measure/step_row.hpp"
#include "scene/world.hpp"

namespace trocar {

/// One body pair in one tick.
struct BodyPairTick {
    bool at_start = false;  ///< the surfaces meet at the frame before
    bool at_end = false;    ///< they meet at this frame
    bool between_frames = false;
    double first =
        std::numeric_limits<double>::quiet_NaN();  ///< fraction of the tick at which contact begins, unless at_start
    double last =
        std::numeric_limits<double>::quiet_NaN();  ///< fraction of the tick at which contact ends, unless at_end
};

class SpaceTimeTruth {
public:
    /// The topology outlives the object.
    explicit SpaceTimeTruth(const Topology& topology) : topology_(&topology) {}

    /// Examines the tick from frame.previous to frame.position, every vertex on a straight line. Returns false, without
    /// results, when one of the two is not finite.
    bool measure(const Frame& frame);

    /// Pairs that are apart at the frame before and meet within the tick, sorted. The kind is unset.
    [[nodiscard]] const std::vector<SweptContact>& beginnings() const { return beginnings_; }
    /// One per Topology::body_pairs entry.
    [[nodiscard]] const std::vector<BodyPairTick>& body_pairs() const { return body_pairs_; }

private:
    const Topology* topology_;
    std::vector<SweptContact> beginnings_;
    std::vector<BodyPairTick> body_pairs_;
    std::vector<Box> boxes_;
    std::vector<Box> boxes_before_;
    std::vector<IndexPair> candidates_;
    std::vector<IndexPair> met_;
};

/// Fills true_swept, swept_false_negatives, swept_false_positives and swept_time_error of the row. A beginning is
/// reported when its pair is among the pairs or the swept contacts, or when a swept contact without triangles names its
/// bodies.
void judge_swept(const Topology& topology, const SpaceTimeTruth& truth, const ContactSet& contacts, StepRow& row);

/// Joins ticks into events.
class ContactEvents {
public:
    /// The topology outlives the object.
    explicit ContactEvents(const Topology& topology);

    /// Adds one tick: its truth and the contacts that the detector reported at its end. dt: s.
    void follow(const Frame& frame, double dt, const SpaceTimeTruth& truth, const ContactSet& contacts);
    [[nodiscard]] const std::vector<ContactEvent>& events() const { return events_; }

private:
    const Topology* topology_;
    std::vector<ContactEvent> events_;    ///< in order of beginning
    std::vector<std::ptrdiff_t> open_;    ///< per body pair: position in events_, -1 = apart
    std::vector<std::uint8_t> reported_;  ///< per body pair: reported in this tick
};

}  // namespace trocar
