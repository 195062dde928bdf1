#include "app/slurm.hpp"

#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/json_values.hpp"
#include "export/exporter.hpp"
#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/text.hpp"
#include "geometry/whole_file.hpp"
#include "study/runner.hpp"

namespace trocar::app {
namespace {

std::filesystem::path shards_folder(std::filesystem::path whole) {
    if (!whole.has_filename()) whole = whole.parent_path();
    return whole += ".shards";
}

/// Start of a script for sbatch, up to the command.
std::string script_head(const std::string& name, const std::filesystem::path& log) {
    return fmt::format("#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --output=\"{}\"\n", name, log.string());
}

std::string command_head(const CommonOptions& common) {
    std::string text = "cd " + shell_word(std::filesystem::current_path().string()) + " && exec";
    for (const std::string& word : common.program) {
        // On another node this names another program.
        text += " " + shell_word(word == "/proc/self/exe" ? std::filesystem::read_symlink(word).string() : word);
    }
    return text;
}

std::string command_tail(const CommonOptions& common) {
    return (common.data ? " --data " + shell_word(common.data->string()) : "") +
           (are_sizes_limited() ? "" : " --large") + "\n";
}

std::string array_script(const std::vector<PlannedRun>& plan, const CommonOptions& common, const StudyOptions& options,
                         const std::string& name, const std::filesystem::path& folder) {
    std::string text = script_head(name, folder / "%a.log");
    text += fmt::format("#SBATCH --array=1-{}\n", options.array);
    if (options.time) text += fmt::format("#SBATCH --time={}\n", *options.time);
    if (options.jobs > 1) text += fmt::format("#SBATCH --cpus-per-task={}\n", options.jobs);
    // A time that is measured beside other jobs is worth nothing.
    const auto wants_quiet = [](const PlannedRun& run) { return !run.settled && is_timed(run.spec); };
    if (std::any_of(plan.begin(), plan.end(), wants_quiet)) text += "#SBATCH --exclusive\n";
    text += fmt::format("{} study {} --jobs {}", command_head(common), shell_word(options.file.string()), options.jobs);
    for (const std::string& word : changes_of(options)) text += " " + shell_word(word);
    const std::string task = "\"$SLURM_ARRAY_TASK_ID\"";
    text += fmt::format(" --shard {0}/{1} --output {2}/{0}-of-{1}", task, options.array, shell_word(folder.string()));
    return text + command_tail(common);
}

/// Number of the submitted job.
std::string submit(const std::string& options, const std::filesystem::path& script) {
    const std::string command = "sbatch --parsable " + options + shell_word(script.string()) + " 2>&1";
    std::FILE* pipe = popen(command.c_str(), "r");
    std::string answer;
    std::array<char, 256> bytes{};
    for (std::size_t n = 1; pipe != nullptr && n > 0;) {
        n = std::fread(bytes.data(), 1, bytes.size(), pipe);
        answer.append(bytes.data(), n);
    }
    const int status = pipe == nullptr ? -1 : pclose(pipe);
    constexpr int no_such_program = 127;
    if (WIFEXITED(status) && WEXITSTATUS(status) == no_such_program) {
        throw InputError("command line", "--slurm", "Slurm's sbatch in the path", "none");
    }
    // The last line is the reason, or "NUMBER" or "NUMBER;CLUSTER" behind warnings.
    answer.erase(answer.find_last_not_of('\n') + 1);
    answer.erase(0, answer.rfind('\n') + 1);
    if (status != 0) throw InputError(script.string(), "", "a script that sbatch takes", answer);
    return answer.substr(0, answer.find(';'));
}

}  // namespace

std::filesystem::path shard_folder(const std::filesystem::path& whole, const Shard& shard) {
    return shards_folder(whole) / fmt::format("{}-of-{}", shard.number, shard.count);
}

int submit_to_slurm(const Study& study, const std::vector<PlannedRun>& plan, const CommonOptions& common,
                    const StudyOptions& options, const std::filesystem::path& whole) {
    if (options.time && options.time->find_first_not_of("0123456789:-") != std::string::npos) {
        throw InputError("command line", "--time", "minutes, MM:SS, HH:MM:SS or D-HH:MM:SS", *options.time);
    }
    // The merge job needs this at its end; nobody waits hours to hear it.
    { const UnfinishedFolder target(whole); }
    const std::filesystem::path folder = shards_folder(whole);
    const std::string name = "trocar-" + file_word(study.name);
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError(folder.string(), "", "a folder that can be made", error.message());
    write_whole(folder / "array.sh", array_script(plan, common, options, name, folder));
    write_whole(folder / "merge.sh", script_head(name + "-merge", folder / "merge.log") + command_head(common) +
                                         fmt::format(" merge {} {}/*-of-{}", shell_word(whole.string()),
                                                     shell_word(folder.string()), options.array) +
                                         command_tail(common));
    const std::string array_job = submit("", folder / "array.sh");
    std::string merge_job;
    try {
        merge_job = submit(fmt::format("--dependency=afterany:{} ", array_job), folder / "merge.sh");
    } catch (const InputError&) {
        (void)std::system(("scancel " + array_job).c_str());
        throw;
    }
    if (common.json) {
        const nlohmann::ordered_json document{{"study", study.name},     {"directory", whole.string()},
                                              {"shards", options.array}, {"folder", folder.string()},
                                              {"array_job", array_job},  {"merge_job", merge_job}};
        print_json_line(document);
    } else {
        fmt::print("Submitted: {} shards as Slurm job {}, their merge as job {}\nShards and logs: {}\nReport: {}\n",
                   options.array, array_job, merge_job, folder.string(), (whole / "report.html").string());
    }
    return done;
}

}  // namespace trocar::app
