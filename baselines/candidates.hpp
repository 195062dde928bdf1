// What the rivals that only find overlapping boxes share: outward rounding to float, and the exact triangle test that
// turns their candidates into pairs. Our own narrow phase is used for all of them, so that only broad phases differ.
#pragma once

#include <cmath>
#include <limits>

#include "contact/contact_set.hpp"
#include "geometry/exact.hpp"
#include "scene/world.hpp"

namespace trocar::baselines {

/// Largest float not above the value, smallest float not below it: boxes must not shrink when narrowed.
inline float round_down(double value) {
    const auto narrowed = static_cast<float>(value);
    return static_cast<double>(narrowed) > value ? std::nextafterf(narrowed, -std::numeric_limits<float>::infinity())
                                                 : narrowed;
}
inline float round_up(double value) {
    const auto narrowed = static_cast<float>(value);
    return static_cast<double>(narrowed) < value ? std::nextafterf(narrowed, std::numeric_limits<float>::infinity())
                                                 : narrowed;
}

inline Corners corners_of(const Topology& topology, const Frame& frame, Index triangle) {
    const auto vertices = topology.triangles.col(triangle);
    return {frame.position.col(vertices[0]), frame.position.col(vertices[1]), frame.position.col(vertices[2])};
}

inline Box box_of(const Topology& topology, const Frame& frame, Index triangle) {
    Box box;
    for (const Vector3& corner : corners_of(topology, frame, triangle)) box.add(corner);
    return box;
}

/// Box of a body's used vertices; tells which body pairs are worth a query.
inline Box box_of_body(const Topology& topology, const Frame& frame, const BodyRange& body) {
    Box box;
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        for (int corner = 0; corner < 3; ++corner) box.add(frame.position.col(topology.triangles(corner, t)));
    }
    return box;
}

/// Tests one candidate exactly and appends it when the closed triangles meet.
inline void test_candidate(const Topology& topology, const Frame& frame, Index a, Index b, ContactSet& contacts) {
    ++contacts.work.triangle_tests;
    if (triangles_intersect(corners_of(topology, frame, a), corners_of(topology, frame, b)))
        contacts.pairs.push_back({a, b});
}

}  // namespace trocar::baselines
