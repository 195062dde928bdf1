// The same first question for every detector, own or foreign: can this frame be answered at all? Libraries differ in
// what a NaN vertex does to them (a silent hit, a silent miss, a crash), so none of them gets to see one.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

/// True when `frame` has one finite position per vertex of `topology`. Never allocates.
inline bool is_answerable(const Topology& topology, const Frame& frame) {
    // A finite number times zero is zero; infinities and NaN give NaN. One vectorised sum, no branch per number.
    return frame.position.cols() == topology.vertex_count && (frame.position.array() * 0.0).sum() == 0.0;
}

/// As is_answerable; otherwise also writes the reason to contacts.outcome (not_finite, or unsupported when the number
/// of vertices is not the topology's).
inline bool check_frame(const Topology& topology, const Frame& frame, ContactSet& contacts) {
    if (is_answerable(topology, frame)) return true;
    if (frame.position.cols() != topology.vertex_count) {
        contacts.outcome = {OutcomeKind::unsupported, "the frame's number of vertices is not the topology's"};
    } else {
        contacts.outcome = {OutcomeKind::not_finite, "a vertex position is not finite"};
    }
    return false;
}

/// For detectors that find pairs that meet and no others: false, with the reason in contacts.outcome, when more is
/// asked.
inline bool check_no_query_distance(double query_distance, ContactSet& contacts) {
    if (query_distance == 0.0) return true;
    contacts.outcome = {OutcomeKind::unsupported, "finds triangles that meet, not those within a query distance"};
    return false;
}

}  // namespace trocar
