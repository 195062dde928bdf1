// `trocar study`: plans, runs every run in a child process (this same program with --child-run), reports, publishes.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/progress.hpp"
#include "app/shipped.hpp"
#include "app/slurm.hpp"
#include "app/study_runs.hpp"
#include "app/view_pages.hpp"
#include "app/worst_tick.hpp"
#include "geometry/input_error.hpp"
#include "geometry/text.hpp"
#include "geometry/whole_file.hpp"
#include "measure/environment.hpp"
#include "report/page_assets.hpp"
#include "report/report.hpp"
#include "report/view_links.hpp"
#include "simulate/runs.hpp"
#include "study/runner.hpp"
#include "study/shard.hpp"
#include "study/study.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

const std::filesystem::path reports_folder = std::filesystem::path("build") / "reports";
constexpr std::size_t most_replays = 20;                 // scenes; of more, `trocar view DIR --pages` makes the pages
constexpr std::uintmax_t largest_published = 8'000'000;  // bytes of a report: compressed records, pages without scripts

/// What is published of a record.
std::string stored_line(const Study& study, const PlannedRun& run, Record record) {
    for (const auto& [key, value] : method_facts(study, run)) record.environment[key] = value;
    // The report reads these from the summary; their single ticks would only make the records too large to publish.
    const std::string& mode = run.spec.mode;
    if ((mode != "replay" && mode != "closed_loop") || is_generated(run.spec)) record.rows.clear();
    // Of a closed loop's ticks those are kept on which truth was computed, and those on which something went wrong; the
    // summary has been taken from all.
    if (mode == "closed_loop") {
        std::erase_if(record.rows, [](const StepRow& row) {
            return row.true_pairs < 0 && row.outcome == OutcomeKind::ok && !row.truncated;
        });
    }
    thin_rows(record);
    shorten_rows(record);
    return to_json_line(record) + "\n";
}

/// Runs in this process, one or those of a group. Their records go into a file, so that a crash before the end leaves
/// none.
int child(const Study& study, const CommonOptions& common, const StudyOptions& options) {
    std::vector<PlannedRun> plan = make_plan(study);
    std::vector<PlannedRun*> runs;
    for (const std::int64_t index : options.child_runs) {
        if (index < 0 || index >= static_cast<std::int64_t>(plan.size()) || !options.child_output) {
            throw InputError("command line", "--child-run",
                             fmt::format("a number below {} and --child-output", plan.size()), std::to_string(index));
        }
        runs.push_back(&plan[static_cast<std::size_t>(index)]);
    }
    // The number of the run that has its turn stands in a file beside the output, for the parent to read after a crash.
    const auto turn = [&options](std::size_t index) {
        write_turn(*options.child_output, options.child_runs.at(index));
    };
    std::vector<Record> records = make_runs(study.file.parent_path(), runs, common.data, turn);
    std::string lines;
    for (std::size_t i = 0; i < runs.size(); ++i) lines += stored_line(study, *runs[i], std::move(records[i]));
    write_whole(*options.child_output, lines);
    return done;
}

std::string rough_duration(double seconds) {
    if (seconds < 120.0) return fmt::format("{:.0f} s", seconds);
    if (seconds < 7200.0) return fmt::format("{:.0f} min", seconds / 60.0);
    return fmt::format("{:.1f} h", seconds / 3600.0);
}

int print_plan(const Study& study, const std::vector<PlannedRun>& plan, bool json) {
    double rough_seconds = 0.0;
    for (const PlannedRun& run : plan) rough_seconds += run.settled ? 0.0 : run.rough_seconds;
    if (json) {
        Json document{{"study", study.name}, {"rough_seconds", rough_seconds}, {"runs", Json::array()}};
        for (const PlannedRun& run : plan) {
            const RunSpec& spec = run.spec;
            document["runs"].push_back({{"mode", spec.mode},
                                        {"scene", spec.scene},
                                        {"class", spec.pair_class},
                                        {"detector", spec.detector},
                                        {"response", spec.response},
                                        {"contacts", spec.contacts},
                                        {"stepper", spec.stepper},
                                        {"setting", spec.setting},
                                        {"repetition", spec.repetition},
                                        {"ticks", spec.ticks},
                                        {"outcome", run.settled ? Json(name_of(run.settled->kind)) : Json(nullptr)},
                                        {"message", run.settled ? run.settled->message : ""}});
        }
        print_json_line(document);
        return done;
    }
    std::size_t number = 0;
    for (const PlannedRun& run : plan) {
        const std::string settled =
            run.settled ? fmt::format("  {} ({})", name_of(run.settled->kind), run.settled->message) : std::string();
        fmt::print("{:4}  {}  {:<13}  {:<14}  {}  {} ticks{}\n", number++, run.spec.repetition, run.spec.mode,
                   run.spec.scene.empty() ? "all scenes" : run.spec.scene, methods_in_words(run.spec), run.spec.ticks,
                   settled);
    }
    fmt::print(
        "{} runs, roughly {} on a quiet machine (slow baselines take longer), each ended after {:g} s at the latest\n",
        plan.size(), rough_duration(rough_seconds), study.time_limit_s);
    return done;
}

/// What page 1's picture shows is run once more and kept beside the records. A study without it is no failure: the page
/// says that there is none.
void keep_worst_tick(const std::filesystem::path& study_file, const CommonOptions& common,
                     const std::filesystem::path& directory, const std::vector<Record>& records) {
    const std::filesystem::path file = directory / worst_tick_file;
    try {
        const auto seen = see_worst_tick(records, study_file.parent_path(), common.data);
        if (seen) {
            write_whole(file, to_json(*seen));
            return;
        }
    } catch (const InputError& error) {
        fmt::print(stderr, "trocar study: no picture of the worst tick: {}\n", error.what());
    }
    std::filesystem::remove(file);
}

/// Copies a finished report (records, report, drawings, replays) to reports/<study>, as a whole or not at all. Its
/// pages load the scripts of reports/assets.
std::filesystem::path publish(const Study& study, const std::filesystem::path& directory, const Report& report) {
    std::vector<std::string> names{records_name};
    if (std::filesystem::exists(directory / worst_tick_file)) names.emplace_back(worst_tick_file);
    for (const std::string& page : pages_there(directory)) names.push_back(fmt::format("{}/{}", view_folder, page));
    for (const auto& [name, content] : report.files) {
        if (!name.starts_with(own_assets)) names.push_back(name);
    }
    std::uintmax_t size = 0;
    for (const std::string& name : names) size += std::filesystem::file_size(directory / name);
    if (size > largest_published) {
        throw InputError(directory.string(), "", fmt::format("at most {} MB to publish", largest_published / 1'000'000),
                         fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(size)));
    }
    std::filesystem::path target = std::filesystem::path("reports") / study.name;
    write_shared_assets(target.parent_path());
    if (std::filesystem::exists(target) && std::filesystem::equivalent(target, directory)) {
        write_report(target, shipped_reports());
        return target;
    }
    std::filesystem::path beside = target;
    beside += ".part";
    std::filesystem::remove_all(beside);
    for (const std::string& name : names) {
        std::filesystem::create_directories((beside / name).parent_path());
        std::filesystem::copy_file(directory / name, beside / name);
    }
    write_report(beside, shipped_reports());
    std::filesystem::remove_all(target);
    std::filesystem::rename(beside, target);
    return target;
}

}  // namespace

std::vector<PlannedRun> completed_plan(const Study& study, const CommonOptions& common) {
    std::vector<PlannedRun> plan = make_plan(study);
    std::map<std::string, SceneFacts> facts;
    for (PlannedRun& run : plan) {
        const std::string& file = run.spec.scene_file;
        if (file.empty()) continue;
        auto known = facts.find(file);
        if (known == facts.end())
            known = facts.emplace(file, input_facts(study.file.parent_path(), run.spec, common.data)).first;
        complete_run(known->second, run);
    }
    return plan;
}

RunnerResult run_study(const Study& study, const std::vector<PlannedRun>& plan, const CommonOptions& common,
                       const StudyOptions& options, const std::filesystem::path& directory, bool timed) {
    RunnerOptions runner;
    runner.directory = directory;
    runner.timed = timed;
    runner.shard = options.shard ? read_shard(*options.shard).number : 1;
    runner.child_command = common.program;
    runner.child_command.insert(runner.child_command.end(), {"study", options.file.string()});
    if (common.data) {
        runner.child_command.emplace_back("--data");
        runner.child_command.push_back(common.data->string());
    }
    runner.binary = binary_identity();
    runner.time_limit_s = study.time_limit_s;
    runner.jobs = options.jobs;
    const std::vector<std::string> changes = changes_of(options);
    runner.child_command.insert(runner.child_command.end(), changes.begin(), changes.end());
    const std::map<std::string, std::string> here = environment();
    runner.environment = [&study, &here](const PlannedRun& run) {
        std::map<std::string, std::string> facts = method_facts(study, run);
        facts.insert(here.begin(), here.end());
        return facts;
    };
    const auto is_here = [&runner](const PlannedRun& run) { return run.shard == runner.shard; };
    Progress progress("run", std::count_if(plan.begin(), plan.end(), is_here));
    runner.progress = [&progress](std::size_t position, const PlannedRun* run) {
        if (run == nullptr) return;
        progress.show(static_cast<std::int64_t>(position),
                      fmt::format("{} {}: {}", run->spec.mode, run->spec.scene, methods_in_words(run->spec)));
    };
    const RunnerResult result = run_plan(plan, runner);
    progress.end();
    return result;
}

Report write_study_report(const std::filesystem::path& study_file, const CommonOptions& common,
                          const std::filesystem::path& directory, const std::vector<Record>& records) {
    if (viewed_scenes(records).size() <= most_replays) {
        write_view_pages(directory, records, study_file.parent_path(), common.data);
    }
    keep_worst_tick(study_file, common, directory, records);
    return write_report(directory, shipped_reports());
}

std::vector<std::string> changes_of(const StudyOptions& options) {
    std::vector<std::string> words;
    for (const std::string& method : options.with) words.insert(words.end(), {"--with", method});
    for (const std::string& scenes : options.scenes) words.insert(words.end(), {"--scenes", scenes});
    return words;
}

namespace {

/// The same as a shell takes it.
std::string changes_text(const StudyOptions& options) {
    std::string text;
    for (const std::string& word : changes_of(options)) {
        text += (text.empty() ? "" : " ") + (word.starts_with("--") ? word : shell_word(word));
    }
    return options.scenes.empty() ? text : text + " --output DIR";
}

}  // namespace

int study(const CommonOptions& common, const StudyOptions& options) {
    if (!options.scenes.empty() && !options.output && !options.plan_only && options.child_runs.empty()) {
        throw InputError("command line", "--scenes", "--output beside it: a folder of its own", "none");
    }
    const Shard shard = options.shard ? read_shard(*options.shard) : Shard{};
    Study study = read_study(options.file, options.with, listed_scenes(), options.scenes);
    study.changes = changes_text(options);
    if (!options.child_runs.empty()) return child(study, common, options);
    std::vector<PlannedRun> plan = completed_plan(study, common);
    const std::filesystem::path whole =
        options.slurm ? options.output.value_or(reports_folder / study.name) : reports_folder / study.name;
    if (options.slurm) return submit_to_slurm(study, plan, common, options, whole);
    if (options.shard) assign_shards(shard.count, study.time_limit_s, plan);
    const auto is_elsewhere = [&shard](const PlannedRun& run) { return run.shard != shard.number; };
    if (options.plan_only) {
        std::erase_if(plan, is_elsewhere);
        return print_plan(study, plan, common.json);
    }
    const std::int64_t planned = std::ssize(plan) - std::count_if(plan.begin(), plan.end(), is_elsewhere);

    const std::filesystem::path directory = options.output.value_or(options.shard ? shard_folder(whole, shard) : whole);
    for (const std::string& note : reference_notes(study)) {
        fmt::print(stderr, "trocar study: {}: {}\n", options.file.string(), note);
    }
    if (options.shard) start_shard(directory, shard, study, plan, binary_identity());
    const RunnerResult result = run_study(study, plan, common, options, directory, true);
    if (result.interrupted) {
        fmt::print(stderr, "trocar study: interrupted; {} of {} runs are kept in {}, the same command goes on there\n",
                   result.made + result.found, planned, directory.string());
        if (common.json) {
            const Json document{{"study", study.name}, {"directory", directory.string()},
                                {"interrupted", true}, {"runs", planned},
                                {"made", result.made}, {"found", result.found}};
            print_json_line(document);
        }
        return interrupted;
    }
    if (options.shard) {
        if (common.json) {
            const Json document{{"study", study.name},   {"directory", directory.string()},
                                {"shard", shard.number}, {"shards", shard.count},
                                {"runs", planned},       {"made", result.made},
                                {"found", result.found}};
            print_json_line(document);
        } else {
            fmt::print("Shard {}/{}: {} of {} runs ({} made now, {} found from an earlier start) in {}\n", shard.number,
                       shard.count, planned, plan.size(), result.made, result.found, directory.string());
        }
        return done;
    }
    const std::vector<Record> records = read_records(directory);
    const Report report = write_study_report(study.file, common, directory, records);
    const std::filesystem::path published =
        options.publish ? publish(study, directory, report) : std::filesystem::path();
    if (!common.json) {
        fmt::print("{}\n{} runs ({} made now, {} found from an earlier start)\nReport: {}\n", report.page_one,
                   plan.size(), result.made, result.found, (directory / "report.html").string());
        if (options.publish) fmt::print("Published: {}\n", published.string());
        return done;
    }
    std::map<std::string, std::int64_t> outcomes;
    for (const Record& record : records) ++outcomes[std::string(name_of(record.outcome.kind))];
    const Json document{{"study", study.name},
                        {"directory", directory.string()},
                        {"report", (directory / "report.html").string()},
                        {"runs", plan.size()},
                        {"made", result.made},
                        {"found", result.found},
                        {"outcomes", outcomes},
                        {"published", options.publish ? Json(published.string()) : Json(nullptr)}};
    print_json_line(document);
    return done;
}

}  // namespace trocar::app
