// `trocar report`: a report from stored records, byte for byte.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "report/report.hpp"

namespace trocar::app {

int report(const CommonOptions& common, const ReportOptions& options) {
    const Report written = write_report(options.directory);
    if (common.json) {
        nlohmann::ordered_json document{{"directory", options.directory.string()},
                                        {"files", nlohmann::ordered_json::array()}};
        for (const auto& [name, content] : written.files) document["files"].push_back(name);
        fmt::print("{}\n", document.dump());
    } else {
        fmt::print("{}\nReport: {}\n", written.page_one, (options.directory / "report.html").string());
    }
    return done;
}

}  // namespace trocar::app
