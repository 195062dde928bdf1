// `trocar report`: a report from stored records, byte for byte; or, with --against, what has changed since other ones.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/shipped.hpp"
#include "app/worst_tick.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "report/figures.hpp"
#include "report/regression.hpp"
#include "report/report.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

void print_text(const StudyComparison& found) {
    const auto list = [](const char* title, const std::vector<std::string>& runs) {
        for (const std::string& run : runs) fmt::print("{:<8} {}\n", title, run);
    };
    list("missing", found.missing);
    list("extra", found.extra);
    list("stale", found.stale);
    constexpr std::size_t most = 200;
    for (std::size_t i = 0; i < std::min(most, found.changes.size()); ++i) {
        const FigureChange& change = found.changes[i];
        fmt::print("changed  {}: {}: {} -> {}\n", change.run, change.figure, change.before, change.after);
    }
    if (found.changes.size() > most) fmt::print("… and {} more (--json lists all)\n", found.changes.size() - most);
    fmt::print("{} runs compared: {} figures changed; {} runs missing, {} extra, {} stale\n", found.compared,
               found.changes.size(), found.missing.size(), found.extra.size(), found.stale.size());
}

int compare(const CommonOptions& common, const ReportOptions& options) {
    if (!(options.tolerance >= 0.0)) {
        throw InputError("command line", "--tolerance", "a number >= 0", fmt::format("{}", options.tolerance));
    }
    const StudyComparison found =
        compare_studies(read_records(*options.against), read_records(options.directory), options.tolerance);
    if (common.json) {
        Json changes = Json::array();
        for (const FigureChange& change : found.changes) {
            changes.push_back({{"run", change.run},
                               {"figure", change.figure},
                               {"before", change.before},
                               {"after", change.after},
                               {"relative", json_number(change.size)}});
        }
        const Json document{{"directory", options.directory.string()},
                            {"against", options.against->string()},
                            {"same", found.same()},
                            {"compared", found.compared},
                            {"missing", found.missing},
                            {"extra", found.extra},
                            {"stale", found.stale},
                            {"changes", changes}};
        print_json_line(document);
    } else {
        print_text(found);
    }
    return found.same() ? done : comparison_failed;
}

/// Scenes are named from the study's file.
void take_picture(const CommonOptions& common, const ReportOptions& options) {
    const std::filesystem::path& directory = options.directory;
    const std::vector<Record> records = read_records(directory);
    const std::filesystem::path study = options.study.value_or(fact_of(records.front(), "study.file"));
    if (!std::filesystem::exists(study)) {
        throw InputError(directory.string(), "--study", "the file of the study that made these records",
                         "no file '" + study.string() + "' here");
    }
    const auto seen = see_worst_tick(records, study.parent_path(), common.data);
    if (!seen) {
        throw InputError(directory.string(), "--picture", "a study with a closed loop that ended well", "none");
    }
    write_whole(directory / worst_tick_file, to_json(*seen));
}

}  // namespace

int report(const CommonOptions& common, const ReportOptions& options) {
    if (options.against) return compare(common, options);
    if (options.picture) take_picture(common, options);
    const Report written = write_report(options.directory, shipped_reports());
    if (common.json) {
        Json document{{"directory", options.directory.string()}, {"files", Json::array()}};
        for (const auto& [name, content] : written.files) document["files"].push_back(name);
        print_json_line(document);
    } else {
        fmt::print("{}\nReport: {}\n", written.page_one, (options.directory / "report.html").string());
    }
    return done;
}

}  // namespace trocar::app
