// Truth about what happens between two frames: which pairs of triangles begin to touch on the way, and from when to
// when two bodies are in contact. A detector that only examines frames is blind to what comes and goes between them;
// this is what it is held against. Candidates from boxes that hold both frames, decisions by the integer oracle.
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
    bool on_the_way = false;
    double first = std::numeric_limits<double>::quiet_NaN();  ///< part of the tick: contact begins; when not at_start
    double last = std::numeric_limits<double>::quiet_NaN();   ///< part of the tick: contact ends; when not at_end
};

class SpaceTimeTruth {
public:
    /// The topology outlives the object.
    explicit SpaceTimeTruth(const Topology& topology) : topology_(&topology) {}

    /// The tick from frame.previous to frame.position, every vertex on a straight line. False, and nothing is known,
    /// when one of the two is not finite.
    bool measure(const Frame& frame);

    /// Pairs that are apart at the frame before and meet on the way, sorted. The kind is left unset.
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

/// Puts ticks together to events.
class ContactEvents {
public:
    /// The topology outlives the object.
    explicit ContactEvents(const Topology& topology);

    /// One tick: truth about it and what the detector reported at its end. dt: s.
    void follow(const Frame& frame, double dt, const SpaceTimeTruth& truth, const ContactSet& contacts);
    [[nodiscard]] const std::vector<ContactEvent>& events() const { return events_; }

private:
    const Topology* topology_;
    std::vector<ContactEvent> events_;    ///< in order of beginning
    std::vector<std::ptrdiff_t> open_;    ///< per body pair: position in events_, -1 = apart
    std::vector<std::uint8_t> reported_;  ///< per body pair, of this tick
};

}  // namespace trocar
