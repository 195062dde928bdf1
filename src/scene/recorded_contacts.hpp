// The contacts that a recording's writer found itself: text after the frames of a trocar-recording-2 (DESIGN §10), so
// that a simulator's own answers stand beside the frames that they belong to.
#pragma once

#include <cstdint>
#include <istream>
#include <limits>
#include <string>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Two triangles that somebody's own simulation says are in contact, and as much geometry as it reports. A pair of
/// triangles may have several contacts in a tick.
struct RecordedContact {
    static constexpr double unreported = std::numeric_limits<double>::quiet_NaN();
    Index a = -1;  ///< triangle number of the topology; its body and that of b are tested against each other
    Index b = -1;
    Vector3 point = Vector3::Constant(unreported);   ///< m, world; all three numbers, or none
    Vector3 normal = Vector3::Constant(unreported);  ///< unit (to 1e-6), from the body of a to the body of b; likewise
    double depth = unreported;                       ///< m, positive: inside by so much; negative: apart by so much
};

/// All contacts of one frame; an empty list says that there were none.
struct RecordedTick {
    std::int64_t tick = 0;
    std::vector<RecordedContact> contacts;
};

/// One line of the text, with its end. Throws InputError, naming `file`, on a triangle that there is not, on two bodies
/// that are not tested against each other, on a number that is not finite or a vector reported in part, and on a normal
/// that is no unit.
std::string recorded_tick_line(const Topology& topology, const RecordedTick& tick, const std::string& file);

/// The line before them all.
std::string recorded_contacts_head(std::int64_t ticks);

/// Reads the text from where the stream stands to its end. `triangle_of_file`: number in the topology of each triangle
/// of the file, empty where they are the same. Contacts come back with a < b. Throws InputError "FILE: contacts line
/// N: …" (N from 1) on whatever the format does not allow, ticks that are missing included.
std::vector<RecordedTick> read_recorded_contacts(std::istream& stream, const Topology& topology,
                                                 const std::vector<Index>& triangle_of_file, std::int64_t frames,
                                                 const std::string& file);

}  // namespace trocar
