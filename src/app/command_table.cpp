// `trocar table`: a table for a paper out of stored records, on standard output, or all of them as a database.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "geometry/input_error.hpp"
#include "report/benchmark_json.hpp"
#include "report/report.hpp"
#include "report/run_database.hpp"
#include "report/table_choice.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

void print_json(const ChosenTable& table) {
    Json document{{"columns", Json::array()}, {"rows", Json::array()}, {"notes", table.notes}};
    for (const ChosenColumn& column : table.columns) {
        document["columns"].push_back({{"name", column.name}, {"unit", column.unit}});
    }
    for (const std::vector<ChosenCell>& row : table.rows) {
        Json cells = Json::array();
        for (std::size_t c = 0; c < row.size(); ++c) {
            cells.push_back(table.columns[c].number ? json_number(row[c].number) : Json(row[c].word));
        }
        document["rows"].push_back(std::move(cells));
    }
    print_json_line(document);
}

}  // namespace

int table(const CommonOptions& common, const TableOptions& options) {
    const std::vector<Record> records = read_records(options.records);
    if (options.sqlite) {
        write_run_database(records, *options.sqlite);
        if (common.json) print_json_line(Json{{"file", options.sqlite->string()}, {"runs", records.size()}});
        return done;
    }
    const bool is_benchmark = options.format == "google-benchmark";
    const bool is_dashboard = options.format == "dashboard";
    if (!options.sort.empty() && (is_benchmark || is_dashboard)) {
        throw InputError("command line", "--sort", "the format md, tex or csv", options.format);
    }
    if (!options.columns.empty() && is_benchmark) {
        throw InputError("command line", "--columns", "the format md, tex, csv or dashboard", options.format);
    }
    if (is_benchmark) {
        fmt::print("{}", google_benchmark_json(choose_runs(records, options.where)));
        return done;
    }
    if (is_dashboard) {
        fmt::print("{}", smaller_is_better_json(choose_runs(records, options.where), options.columns));
        return done;
    }
    const ChosenTable chosen =
        choose_table(records, {.columns = options.columns, .where = options.where, .sort = options.sort});
    for (const std::string& note : chosen.notes) fmt::print(stderr, "trocar: {}\n", note);
    if (common.json) {
        print_json(chosen);
    } else if (options.format == "csv") {
        fmt::print("{}", table_as_csv(chosen));
    } else {
        fmt::print("{}", options.format == "tex" ? table_as_latex(chosen) : table_as_markdown(chosen));
    }
    return done;
}

}  // namespace trocar::app
