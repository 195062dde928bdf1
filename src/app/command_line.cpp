// The command line of trocar: parses, calls one command, turns InputError into one line and exit status 2.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <string>
#include <system_error>
#include <vector>

#include "app/commands.hpp"
#include "app/program.hpp"
#include "app/shell_words.hpp"
#include "app/shipped.hpp"
#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"

namespace {

using namespace trocar::app;

constexpr const char* exit_status_text =
    "Exit status: 0 the work was done (failed runs are rows); 1 a comparison failed; 2 bad input; 3 the one method "
    "asked for by name failed, or trocar itself; 130 interrupted.";

struct CommandLine {
    CLI::App app{
        "trocar: which collision detector and which contact response should a surgical simulator use, at haptic "
        "rate, and how wrong are they?"};
    CommonOptions common;
    std::string data;
    bool large = false;
    std::function<int()> command;

    CLI::App* add(const std::string& name, const std::string& description, const std::string& example) {
        CLI::App* sub = app.add_subcommand(name, description);
        sub->footer("Example:\n  " + example);
        sub->add_flag("--json", common.json, "One JSON document on stdout, messages on stderr");
        sub->add_option("--data", data, "Folder of the data outside the project (default: $TROCAR_DATA)");
        sub->add_flag("--large", large,
                      fmt::format("Take files of any size; without it at most {} triangles, {} bodies and {} runs of a "
                                  "study",
                                  trocar::most_triangles, trocar::most_bodies, trocar::most_runs));
        return sub;
    }
    /// Empty when the first word names a command, or is an option such as --help.
    std::string command_fault(int argc, char** argv) const {
        const std::string first = argc > 1 ? argv[1] : "";
        if (!first.empty() && first.front() == '-') return {};
        std::string known;
        for (const CLI::App* sub : app.get_subcommands({})) {
            if (sub->get_name() == first) return {};
            known += (known.empty() ? "" : ", ") + sub->get_name();
        }
        return "expected one of " + known + " as first word, got " + (first.empty() ? "nothing" : "'" + first + "'");
    }
    static void add_methods(CLI::App* sub, MethodChoice& choice) {
        sub->add_option("--detector", choice.detector, "NAME[:key=value,...]")->capture_default_str();
        sub->add_option("--response", choice.response,
                        "NAME[:key=value,...]; the default is what trocar recommends, thesis is the thesis' own")
            ->capture_default_str();
        sub->add_option(
            "--contacts", choice.contacts,
            "Contact generator: native, intersection, proximity or tracked_proximity (default: the response's own)");
        sub->add_option("--stepper", choice.stepper,
                        "NAME[:key=value,...]: what moves the tissue (default: semi_implicit)");
        sub->add_option("--device", choice.device,
                        "key=value,...: what shows the force on the tool, the same for every response; settings as in "
                        "trocar list (default: tip=fulcrum,saturation=8.5)");
    }
    /// A required file, or one of the names that `find` knows.
    static void add_found(CLI::App* sub, const std::string& name, auto& found, const std::string& meaning,
                          std::filesystem::path (*find)(const std::filesystem::path&) = find_scene,
                          const char* type = "SCENE") {
        const auto replace = [find](std::string& text) {
            if (!text.empty()) text = find(text).string();
            return std::string();
        };
        sub->add_option(name, found, meaning)->required()->type_name(type)->transform(CLI::Validator(replace, ""));
    }
    template <typename Options>
    void on(CLI::App* sub, Options& options, int (*run)(const CommonOptions&, const Options&)) {
        sub->callback([this, &options, run] { command = [this, &options, run] { return run(common, options); }; });
    }
};

/// One line on stderr, printable and at most 400 bytes long; of `text` the middle is left out where it does not fit.
void complain(std::string before, const std::string& text, const std::string& after = {}) {
    before = trocar::printable_line("trocar: " + before, 200);
    std::fprintf(stderr, "%s%s%s\n", before.c_str(),
                 trocar::printable_line(text, 400 - before.size() - after.size()).c_str(), after.c_str());
}

/// Refuses what is not what it is taken for: an empty text, which names nothing; and what CLI11 reads as a number,
/// nothing as 0 and all that are too large as the largest one.
void check_text(CLI::Option& option) {
    const std::string type = option.get_type_name();
    const bool whole = type.starts_with("INT");
    const bool number = type.starts_with("FLOAT");
    const auto fault = [whole, number](std::string& text) -> std::string {
        if (text.empty()) return "expected something, got ''";
        const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
        const char* end = text.data() + text.size();
        std::from_chars_result read{end, std::errc()};
        std::int64_t integer = 0;
        double real = 0.0;
        if (whole) read = std::from_chars(begin, end, integer);
        if (number) read = std::from_chars(begin, end, real);
        if (read.ec == std::errc() && read.ptr == end) return {};
        return fmt::format("expected {}, got '{}'",
                           whole ? "an integer of at most 9223372036854775807" : "a number that a double can hold",
                           text);
    };
    option.check(CLI::Validator(fault, ""));
}

/// Throws what the command throws.
int run_command(int argc, char** argv, const std::vector<std::string>& program) {
    CommandLine line;
    line.common.program = program;
    line.app.require_subcommand(1);
    line.app.footer(exit_status_text);
    line.app.set_version_flag("--version", TROCAR_VERSION);

    RunOptions run_options;
    CLI::App* sub = line.add("run", "Run one scene with one detector and one response",
                             "trocar run i2t_poke; trocar run i2t_poke --response thesis");
    CommandLine::add_found(sub, "scene", run_options.scene, "Scene file (JSON), or a name of trocar scenes");
    CommandLine::add_methods(sub, run_options.methods);
    sub->add_option("--ticks", run_options.ticks, "Ticks to run instead of the scene's number");
    sub->add_option("--record", run_options.record, "Write the frames as a recording");
    sub->add_flag("--paced", run_options.paced,
                  "Release one tick per dt by the clock, without judging; in turns with an empty loop");
    sub->add_flag(
        "--explain-step", run_options.explain_step,
        "Run nothing: say what step tissue and operators bear, which vertex and edge decide, and what a tick costs");
    sub->add_option("--unstable-step", run_options.unstable_step,
                    "Steps that are unstable for certain: refuse them; substep: take as many sub-steps as are stable "
                    "instead; allow: take them. The record says so")
        ->check(CLI::IsMember({"refuse", "substep", "allow"}))
        ->capture_default_str();
    line.on(sub, run_options, run);

    ViewOptions view_options;
    sub = line.add(
        "view",
        "Write a page that replays a scene, a recording, or runs of a report: 3D beside curves, one file, "
        "offline",
        "trocar view i2t_poke --response unilateral --response thesis; trocar view reports/default --scene i2t_poke");
    CommandLine::add_found(
        sub, "inputs", view_options.inputs,
        "A scene (file or name), a recording, or folders of reports (their records are run once more)");
    sub->add_option(
           "--response", view_options.responses,
           "NAME[:key=value,...]; may be repeated: side by side (default: unilateral; of a report: ours and the "
           "best other)")
        ->take_all()
        ->allow_extra_args(false);
    sub->add_option("--scene", view_options.scene, "Of a report: the scene's name, or its file");
    sub->add_flag("--pages", view_options.pages,
                  "Of a report: a page for every scene in its folder view/, sharing one script");
    sub->add_option("--detector", view_options.methods.detector, "NAME[:key=value,...], of a scene")
        ->capture_default_str();
    sub->add_option("--contacts", view_options.methods.contacts,
                    "Contact generator, of a scene (default: each response's own)");
    sub->add_option("--stepper", view_options.methods.stepper,
                    "NAME[:key=value,...], of a scene (default: semi_implicit)");
    sub->add_option("--ticks", view_options.ticks, "Ticks to run instead of the scene's number");
    sub->add_option("--output", view_options.output, "The page (default: SCENE.html in this folder)");
    line.on(sub, view_options, view);

    ExportOptions export_options;
    sub = line.add("export", "The frames of a scene's run or of a recording as files for ParaView, as glTF or as OBJ",
                   "trocar export i2t_poke --to paraview --output poke");
    CommandLine::add_found(sub, "source", export_options.source, "Scene (file or name) or recording");
    sub->add_option(
           "--to", export_options.to,
           "paraview: .pvd and .vtp with depth, strain, displacement, contacts and forces; gltf: one animation "
           "(.glb); obj: posed meshes, one file per body and tick")
        ->required()
        ->check(CLI::IsMember({"paraview", "gltf", "obj"}));
    sub->add_option("--output", export_options.output, "New or empty folder")->required();
    CommandLine::add_methods(sub, export_options.methods);
    sub->add_option("--ticks", export_options.ticks, "Ticks to run instead of the scene's number");
    sub->add_option("--every", export_options.every,
                    "Write every n-th tick (default: such that about 60 are written); the deepest and the last one are "
                    "written in any case");
    sub->add_option("--tick", export_options.more_ticks, "Write this tick too; may be repeated")
        ->take_all()
        ->allow_extra_args(false);
    line.on(sub, export_options, export_frames);

    StudyOptions study_options;
    sub = line.add("study", "Run a study (all its methods on all its scenes) and write its report",
                   "trocar study default");
    CommandLine::add_found(sub, "file", study_options.file,
                           "Study file (JSON), or the name of one that comes with trocar", find_study, "STUDY");
    sub->add_option("--output", study_options.output, "Folder for records and report (default: build/reports/<study>)");
    sub->add_flag("--publish", study_options.publish, "Copy the finished report to reports/<study>");
    sub->add_option("--with", study_options.with,
                    "NAME[:key=value,...]: a detector or response that takes part beside those of the file; may be "
                    "repeated")
        ->take_all()
        ->allow_extra_args(false);
    sub->add_option("--scenes", study_options.scenes,
                    "A scene file, a pattern of files or a name of trocar scenes, in place of the scenes of every "
                    "experiment; may be repeated; wants --output")
        ->excludes("--publish")
        ->take_all()
        ->allow_extra_args(false);
    sub->add_option("--jobs", study_options.jobs,
                    "So many runs side by side, of those that nobody times (hard cases, metamorphic tests); timed ones "
                    "always run alone")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    CLI::Option* plan = sub->add_flag("--plan", study_options.plan_only, "Print the list of runs and stop");
    CLI::Option* shard =
        sub->add_option("--shard", study_options.shard,
                        "K/N: make only the K-th of N shares of the runs, without report (default folder: "
                        "build/reports/<study>.shards/K-of-N); trocar merge puts the shares together");
    CLI::Option* slurm =
        sub->add_flag("--slurm", study_options.slurm,
                      "Submit the study to Slurm and stop: an array of shards in <output>.shards, and a job that "
                      "merges them into <output>; submitted again, it goes on where it stopped");
    sub->add_option("--array", study_options.array, "So many shards, with --slurm")
        ->check(CLI::Range(1, 100000))
        ->needs(slurm)
        ->capture_default_str();
    sub->add_option("--time", study_options.time, "Limit of a shard's time as Slurm writes it (2:00:00), with --slurm")
        ->needs(slurm);
    for (CLI::Option* choice : {shard, slurm}) choice->excludes("--publish");
    shard->excludes(slurm);
    plan->excludes(slurm);
    sub->add_option("--child-run", study_options.child_runs)->group("");
    sub->add_option("--child-output", study_options.child_output)->group("");
    line.on(sub, study_options, study);

    MergeOptions merge_options;
    sub = line.add("merge", "Put the shards of a study together and write its report",
                   "trocar merge build/reports/default build/reports/default.shards/*");
    sub->add_option("output", merge_options.output, "New or empty folder for records and report")->required();
    sub->add_option("folders", merge_options.folders, "Folders of the shards (trocar study --shard)")->required();
    line.on(sub, merge_options, merge);

    TuneOptions tune_options;
    sub = line.add("tune", "Search the settings of responses: one objective, one budget and two starts for all",
                   "trocar tune bench/tune.json --output build/tune --jobs 2");
    sub->add_option("file", tune_options.file, "Tune file (JSON)")->required();
    sub->add_option("--output", tune_options.output, "Folder for the stages' records and tuned.json")->required();
    sub->add_option("--jobs", tune_options.jobs, "So many runs side by side; nobody times them")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    line.on(sub, tune_options, tune);

    ReportOptions report_options;
    sub =
        line.add("report", "Rebuild a report from its stored records, byte for byte", "trocar report reports/default");
    sub->add_option("directory", report_options.directory, "Folder that holds the records of a study")->required();
    sub->add_option("--against", report_options.against,
                    "Write nothing: what changed since the records of this folder, figures of the clock left out; "
                    "status 1 when anything did");
    sub->add_option("--tolerance", report_options.tolerance, "Relative change that counts as none, with --against")
        ->capture_default_str();
    sub->add_flag("--picture", report_options.picture,
                  "Run the two runs of page 1's picture once more and keep what they show in worst_tick.json");
    sub->add_option("--study", report_options.study,
                    "The study's file, with --picture, where the records do not name it from this folder");
    line.on(sub, report_options, report);

    BoardOptions board_options;
    sub = line.add("board", "One page out of the records of many machines and versions",
                   "trocar board old/verdict new/verdict --output build/board");
    sub->add_option("records", board_options.records, "Folders of reports, or their files of records, the oldest first")
        ->required();
    sub->add_option("-o,--output", board_options.output, "Folder for the page")->required();
    line.on(sub, board_options, board);

    TableOptions table_options;
    sub =
        line.add("table", "A table for a paper out of a report's records: columns and rows by name",
                 "trocar table reports/default --columns scene,response,residual_penetration_max_m:mm,total_p99_ns:ms "
                 "--where scene=i2t_poke --where response=unilateral --where response=penalty --format tex");
    sub->add_option("records", table_options.records, "Folder of a report, or its file of records")->required();
    sub->add_option(
           "--columns", table_options.columns,
           "NAME[:UNIT],...: columns of results.csv (trocar schema figures lists the figures), numbers in UNIT "
           "(default: who, where and what is left over, missed and waited for)")
        ->delimiter(',');
    sub->add_option("--where", table_options.where,
                    "NAME=VALUE: only runs with it; may be repeated: any value of one name, all names. NAME!=VALUE: "
                    "only runs without it (NAME!=: those that know the figure)")
        ->take_all()
        ->allow_extra_args(false);
    sub->add_option("--sort", table_options.sort,
                    "NAME[:desc],...: order of the rows (default: by the columns shown, left to right)")
        ->delimiter(',');
    sub->add_option("--format", table_options.format,
                    "md, tex (one file to \\input, fits a two-column page) or csv; google-benchmark: its JSON of every "
                    "timed run, for compare.py; dashboard: JSON of figures of which smaller is better (--columns), for "
                    "github-action-benchmark")
        ->check(CLI::IsMember({"md", "tex", "csv", "google-benchmark", "dashboard"}))
        ->capture_default_str();
    CLI::Option* sqlite = sub->add_option(
        "--sqlite", table_options.sqlite,
        "Print no table: write every run to this file, an SQLite database with the tables results (columns of "
        "results.csv), facts and metrics");
    for (const char* choice : {"--columns", "--where", "--sort", "--format"}) sqlite->excludes(choice);
    line.on(sub, table_options, table);

    DetectOptions detect_options;
    sub = line.add("detect", "All intersecting triangle pairs of two mesh files",
                   "trocar detect liver.stl tool.obj --pose-b \"0 0 0.01 0 90 0\" --scale-b 0.001 --detector all");
    sub->add_option("a", detect_options.file_a, "First mesh (OBJ, STL, PLY, OFF, VRML)")->required();
    sub->add_option("b", detect_options.file_b, "Second mesh")->required();
    sub->add_option("--pose-a", detect_options.pose_a, "\"x y z rx ry rz\": translation, rotation vector in degrees");
    sub->add_option("--pose-b", detect_options.pose_b, "\"x y z rx ry rz\": translation, rotation vector in degrees");
    sub->add_option("--scale-a", detect_options.scale_a, "Factor on the coordinates of a, before the pose");
    sub->add_option("--scale-b", detect_options.scale_b, "Factor on the coordinates of b, before the pose");
    sub->add_option("--detector", detect_options.detector, "NAME[:key=value,...] or all")->capture_default_str();
    sub->add_flag("--truth", detect_options.truth, "Hold the answer against the exact oracle");
    sub->add_option("--time-limit", detect_options.time_limit_s, "Seconds after which a detector is given up")
        ->capture_default_str();
    sub->add_option("--write-posed", detect_options.write_posed, "Write a.obj and b.obj as tested into this folder");
    line.on(sub, detect_options, detect);

    ReplayOptions replay_options;
    sub = line.add("replay", "Detectors on recorded frames", "trocar replay frames.trocrec --detector all");
    sub->add_option("recording", replay_options.recording, "Recording file (trocar schema recording)")->required();
    sub->add_option("--detector", replay_options.detector,
                    "NAME[:key=value,...], all, or recorded (the contacts that the recording carries)")
        ->capture_default_str();
    sub->add_flag("--truth", replay_options.truth,
                  "Hold the answers against the exact oracle; --json then has the figures of every frame too");
    sub->add_option("--start", replay_options.start,
                    "clean: every body starts on the right side of open sheets; unknown: what needs that is n/a")
        ->check(CLI::IsMember({"clean", "unknown"}))
        ->capture_default_str();
    sub->add_option("--time-limit", replay_options.time_limit_s, "Seconds after which a detector is given up")
        ->capture_default_str();
    line.on(sub, replay_options, replay);

    JudgeOptions judge_options;
    sub = line.add("judge", "Penetration, passages and sides on the frames of another simulator, with limits",
                   "trocar judge frames/ floor.obj --unit mm --frame-time 10ms --start clean --max-penetration 0.5mm");
    sub->add_option("frames", judge_options.inputs,
                    "Folder of mesh files per frame, .npz, .pvd, .series, a recording; a mesh file stands still")
        ->required();
    sub->add_option("--unit", judge_options.unit, "Unit of the coordinates (a recording has its own)")
        ->check(CLI::IsMember({"m", "cm", "mm", "um", "in"}));
    sub->add_option("--frame-time", judge_options.frame_time, "Time from frame to frame, 10ms (default: unknown)");
    sub->add_option("--bodies", judge_options.bodies,
                    "given: body_ids of an .npz file, else every surface is one body; components: connected ones; "
                    "objects: those of OBJ files (o, else g)")
        ->check(CLI::IsMember({"given", "components", "objects"}))
        ->capture_default_str();
    sub->add_option("--start", judge_options.start,
                    "clean: every body starts on the right side of open sheets; unknown: what needs that is n/a")
        ->check(CLI::IsMember({"clean", "unknown"}))
        ->capture_default_str();
    CLI::Option* self = sub->add_flag("--self", judge_options.self, "Also count self-intersections of every body");
    sub->add_option("--max-penetration", judge_options.max_penetration, "Status 1 above it: 0.5mm");
    sub->add_option("--max-passed-through", judge_options.max_passed_through, "Status 1 above so many passages");
    sub->add_option("--max-wrong-side", judge_options.max_wrong_side,
                    "Status 1 above so many samples on the wrong side in a frame");
    sub->add_option("--max-self-intersections", judge_options.max_self_intersections,
                    "Status 1 above so many pairs in a frame, with --self")
        ->needs(self);
    sub->add_option("--junit", judge_options.junit, "Also write the limits as a JUnit file");
    sub->add_option("--output", judge_options.output,
                    "New or empty folder for frames.json, replay.html and a picture of the worst frame");
    line.on(sub, judge_options, judge);

    ExplainOptions explain_options;
    sub = line.add("explain", "One tick of a scene, all detectors side by side", "trocar explain i2t_poke --tick 300");
    CommandLine::add_found(sub, "scene", explain_options.scene, "Scene file (JSON), or a name of trocar scenes");
    sub->add_option("--tick", explain_options.tick, "Tick to examine")->required();
    sub->add_option("--pair", explain_options.pair, "One triangle pair a,b (numbers of the scene's files)");
    sub->add_option("--response", explain_options.response, "Response that drives the scene to the tick")
        ->capture_default_str();
    line.on(sub, explain_options, explain);

    MeshOptions mesh_options;
    sub = line.add("mesh", "Counts, defects, box and unit of a mesh file", "trocar mesh liver.stl --json");
    sub->add_option("file", mesh_options.file, "Mesh file (OBJ, STL, PLY, OFF, VRML)")->required();
    sub->add_option("--mend", mesh_options.mend,
                    "Write the mesh as OBJ with every triangle once and turned the right way round");
    line.on(sub, mesh_options, mesh);

    TritriOptions tritri_options;
    sub = line.add("tritri", "The triangle test on a file of pairs (18 numbers a line)",
                   "trocar tritri pairs.txt --test exact");
    sub->add_option("file", tritri_options.file, "One pair a line, optionally followed by truth and class")->required();
    sub->add_option("--test", tritri_options.test, "moller, interval or exact")
        ->check(CLI::IsMember({"moller", "interval", "exact"}))
        ->capture_default_str();
    line.on(sub, tritri_options, tritri);

    RespondOptions respond_options;
    sub = line.add("respond", "The response equations on a file of cases", "trocar respond response_cases.json");
    sub->add_option("file", respond_options.file, "Cases (JSON)")->required();
    line.on(sub, respond_options, respond);

    ReferenceOptions reference_options;
    sub = line.add(
        "reference",
        "Make the stored references of scenes (minutes each; those this program has made are kept), or check them",
        "trocar reference scenes/i2t_poke.json scenes/i2t_drag.json");
    CommandLine::add_found(sub, "scenes", reference_options.scenes,
                           "Scene files (JSON) or names of trocar scenes; written to reference/ beside them");
    sub->add_flag("--check", reference_options.check, "Make nothing; status 1 when one is missing or stale");
    sub->add_option("--k", reference_options.k,
                    "Contact stiffness in N/m between every two bodies, as a study's knob k sets it; another file");
    sub->add_option("--without", reference_options.without, "Store that there is none, and this reason");
    line.on(sub, reference_options, reference);

    BaselineOptions baseline_options;
    sub = line.add("baseline",
                   "Keep the contacts that recordings carry, or those of detectors, and check them for changes",
                   "trocar baseline write frames.trocrec; trocar baseline check frames.trocrec --junit contacts.xml");
    sub->add_option("what", baseline_options.what, "write: store the contacts; check: status 1 when one changed")
        ->required()
        ->check(CLI::IsMember({"write", "check"}));
    CommandLine::add_found(sub, "sources", baseline_options.sources,
                           "Scene files (JSON), names of trocar scenes, and recordings");
    sub->add_option("--detector", baseline_options.detectors,
                    "NAME[:key=value,...], all, or recorded (what a recording carries); may be repeated. Default: what "
                    "is stored; to begin with what the recording carries, else all")
        ->take_all()
        ->allow_extra_args(false);
    sub->add_option("--folder", baseline_options.folder, "Folder of the stored files (default: baseline/ beside each)");
    sub->add_option("--every", baseline_options.every,
                    "Keep every n-th tick (default: as stored, else about 20, of what a recording carries all)");
    sub->add_option("--tolerance", baseline_options.tolerance, "Change of a depth or point in m that counts as none")
        ->capture_default_str();
    sub->add_option("--junit", baseline_options.junit, "Also write what check finds as a JUnit file");
    sub->add_option("--time-limit", baseline_options.time_limit_s, "Seconds after which a detector is given up")
        ->capture_default_str();
    line.on(sub, baseline_options, baseline);

    ScenesOptions scenes_options;
    sub = line.add("scenes", "The scenes that come with trocar, or those of a folder, a line each",
                   "trocar scenes; trocar scenes my/scenes --json");
    sub->add_option("places", scenes_options.places, "Scene files, names, or folders (default: trocar's own)")
        ->type_name("SCENE");
    sub->add_flag("--all", scenes_options.all, "Also trocar's scenes that only studies use (seconds)");
    sub->add_flag("--names", scenes_options.names, "Print the names and nothing else");
    line.on(sub, scenes_options, scenes);

    DrawOptions draw_options;
    sub =
        line.add("draw", "Write the scenes of a family, drawn by a seed", "trocar draw resolution my/scenes --seed 7");
    sub->add_option("family", draw_options.family,
                    "resolution: bodies that pass into each other without contact; judged: ordinary contact")
        ->required()
        ->check(CLI::IsMember({"resolution", "judged"}));
    sub->add_option("folder", draw_options.folder, "New or empty folder")->required();
    sub->add_option("--seed", draw_options.seed, "Of places, tilts and tools")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    line.on(sub, draw_options, draw);

    ListOptions list_options;
    sub = line.add("list", "All methods with their parameters; absent ones with the reason", "trocar list --json");
    line.on(sub, list_options, list);

    SchemaOptions schema_options;
    sub = line.add("schema", "The file formats: scene, study, recording or baseline; figures", "trocar schema scene");
    sub->add_option("what", schema_options.what, "scene, study, recording, baseline or figures")
        ->required()
        ->check(CLI::IsMember({"scene", "study", "recording", "baseline", "figures"}));
    line.on(sub, schema_options, schema);

    std::string shell;
    sub = line.app.add_subcommand("completion",
                                  "A completion script for a shell, or the man page, from these very commands");
    sub->footer("Example:\n  trocar completion bash > ~/.local/share/bash-completion/completions/trocar");
    sub->add_option("what", shell, "bash, zsh, fish or man")
        ->required()
        ->check(CLI::IsMember({"bash", "zsh", "fish", "man"}));
    sub->callback([&line, &shell] {
        line.command = [&line, &shell] {
            std::fputs(shell_words(line.app, shell, exit_status_text, TROCAR_VERSION).c_str(), stdout);
            return static_cast<int>(done);
        };
    });

    for (CLI::App* command : line.app.get_subcommands({})) {
        for (CLI::Option* option : command->get_options()) check_text(*option);
    }
    if (const std::string fault = line.command_fault(argc, argv); !fault.empty()) {
        complain("command line: ", fault, " (see trocar --help)");
        return bad_input;
    }
    try {
        line.app.parse(argc, argv);
    } catch (const CLI::Success& success) {
        return line.app.exit(success);
    } catch (const CLI::ParseError& error) {
        complain("command line: ", error.what(), " (see trocar --help)");
        return bad_input;
    }
    if (line.large) trocar::lift_size_limits();
    if (!line.data.empty()) {
        line.common.data = line.data;
    } else if (const char* variable = std::getenv("TROCAR_DATA"); variable != nullptr && *variable != '\0') {
        line.common.data = variable;
    }
    const int status = line.command();
    // A full disk or a closed pipe shows only when the last bytes leave.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
        throw trocar::InputError("standard output", "", "to be writable", std::strerror(errno));
    }
    return status;
}

}  // namespace

int trocar::app::run_program(int argc, char** argv, const std::filesystem::path& share,
                             const std::vector<std::string>& program) {
    add_shipped_root(share);
    try {
        return run_command(argc, argv, program);
    } catch (const trocar::InputError& error) {
        complain("", error.what());
        return bad_input;
    } catch (const std::filesystem::filesystem_error& error) {
        complain(error.path1().string() + ": ",
                 "expected a file or folder that can be used, got " + error.code().message());
        return bad_input;
    } catch (const std::system_error& error) {
        complain("", std::string("standard output or a file: expected to be writable, got ") + error.what());
        return bad_input;
    } catch (const std::bad_alloc&) {
        complain("", "expected input that fits into memory, got more");
        return bad_input;
    } catch (const std::exception& error) {
        complain("internal error: ", error.what(), " (please report the command, its files and trocar --version)");
        return method_failed;
    }
}
