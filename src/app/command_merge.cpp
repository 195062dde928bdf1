// `trocar merge`: the records of a study's shards in one folder, with the report of the whole.
#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/shipped.hpp"
#include "app/study_runs.hpp"
#include "export/exporter.hpp"
#include "geometry/gzip.hpp"
#include "geometry/whole_file.hpp"
#include "report/report.hpp"
#include "study/shard.hpp"

namespace trocar::app {

int merge(const CommonOptions& common, const MergeOptions& options) {
    UnfinishedFolder folder(options.output);
    const MergedShards merged = merge_shards(options.folders);
    if (!common.json) {
        for (const std::string& run : merged.missing) fmt::print("missing  {}\n", run);
    }
    std::string page_one;
    if (merged.missing.empty()) {
        write_whole(folder.path() / records_name, gzipped(merged.records));
        if (!std::filesystem::exists(merged.study_file)) {
            fmt::print(stderr, "trocar merge: no replay pages and no picture of the worst tick: no file {} here\n",
                       merged.study_file.string());
            page_one = write_report(folder.path(), shipped_reports()).page_one;
        } else {
            const std::vector<Record> records = read_records(folder.path());
            page_one = write_study_report(merged.study_file, common, folder.path(), records).page_one;
        }
        folder.keep();
    }
    const std::string report = (options.output / "report.html").string();
    if (common.json) {
        const nlohmann::ordered_json document{
            {"directory", options.output.string()},
            {"report", merged.missing.empty() ? nlohmann::ordered_json(report) : nlohmann::ordered_json(nullptr)},
            {"runs", merged.runs},
            {"missing", merged.missing}};
        print_json_line(document);
    } else if (merged.missing.empty()) {
        fmt::print("{}\n{} runs merged\nReport: {}\n", page_one, merged.runs, report);
    } else {
        fmt::print("{} of {} runs missing; nothing is written\n", merged.missing.size(), merged.runs);
    }
    return merged.missing.empty() ? done : comparison_failed;
}

}  // namespace trocar::app
