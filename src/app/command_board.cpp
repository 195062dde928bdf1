// `trocar board`: one static page out of the records of many machines, versions and methods.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "geometry/input_error.hpp"
#include "report/board.hpp"
#include "report/report.hpp"
#include "report/report_files.hpp"

namespace trocar::app {

int board(const CommonOptions& common, const BoardOptions& options) {
    if (std::filesystem::exists(options.output) && !std::filesystem::is_directory(options.output)) {
        throw InputError(options.output.string(), "--output", "a folder, there or to be made", "a file");
    }
    std::vector<std::vector<Record>> sources;
    for (const std::filesystem::path& path : options.records) {
        sources.push_back(read_records(path));
        for (Record& record : sources.back()) record.rows = {};  // the page shows figures of runs alone
    }
    const std::map<std::string, std::string> files = make_board(sources);
    std::filesystem::create_directories(options.output);
    write_report_files(options.output, files);
    const std::string page = (options.output / "index.html").string();
    if (common.json) {
        print_json_line(nlohmann::ordered_json{{"page", page}, {"sources", sources.size()}});
    } else {
        fmt::print("Board: {}\n", page);
    }
    return done;
}

}  // namespace trocar::app
