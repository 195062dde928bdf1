// trocar_bench: measures all detectors side by side and writes the report. The work of every cell happens in a child of
// this program, see session.hpp.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bench_report.hpp"
#include "far_field.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "measure/environment.hpp"
#include "session.hpp"

namespace {

using namespace trocar::bench;

enum ExitStatus : int { done = 0, comparison_failed = 1, bad_input = 2, interrupted = 130, internal_error = 70 };

struct Options {
    std::filesystem::path output = "build/reports/detection";
    std::filesystem::path published = "reports/detection";
    bool quick = false;
    bool publish = false;
    bool list = false;
    std::string only;
    std::string child_cell;
    std::filesystem::path child_output;
    std::vector<std::string> without;
    std::filesystem::path directory;
};

int print_report(const BenchReport& report, const std::filesystem::path& directory) {
    fmt::print("{}\nReport: {}\n", report.page_one, (directory / "report.html").string());
    for (const std::string& broken : report.broken_claims) {
        fmt::print(stderr, "trocar_bench: claims to be exact and is not: {}\n", broken);
    }
    return report.broken_claims.empty() ? done : comparison_failed;
}

void publish(const std::filesystem::path& from, const BenchReport& report, const std::filesystem::path& to) {
    if (std::filesystem::exists(to) && std::filesystem::equivalent(from, to)) return;
    std::filesystem::remove_all(to);
    const auto copy = [&](const std::string& name) {
        std::filesystem::create_directories((to / name).parent_path());
        std::filesystem::copy_file(from / name, to / name, std::filesystem::copy_options::overwrite_existing);
    };
    copy("records.jsonl");
    for (const auto& [name, content] : report.files) copy(name);
}

int detection(const Options& options) {
    std::vector<CellSpec> plan = plan_cells(options.quick);
    std::erase_if(plan, [&options](const CellSpec& cell) { return cell.id.find(options.only) == std::string::npos; });
    if (plan.empty()) throw trocar::InputError("command line", "--only", "part of a cell's name", options.only);
    if (!options.child_cell.empty()) {
        run_child(plan, options.child_cell, options.without, options.child_output);
        return done;
    }
    if (options.list) {
        for (const CellSpec& cell : plan) fmt::print("{}\n", cell.id);
        return done;
    }
    SessionOptions session;
    session.directory = options.output;
    session.child_command = {std::filesystem::read_symlink("/proc/self/exe").string(), "detection"};
    if (options.quick) session.child_command.emplace_back("--quick");
    session.plan = std::move(plan);
    session.time_limit_s = options.quick ? 900.0 : 1800.0;
    session.progress = isatty(STDERR_FILENO) == 1;
    const SessionResult result = run_session(session);
    if (result.interrupted) {
        fmt::print(stderr, "trocar_bench: interrupted; {} cells are kept, the same command goes on from there\n",
                   result.made + result.found);
        return interrupted;
    }
    const BenchReport report = write_report(options.output);
    if (options.publish) publish(options.output, report, options.published);
    return print_report(report, options.publish ? options.published : options.output);
}

struct FarFieldOptions {
    std::filesystem::path output = "build/reports/far_field";
    std::vector<std::int64_t> triangles{20000};
    std::string stepper = "adaptive_multires";
    std::string whole = "implicit";
    std::int64_t ticks = 2500;
    bool publish = false;
};

int far_field(const FarFieldOptions& options) {
    std::vector<FarFieldRun> runs;
    for (const std::int64_t triangles : options.triangles) {
        fmt::print(stderr, "trocar_bench: {} triangles, {} ticks\n", triangles, options.ticks);
        runs.push_back(run_far_field(triangles, options.stepper, options.whole, options.ticks));
    }
    const std::map<std::string, std::string> files = far_field_report(runs, trocar::environment());
    for (const std::filesystem::path& folder :
         options.publish ? std::vector{options.output, std::filesystem::path("reports/far_field")}
                         : std::vector{options.output}) {
        std::filesystem::create_directories(folder / "charts");
        for (const auto& [name, content] : files) {
            trocar::write_whole(folder / name, content);
        }
        fmt::print("Report: {}\n", (folder / "report.html").string());
    }
    return done;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Benchmark of all registered detectors, side by side on the same frames"};
    app.require_subcommand(1);
    app.footer(
        "Exit status: 0 measured; 1 a detector that claims exactness differs from truth; 2 bad input; 130 interrupted "
        "(the same command goes on).");
    Options options;
    CLI::App* run = app.add_subcommand("detection", "Measure what is not measured yet and write the report");
    run->add_flag("--quick", options.quick, "A selection of scenes and fewer steps: under 10 minutes");
    run->add_option("--output", options.output, "Folder for records and report")->capture_default_str();
    run->add_flag("--publish", options.publish, "Copy the finished report to reports/detection");
    run->add_option("--only", options.only, "Only cells whose name holds this text");
    run->add_flag("--list", options.list, "Print the names of the cells and stop");
    run->add_option("--child-cell", options.child_cell)->group("");
    run->add_option("--child-output", options.child_output)->group("");
    run->add_option("--without", options.without)->group("");
    FarFieldOptions far;
    CLI::App* field =
        app.add_subcommand("far_field", "Hold a stepper against one that moves the whole tissue, in step");
    field->add_option("--triangles", far.triangles, "Of the sheet, one run for each")
        ->delimiter(',')
        ->check(CLI::Range(200, 4000000))
        ->capture_default_str();
    field->add_option("--stepper", far.stepper, "NAME[:key=value,...] under test")->capture_default_str();
    field->add_option("--whole", far.whole, "NAME[:key=value,...] that it is held against")->capture_default_str();
    field->add_option("--ticks", far.ticks, "Of each run")->check(CLI::Range(1, 1000000))->capture_default_str();
    field->add_option("--output", far.output, "Folder for the report")->capture_default_str();
    field->add_flag("--publish", far.publish, "Write it to reports/far_field as well");
    CLI::App* report = app.add_subcommand("report", "Rebuild a report from its stored records, byte for byte");
    report->add_option("directory", options.directory, "Folder that holds records.jsonl")->required();
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& success) {
        return app.exit(success);
    } catch (const CLI::ParseError& error) {
        std::fprintf(stderr, "trocar_bench: command line: %s (see trocar_bench --help)\n", error.what());
        return bad_input;
    }
    try {
        if (field->parsed()) return far_field(far);
        if (report->parsed()) return print_report(write_report(options.directory), options.directory);
        return detection(options);
    } catch (const trocar::InputError& error) {
        std::fprintf(stderr, "trocar_bench: %s\n", error.what());
        return bad_input;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "trocar_bench: internal error: %s\n", error.what());
        return internal_error;
    }
}
