// A study says what to compare: which methods on which scenes, how often, and within what time. It is a file that a
// person can read; the plan made from it is the shuffled list of runs that the runner works off one by one.
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

/// A method as a study names it, with the origin of its settings for the fairness block.
struct StudyMethod {
    std::string text;                 ///< NAME[:key=value…], keys in alphabetical order
    std::string setting = "default";  ///< "default" | "recommended" | "tuned"
    std::string basis;                ///< who recommends the setting, or how it was searched and with what budget
    std::vector<std::string> scenes;  ///< of the part's scenes, those it runs on; empty: all
    /// Of a response in the closed loop: those of the part's detectors and contact generators that it runs with; empty:
    /// all.
    std::vector<std::string> detectors = {};
    std::vector<std::string> contacts = {};
    /// Of a response in the closed loop: what it is made for, as RunSpec::stepper, instead of the part's; empty: those.
    std::vector<std::string> steppers = {};
    /// Of a detector in the closed loop: false, its runs are not judged; they are timed, and what truth says of the
    /// same motion is reported them too.
    bool judged = true;
    std::optional<std::string> absent_reason;  ///< set when this build lacks the method: its runs become rows `absent`
};

/// Detectors on the same frames.
struct ReplayPart {
    std::vector<std::string> scenes;  ///< files, relative to the study file
    std::vector<StudyMethod> detectors;
    std::int64_t ticks = 0;         ///< 0: the scene's own number
    std::int64_t repetitions = 1;   ///< fresh processes per method
    std::int64_t truth_stride = 1;  ///< truth is computed on every n-th tick
    bool between_ticks = false;     ///< the space-time oracle follows every tick
};

/// Detector × response × contact generator × stepper, each driving its own copy of the scene.
struct ClosedLoopPart {
    std::vector<std::string> scenes;
    std::vector<StudyMethod> detectors;
    std::vector<StudyMethod> responses;
    std::vector<std::string> contacts;       ///< contact generators
    std::vector<std::string> steppers = {};  ///< as RunSpec::stepper; empty: the default one alone
    std::int64_t ticks = 0;
    std::int64_t repetitions = 1;
    std::int64_t truth_stride = 1;
    std::int64_t detail_stride = 1;  ///< as RunSpec::detail_stride
};

/// The thesis' own table: time of the response per triangle pair and per iteration, without and with the triangle test.
struct TrianglePairPart {
    std::vector<std::string> scenes;
    StudyMethod response;
    std::int64_t ticks = 0;
    std::int64_t repetitions = 1;
    std::int64_t truth_stride = 1;
};

/// Knobs turned one at a time: one curve of time against error for each scene and method.
struct WorkPrecisionPart {
    struct Sweep {
        std::vector<std::string> scenes;
        std::vector<StudyMethod> detectors;
        std::vector<StudyMethod> responses;  ///< empty: the detectors on replayed frames
        std::string contacts;                ///< empty: each response's own
        std::string knob;                    ///< dt | k | substeps | detector.KEY | response.KEY
        std::vector<std::string> values;     ///< as written after KEY=
    };
    std::vector<Sweep> sweeps;
    std::int64_t ticks = 0;  ///< at the scene's own dt
    std::int64_t repetitions = 1;
    std::int64_t truth_stride = 1;
};

/// What each switch between two settings of a response changes: turned on alone in `from`, turned off alone in `to`. An
/// option, which neither setting turns on, is turned on alone in both. Without `to` all switches are options of `from`.
/// Contacts are of the generator that `from` works from by itself; a switch `source` turns that.
struct AblationPart {
    struct Switch {
        std::string parameter;
        std::string from;  ///< empty: an option
        std::string to;
        std::vector<std::string> scenes;  ///< of the part's scenes, those it is turned on; empty: all
        /// "key=value,…" set in both settings while this switch is turned: what it needs to act. Empty: nothing.
        std::string with;
        std::string silent_from;  ///< why it is without effect in `from` by construction; empty: it is not
        std::string silent_to;
    };
    std::vector<std::string> scenes;
    StudyMethod detector;
    StudyMethod from;
    StudyMethod to;  ///< without a text: none
    std::vector<Switch> switches;
    std::int64_t ticks = 0;
    std::int64_t repetitions = 1;
    std::int64_t truth_stride = 1;
};

/// The switch of an ablation that is no parameter: the contact generator.
inline constexpr const char* generator_switch = "source";

/// Methods on scenes, each response on the contact generator that it works from by itself; which detector meets which
/// response is reported beside the part.
struct LoopPart {
    std::vector<std::string> scenes;
    std::vector<StudyMethod> detectors;
    std::vector<StudyMethod> responses;
    std::vector<std::string> steppers = {};  ///< as RunSpec::stepper; empty: the default one alone
    std::int64_t ticks = 0;
    std::int64_t repetitions = 1;  ///< processes of their own
    std::int64_t truth_stride = 1;
};

/// The hard cases (simulate/hard_case.hpp): every detector on every case of meshes and every family of triangle pairs,
/// every response (on the answer of the first detector, by its own contact generator) on every case that is a scene.
struct HardCasesPart {
    std::string folder;  ///< relative to the study file
    std::vector<HardCase> cases;
    std::vector<std::string> families;  ///< files of triangle pairs, "data:PATH"
    std::vector<StudyMethod> detectors;
    std::vector<StudyMethod> responses;
    std::int64_t truth_stride = 1;
};

/// The method with one parameter set, whatever it was before.
StudyMethod with_parameter(const StudyMethod& method, const std::string& key, const std::string& value);

struct Study {
    std::filesystem::path file;
    std::string name;
    std::uint64_t seed = 1;
    double time_limit_s = 60.0;  ///< s, per run
    std::string device;          ///< of every closed loop, as RunSpec::device
    std::string reference;       ///< detector that ratios of times are taken to; empty: no ratios
    std::string ours;            ///< response that page one sets against all others; empty: methods written by us
    std::string quotes;          ///< what another published report found, with its name; page one repeats it
    std::optional<ReplayPart> replay;
    std::optional<ClosedLoopPart> closed_loop;
    std::optional<TrianglePairPart> triangle_pair;
    std::optional<WorkPrecisionPart> work_precision;
    std::optional<AblationPart> ablation;
    /// Every detector with every response in the closed loop, released by the clock (simulate/paced.hpp).
    std::optional<LoopPart> paced;
    /// Every detector with every response and stepper on scenes that grow, timed and not judged: what a tick costs
    /// against the number of tissue triangles, stages apart. Scenes of one family have names that differ behind the
    /// last underscore only.
    std::optional<LoopPart> cost_by_size;
    std::optional<HardCasesPart> hard_cases;
    /// Determinism (simulate/metamorphic.hpp): every detector on the frames of every scene, every response in the
    /// closed loop of the first detector. At least two processes: one knows nothing of a fresh one.
    std::optional<LoopPart> metamorphic;
};

/// Reads strictly. Throws InputError with a JSON pointer for an unknown key, a wrong type, an impossible number, a
/// missing scene file, and a method or parameter that no build knows. A method that this build lacks is no error.
/// `with`: methods that take part beside those of the file (study_items.hpp, add_method).
/// `shipped`: scene files that the study may name without a folder when none of that name lies beside it.
Study read_study(const std::filesystem::path& file, const std::vector<std::string>& with = {},
                 const std::vector<std::filesystem::path>& shipped = {});
/// Where the detector that ratios are taken to does not run, so that there are none: one line each.
std::vector<std::string> reference_notes(const Study& study);

/// JSON Schema document printed by `trocar schema study`.
std::string study_schema();

/// What a scene file reports a plan.
struct SceneFacts {
    std::string name;
    std::string hash;        ///< 16 hex digits; empty when the scene could not be read
    std::string pair_class;  ///< "I2T", or several joined by "+"
    std::int64_t ticks = 0;  ///< the scene's own number
    double dt = 0.001;       ///< s
    std::int64_t triangles = 0;
    bool lacks_data = false;
};

/// Facts of a scene that has been read.
SceneFacts facts_of(const Scene& scene);

/// Reads one scene. A scene that names data which is not there is a fact, any other fault is an InputError.
SceneFacts read_scene_facts(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);

/// True when the run reads no scene: a hard case of meshes, or a family of triangle pairs.
bool is_mesh_case(const RunSpec& spec);
/// The same facts of what such a run reads. `folder`: of the study file.
SceneFacts read_case_facts(const std::filesystem::path& folder, const RunSpec& spec,
                           const std::optional<std::filesystem::path>& data);
/// Makes such a run.
Record make_mesh_case_run(const std::filesystem::path& folder, const RunSpec& spec,
                          const std::optional<std::filesystem::path>& data);

struct PlannedRun {
    RunSpec spec;  ///< scene name, hash, class and ticks are filled by complete_run
    StudyMethod detector;
    StudyMethod response;
    /// Set when the outcome is known without running: absent method, missing data, native contacts of a detector that
    /// has none or for a response that cannot read them.
    std::optional<Outcome> settled;
    std::map<std::string, std::string> facts;  ///< more for the record's environment
    /// s, for the plan alone: a line through the default study's runs in ticks, judged ticks and triangles. A slow
    /// baseline or a busy machine takes several times as long.
    double rough_seconds = 0.0;
};

/// The runs in the order in which they are made: one block per repetition, methods of a block interleaved at random
/// by the study's seed. The same study gives the same list on every machine. Reads no scene.
std::vector<PlannedRun> make_plan(const Study& study);

/// Fills what only the scene file knows, and settles runs whose data is missing.
void complete_run(const SceneFacts& facts, PlannedRun& run);

/// Facts about study and methods that a record carries in its environment, so that a report needs nothing else:
/// "study.…", "detector.…", "response.…", "absent.…".
std::map<std::string, std::string> method_facts(const Study& study, const PlannedRun& run);

}  // namespace trocar
