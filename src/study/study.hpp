// A study defines a comparison: methods, scenes, repetitions and time limit. make_plan turns it into the shuffled list
// of runs that the runner executes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "contact/outcome.hpp"
#include "measure/record.hpp"
#include "scene/scene.hpp"
#include "simulate/hard_case.hpp"

namespace trocar {

/// A method of a study, with the origin of its settings for the fairness section.
struct StudyMethod {
    std::string text;                 ///< NAME[:key=value…], keys in alphabetical order
    std::string setting = "default";  ///< "default" | "recommended" | "tuned"
    std::string basis;                ///< source of the setting: who recommends it, or the search and its budget
    std::vector<std::string> scenes;  ///< subset of the part's scenes; empty: all
    /// For a response in the closed loop: subset of the part's detectors and contact generators; empty: all.
    std::vector<std::string> detectors = {};
    std::vector<std::string> contacts = {};
    /// For a response in the closed loop: steppers as RunSpec::stepper, instead of the part's; empty: the part's.
    std::vector<std::string> steppers = {};
    /// For a detector in the closed loop: false = its runs are timed and not judged. They report the oracle's figures
    /// of a judged run with the same motion.
    bool judged = true;
    std::optional<std::string> absent_reason;  ///< set when this build lacks the method; its runs become rows `absent`
};

/// Detectors on prescribed frames.
struct ReplayPart {
    std::vector<std::string> scenes;  ///< files, relative to the study file
    std::vector<StudyMethod> detectors;
    std::int64_t ticks = 0;         ///< 0: as the scene says
    std::int64_t repetitions = 1;   ///< processes per method
    std::int64_t truth_stride = 1;  ///< the oracle runs on every n-th tick
    bool between_ticks = false;     ///< true: the space-time oracle follows every tick
};

/// Detector × response × contact generator × stepper, each on its own copy of the scene.
struct ClosedLoopPart {
    std::vector<std::string> scenes;
    std::vector<StudyMethod> detectors;
    std::vector<StudyMethod> responses;
    std::vector<std::string> contacts;       ///< contact generators
    std::vector<std::string> steppers = {};  ///< as RunSpec::stepper; empty: the default one
    std::int64_t ticks = 0;
    std::int64_t repetitions = 1;
    std::int64_t truth_stride = 1;
    std::int64_t detail_stride = 1;
};

/// Varies one parameter at a time: one curve of time against error per scene and method.
struct WorkPrecisionPart {
    struct Sweep {
        std::vector<std::string> scenes;
        std::vector<StudyMethod> detectors;
        std::vector<StudyMethod> responses;  ///< empty: detectors on prescribed frames
        std::string contacts;                ///< empty: each response's default generator
        std::string knob;                    ///< dt | k | substeps | detector.KEY | response.KEY
        std::vector<std::string> values;     ///< as written after KEY=
    };
    std::vector<Sweep> sweeps;
    std::int64_t ticks = 0;  ///< at the scene's dt
    std::int64_t repetitions = 1;
    std::int64_t truth_stride = 1;
};

/// Methods on scenes, each response with its default contact generator. The members of Study state how detectors and
/// responses combine.
struct LoopPart {
    std::vector<std::string> scenes;
    std::vector<StudyMethod> detectors;
    std::vector<StudyMethod> responses;
    std::vector<std::string> steppers = {};  ///< as RunSpec::stepper; empty: the default one
    std::int64_t ticks = 0;
    std::int64_t repetitions = 1;  ///< processes per method
    std::int64_t truth_stride = 1;
};

/// Hard cases (simulate/hard_case.hpp). Every detector runs on every mesh case and every family of triangle pairs.
/// Every response runs on every scene case, with the first detector and its default contact generator.
struct HardCasesPart {
    std::string folder;  ///< relative to the study file
    std::vector<HardCase> cases;
    std::vector<std::string> families;  ///< files of triangle pairs, "data:PATH"
    std::vector<StudyMethod> detectors;
    std::vector<StudyMethod> responses;
    std::int64_t truth_stride = 1;
};

/// Copy of the method with one parameter replaced or added.
StudyMethod with_parameter(const StudyMethod& method, const std::string& key, const std::string& value);

struct Study {
    std::filesystem::path file;
    std::string name;
    std::uint64_t seed = 1;
    double time_limit_s = 60.0;  ///< s, per run
    std::string device;          ///< of every closed loop, as RunSpec::device
    std::string reference;       ///< detector in the denominator of time ratios; empty: no ratios
    std::string ours;            ///< response that page one compares with all others; empty: this project's methods
    std::string quotes;          ///< finding of another published report, with its source, printed on page one
    std::optional<ReplayPart> replay;
    std::optional<ClosedLoopPart> closed_loop;
    std::optional<WorkPrecisionPart> work_precision;
    /// Every detector with every response in the closed loop, paced by the clock (simulate/paced.hpp).
    std::optional<LoopPart> paced;
    /// Every detector with every response and stepper on scenes of growing size: time per stage against tissue
    /// triangles. These runs are not judged. Names of one family of scenes differ only after the last underscore.
    std::optional<LoopPart> cost_by_size;
    std::optional<HardCasesPart> hard_cases;
    /// Metamorphic and determinism tests (`simulate/metamorphic.hpp`): every detector on the frames of every scene,
    /// every response in the closed loop of the first detector. At least two processes, so that fresh ones are
    /// compared.
    std::optional<LoopPart> metamorphic;
};

/// Strict reader. Throws InputError with a JSON pointer for an unknown key, wrong type, value out of range, missing
/// scene, or unknown method or parameter. A method that this build lacks is no error. `with`: additional methods
/// (study_items.hpp, add_method). `shipped`: scene files used when no file of that bare name lies beside the study.
Study read_study(const std::filesystem::path& file, const std::vector<std::string>& with = {},
                 const std::vector<std::filesystem::path>& shipped = {});
/// One line for each part without ratios because the reference detector does not run there.
std::vector<std::string> reference_notes(const Study& study);

/// JSON Schema, printed by `trocar schema study`.
std::string study_schema();

/// Facts of a scene file that a plan needs.
struct SceneFacts {
    std::string name;
    std::string hash;        ///< 16 hex digits; empty when the scene cannot be read
    std::string pair_class;  ///< "I2T", or several joined by "+"
    std::int64_t ticks = 0;
    double dt = 0.001;  ///< s
    std::int64_t triangles = 0;
    bool lacks_data = false;
};

SceneFacts facts_of(const Scene& scene);

/// Reads one scene. Missing data sets `lacks_data`; any other fault throws InputError.
SceneFacts read_scene_facts(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// True for a run without a scene: a mesh case or a family of triangle pairs.
bool is_mesh_case(const RunSpec& spec);
/// Facts of a mesh case. `folder`: of the study file.
SceneFacts read_case_facts(const std::filesystem::path& folder, const RunSpec& spec,
                           const std::optional<std::filesystem::path>& data);
/// Executes a run with is_mesh_case().
Record make_mesh_case_run(const std::filesystem::path& folder, const RunSpec& spec,
                          const std::optional<std::filesystem::path>& data);

struct PlannedRun {
    RunSpec spec;  ///< complete_run fills scene name, hash, class and ticks
    StudyMethod detector;
    StudyMethod response;
    /// Set when the outcome is fixed without running: absent method, missing data, or native contacts that the detector
    /// lacks or the response cannot read.
    std::optional<Outcome> settled;
    std::map<std::string, std::string> facts;  ///< additional facts for the record's environment
    /// s, estimate for the printed plan: linear in ticks, judged ticks and triangles, fitted to the default study. Slow
    /// methods and loaded machines take several times as long.
    double rough_seconds = 0.0;
};

/// Runs in execution order: one block per repetition, methods of a block shuffled by the study's seed. The result is
/// the same on every machine. Reads no scene.
std::vector<PlannedRun> make_plan(const Study& study);

/// Fills the facts of the scene, and sets `settled` for missing data.
void complete_run(const SceneFacts& facts, PlannedRun& run);

/// Facts of study and methods for the record's environment, so that a report needs records only: "study.…",
/// "detector.…", "response.…", "absent.…".
std::map<std::string, std::string> method_facts(const Study& study, const PlannedRun& run);

}  // namespace trocar
