// Closed loops of whole scenes, for tests of responses.
#pragma once

#include <cstdint>
#include <string>

#include "method/registry.hpp"
#include "simulate/runs.hpp"

namespace trocar::test {

/// Contact generator `intersection` where the response can read it, else the response's default.
inline std::string meeting_triangles_or_own(const MethodSpec& response) {
    return why_unreadable(registry().contact_generator("intersection"), response).empty()
               ? "intersection"
               : default_contact_generator(response);
}

/// Runs a scene with ohc_clustered. The depth is measured on every `truth_stride`-th tick. `ticks`: 0 = as the scene
/// says; `contacts`: empty = the response's default.
inline Record run_scene_with(const Scene& scene, const std::string& response, std::int64_t truth_stride = 1,
                             std::int64_t ticks = 0, const RunLimits& limits = {}, const std::string& stepper = {},
                             const std::string& contacts = {}) {
    RunSpec spec;
    spec.mode = "closed_loop";
    spec.detector = "ohc_clustered";
    spec.response = response;
    spec.contacts = contacts.empty() ? default_contact_generator(parse_method(response)) : contacts;
    spec.ticks = ticks;
    spec.truth_stride = truth_stride;
    spec.stepper = stepper;
    return run_closed_loop(scene, spec, limits);
}

}  // namespace trocar::test
