// Metamorphic test of one method on one scene, by real runs: repetition, permutation, another origin and another unit
// must not change the answer. Differences are figures.
#pragma once

#include "measure/record.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// Variants in the order of the report's columns; NaN: does not apply. Detector: "metamorphic_NAME_pairs", number of
/// pairs that only one of both answers has, summed over frames. Response, over the whole run: "metamorphic_NAME_m",
/// largest distance of a vertex, and "metamorphic_NAME_n", largest difference of the force on a body. state_hash
/// compares processes over the repetitions.
inline constexpr const char* metamorphic_names[] = {"twice", "triangles", "bodies", "swapped", "origin", "unit"};

/// With an empty spec.response: tests spec.detector on about 20 frames of the scene's stream. Otherwise tests the
/// closed loop. state_hash covers all answers. Throws InputError for an unknown or absent method.
Record run_metamorphic_test(const Scene& scene, const RunSpec& spec);

}  // namespace trocar
