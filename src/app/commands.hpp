// One plain structure of options and one function per command. command_line.cpp fills the structures from the command
// line, so that the heavy parser header stays in one file; each function returns the exit status (DESIGN §10).
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

/// Given to every command.
struct CommonOptions {
    bool json = false;                               ///< one JSON document on stdout, messages on stderr
    std::optional<std::filesystem::path> data = {};  ///< --data, else $TROCAR_DATA
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
    double time_limit_s = 600.0;  ///< per detector
};
int replay(const CommonOptions& common, const ReplayOptions& options);

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
    std::vector<std::string> responses;         ///< empty: hold; of a report: ours and the best other
    std::string detector = "ohc_clustered";
    std::string contacts;  ///< contact generator; empty: each response's own
    std::string stepper;   ///< NAME[:key=value…]; empty: the default one
    std::optional<std::int64_t> ticks;
    std::string scene;   ///< of a report: name, or file
    bool pages = false;  ///< a page for every scene of a report, in its folder
    std::optional<std::filesystem::path> output;
};
int view(const CommonOptions& common, const ViewOptions& options);

struct ExportOptions {
    std::filesystem::path source;  ///< scene (.json) or recording
    std::string to;                ///< paraview | gltf | obj
    std::filesystem::path output;  ///< a new or empty folder
    MethodChoice methods;          ///< of a scene
    std::optional<std::int64_t> ticks;
    std::optional<std::int64_t> every;     ///< absent: so that about 60 frames are written
    std::vector<std::int64_t> more_ticks;  ///< written too
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
    int jobs = 1;                                 ///< side by side, of runs that nobody times
    std::vector<std::string> with;                ///< methods that take part beside those of the file
    std::optional<std::filesystem::path> output;  ///< default build/reports/<study>
    bool publish = false;                         ///< copy the finished report to reports/<study>
    bool plan_only = false;                       ///< print the run list and stop
    /// Internal: run only this entry of the plan in this process and write its record to `child_output`.
    std::optional<std::int64_t> child_run;
    std::optional<std::filesystem::path> child_output;
};
int study(const CommonOptions& common, const StudyOptions& options);

struct ReportOptions {
    std::filesystem::path directory;
    std::optional<std::filesystem::path> against;  ///< compare with these records instead of writing a report
    double tolerance = 1.0e-9;                     ///< relative, for --against
    bool picture = false;                          ///< run the picture's two runs once more and keep what they show
    std::optional<std::filesystem::path> study;    ///< its file, where the records do not name it from here
};
int report(const CommonOptions& common, const ReportOptions& options);

struct TableOptions {
    std::filesystem::path records;     ///< a report's folder, or its records.jsonl
    std::vector<std::string> columns;  ///< NAME[:UNIT]; empty: a choice that suits the records
    std::vector<std::string> where;    ///< NAME=VALUE or NAME!=VALUE
    std::vector<std::string> sort;     ///< NAME[:desc]
    std::string format = "md";         ///< md | tex | csv
};
int table(const CommonOptions& common, const TableOptions& options);

struct ReferenceOptions {
    std::vector<std::filesystem::path> scenes;
    bool check = false;                  ///< only say whether the stored ones fit; nothing is made
    std::optional<double> time_step_ms;  ///< finest step instead of the scene's own
    std::optional<double> k;             ///< N/m, of every contact instead of the scene's own
    std::string without;                 ///< store that there is none, for this reason; nothing is computed
};
int reference(const CommonOptions& common, const ReferenceOptions& options);

struct BaselineOptions {
    std::string what;                            ///< write | check
    std::vector<std::filesystem::path> sources;  ///< scenes (.json) and recordings
    /// NAME[:parameters], all, or recorded: what a recording carries; empty: what is kept, else recorded, else all
    std::vector<std::string> detectors;
    std::optional<std::filesystem::path> folder;  ///< default: baseline/ beside each source
    std::optional<std::int64_t> every;            ///< default: as kept, else about 20 ticks of the generator
    double tolerance = 1.0e-9;                    ///< m
    double time_limit_s = 600.0;                  ///< per detector and source
    std::optional<std::filesystem::path> junit;   ///< file for a CI server, of check
};
int baseline(const CommonOptions& common, const BaselineOptions& options);

struct ScenesOptions {
    std::vector<std::filesystem::path> places;  ///< scene files, their names, and folders; empty: trocar's own
    bool all = false;                           ///< of trocar's own also those that only studies use
    bool names = false;                         ///< print names and nothing else; reads no scene
};
int scenes(const CommonOptions& common, const ScenesOptions& options);

struct ListOptions {};
int list(const CommonOptions& common, const ListOptions& options);

struct SchemaOptions {
    std::string what;  ///< scene | study | recording | baseline | figures
};
int schema(const CommonOptions& common, const SchemaOptions& options);

}  // namespace trocar::app
