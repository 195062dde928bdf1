// Determinism metamorphic test of one method on one scene, by real runs: the same question asked again and asked in
// other words (order, origin, unit) must bring the same answer, and where it does not, how far off it is.
#pragma once

#include "simulate/runs.hpp"

namespace trocar {

/// The re-tellings in the order of the report's columns; each is a figure "metamorphic_NAME_pairs" (detector: pairs
/// that are in one answer only, summed over the frames) or "metamorphic_NAME_m" and "metamorphic_NAME_n" (response:
/// largest distance of a vertex, largest difference of the load on an instrument, over the whole run). NaN: does not
/// apply. What a fresh process answers is reported by comparing state_hash over the repetitions.
inline constexpr const char* metamorphic_names[] = {"twice", "triangles", "bodies", "swapped", "origin", "unit"};

/// spec.response empty: spec.detector on about 20 frames of the scene's stream. Otherwise the closed loop. state_hash
/// is a hash over all answers. Throws InputError for an unknown or absent method.
Record run_metamorphic_test(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

}  // namespace trocar
