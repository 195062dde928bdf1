#include "session.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "measure/environment.hpp"
#include "study/child_process.hpp"
#include "study/runner.hpp"

namespace trocar::bench {
namespace {

std::filesystem::path now_file(std::filesystem::path output) { return output += ".now"; }

std::optional<std::string> first_line(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string line;
    if (!std::getline(stream, line)) return std::nullopt;
    return line;
}

/// Everything that decides what a cell measures, besides the binary.
std::string key_of(const CellSpec& spec) {
    CellRecord bare;
    bare.spec = spec;
    return to_json_line(bare);
}

std::string file_name(const CellSpec& spec) {
    FnvHash hash;
    hash.add_text(key_of(spec));
    return hash.text() + ".json";
}

std::optional<CellRecord> finished_cell(const std::filesystem::path& file, const CellSpec& spec) {
    const std::optional<std::string> line = first_line(file);
    if (!line) return std::nullopt;
    try {
        CellRecord record = cell_from_json_line(*line, file.string(), 1);
        if (key_of(record.spec) == key_of(spec)) return record;
    } catch (const InputError&) {
        // Half a file or another program's: the cell is simply not finished.
    }
    return std::nullopt;
}

/// One cell, measured again without whoever ends it early.
class CellAttempts {
public:
    CellAttempts(const SessionOptions& options, const SignalsHeld& signals, std::filesystem::path file)
        : options_(options), signals_(signals), file_(std::move(file)) {}

    /// Nothing when interrupted.
    std::optional<CellRecord> run(const CellSpec& spec) {
        constexpr int most_attempts = 8;
        for (int attempt = 0; attempt < most_attempts; ++attempt) {
            std::vector<std::string> command = options_.child_command;
            command.insert(command.end(), {"--child-cell", spec.id, "--child-output", file_.string()});
            for (const MethodResult& row : lost_) command.insert(command.end(), {"--without", row.label});
            std::error_code ignored;
            std::filesystem::remove(now_file(file_), ignored);
            std::filesystem::path log = file_;
            log += ".log";
            ChildProcess child(command, log, options_.time_limit_s, signals_);
            const std::optional<ChildEnd> end = wait_for(child);
            if (!end) return std::nullopt;
            std::optional<CellRecord> record = finished_cell(file_, spec);
            const std::string culprit = first_line(now_file(file_)).value_or("");
            std::filesystem::remove(now_file(file_), ignored);
            std::filesystem::remove(log, ignored);
            if (record) {
                for (const MethodResult& row : lost_) {
                    record->set_aside.push_back(row.label + ": " + row.outcome.message);
                    record->measurement.methods.push_back(row);
                }
                return record;
            }
            const Outcome outcome = failure_of(*end, options_.time_limit_s);
            if (culprit.empty()) return failed(spec, outcome);
            MethodResult row;
            row.label = culprit;
            row.method = culprit;
            row.outcome = outcome;
            lost_.push_back(std::move(row));
        }
        return failed(spec, {OutcomeKind::crashed, "one method after the other ended the cell"});
    }

private:
    static CellRecord failed(const CellSpec& spec, const Outcome& outcome) {
        CellRecord record;
        record.spec = spec;
        record.binary = binary_identity();
        record.environment = environment();
        record.outcome = outcome;
        return record;
    }

    const SessionOptions& options_;
    const SignalsHeld& signals_;
    std::filesystem::path file_;
    std::vector<MethodResult> lost_;
};

void show(const SessionOptions& options, std::size_t number, const std::string& text,
          std::chrono::steady_clock::time_point start) {
    if (!options.progress) return;
    const auto seconds =
        std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - start).count();
    std::fputs(fmt::format("\r\033[K[{}/{}] {}:{:02} {}", number, options.plan.size(), seconds / 60, seconds % 60, text)
                   .c_str(),
               stderr);
    std::fflush(stderr);
}

}  // namespace

SessionResult run_session(const SessionOptions& options) {
    SessionResult result;
    const std::filesystem::path all = options.directory / "cells";
    const std::filesystem::path folder = all / binary_identity();
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError(folder.string(), "", "a folder that can be made", error.message());
    const DirectoryLock lock(options.directory);
    const SignalsHeld signals;
    const auto start = std::chrono::steady_clock::now();
    std::string lines;
    for (std::size_t i = 0; i < options.plan.size() && !result.interrupted; ++i) {
        const CellSpec& spec = options.plan[i];
        const std::filesystem::path file = folder / file_name(spec);
        std::optional<CellRecord> record = finished_cell(file, spec);
        if (record) {
            ++result.found;
        } else if (!SignalsHeld::take_interruption()) {
            show(options, i + 1, spec.id, start);
            record = CellAttempts(options, signals, file).run(spec);
            if (record) {
                write_whole(file, to_json_line(*record) + "\n");
                ++result.made;
            }
        }
        if (record) {
            lines += to_json_line(*record) + "\n";
        } else {
            result.interrupted = true;
        }
    }
    if (options.progress) std::fputs("\r\033[K", stderr);
    if (result.interrupted) return result;
    write_whole(options.directory / "records.jsonl", lines);
    for (const auto& entry : std::filesystem::directory_iterator(all)) {
        if (entry.path() != folder) std::filesystem::remove_all(entry.path(), error);
    }
    return result;
}

void run_child(const std::vector<CellSpec>& plan, const std::string& id, const std::vector<std::string>& without,
               const std::filesystem::path& output) {
    const auto spec = std::find_if(plan.begin(), plan.end(), [&id](const CellSpec& cell) { return cell.id == id; });
    if (spec == plan.end()) throw InputError("command line", "--child-cell", "a cell of the plan", id);
    const int descriptor = open(now_file(output).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    const CellRecord record = run_cell(*spec, without, [descriptor](const std::string& label) {
        const std::string line = label + "\n";
        if (ftruncate(descriptor, 0) == 0) (void)!pwrite(descriptor, line.data(), line.size(), 0);
    });
    close(descriptor);
    write_whole(output, to_json_line(record) + "\n");
}

std::vector<CellRecord> read_cells(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw InputError(file.string(), "", "records of the benchmark", "no such file");
    std::vector<CellRecord> records;
    std::string line;
    for (std::int64_t number = 1; std::getline(stream, line); ++number) {
        if (!line.empty()) records.push_back(cell_from_json_line(line, file.string(), number));
    }
    if (records.empty()) throw InputError(file.string(), "", "records of the benchmark", "an empty file");
    return records;
}

}  // namespace trocar::bench
