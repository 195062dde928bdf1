// Contacts found by the writer of a recording: text after the frames of a trocar-recording-2 (DESIGN §10), for
// comparison with detectors on the same frames.
#pragma once

#include <cstdint>
#include <istream>
#include <limits>
#include <string>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Contact of two triangles reported by another simulation, with optional geometry. A pair of triangles may have
/// several contacts in a tick.
struct RecordedContact {
    Index a = -1;  ///< triangle of the topology; its body and that of b form a tested pair
    Index b = -1;
    Vector3 point = Vector3::Constant(not_known);   ///< m, world; all three numbers, or NaN
    Vector3 normal = Vector3::Constant(not_known);  ///< unit (to 1e-6), from the body of a to the body of b; or NaN
    double depth = not_known;                       ///< m, positive: penetrating, negative: separated
};

/// All contacts of one frame; an empty list means none.
struct RecordedTick {
    std::int64_t tick = 0;
    std::vector<RecordedContact> contacts;
};

/// One line of the text, with its end. Throws InputError, naming `file`, on a triangle out of range or a body pair that
/// is not tested. Also throws on a non-finite number, a partial vector, or a normal that is not unit.
std::string recorded_tick_line(const Topology& topology, const RecordedTick& tick, const std::string& file);

/// First line of the text.
std::string recorded_contacts_head(std::int64_t ticks);

/// Reads the text from the stream's position to its end; contacts are returned with a < b. `triangle_of_file`: topology
/// number of each triangle of the file, empty where equal. Throws InputError "FILE: contacts line N: …" (N from 1) on
/// whatever the format forbids, missing ticks included.
std::vector<RecordedTick> read_recorded_contacts(std::istream& stream, const Topology& topology,
                                                 const std::vector<Index>& triangle_of_file, std::int64_t frames,
                                                 const std::string& file);

}  // namespace trocar
