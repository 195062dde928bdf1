// Scenes of ordinary contact, drawn by a seed, on which responses are judged: nobody has tuned on them.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/drawn_scenes.hpp"

namespace trocar {

/// Five draws of each of twelve kinds, "press_sheet_1" to "over_bone_5"; the group of a scene is its kind. Each is 500
/// to 750 ticks. Equal seeds give equal texts on every machine.
///
/// | kind | what happens |
/// |---|---|
/// | press_sheet | a blunt tool presses a pinned sheet 3 to 8 mm, holds, leaves |
/// | point_sheet | the same with a pointed tool, 2 to 5 mm |
/// | stab_sheet | a pointed tool stabs 5 to 12 mm at 0.2 to 0.5 m/s and is withdrawn |
/// | drag_sheet | a blunt tool at 2 to 5 mm is dragged 10 to 25 mm along a sheet |
/// | press_organ | a blunt tool presses a closed organ 3 to 8 mm near its top |
/// | drag_organ | a blunt tool is dragged along an organ |
/// | side_organ | a tool pokes an organ from the side, just above its pinned part, 2 to 5 mm |
/// | two_sheets | a blunt tool presses a sheet into another one 1 to 3 mm below, 2 to 5 mm past its plane |
/// | sheet_on_organ | a blunt tool presses a sheet onto an organ |
/// | held_sheet | an operator holds a blunt or pointed tool and presses a sheet |
/// | held_organ | the same on an organ |
/// | over_bone | a blunt tool presses a sheet beside a bone 0.5 to 1.5 mm below it, 4 to 7 mm past its top |
///
/// The seed draws in every kind: place, direction of the path and tilt of the tool (each within 15 degrees of the
/// normal; 6 beside a bone), turn of tool and tissue, speed (40 to 100 mm/s; of drags 60 to 100), depth, tool radius (3
/// to 5 mm; pointed 1.5 to 2.5), edge of the tissue (5 to 6.5 mm), its size, and k (100 to 1000 N/m, log scale).
///
/// No search of parameters may use drag_organ, side_organ, held_organ and over_bone. The search so far
/// (reports/response_search) used three other scenes; press_sheet, stab_sheet and two_sheets are like them.
std::vector<DrawnScene> draw_judged_scenes(std::uint64_t seed);

}  // namespace trocar
