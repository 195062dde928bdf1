// Scenes in which bodies pass into each other while there is no contact, drawn by a seed. They ask how a response gets
// bodies apart (simulate/resolution.hpp).
#pragma once

#include <cstdint>
#include <vector>

#include "scene/drawn_scenes.hpp"

namespace trocar {

/// 24 scenes of each of five groups, one per stratum. Depths are 0.5, 1, 2 and 4 edges of the tissue; between rigid
/// bodies they are parts of the tool's radius. The seed decides places, tilts and turns within the strata, and tools
/// where a stratum leaves them open. Equal seeds give equal texts on every machine.
///
/// - At rest: a tool moves into a sheet, a closed organ or two sheets before the first tick, and stays.
/// - Moving: the same; it then moves on for 50 ms, onward, sideways or outward, and stays.
/// - Silent detector: contact is off for 1, 5, 20 or 100 ticks within a press, a stab or a drag.
/// - Through in one tick: contact is off for the tick in which the tool passes. A needle's shaft still crosses the
///   surface; a blade is wholly behind it.
/// - Hand-held: a simulated operator holds the tool, on another tool, on bone or on tissue.
std::vector<DrawnScene> draw_resolution_scenes(std::uint64_t seed);

}  // namespace trocar
