// Page 1 put together.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "geometry/fnv_hash.hpp"
#include "report/inline_text.hpp"
#include "report/page_one.hpp"

namespace trocar {
namespace {

constexpr const char* thesis_named =
    "`thesis` is what Jitesh Butala describes in \"Collision Response for Virtual Laparoscopic Surgery\", M.S. thesis "
    "in Electrical Engineering, The University of Texas at Arlington, August 2005";

bool names_thesis(const Draft& draft) {
    return std::any_of(draft.records.begin(), draft.records.end(),
                       [](const Record& record) { return method_name(record.spec.response) == "thesis"; });
}

/// One hash over the frame hashes of all replayed scenes, in order of their names.
std::string frames_digest(const Draft& draft) {
    std::map<std::string, std::string> by_scene;
    for (const Record& record : draft.records) {
        if (!record.frames_hash.empty()) by_scene[record.spec.scene] = record.frames_hash;
    }
    if (by_scene.empty()) return {};
    FnvHash hash;
    for (const auto& [scene, frames] : by_scene) hash.add_text(scene + frames);
    return hash.text();
}

/// Where the numbers come from, and how to have them again.
std::string origin(const Draft& draft) {
    std::string text =
        fmt::format("Study {}, commit {}, {}, seed {}, {} runs.", code(draft.study),
                    code(common_fact(draft.records, "commit").substr(0, 12)), common_fact(draft.records, "cpu"),
                    draft.records.front().spec.seed, draft.records.size());
    const std::string frames = frames_digest(draft);
    if (!frames.empty()) text += " Frames " + code(frames) + ".";
    text += " This page again: " + code("trocar report .") +
            " in its folder; the records anew: " + code(study_command(draft.records)) + ".";
    if (names_thesis(draft)) text += " " + std::string(thesis_named) + ".";
    return text;
}

void warnings(Draft& draft) {
    if (common_fact(draft.records, "dirty").find("yes") != std::string::npos) {
        draft.paragraph("The source tree had uncommitted changes: these numbers belong to no commit.",
                        Paragraph::Style::warning);
    }
    if (draft.results.noise_floor() > 1.25) {
        draft.paragraph(fmt::format("Noisy machine: two processes of the same method differ by up to a factor {} in "
                                    "their medians (95 % of all pairs of processes). Smaller ratios mean nothing here.",
                                    format_number(draft.results.noise_floor())),
                        Paragraph::Style::warning);
    }
    if (are_of_several_machines(draft.records)) {
        draft.paragraph(
            "The records come from several machines, whose times and memory do not compare: they are n/a in every "
            "table. results.csv has those of every run beside its machine.",
            Paragraph::Style::warning);
    }
    bool mixed = false;
    for (const char* key : {"binary", "cpu", "kernel"}) (void)common_fact(draft.records, key, &mixed);
    if (mixed) {
        draft.paragraph("The records come from more than one binary or machine; see the environment.",
                        Paragraph::Style::warning);
    }
}

/// The first rows and columns of a table that is reported in full behind page 1.
Table first_of(Table table, const std::string& where) {
    const std::size_t rows = table.rows.size();
    if (table.columns.size() > page_one_columns) table.columns.resize(page_one_columns);
    if (rows > page_one_rows) {
        table.rows.resize(page_one_rows);
        table.note += fmt::format("{}The first {} of {} rows; all of them under \"{}\".", table.note.empty() ? "" : " ",
                                  page_one_rows, rows, where);
    }
    for (TableRow& row : table.rows) row.cells.resize(std::min(row.cells.size(), page_one_columns));
    return table;
}

/// What page 1 shows: its sentence goes into the draft.
std::vector<Table> tables_of(const Draft& draft) {
    std::vector<Table> tables{detectors_table(draft), responses_table(draft, response_rows(draft))};
    std::erase_if(tables, [](const Table& table) { return table.rows.empty(); });
    if (!tables.empty()) return tables;
    for (const bool responses : {false, true}) {
        tables.push_back(first_of(hard_case_tally(draft, responses), "Hard cases"));
    }
    tables.push_back(first_of(paced_page(draft), "Paced loop"));
    tables.push_back(first_of(size_page(draft), "Cost by size"));
    tables.push_back(first_of(against_table(draft), "Steppers in step"));
    tables.push_back(resolution_page(draft));
    tables.push_back(first_of(repeated_motion_table(draft), "Repeated motion"));
    std::erase_if(tables, [](const Table& table) { return table.rows.empty(); });
    return tables;
}

std::string sentence_of(const Draft& draft) {
    std::string text = response_sentence(draft, response_rows(draft));
    if (text.empty() && !draft.results.scenes("replay").empty()) {
        text = detector_sentence(make_verdict(draft.results, draft.reference, "replay", draft.results.scenes("replay")),
                                 draft);
    }
    if (text.empty()) text = resolution_sentence(draft);
    if (text.empty()) text = paced_sentence(draft);
    if (text.empty()) text = hard_case_sentence(draft);
    if (text.empty()) text = external_sentence(draft);
    return text.empty() ? work_precision_sentence(draft) : text;
}

/// The table as lines for a terminal.
std::string plain_table(const Table& table) {
    std::vector<std::vector<std::string>> lines(1);
    for (const Column& column : table.columns) lines.front().push_back(without_code(column.header));
    for (const TableRow& row : table.rows) {
        std::vector<std::string> line;
        for (const std::string& cell : row.cells) line.push_back(without_code(cell));
        lines.push_back(std::move(line));
    }
    std::vector<std::size_t> widths(table.columns.size());
    const auto width_of = [](const std::string& cell) {
        return static_cast<std::size_t>(std::count_if(
            cell.begin(), cell.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
    };
    for (const auto& line : lines) {
        for (std::size_t i = 0; i < line.size(); ++i) widths.at(i) = std::max(widths.at(i), width_of(line[i]));
    }
    std::string text;
    for (const auto& line : lines) {
        for (std::size_t i = 0; i < line.size(); ++i) {
            const std::string padding(widths.at(i) - width_of(line[i]), ' ');
            const bool left_aligned = !table.columns[i].number;
            const bool last = i + 1 == line.size();
            text += left_aligned ? line[i] + (last ? "" : padding) : padding + line[i];
            text += last ? "\n" : "  ";
        }
    }
    return text;
}

}  // namespace

void add_page_one(Draft& draft, const std::string& worst_tick) {
    draft.sentence = sentence_of(draft);
    for (const QuotedReport& report : draft.quoted) {
        if (!report.sentence.empty()) draft.sentence += (draft.sentence.empty() ? "" : " ") + report.sentence;
    }
    if (!draft.sentence.empty()) draft.paragraph(draft.sentence, Paragraph::Style::quote);
    const std::string quoted = common_fact(draft.records, "study.quotes");
    if (!quoted.empty()) draft.paragraph(quoted);
    warnings(draft);
    const std::vector<Table> tables = tables_of(draft);
    for (const Table& table : tables) draft.add(table);
    for (const QuotedReport& report : draft.quoted) {
        draft.add(report.table);
        if (!report.different.empty()) {
            draft.paragraph("Other states than in the report " + code(report.name) + ": " +
                                joined_code(report.different) + ". Its figures are not those of this program.",
                            Paragraph::Style::warning);
        }
        if (report.table.rows.empty()) {
            draft.paragraph("The report " + code(report.name) +
                            " is not at hand: " + code("trocar study " + report.name + " --publish") +
                            " makes it, and its table then stands here.");
        }
    }
    add_external(draft);
    const bool planned = std::any_of(draft.records.begin(), draft.records.end(), [](const Record& record) {
        return record.spec.mode == "closed_loop" || record.spec.mode == "replay";
    });
    if (tables.empty() && planned) {
        draft.paragraph("No run of a detector or response could be made; see the failures and what is absent.");
    }
    const std::vector<ResponseRow> rows = response_rows(draft);
    const Metric tail = draft.results.tail_metric();
    draft.figure(
        "depth_time", depth_against_time(rows, tail),
        std::string("What accuracy costs: the ") + (tail == Metric::total_p99_ns ? "99" : "90") +
            " % tick of the slowest scene against the worst depth, a line per method over "
            "its settings. Right of 1 ms no haptic loop can follow; what failed on a scene stands on the rail.");
    add_worst_tick(draft, worst_tick);
    draft.paragraph(origin(draft), Paragraph::Style::small);
    draft.document.page_one = draft.document.blocks.size();
    const Table readings = readings_table(draft, rows);
    if (!readings.rows.empty()) {
        draft.heading(2, "What authors leave open");
        draft.add(readings);
    }
    // Without tissue in the study page 1 has these rows already.
    const std::vector<std::string> scenes = draft.results.scenes("closed_loop");
    const bool has_tissue = std::any_of(scenes.begin(), scenes.end(), [&draft](const std::string& scene) {
        return meets_tissue(draft.results.class_of(scene));
    });
    if (rows.empty() || !has_tissue) return;
    const Table rigid = responses_table(draft, response_rows(draft, false), false);
    if (rigid.rows.empty()) return;
    draft.heading(2, "Responses without tissue");
    draft.add(rigid);
}

QuotedReport quote_of(const std::string& name, const std::vector<Record>& records, const std::vector<Record>& own) {
    const Draft draft(records);
    QuotedReport quoted{.name = name, .sentence = sentence_of(draft)};
    const auto name_of_run = [](const Record& record) {
        const Method method = method_of(record.spec);
        return method.mode + " " + method.label() + " on " + record.spec.scene + " " + record.spec.scene_hash;
    };
    std::map<std::string, std::string> state_of;
    for (const Record& record : records) state_of[name_of_run(record)] = record.state_hash;
    for (const Record& record : own) {
        const auto found = state_of.find(name_of_run(record));
        if (found == state_of.end() || record.state_hash.empty()) continue;
        quoted.repeated.push_back(method_of(record.spec).label() + " on " + record.spec.scene);
        if (found->second != record.state_hash) quoted.different.push_back(quoted.repeated.back());
    }
    const std::vector<Table> tables = tables_of(draft);
    if (tables.empty()) return quoted;
    quoted.table = tables.front();
    quoted.table.note +=
        fmt::format("{}From the report {}: commit {}, {}, {} runs.", quoted.table.note.empty() ? "" : " ", code(name),
                    code(common_fact(records, "commit").substr(0, 12)), common_fact(records, "cpu"), records.size());
    if (!quoted.repeated.empty()) {
        quoted.table.note += fmt::format(" This study repeats {} of them; {} end in the same state, bit by bit.",
                                         quoted.repeated.size(), quoted.repeated.size() - quoted.different.size());
    }
    for (TableRow& row : quoted.table.rows) row.command = study_command(records);
    return quoted;
}

std::string terminal_text(const Draft& draft) {
    std::string text = draft.sentence.empty() ? std::string() : without_code(draft.sentence) + "\n";
    std::vector<Table> tables = tables_of(draft);
    for (const QuotedReport& report : draft.quoted) {
        if (!report.table.rows.empty()) tables.push_back(report.table);
    }
    for (Table& table : external_tables(draft)) tables.push_back(std::move(table));
    for (const Table& table : tables) {
        text += "\n" + without_code(table.caption) + "\n" + plain_table(table);
    }
    return text;
}

}  // namespace trocar
