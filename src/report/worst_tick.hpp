// One scene at its worst tick, side by side: what records cannot report, since they hold no geometry. Whoever can run
// the records again writes it once into worst_tick.json beside them; a report draws it from there.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

/// The name of the file beside records.jsonl.
inline constexpr const char* worst_tick_file = "worst_tick.json";

/// A vertical cut through the deepest place. Lengths in mm, x along the cut, y up, from the deepest place.
struct WorstTick {
    struct Segment {
        std::array<double, 4> ends{};  ///< x, y of one end, x, y of the other
        double depth = 0.0;            ///< mm, mean of its ends; NaN where truth leaves the side open
    };
    struct Body {
        std::string name;
        std::string kind;  ///< "instrument", "rigid", "tissue"
        std::vector<Segment> segments;
    };
    struct State {
        std::string name;
        std::string state_hash;  ///< of the run's last frame, the record's; empty for the reference
        double depth = std::numeric_limits<double>::quiet_NaN();  ///< mm, worst of this tick; NaN: not reported
        std::vector<Body> bodies;
        std::vector<std::array<double, 2>> points;  ///< places of the vertices that the reference holds, on the cut
        std::string note;                           ///< what the state does not hold
    };
    struct Curve {
        std::string name;
        std::vector<std::pair<double, double>> points;  ///< s, N
    };
    std::string scene;
    std::int64_t tick = 0;
    double time = 0.0;  ///< s
    std::vector<State> states;
    std::vector<Curve> force;
};

/// One line. Lengths are rounded to a micrometre, forces to a millinewton.
std::string to_json(const WorstTick& seen);
/// Throws InputError.
WorstTick worst_tick_from_json(const std::string& text, const std::string& file);

/// The runs that the picture shows: on the scene where the best other response was deepest, the response of the
/// sentence and that other one. Of scenes those come first that have a reference of hard contact. Nothing when no
/// response was judged.
struct WorstTickRuns {
    const Record* first = nullptr;
    const Record* other = nullptr;  ///< null: there is only one
    std::string first_name;
    std::string other_name;
};
std::optional<WorstTickRuns> worst_tick_runs(const std::vector<Record>& records);
/// What it reports points into the records.
std::optional<WorstTickRuns> worst_tick_runs(std::vector<Record>&&) = delete;

/// The states side by side on one scale of depth, as SVG.
std::string draw(const WorstTick& seen);

}  // namespace trocar
