#include "report/report.hpp"

#include <fstream>
#include <stdexcept>
#include <variant>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "report/document.hpp"
#include "report/sections.hpp"
#include "report/verdict.hpp"
#include "report/view_links.hpp"

namespace trocar {
namespace {

Report compose(const std::vector<Record>& records) {
    Draft draft(records);
    const Verdict overall = make_verdict(draft.results, draft.reference, draft.mode, draft.results.scenes(draft.mode));
    add_verdict_page(draft, overall);
    const bool has_verdict = !overall.rows.empty();
    if (!has_verdict) add_hard_cases(draft);
    if (!has_verdict) add_certificate(draft);
    if (!has_verdict) add_ablation(draft);
    if (!has_verdict) add_work_precision(draft);
    add_cost_by_size(draft);
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
    if (has_verdict) add_ablation(draft);
    if (has_verdict) add_hard_cases(draft);
    if (has_verdict) add_certificate(draft);
    add_failures(draft);
    add_thesis_table(draft);
    add_table_2_1(draft);
    add_work_profile(draft);
    add_glossary(draft);
    add_rebuild(draft);

    Report report;
    for (const Block& block : draft.document.blocks) {
        if (const auto* figure = std::get_if<Figure>(&block)) report.files[figure->file] = figure->svg;
    }
    report.files["report.md"] = to_markdown(draft.document);
    report.files["report.html"] = to_html(draft.document);
    report.files["report.tex"] = to_latex(draft.document);
    report.files["results.csv"] = results_csv(draft);
    report.page_one = terminal_text(draft, overall);
    return report;
}

}  // namespace

Report make_report(const std::vector<Record>& records, const std::set<std::string>& with_page) {
    if (records.empty()) {
        const Document document{.title = "trocar study",
                                .blocks = {Paragraph{"There are no records.", Paragraph::Style::normal}}};
        return {.files = {{"report.md", to_markdown(document)},
                          {"report.html", to_html(document)},
                          {"report.tex", to_latex(document)}},
                .page_one = "There are no records.\n"};
    }
    Report report = compose(records);
    add_view_links(records, with_page, report.files);
    return report;
}

std::vector<Record> read_records(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || !std::filesystem::is_regular_file(file)) {
        throw InputError(file.string(), "", "the records of a study", "no such file");
    }
    std::vector<Record> records;
    std::string line;
    for (std::int64_t number = 1; std::getline(stream, line); ++number) {
        if (!line.empty()) records.push_back(record_from_json_line(line, file.string(), number));
    }
    if (records.empty()) throw InputError(file.string(), "", "at least one record", "none");
    return records;
}

Report write_report(const std::filesystem::path& directory) {
    if (!std::filesystem::is_directory(directory)) {
        throw InputError(directory.string(), "", "a folder that holds records.jsonl", "no such folder");
    }
    Report report = make_report(read_records(directory / "records.jsonl"), scenes_with_pages(directory));
    std::filesystem::create_directories(directory / "charts");
    for (const auto& entry : std::filesystem::directory_iterator(directory / "charts")) {
        if (entry.path().extension() == ".svg" &&
            !report.files.contains("charts/" + entry.path().filename().string())) {
            std::filesystem::remove(entry.path());
        }
    }
    for (const auto& [name, content] : report.files) {
        write_whole(directory / name, content);
    }
    return report;
}

}  // namespace trocar
