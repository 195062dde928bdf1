// What detectors answer of a world, for tests of single detectors.
#pragma once

#include <map>
#include <string>

#include "method/registry.hpp"
#include "support/shapes.hpp"

namespace trocar::test {

using Settings = std::map<std::string, std::string>;

/// A tick of a detector that stays.
inline ContactSet tick(Detector& detector, const Frame& frame, double query_distance = 0.0) {
    ContactSet contacts;
    detector.update(frame, query_distance);
    detector.detect(frame, contacts);
    return contacts;
}

/// The first tick of a new one.
inline ContactSet first_answer(const std::string& name, const World& world, const Settings& settings = {}) {
    const auto detector = make_detector(name, settings);
    detector->prepare(world.topology, world.frame);
    return tick(*detector, world.frame);
}

/// A shaft that dips into a slab of n × n quads, moved on by `tick`.
inline World dipping(int tick, int n) {
    return make_world("dip", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.0007 * tick, 0.0003, -0.004})},
                              {BodyKind::tissue, slab(0.1, 0.01, n).shake(0.0003, 3)}});
}

}  // namespace trocar::test
