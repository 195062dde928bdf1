#include "study/runner.hpp"

#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "study/child_process.hpp"

namespace trocar {
namespace {

constexpr std::uint64_t fnv_start = 0xCBF29CE484222325ULL;

std::uint64_t fnv(std::uint64_t hash, std::string_view bytes) {
    for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
    return hash;
}

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

    /// False when interrupted.
    bool make(std::size_t index, const PlannedRun& run) {
        if (run.settled) {
            keep(run, *run.settled, std::nullopt);
            return true;
        }
        std::filesystem::path output = file_of(run);
        output.replace_extension(".child");
        std::filesystem::remove(output);
        std::vector<std::string> command = options_.child_command;
        command.insert(command.end(), {"--child-run", std::to_string(index), "--child-output", output.string()});
        const ChildEnd end = run_child_process(command, folder_ / "stderr.log", options_.time_limit_s, signals_);
        if (end.kind == ChildEnd::Kind::interrupted) {
            std::filesystem::remove(output);
            return false;
        }
        std::optional<Record> record = finished_record(output, run.spec);
        if (!record) {
            keep(run, failure_of(end, options_.time_limit_s), std::nullopt);
        } else {
            // A complete answer followed by a crash or a hang is still a failure of the method, with its rows.
            const bool ended_well = end.kind == ChildEnd::Kind::exited;
            Outcome outcome = record->outcome;
            if (!ended_well && outcome.ok()) outcome = failure_of(end, options_.time_limit_s);
            keep(run, outcome, std::move(record));
        }
        std::filesystem::remove(output);
        return true;
    }

private:
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
    std::uint64_t hash = fnv_start;
    for (const std::string& file : files) {
        if (std::filesystem::exists(file)) hash = fnv(hash, read_whole(file, "a record"));
    }
    return fmt::format("{:016x}", hash);
}

std::string run_key(const RunSpec& spec, double time_limit_s) {
    return fmt::format("{:016x}", fnv(fnv(fnv_start, spec_line(spec)), fmt::format("{}", time_limit_s)));
}

void shorten_rows(Record& record) {
    const auto shorten = [](double& value) {
        if (!std::isfinite(value)) return;
        const std::string text = fmt::format("{:.4e}", value);
        std::from_chars(text.data(), text.data() + text.size(), value);
    };
    for (StepRow& row : record.rows) {
        for (double* value :
             {&row.max_depth, &row.mean_depth, &row.depth_error, &row.native_depth_error, &row.overlap_volume,
              &row.min_translation, &row.overshoot, &row.strain_over, &row.max_strain}) {
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
            if (rows[i].max_depth > rows[deepest].max_depth) deepest = i;
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
        for (std::size_t i = 0; i < plan.size(); ++i) {
            if (SignalsHeld::take_interruption()) {
                result.interrupted = true;
                return result;
            }
            if (finished_record(runner.file_of(plan[i]), plan[i].spec)) {
                ++result.found;
                continue;
            }
            if (options.progress) options.progress(i, &plan[i]);
            if (!runner.make(i, plan[i])) {
                result.interrupted = true;
                return result;
            }
            ++result.made;
        }
        if (options.progress) options.progress(plan.size(), nullptr);
        std::string records;
        for (const PlannedRun& run : plan) records += read_whole(runner.file_of(run), "a record");
        write_whole(options.directory / "records.jsonl", records);
    }
    std::filesystem::remove(folder / "stderr.log", error);
    for (const auto& entry : std::filesystem::directory_iterator(all_runs)) {
        if (entry.path() != folder) std::filesystem::remove_all(entry.path(), error);
    }
    return result;
}

}  // namespace trocar
