// One run as a report reads it: specification, environment, every tick and outcome. It is stored as one JSON line. A
// report reads records only, so that any table can be rebuilt byte for byte.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "contact/outcome.hpp"
#include "measure/contact_event.hpp"
#include "measure/metric.hpp"
#include "measure/step_row.hpp"

namespace trocar {

/// Everything that determines the result of a run, and thus the key under which it is stored.
struct RunSpec {
    std::string study;
    std::string mode;             ///< "replay" | "repeated_motion" | "closed_loop" | "work_precision" | "paced" |
                                  ///< "cost_by_size" | "against" | "resolution" | "hard_case" | "metamorphic" |
                                  ///< "external"
    std::string scene;            ///< scene name
    std::string scene_file;       ///< relative to the study file
    std::string scene_hash;       ///< 16 hex digits
    std::string pair_class;       ///< "I2I", "I2R", "I2T", "R2T", "T2T"
    std::string detector;         ///< NAME[:key=value…]
    std::string response;         ///< empty in replay
    std::string contacts;         ///< contact generator; empty in replay, but on generated scenes
    std::string stepper = {};     ///< empty: the default one
    std::string against = {};     ///< second stepper of the run (simulate/against.hpp); empty: none
    std::string device = {};      ///< "key=value,…" with all settings; empty in replay, else the default one
    std::string setting;          ///< "default" | "recommended" | "tuned" | "reading"
    std::int64_t repetition = 0;  ///< process number
    std::uint64_t seed = 1;
    std::int64_t ticks = 0;
    /// Truth (pairs and depth) is computed on every n-th tick, since it costs more than any method; 0 = never.
    std::int64_t truth_stride = 1;
    /// Every n-th judged tick is judged in detail too: proximity pairs, depth errors of contacts, overlap of closed
    /// bodies. These figures rank nothing and cost more than the rest.
    std::int64_t detail_stride = 1;
    /// Runs the space-time oracle on every tick: contacts that begin between frames, and events.
    bool between_ticks = false;
    /// Changes to the scene, "KEY=VALUE,…" as simulate/overrides.hpp reads them; empty: none.
    std::string overrides = {};
    /// Work-precision run: the parameter that varies, and its value.
    std::string knob = {};
    std::string point = {};
};

/// True when the report uses a time of this run, so that no other run may execute in parallel.
bool is_timed(const RunSpec& spec);

struct Record {
    RunSpec spec;
    std::map<std::string, std::string>
        environment;  ///< commit, dirty, compiler, flags, cpu, kernel, library versions …
    Outcome outcome;
    std::string frames_hash;  ///< replay: hash over all frames of the detector
    std::string state_hash;   ///< closed loop: hash of the last frame
    Summary summary;
    std::vector<ContactEvent> events;  ///< in order of beginning; empty unless spec.between_ticks
    std::vector<StepRow> rows;
};

/// A record of the run without results, with environment().
Record started_record(const RunSpec& spec);

/// Name of a run: a hash over its specification alone, 16 hexadecimal digits. Measuring a run again does not change it.
std::string run_id(const RunSpec& spec);

/// One JSON line without a newline; non-finite numbers are null (NaN again when read). Numbers have the fewest digits
/// that restore the same bits. Rows are stored by column, and unset columns are left out. Columns that are constant,
/// count up, or are set on every k-th tick only have a short form.
std::string to_json_line(const Record& record);
/// Throws InputError with file and line number.
Record record_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number);

/// Name of the file in which a study stores its records, one line each, compressed by gzip.
inline constexpr const char* records_name = "records.jsonl.gz";
/// The records of a folder: records.jsonl.gz, which is the newer format and wins where both are there, or the plain
/// records.jsonl of earlier versions. Where neither is there, the name of the former.
std::filesystem::path records_file(const std::filesystem::path& folder);

}  // namespace trocar
