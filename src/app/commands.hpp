// One struct of options and one function per command. command_line.cpp fills the structs, so that the parser header
// stays in one file. Each function returns the exit status (DESIGN §10).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/run_choice.hpp"

namespace trocar::app {

/// Exit status of the program.
enum ExitStatus : int { done = 0, comparison_failed = 1, bad_input = 2, method_failed = 3, interrupted = 130 };

/// Options of every command.
struct CommonOptions {
    bool json = false;                               ///< one JSON document on stdout, messages on stderr
    std::optional<std::filesystem::path> data = {};  ///< --data, else $TROCAR_DATA
    std::vector<std::string> program = {};           ///< command that starts this program again
};

struct MeshOptions {
    std::filesystem::path file;
    std::optional<std::filesystem::path> mend;
};
int mesh(const CommonOptions& common, const MeshOptions& options);

struct DetectOptions {
    std::filesystem::path file_a;
    std::filesystem::path file_b;
    std::string pose_a = "0 0 0 0 0 0";
    std::string pose_b = "0 0 0 0 0 0";
    double scale_a = 1.0;
    double scale_b = 1.0;
    std::string detector = "ohc";  ///< NAME[:parameters] or all
    bool truth = false;
    double time_limit_s = 60.0;  ///< per detector
    std::optional<std::filesystem::path> write_posed;
};
int detect(const CommonOptions& common, const DetectOptions& options);

struct TritriOptions {
    std::filesystem::path file;
    std::string test = "exact";  ///< moller | interval | exact
};
int tritri(const CommonOptions& common, const TritriOptions& options);

struct ReplayOptions {
    std::filesystem::path recording;
    std::string detector = "ohc";  ///< NAME[:parameters] or all
    bool truth = false;
    std::string start = "unknown";  ///< clean | unknown
    double time_limit_s = 600.0;    ///< per detector
};
int replay(const CommonOptions& common, const ReplayOptions& options);

struct JudgeOptions {
    std::vector<std::filesystem::path> inputs;  ///< playback/frame_series.hpp
    std::string unit;                           ///< of coordinates; empty: none
    std::string frame_time;                     ///< number with unit; empty: unknown
    std::string bodies = "given";               ///< given | components | objects
    std::string start = "unknown";              ///< clean | unknown
    bool self = false;                          ///< count self-intersections
    std::string max_penetration;                ///< number with unit; empty: no limit
    std::optional<double> max_passed_through;
    std::optional<double> max_wrong_side;
    std::optional<double> max_self_intersections;
    std::optional<std::filesystem::path> output;  ///< new or empty folder
    std::optional<std::filesystem::path> junit;
};
int judge(const CommonOptions& common, const JudgeOptions& options);

struct RespondOptions {
    std::filesystem::path file;
};
int respond(const CommonOptions& common, const RespondOptions& options);

struct RunOptions {
    std::filesystem::path scene;
    MethodChoice methods;
    std::optional<std::int64_t> ticks;
    std::optional<std::filesystem::path> record;
    bool paced = false;                    ///< released by the clock, not judged
    bool explain_step = false;             ///< say what step tissue and operators bear, run nothing
    std::string unstable_step = "refuse";  ///< refuse | substep | allow: steps that are unstable for certain
};
int run(const CommonOptions& common, const RunOptions& options);

struct ViewOptions {
    std::vector<std::filesystem::path> inputs;  ///< one scene, one recording, or report folders
    std::vector<std::string> responses;         ///< empty: the default; for a report: ours and the best other
    MethodChoice methods;                       ///< of a scene, but for the response
    std::optional<std::int64_t> ticks;
    std::string scene;   ///< for a report: scene name or file
    bool pages = false;  ///< create a page for every scene of a report, in its folder
    std::optional<std::filesystem::path> output;
};
int view(const CommonOptions& common, const ViewOptions& options);

struct ExportOptions {
    std::filesystem::path source;  ///< scene (.json) or recording
    std::string to;                ///< paraview | gltf | obj
    std::filesystem::path output;  ///< new or empty folder
    MethodChoice methods;          ///< for a scene
    std::optional<std::int64_t> ticks;
    std::optional<std::int64_t> every;     ///< default: chosen for about 60 frames
    std::vector<std::int64_t> more_ticks;  ///< additional ticks to write
};
int export_frames(const CommonOptions& common, const ExportOptions& options);

struct ExplainOptions {
    std::filesystem::path scene;
    std::int64_t tick = 0;
    std::string response = "thesis:profile=faithful";
    std::string pair;  ///< "a,b" or empty
};
int explain(const CommonOptions& common, const ExplainOptions& options);

struct StudyOptions {
    std::filesystem::path file;
    int jobs = 1;                                 ///< parallel runs, untimed ones only
    std::vector<std::string> with;                ///< additional methods
    std::vector<std::string> scenes;              ///< in place of those of the study
    std::optional<std::filesystem::path> output;  ///< default build/reports/<study>
    bool publish = false;                         ///< copy the finished report to reports/<study>
    bool plan_only = false;                       ///< print the run list and stop
    std::optional<std::string> shard = {};        ///< K/N: only these runs, without report
    bool slurm = false;                           ///< submit shards and their merge to Slurm and stop
    std::int64_t array = 4;                       ///< shards, for `slurm`
    std::optional<std::string> time = {};         ///< limit of a shard as Slurm writes it, for `slurm`
    /// Internal: execute only these runs of the plan, one or those of a group, and write their records to
    /// `child_output`.
    std::vector<std::int64_t> child_runs;
    std::optional<std::filesystem::path> child_output;
};
/// Words of the command line that say how the study differs from its file.
std::vector<std::string> changes_of(const StudyOptions& options);
int study(const CommonOptions& common, const StudyOptions& options);

struct MergeOptions {
    std::filesystem::path output;                ///< new or empty folder
    std::vector<std::filesystem::path> folders;  ///< of shards
};
int merge(const CommonOptions& common, const MergeOptions& options);

struct TuneOptions {
    std::filesystem::path file;
    int jobs = 1;
    std::filesystem::path output;
};
int tune(const CommonOptions& common, const TuneOptions& options);

struct ReportOptions {
    std::filesystem::path directory;
    std::optional<std::filesystem::path> against;  ///< compare with these records instead of writing a report
    double tolerance = 1.0e-9;                     ///< relative, for --against
    bool picture = false;  ///< repeat the two runs of the picture and store their cross-sections
    /// study file, when the records do not name it relative to the working directory
    std::optional<std::filesystem::path> study;
};
int report(const CommonOptions& common, const ReportOptions& options);

struct BoardOptions {
    std::vector<std::filesystem::path> records;  ///< reports' folders, or their files of records, the oldest first
    std::filesystem::path output;                ///< folder of the page
};
int board(const CommonOptions& common, const BoardOptions& options);

struct TableOptions {
    std::filesystem::path records;     ///< a report's folder, or its file of records
    std::vector<std::string> columns;  ///< NAME[:UNIT]; empty: default columns
    std::vector<std::string> where;    ///< NAME=VALUE or NAME!=VALUE
    std::vector<std::string> sort;     ///< NAME[:desc]
    std::string format = "md";         ///< md | tex | csv | google-benchmark | dashboard
    /// database with all runs instead of a printed table
    std::optional<std::filesystem::path> sqlite = {};
};
int table(const CommonOptions& common, const TableOptions& options);

struct ReferenceOptions {
    std::vector<std::filesystem::path> scenes;
    bool check = false;       ///< only report whether stored references are current; computes nothing
    std::optional<double> k;  ///< N/m, of every contact instead of the scene's own
    std::string without;      ///< store the absence of a reference with this reason; computes nothing
};
int reference(const CommonOptions& common, const ReferenceOptions& options);

struct BaselineOptions {
    std::string what;                            ///< write | check
    std::vector<std::filesystem::path> sources;  ///< scenes (.json) and recordings
    /// NAME[:parameters], all, or recorded (contacts of a recording). Default: the stored ones, else recorded, else
    /// all.
    std::vector<std::string> detectors;
    std::optional<std::filesystem::path> folder;  ///< default: baseline/ beside each source
    std::optional<std::int64_t> every;            ///< default: as stored, else about 20 ticks of the generator
    double tolerance = 1.0e-9;                    ///< m
    double time_limit_s = 600.0;                  ///< per detector and source
    std::optional<std::filesystem::path> junit;   ///< for `check`: JUnit file for a CI server
};
int baseline(const CommonOptions& common, const BaselineOptions& options);

struct ScenesOptions {
    std::vector<std::filesystem::path> places;  ///< scene files, scene names and folders; empty: shipped scenes
    bool all = false;                           ///< include shipped scenes that only studies use
    bool names = false;                         ///< print names only; reads no scene
};
int scenes(const CommonOptions& common, const ScenesOptions& options);

struct DrawOptions {
    std::string family;  ///< resolution | judged
    std::filesystem::path folder;
    std::uint64_t seed = 1;
};
int draw(const CommonOptions& common, const DrawOptions& options);

struct ListOptions {};
int list(const CommonOptions& common, const ListOptions& options);

struct SchemaOptions {
    std::string what;  ///< scene | study | recording | baseline | figures
};
int schema(const CommonOptions& common, const SchemaOptions& options);

}  // namespace trocar::app
