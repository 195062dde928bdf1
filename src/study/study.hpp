// A study is a list of experiments, and an experiment is a product of factors. make_plan turns a study into the
// shuffled list of runs that the runner executes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "contact/outcome.hpp"
#include "measure/record.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// One level of a factor: a method, with the origin of its settings and the levels of other factors that it runs with.
struct Level {
    std::string text;                 ///< NAME[:key=value…], keys in alphabetical order
    std::string setting = "default";  ///< "default" | "recommended" | "tuned" | "reading"
    /// For a reading: the response that it is, at another value that its author leaves open.
    std::string reading_of = {};
    std::string basis = {};  ///< source of the setting: who recommends it, or the search and its budget
    /// By factor, "inputs", "detectors", "contacts" or "steppers": what it runs with instead of the experiment's list.
    std::map<std::string, std::vector<std::string>> only = {};
    /// For a detector in the closed loop: false = its runs are timed and not judged. They report the oracle's figures
    /// of a judged run with the same motion.
    bool judged = true;
    std::int64_t most_triangles = 0;                ///< of a generated scene that a detector runs on; 0: no limit
    std::optional<std::string> absent_reason = {};  ///< set when this build lacks it; its runs become rows `absent`
};

/// One level of the factor that methods run on.
struct Input {
    enum class Kind : std::uint8_t {
        scene,
        mesh_case,   ///< two meshes with their pairs (simulate/hard_case.hpp)
        scene_case,  ///< a scene with bounds on its figures (simulate/hard_case.hpp)
        pair_file,   ///< triangle pairs with truth, "data:PATH"
        generated,   ///< a scene by its text (simulate/generated_scene.hpp); its detectors take turns in one process
        external     ///< another group's data with its answers, "external:FORMAT:PATH"; detectors take turns
    };
    Kind kind = Kind::scene;
    std::string file = {};                          ///< relative to the study file; generated: "generated:" and text
    std::string name = {};                          ///< of a case or pair file; a scene has its own
    std::int64_t ticks = 0;                         ///< overrides the experiment's; 0: it does not
    std::int64_t triangles = 0;                     ///< of a generated scene
    std::map<std::string, std::string> facts = {};  ///< what the record keeps of the case
};

/// One parameter and the values that it takes.
struct Sweep {
    std::string knob;                 ///< dt | k | substeps | detector.KEY | response.KEY
    std::vector<std::string> values;  ///< as written after KEY=
};

/// Word for Experiment::against: the same scene with contact at every tick (simulate/resolution.hpp).
inline constexpr const char* twin = "twin";

/// The product inputs × detectors × responses × contact generators × steppers × values of the sweep, less what `only`
/// of a level excludes. Every combination is a run in a process of its own; on a generated scene, detectors take turns
/// in one process, and the study's reference takes part twice.
struct Experiment {
    enum class Frames : std::uint8_t {
        replay,      ///< the scene's prescribed frames: detectors alone
        closed_loop  ///< every combination drives its own copy of the scene
    };
    enum class Clock : std::uint8_t {
        back_to_back,  ///< the next tick begins when one ends
        paced          ///< at most one tick per dt, in turns with an empty loop (simulate/paced.hpp); not judged
    };
    Frames frames = Frames::replay;
    Clock clock = Clock::back_to_back;
    std::vector<Input> inputs;
    std::vector<Level> detectors;
    std::vector<Level> responses;       ///< empty in replay
    std::vector<std::string> contacts;  ///< contact generators; empty: each response's own
    std::vector<std::string> steppers;  ///< as RunSpec::stepper; empty: the default one
    std::optional<Sweep> sweep;
    /// Partner of every run in its process: a stepper that runs the scene in step, or `twin`; empty: none.
    std::string against;
    std::int64_t cycles = 0;       ///< scenes repeat their motion so often (simulate/overrides.hpp); 0: not
    double dither = 0.0;           ///< m, of scripted bodies in paced runs (simulate/overrides.hpp); 0: none
    bool perturbed = false;        ///< every run is compared with itself under perturbations (simulate/metamorphic.hpp)
    std::int64_t ticks = 0;        ///< 0: as the scene says; at the scene's dt
    std::int64_t repetitions = 1;  ///< processes per combination; cases and pair files run once
    std::int64_t truth_stride = 1;  ///< the oracle runs on every n-th tick; 0: never, the runs are timed only
    std::int64_t detail_stride = 1;
    bool between_ticks = false;  ///< the space-time oracle follows every tick
};

/// Copy of the method with one parameter replaced or added.
Level with_parameter(const Level& method, const std::string& key, const std::string& value);

struct Study {
    std::filesystem::path file;
    std::string name;
    std::uint64_t seed = 1;
    double time_limit_s = 60.0;  ///< s, per run
    std::string device;          ///< of every closed loop, as RunSpec::device
    std::string reference;       ///< detector in the denominator of time ratios; empty: no ratios
    std::string ours;            ///< response that page one compares with all others; empty: this project's methods
    std::string changes;         ///< words of the command line that say how it differs from its file
    std::string quotes;          ///< findings of other published reports, with their sources, printed on page one
    std::vector<std::string> quoted_reports;  ///< reports whose sentence and first table stand on page one
    std::vector<Experiment> experiments;
};

/// Strict reader. Throws InputError with a JSON pointer for an unknown key, wrong type, value out of range, missing
/// scene, or unknown method or parameter. A method that this build lacks is no error. `with`: additional methods
/// (study_items.hpp, add_method). `shipped`: scene files used when no file of that bare name lies beside the study.
/// `scenes`: files, patterns or shipped names in place of the list "scenes" of every experiment that has one.
Study read_study(const std::filesystem::path& file, const std::vector<std::string>& with = {},
                 const std::vector<std::filesystem::path>& shipped = {}, const std::vector<std::string>& scenes = {});
/// One line for each experiment without ratios because the reference detector does not run there.
std::vector<std::string> reference_notes(const Study& study);

/// JSON Schema, printed by `trocar schema study`.
std::string study_schema();

/// Facts of a scene file that a plan needs.
struct SceneFacts {
    std::string name;
    std::string hash;             ///< 16 hex digits; empty when the scene cannot be read
    std::string references = {};  ///< hash_of_references
    std::string pair_class;       ///< "I2T", or several joined by "+"
    std::int64_t ticks = 0;
    double dt = 0.001;  ///< s
    std::int64_t triangles = 0;
    std::int64_t bodies = 0;
    std::int64_t motions = 0;            ///< bodies with a scripted motion
    bool has_resolution_window = false;  ///< an interval without contact, and time after it (simulate/resolution.hpp)
    bool lacks_data = false;
};

SceneFacts facts_of(const Scene& scene);

/// Reads one scene. Missing data sets `lacks_data`; any other fault throws InputError.
SceneFacts read_scene_facts(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// True for a run without a scene: a mesh case or a file of triangle pairs.
bool is_mesh_case(const RunSpec& spec);
/// True for a run on a generated scene; the runs of one `group` are executed together.
bool is_generated(const RunSpec& spec);
/// True for a run on external data; the runs of one `group` are executed together.
bool is_external(const RunSpec& spec);
/// Formats of external data, as study files name them.
inline const std::vector<std::string> external_formats{"scalable_ccd", "fcl_scenario", "triangle_pairs", "ccd_queries"};
/// Input::file of a path below the data folder.
std::string external_file(const std::string& format, const std::string& path);
/// Name of such an input in reports.
std::string external_name(const std::string& path);

/// Facts of what RunSpec::scene_file names, without running it. `folder`: of the study file. `lacks_data` is set
/// where data are absent; any other fault throws InputError.
SceneFacts input_facts(const std::filesystem::path& folder, const RunSpec& spec,
                       const std::optional<std::filesystem::path>& data);

struct PlannedRun {
    RunSpec spec;  ///< complete_run fills scene name, hash, class and ticks
    Level detector;
    Level response;
    /// Set when the outcome is fixed without running: absent method, missing data, or native contacts that the detector
    /// lacks or the response cannot read.
    std::optional<Outcome> settled;
    std::map<std::string, std::string> facts;  ///< additional facts for the record's environment
    std::int64_t shard = 1;                    ///< number of the shard that makes it (shard.hpp)
    std::string group = {};  ///< runs with the same one take turns in one process; empty: alone in its process
    /// s, estimate for the printed plan: linear in ticks, judged ticks and triangles, fitted to the default study. Slow
    /// methods and loaded machines take several times as long.
    double rough_seconds = 0.0;
};

/// Methods of a run as texts print them: "ohc + penalty, implicit [k 1000]".
std::string methods_in_words(const RunSpec& spec);

/// Runs in execution order: one block per repetition, methods of a block shuffled by the study's seed. The result is
/// the same on every machine. Reads no scene.
std::vector<PlannedRun> make_plan(const Study& study);

/// Fills the facts of the scene, and sets `settled` for missing data. Throws InputError for cycles of a scene without
/// exactly one motion.
void complete_run(const SceneFacts& facts, PlannedRun& run);

/// Completes and executes the runs of one group, or a run without one. `turn`: called with the position of a run of a
/// group before its turn, to attribute a crash.
std::vector<Record> make_runs(const std::filesystem::path& folder, const std::vector<PlannedRun*>& runs,
                              const std::optional<std::filesystem::path>& data,
                              const std::function<void(std::size_t)>& turn);

/// Facts of study and methods for the record's environment, so that a report needs records only: "study.…",
/// "detector.…", "response.…", "absent.…".
std::map<std::string, std::string> method_facts(const Study& study, const PlannedRun& run);

}  // namespace trocar
