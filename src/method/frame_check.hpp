// Validation of frames before detection. Libraries differ in what they do with a NaN vertex (false positive, false
// negative, crash), so that none receives one.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

/// True when `frame` has one finite position per vertex of `topology`. Never allocates.
inline bool is_answerable(const Topology& topology, const Frame& frame) {
    // A finite number times zero is zero; infinities and NaN give NaN. One vectorised sum, no branch per number.
    return frame.position.cols() == topology.vertex_count && (frame.position.array() * 0.0).sum() == 0.0;
}

/// is_answerable; if false, sets contacts.outcome: not_finite, or unsupported for a wrong number of vertices.
inline bool check_frame(const Topology& topology, const Frame& frame, ContactSet& contacts) {
    if (is_answerable(topology, frame)) return true;
    if (frame.position.cols() != topology.vertex_count) {
        contacts.outcome = {OutcomeKind::unsupported, "the frame's number of vertices is not the topology's"};
    } else {
        contacts.outcome = {OutcomeKind::not_finite, "a vertex position is not finite"};
    }
    return false;
}

/// For detectors of intersecting pairs only: at a query distance > 0 sets outcome unsupported and returns false.
inline bool check_no_query_distance(double query_distance, ContactSet& contacts) {
    if (query_distance == 0.0) return true;
    contacts.outcome = {OutcomeKind::unsupported, "finds triangles that meet, not those within a query distance"};
    return false;
}

}  // namespace trocar
