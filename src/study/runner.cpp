#include "study/runner.hpp"

#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "geometry/fnv_hash.hpp"
#include "geometry/gzip.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "method/registry.hpp"
#include "study/child_process.hpp"

namespace trocar {
namespace {

std::string spec_line(const RunSpec& spec) {
    Record record;
    record.spec = spec;
    return to_json_line(record);
}

/// The records in a file if it is complete and holds these very runs, in this order.
std::optional<std::vector<Record>> finished_records(const std::filesystem::path& file,
                                                    const std::vector<const PlannedRun*>& runs) {
    if (!std::filesystem::is_regular_file(file)) return std::nullopt;
    std::vector<Record> records;
    try {
        std::istringstream stream(read_whole(file, "records"));
        for (std::string line; std::getline(stream, line);) {
            records.push_back(record_from_json_line(line, file.string(), 1));
        }
    } catch (const InputError&) {
        return std::nullopt;  // half a file or another program's
    }
    const auto is_of = [](const Record& record, const PlannedRun* run) {
        return spec_line(record.spec) == spec_line(run->spec);
    };
    if (!std::equal(records.begin(), records.end(), runs.begin(), runs.end(), is_of)) return std::nullopt;
    return records;
}

std::filesystem::path turn_file(std::filesystem::path output) { return output += ".turn"; }

/// The run of a group that had its turn last; -1: unknown.
std::int64_t last_turn(const std::filesystem::path& output) {
    std::ifstream stream(turn_file(output));
    std::int64_t index = -1;
    stream >> index;
    return index;
}

class Runner {
public:
    Runner(const RunnerOptions& options, std::filesystem::path folder)
        : options_(options), folder_(std::move(folder)) {}

    [[nodiscard]] std::filesystem::path file_of(const PlannedRun& run) const {
        return folder_ / (run_key(run.spec, run.facts, options_.time_limit_s) + ".json");
    }

    /// Positions of the runs of `members` that have to be made: none when all have a record. The runs of a group are
    /// made together again when one is missing, without those that ended their process.
    [[nodiscard]] std::vector<std::size_t> missing(const std::vector<PlannedRun>& plan,
                                                   const std::vector<std::size_t>& members) const {
        std::vector<std::size_t> unmade;
        bool all_made = true;
        for (const std::size_t index : members) {
            const auto made = finished_records(file_of(plan[index]), {&plan[index]});
            all_made = all_made && made.has_value();
            const bool ended_its_process = made && (made->front().outcome.kind == OutcomeKind::crashed ||
                                                    made->front().outcome.kind == OutcomeKind::timed_out);
            if (!ended_its_process && !(made && plan[index].settled)) unmade.push_back(index);
        }
        return all_made ? std::vector<std::size_t>{} : unmade;
    }

    /// Keeps the rows of runs whose outcome is known; starts the others in one process.
    void start(const std::vector<PlannedRun>& plan, const std::vector<std::size_t>& members) {
        Child child;
        std::vector<std::string> command = options_.child_command;
        for (const std::size_t index : members) {
            const PlannedRun& run = plan[index];
            if (run.settled) {
                keep(run, *run.settled, std::nullopt);
                continue;
            }
            child.runs.push_back(&run);
            command.insert(command.end(), {"--child-run", std::to_string(index)});
        }
        if (child.runs.empty()) return;
        child.plan = plan.data();
        child.output = file_of(*child.runs.front());
        child.output.replace_extension(".child");
        child.log = child.output;
        child.log.replace_extension(".log");
        remove_files(child);
        command.insert(command.end(), {"--child-output", child.output.string()});
        child.process = std::make_unique<ChildProcess>(command, child.log, options_.time_limit_s, signals_);
        children_.push_back(std::move(child));
    }

    /// Waits until fewer than `most` children run, and reports the oldest once a second. False when interrupted; then
    /// none runs. `done`: runs that are done or started.
    bool wait_until_below(std::size_t most, std::int64_t done) {
        constexpr double between = 1.0;  // s
        while (true) {
            std::erase_if(children_, [this](const Child& child) {
                const std::optional<ChildEnd> end = child.process->end();
                if (end) take(child, *end);
                return end.has_value();
            });
            if (children_.size() < most) return true;
            if (options_.progress) options_.progress(static_cast<std::size_t>(done), children_.front().runs.front());
            double seconds = std::min(between, children_.front().process->seconds_left());
            for (const Child& child : children_) seconds = std::min(seconds, child.process->seconds_left());
            if (!SignalsHeld::wait(seconds)) continue;
            stop();
            return false;
        }
    }

    bool is_interrupted() { return signals_.take_interruption(); }

    /// Ends all that run; what they left is gone.
    void stop() {
        for (Child& child : children_) {
            child.process.reset();
            remove_files(child);
        }
        children_.clear();
    }

private:
    struct Child {
        const PlannedRun* plan = nullptr;  ///< first of the plan
        std::vector<const PlannedRun*> runs;
        std::filesystem::path output;
        std::filesystem::path log;
        std::unique_ptr<ChildProcess> process;
    };

    static void remove_files(const Child& child) {
        for (const std::filesystem::path& file : {child.output, child.log, turn_file(child.output)}) {
            std::filesystem::remove(file);
        }
    }

    void take(const Child& child, const ChildEnd& end) {
        std::optional<std::vector<Record>> records = finished_records(child.output, child.runs);
        if (!records) {
            // Of a group, the run that had its turn is to blame; the others are made again without it.
            const std::int64_t turn = last_turn(child.output);
            for (const PlannedRun* run : child.runs) {
                if (turn >= 0 && run != child.plan + turn) continue;
                keep(*run, end.failure, std::nullopt);
            }
        } else {
            // A complete answer followed by a crash or a hang is still a failure of the method, with its rows.
            for (std::size_t i = 0; i < child.runs.size(); ++i) {
                Outcome outcome = (*records)[i].outcome;
                if (!end.exited && outcome.ok()) outcome = end.failure;
                keep(*child.runs[i], outcome, std::move((*records)[i]));
            }
        }
        remove_files(child);
    }

    void keep(const PlannedRun& run, const Outcome& outcome, std::optional<Record> record) {
        Record kept;
        if (record) {
            kept = std::move(*record);
        } else {
            kept.spec = run.spec;
            if (options_.environment) kept.environment = options_.environment(run);
        }
        kept.outcome = outcome;
        kept.environment["binary"] = options_.binary;
        write_whole(file_of(run), to_json_line(kept) + "\n");
    }

    const RunnerOptions& options_;
    std::filesystem::path folder_;
    SignalsHeld signals_;
    std::vector<Child> children_;
};

/// Runs of the plan that are made in one process, in the order of the first of each.
std::vector<std::vector<std::size_t>> processes_of(const std::vector<PlannedRun>& plan) {
    std::vector<std::vector<std::size_t>> processes;
    std::map<std::string, std::size_t> by_group;
    for (std::size_t i = 0; i < plan.size(); ++i) {
        if (!plan[i].group.empty()) {
            const auto [place, is_new] = by_group.emplace(plan[i].group, processes.size());
            if (!is_new) {
                processes[place->second].push_back(i);
                continue;
            }
        }
        processes.push_back({i});
    }
    return processes;
}

std::string hash_of_binary() {
    std::set<std::string> files;
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void* out) {
            const std::string name = info->dlpi_name == nullptr ? "" : info->dlpi_name;
            static_cast<std::set<std::string>*>(out)->insert(name.empty() ? "/proc/self/exe" : name);
            return 0;
        },
        &files);
    FnvHash hash;
    for (const std::string& file : files) {
        if (std::filesystem::exists(file)) hash.add_text(read_whole(file, "a record"));
    }
    for (const DetectorEntry& entry : registry().detectors()) hash.add_text(entry.name + entry.version);
    for (const ResponseEntry& entry : registry().responses()) hash.add_text(entry.name + entry.version);
    return hash.text();
}

}  // namespace

void write_turn(const std::filesystem::path& output, std::int64_t index) {
    std::ofstream(turn_file(output)) << index << "\n";
}

std::string binary_identity() {
    static const std::string identity = hash_of_binary();  // takes a fifth of a second
    return identity;
}

std::string run_key(const RunSpec& spec, const std::map<std::string, std::string>& facts, double time_limit_s) {
    FnvHash hash;
    hash.add_text(spec_line(spec));
    hash.add_text(fmt::format("{}", time_limit_s));
    if (const auto references = facts.find("scene.references"); references != facts.end())
        hash.add_text(references->second);
    return hash.text();
}

void shorten_rows(Record& record) {
    const auto shorten = [](double& value) {
        if (!std::isfinite(value)) return;
        const std::string text = fmt::format("{:.4e}", value);
        std::from_chars(text.data(), text.data() + text.size(), value);
    };
    for (StepRow& row : record.rows) {
        for (double* value :
             {&row.residual_penetration, &row.residual_penetration_mean, &row.depth_error, &row.native_depth_error,
              &row.overlap_volume, &row.min_translation, &row.overshoot, &row.strain_over, &row.max_strain}) {
            shorten(*value);
        }
        for (double& component : row.tool_force) shorten(component);
    }
}

void thin_rows(Record& record) {
    const auto stretch = static_cast<std::size_t>(record.spec.detail_stride);
    if (record.spec.mode != "closed_loop" || stretch < 2) return;
    const std::vector<StepRow>& rows = record.rows;
    std::vector<StepRow> kept;
    for (std::size_t first = 0; first < rows.size(); first += stretch) {
        const std::size_t end = std::min(first + stretch, rows.size());
        std::size_t deepest = first;
        std::size_t strongest = first;
        for (std::size_t i = first; i < end; ++i) {
            if (rows[i].residual_penetration > rows[deepest].residual_penetration) deepest = i;
            if (rows[i].tool_force.norm() > rows[strongest].tool_force.norm()) strongest = i;
        }
        for (std::size_t i = first; i < end; ++i) {
            const bool wrong = rows[i].outcome != OutcomeKind::ok || rows[i].truncated;
            if (i == first || i == deepest || i == strongest || wrong) kept.push_back(rows[i]);
        }
    }
    record.rows = std::move(kept);
}

RunnerResult run_plan(const std::vector<PlannedRun>& plan, const RunnerOptions& options) {
    RunnerResult result;
    const std::filesystem::path all_runs = options.directory / "runs";
    const std::filesystem::path folder = all_runs / options.binary;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError(folder.string(), "", "a folder that can be made", error.message());
    const DirectoryLock lock(options.directory);
    {
        Runner runner(options, folder);
        const auto most = static_cast<std::size_t>(std::max(options.jobs, 1));
        // Those that may run side by side come last, so that no timed one has to wait for them to end.
        std::vector<std::vector<std::size_t>> processes = processes_of(plan);
        const auto is_elsewhere = [&](const auto& members) { return plan[members.front()].shard != options.shard; };
        std::erase_if(processes, is_elsewhere);
        for (const bool timed : {true, false}) {
            for (const std::vector<std::size_t>& members : processes) {
                const PlannedRun& first = plan[members.front()];
                if ((options.timed && is_timed(first.spec)) != timed) continue;
                const auto count = static_cast<std::int64_t>(members.size());
                std::vector<std::size_t> missing = runner.missing(plan, members);
                if (missing.empty()) result.found += count;
                // Again without the run that ended the process of a group.
                for (bool again = false; !missing.empty(); again = true) {
                    if (runner.is_interrupted()) {
                        runner.stop();
                        result.interrupted = true;
                        return result;
                    }
                    const std::int64_t done = result.found + result.made;
                    if (options.progress) options.progress(static_cast<std::size_t>(done), &first);
                    runner.start(plan, missing);
                    if (!runner.wait_until_below(timed ? 1 : most, done)) {
                        result.interrupted = true;
                        return result;
                    }
                    if (!again) result.made += count;
                    missing = count > 1 ? runner.missing(plan, members) : std::vector<std::size_t>{};
                }
            }
        }
        if (!runner.wait_until_below(1, result.found + result.made)) {
            result.interrupted = true;
            return result;
        }
        if (options.progress) options.progress(static_cast<std::size_t>(result.found + result.made), nullptr);
        std::string records;
        for (const PlannedRun& run : plan) {
            if (run.shard == options.shard) records += read_whole(runner.file_of(run), "a record");
        }
        write_whole(options.directory / records_name, gzipped(records));
    }
    for (const auto& entry : std::filesystem::directory_iterator(all_runs)) {
        if (entry.path() != folder) std::filesystem::remove_all(entry.path(), error);
    }
    return result;
}

}  // namespace trocar
