// Scenes of ordinary contact, drawn by a seed, on which responses are judged: nobody has tuned on them.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/drawn_scenes.hpp"

namespace trocar {

/// Five draws of each of twelve kinds, "press_sheet_1" to "over_bone_5"; the group of a scene is its kind. Each is 500
/// to 750 ticks. Equal seeds give equal texts on every machine.
///
/// - press_sheet: a blunt tool presses a pinned sheet, holds, leaves.
/// - point_sheet: a pointed tool does.
/// - stab_sheet: a pointed tool stabs a sheet and is withdrawn.
/// - drag_sheet: a blunt tool is dragged along a sheet.
/// - press_organ: a blunt tool presses a closed organ near its top.
/// - drag_organ: a blunt tool is dragged along an organ.
/// - side_organ: a tool pokes an organ from the side, just above its pinned part.
/// - two_sheets: a blunt tool presses a sheet into a second one.
/// - sheet_on_organ: a blunt tool presses a sheet onto an organ.
/// - held_sheet, held_organ: an operator holds the tool.
/// - over_bone: a blunt tool presses a sheet down beside a bone below it.
///
/// The seed draws place, direction, tilt, turn, speed, depth and tool size in every kind. It also draws k and the
/// tissue's edge, size and turn. STUDIES, Judged scenes, has the ranges.
///
/// No search of parameters may use drag_organ, side_organ, held_organ and over_bone.
std::vector<DrawnScene> draw_judged_scenes(std::uint64_t seed);

}  // namespace trocar
