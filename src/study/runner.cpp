#include "study/runner.hpp"

#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>

#include "geometry/fnv_hash.hpp"
#include "geometry/gzip.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "study/child_process.hpp"

namespace trocar {
namespace {

std::string spec_line(const RunSpec& spec) {
    Record record;
    record.spec = spec;
    return to_json_line(record);
}

/// The record in a file if it is complete and of this very run.
std::optional<Record> finished_record(const std::filesystem::path& file, const RunSpec& spec) {
    if (!std::filesystem::is_regular_file(file)) return std::nullopt;
    try {
        Record record = record_from_json_line(read_whole(file, "a record"), file.string(), 1);
        if (spec_line(record.spec) == spec_line(spec)) return record;
    } catch (const InputError&) {
        // Half a file or another program's: the run is simply not finished.
    }
    return std::nullopt;
}

class Runner {
public:
    Runner(const RunnerOptions& options, std::filesystem::path folder)
        : options_(options), folder_(std::move(folder)) {}

    [[nodiscard]] std::filesystem::path file_of(const PlannedRun& run) const {
        return folder_ / (run_key(run.spec, options_.time_limit_s) + ".json");
    }

    /// Keeps the row of a run whose outcome is known; else starts it.
    void start(std::size_t index, const PlannedRun& run) {
        if (run.settled) {
            keep(run, *run.settled, std::nullopt);
            return;
        }
        std::filesystem::path output = file_of(run);
        output.replace_extension(".child");
        std::filesystem::remove(output);
        std::filesystem::path log = output;
        log.replace_extension(".log");
        std::vector<std::string> command = options_.child_command;
        command.insert(command.end(), {"--child-run", std::to_string(index), "--child-output", output.string()});
        children_.push_back(
            {&run, output, log, std::make_unique<ChildProcess>(command, log, options_.time_limit_s, signals_)});
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
            if (options_.progress) options_.progress(static_cast<std::size_t>(done), children_.front().run);
            double seconds = std::min(between, children_.front().process->seconds_left());
            for (const Child& child : children_) seconds = std::min(seconds, child.process->seconds_left());
            if (!SignalsHeld::wait(seconds)) continue;
            stop();
            return false;
        }
    }

    /// Ends all that run; what they left is gone.
    void stop() {
        for (Child& child : children_) {
            child.process.reset();
            std::filesystem::remove(child.output);
            std::filesystem::remove(child.log);
        }
        children_.clear();
    }

private:
    struct Child {
        const PlannedRun* run;
        std::filesystem::path output;
        std::filesystem::path log;
        std::unique_ptr<ChildProcess> process;
    };

    void take(const Child& child, const ChildEnd& end) {
        std::optional<Record> record = finished_record(child.output, child.run->spec);
        if (!record) {
            keep(*child.run, failure_of(end, options_.time_limit_s), std::nullopt);
        } else {
            // A complete answer followed by a crash or a hang is still a failure of the method, with its rows.
            const bool ended_well = end.kind == ChildEnd::Kind::exited;
            Outcome outcome = record->outcome;
            if (!ended_well && outcome.ok()) outcome = failure_of(end, options_.time_limit_s);
            keep(*child.run, outcome, std::move(record));
        }
        std::filesystem::remove(child.output);
        std::filesystem::remove(child.log);
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

}  // namespace

std::string binary_identity() {
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
    return hash.text();
}

bool is_timed(const RunSpec& spec) { return spec.mode != "hard_case" && spec.mode != "metamorphic"; }

std::string run_key(const RunSpec& spec, double time_limit_s) {
    FnvHash hash;
    hash.add_text(spec_line(spec));
    hash.add_text(fmt::format("{}", time_limit_s));
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
        for (const bool timed : {true, false}) {
            for (std::size_t i = 0; i < plan.size(); ++i) {
                if (is_timed(plan[i].spec) != timed) continue;
                if (SignalsHeld::take_interruption()) {
                    runner.stop();
                    result.interrupted = true;
                    return result;
                }
                if (finished_record(runner.file_of(plan[i]), plan[i].spec)) {
                    ++result.found;
                    continue;
                }
                const std::int64_t done = result.found + result.made;
                if (options.progress) options.progress(static_cast<std::size_t>(done), &plan[i]);
                runner.start(i, plan[i]);
                if (!runner.wait_until_below(timed ? 1 : most, done)) {
                    result.interrupted = true;
                    return result;
                }
                ++result.made;
            }
        }
        if (!runner.wait_until_below(1, result.found + result.made)) {
            result.interrupted = true;
            return result;
        }
        if (options.progress) options.progress(plan.size(), nullptr);
        std::string records;
        for (const PlannedRun& run : plan) records += read_whole(runner.file_of(run), "a record");
        write_whole(options.directory / records_name, gzipped(records));
    }
    for (const auto& entry : std::filesystem::directory_iterator(all_runs)) {
        if (entry.path() != folder) std::filesystem::remove_all(entry.path(), error);
    }
    return result;
}

}  // namespace trocar
