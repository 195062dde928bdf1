// trocar_far_field: holds a stepper that does not update the whole tissue at every tick against one that does.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "far_field.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "measure/environment.hpp"

namespace {

using namespace trocar::bench;

enum ExitStatus : int { done = 0, bad_input = 2, internal_error = 70 };

struct Options {
    std::filesystem::path output = "build/reports/far_field";
    std::vector<std::int64_t> triangles{20000};
    std::string stepper = "adaptive_multires";
    std::string whole = "implicit";
    std::int64_t ticks = 2500;
    bool publish = false;
};

int far_field(const Options& options) {
    std::vector<FarFieldRun> runs;
    for (const std::int64_t triangles : options.triangles) {
        fmt::print(stderr, "trocar_far_field: {} triangles, {} ticks\n", triangles, options.ticks);
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
    CLI::App app{"Hold a stepper against one that moves the whole tissue, in step"};
    Options options;
    app.add_option("--triangles", options.triangles, "Of the sheet, one run for each")
        ->delimiter(',')
        ->check(CLI::Range(200, 4000000))
        ->capture_default_str();
    app.add_option("--stepper", options.stepper, "NAME[:key=value,...] under test")->capture_default_str();
    app.add_option("--whole", options.whole, "NAME[:key=value,...] that it is held against")->capture_default_str();
    app.add_option("--ticks", options.ticks, "Of each run")->check(CLI::Range(1, 1000000))->capture_default_str();
    app.add_option("--output", options.output, "Folder for the report")->capture_default_str();
    app.add_flag("--publish", options.publish, "Write it to reports/far_field as well");
    try {
        app.parse(argc, argv);
        return far_field(options);
    } catch (const CLI::Success& success) {
        return app.exit(success);
    } catch (const CLI::ParseError& error) {
        std::fprintf(stderr, "trocar_far_field: command line: %s (see --help)\n", error.what());
        return bad_input;
    } catch (const trocar::InputError& error) {
        std::fprintf(stderr, "trocar_far_field: %s\n", error.what());
        return bad_input;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "trocar_far_field: internal error: %s\n", error.what());
        return internal_error;
    }
}
