#include "report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <istream>
#include <memory>
#include <sstream>
#include <variant>

#include "geometry/gzip.hpp"
#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "report/document.hpp"
#include "report/report_files.hpp"
#include "report/run_table.hpp"
#include "report/sections.hpp"
#include "report/verdict.hpp"
#include "report/view_links.hpp"
#include "report/worst_tick.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

/// The records without what clock and memory gave.
std::vector<Record> without_times(std::vector<Record> records) {
    for (Record& record : records) {
        std::erase_if(record.summary, [](const auto& entry) { return is_timed(info_of(entry.first).source); });
        for (StepRow& row : record.rows) row.stage_ns.fill(-1);
    }
    return records;
}

Report compose(const std::vector<Record>& records, const std::string& worst_tick, const std::string& assets,
               const QuotedRecords& quoted) {
    Draft draft(records);
    for (const auto& [name, of_report] : quoted) {
        draft.quoted.push_back(of_report.empty() ? QuotedReport{.name = name} : quote_of(name, of_report, records));
    }
    const Verdict overall = make_verdict(draft.results, draft.reference, draft.mode, draft.results.scenes(draft.mode));
    add_page_one(draft, worst_tick);
    const bool has_verdict = !overall.rows.empty();
    add_all_methods(draft, overall);
    if (!has_verdict) add_hard_cases(draft);
    if (!has_verdict) add_metamorphic(draft);
    if (!has_verdict) add_work_precision(draft);
    add_cost_by_size(draft);
    add_side_by_side(draft);
    add_repeated_motion(draft);
    add_against(draft);
    add_resolution(draft);
    add_kinds(draft);
    add_reference_laws(draft);
    add_between_ticks(draft);
    add_lost_by_the_detector(draft);
    add_verdict_by_class(draft);
    add_rank_robustness(draft);
    add_environment(draft);
    add_fairness(draft);
    add_frames(draft);
    add_detection(draft);
    add_latency(draft);
    add_paced(draft);
    add_stages(draft);
    add_contacts_and_forces(draft);
    add_outcome(draft);
    if (has_verdict) add_work_precision(draft);
    if (has_verdict) add_hard_cases(draft);
    if (has_verdict) add_metamorphic(draft);
    add_failures(draft);
    add_table_2_1(draft);
    add_table_3_1(draft);
    add_glossary(draft);
    add_rebuild(draft);
    add_commands(draft);
    draft.document.command = study_command(draft.records);
    const bool interactive =
        std::any_of(draft.document.blocks.begin(), draft.document.blocks.end(), [](const Block& block) {
            const auto* figure = std::get_if<Figure>(&block);
            return figure != nullptr && !figure->chart.empty();
        });
    if (interactive) draft.document.charts_js = fmt::format("{}/{}", assets, web::charts_name);

    Report report;
    for (const Block& block : draft.document.blocks) {
        if (const auto* figure = std::get_if<Figure>(&block)) report.files[figure->file] = figure->svg;
    }
    report.files["report.md"] = page_one_to_markdown(draft.document, "report.html");
    if (interactive && assets == own_assets) report.files[draft.document.charts_js] = web::charts_script();
    report.files["report.html"] = to_html(draft.document);
    report.page_one = terminal_text(draft);
    report.document = std::move(draft.document);
    return report;
}

/// The records of the reports that a study quotes, in its order; none of a report that is in no place.
QuotedRecords quoted_records(const std::vector<Record>& records, const std::vector<std::filesystem::path>& places) {
    QuotedRecords quoted;
    std::istringstream names(common_fact(records, "study.quoted_reports"));
    for (std::string name; std::getline(names, name, ',');) {
        const auto place = std::find_if(places.begin(), places.end(), [&name](const std::filesystem::path& folder) {
            return std::filesystem::is_regular_file(records_file(folder / name));
        });
        quoted.emplace_back(name, place == places.end() ? std::vector<Record>() : read_records(*place / name));
    }
    return quoted;
}

}  // namespace

Report make_report(const std::vector<Record>& records, const std::string& worst_tick,
                   const std::set<std::string>& pages, const std::string& assets, QuotedRecords quoted) {
    if (records.empty()) {
        const Document document{.title = "trocar study",
                                .blocks = {Paragraph{"There are no records.", Paragraph::Style::normal}}};
        return {.files = {{"report.md", to_markdown(document)}, {"report.html", to_html(document)}},
                .page_one = "There are no records.\n",
                .document = document};
    }
    // No table may pool times of several machines.
    for (auto& [name, of_report] : quoted) {
        if (are_of_several_machines(of_report)) of_report = without_times(std::move(of_report));
    }
    Report report = are_of_several_machines(records) ? compose(without_times(records), worst_tick, assets, quoted)
                                                     : compose(records, worst_tick, assets, quoted);
    report.files.merge(results_files(records));
    if (!pages.empty() && assets == own_assets) {
        report.files[fmt::format("{}/{}", own_assets, web::viewer_name)] = web::viewer_script();
    }
    add_view_links(records, pages, report.files);
    return report;
}

std::vector<Record> read_records(const std::filesystem::path& input) {
    const std::filesystem::path file = std::filesystem::is_directory(input) ? records_file(input) : input;
    const std::unique_ptr<std::istream> stream = open_lines(file, "the records of a study");
    std::vector<Record> records;
    std::string line;
    std::int64_t ticks = 0;
    for (std::int64_t number = 1; read_line(*stream, line, file.string()); ++number) {
        if (line.empty()) continue;
        records.push_back(record_from_json_line(line, file.string(), number));
        ticks += static_cast<std::int64_t>(records.back().rows.size());
        if (are_sizes_limited() && ticks > most_records_ticks) {
            throw InputError(file.string(), fmt::format("line {}", number),
                             limit_text(most_records_ticks, "ticks of all records"), fmt::format("{}", ticks));
        }
    }
    if (records.empty()) throw InputError(file.string(), "", "at least one record", "none");
    return records;
}

Report write_report(const std::filesystem::path& directory, const std::vector<std::filesystem::path>& published) {
    if (!std::filesystem::is_directory(directory)) {
        throw InputError(directory.string(), "", "a folder that holds the records of a study", "no such folder");
    }
    const std::filesystem::path seen = directory / worst_tick_file;
    const std::string assets = assets_of(directory);
    const std::vector<Record> records = read_records(directory);
    std::vector<std::filesystem::path> places{directory / ".."};
    places.insert(places.end(), published.begin(), published.end());
    Report report = make_report(
        records, std::filesystem::exists(seen) ? read_whole(seen, "what a study saw at its worst tick") : std::string(),
        pages_there(directory), assets, quoted_records(records, places));
    write_report_files(directory, report.files);
    link_viewer(directory, assets);
    return report;
}

}  // namespace trocar
