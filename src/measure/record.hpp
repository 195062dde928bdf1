// One run as a report reads it: what was run, on what, every tick, and how it ended. Written as one JSON line; a report
// reads records only, so any table can be rebuilt byte for byte.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "contact/outcome.hpp"
#include "measure/contact_event.hpp"
#include "measure/step_row.hpp"

namespace trocar {

/// What one run is: everything that decides its result, and thus the key it is stored under.
struct RunSpec {
    std::string study;
    std::string mode;        ///< "replay" | "closed_loop" | "triangle_pair" | "work_precision" | "ablation" | "paced" |
                             ///< "cost_by_size" | "hard_case" | "metamorphic test"
    std::string scene;       ///< scene name
    std::string scene_file;  ///< relative to the study file
    std::string scene_hash;  ///< 16 hex digits
    std::string pair_class;  ///< "I2I", "I2R", "I2T", "R2T", "T2T"
    std::string detector;    ///< NAME[:key=value…]
    std::string response;    ///< empty in replay
    std::string contacts;    ///< contact generator; empty in replay
    std::string stepper = {};                ///< empty: the default one
    std::string query_distance_margin = {};  ///< mean edges; empty: the default one
    std::string device = {};      ///< "key=value,…" with all settings; empty in replay, else the default one
    std::string setting;          ///< "default" | "recommended" | "tuned"
    std::int64_t repetition = 0;  ///< process number
    std::uint64_t seed = 1;
    std::int64_t ticks = 0;
    /// Truth (pairs and depth) is computed on every n-th tick, since it costs more than any method; 0 = never.
    std::int64_t truth_stride = 1;
    /// Of the judged ticks, every n-th is judged in detail too: near pairs, depth errors of contacts, overlap of closed
    /// bodies. Nothing is ranked by these, and they cost more than the rest.
    std::int64_t detail_stride = 1;
    /// The space-time oracle follows every tick: contacts that begin between frames, and events.
    bool between_ticks = false;
    /// Changes to the scene, "KEY=VALUE,…" as simulate/overrides.hpp reads them; empty: as the file says.
    std::string overrides = {};
    /// Of a work-precision or ablation run: the knob or switch that is turned, and where it stands.
    std::string knob = {};
    std::string point = {};
};

struct Record {
    RunSpec spec;
    std::map<std::string, std::string>
        environment;  ///< commit, dirty, compiler, flags, cpu, kernel, library versions …
    Outcome outcome;
    std::string frames_hash;                ///< replay: hash over all frames the detector saw
    std::string state_hash;                 ///< closed loop: hash of the last frame
    std::map<std::string, double> summary;  ///< figures by the names of metrics.hpp; NaN = n/a
    std::vector<ContactEvent> events;       ///< in order of beginning; empty unless spec.between_ticks
    std::vector<StepRow> rows;
};

/// One JSON line without a newline; non-finite numbers are null (NaN again when read). Numbers are written with as few
/// digits as bring back the same bits. Rows are stored column by column; a column that is unset throughout is left out,
/// one that is constant, counts up, or is set on every k-th tick only is stored in that short form.
std::string to_json_line(const Record& record);
/// Throws InputError with file and line number.
Record record_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number);

}  // namespace trocar
