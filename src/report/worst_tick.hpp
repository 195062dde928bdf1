// Cross-sections of one scene at its worst tick. Records hold no geometry, so a rerun writes it once to worst_tick.json
// beside them.
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

/// File name beside the records.
inline constexpr const char* worst_tick_file = "worst_tick.json";

/// Vertical cut through the deepest point, which is the origin. Lengths in mm, x along the cut, y up.
struct WorstTick {
    struct Segment {
        std::array<double, 4> ends{};  ///< x, y of both ends
        double depth = 0.0;            ///< mm, mean of its ends; NaN where the oracle leaves the side undecided
    };
    struct Body {
        std::string name;
        std::string kind;  ///< "instrument", "rigid", "tissue"
        std::vector<Segment> segments;
    };
    struct State {
        std::string name;
        std::string state_hash;  ///< hash of the run's last frame, equal to the record's; empty for the reference
        double depth = std::numeric_limits<double>::quiet_NaN();  ///< mm, maximum of this tick; NaN: unknown
        std::vector<Body> bodies;
        std::vector<std::array<double, 2>> points;  ///< vertices that the reference constrains, on the cut
        std::string note;                           ///< data that the state lacks
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

/// One line of JSON, lengths rounded to 1 µm, forces to 1 mN.
std::string to_json(const WorstTick& seen);
/// Throws InputError.
WorstTick worst_tick_from_json(const std::string& text, const std::string& file);

/// Runs of the picture: the response of the summary sentence and the best other one, on the scene where either was
/// deepest. Scenes with a hard-contact reference come first. Empty when no response was judged.
struct WorstTickRuns {
    const Record* first = nullptr;
    const Record* other = nullptr;  ///< null: only one run
    bool first_is_deeper = true;    ///< by the worst depth of the scene; the tick shown is that of this run
    std::string first_name;
    std::string other_name;
};
std::optional<WorstTickRuns> worst_tick_runs(const std::vector<Record>& records);
/// The result points into the records.
std::optional<WorstTickRuns> worst_tick_runs(std::vector<Record>&&) = delete;

/// Draws the states side by side with a common depth scale, as SVG.
std::string draw(const WorstTick& seen);

}  // namespace trocar
