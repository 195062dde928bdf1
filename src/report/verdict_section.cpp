#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace trocar {
namespace {

/// One hash over the frame hashes of all replayed scenes, in order of their names.
std::string frames_digest(const Draft& draft) {
    std::map<std::string, std::string> by_scene;
    for (const Record& record : draft.records) {
        if (!record.frames_hash.empty()) by_scene[record.spec.scene] = record.frames_hash;
    }
    if (by_scene.empty()) return {};
    std::uint64_t hash = 0xCBF29CE484222325ULL;
    for (const auto& [scene, frames] : by_scene) {
        for (const char c : scene + frames) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
    }
    return fmt::format("{:016x}", hash);
}

std::string origin(const Draft& draft) {
    std::string text = fmt::format("Study {}, commit {}, {}, seed {}, {} runs.", code(draft.study),
                                   code(common_fact(draft.records, "commit")), common_fact(draft.records, "cpu"),
                                   draft.records.front().spec.seed, draft.records.size());
    const std::string frames = frames_digest(draft);
    if (!frames.empty()) text += " Frames " + code(frames) + ".";
    text += " This page from its records: " + code("trocar report reports/" + draft.study) +
            "; the records anew: " + code("trocar study " + common_fact(draft.records, "study.file")) + ".";
    return text;
}

void warnings(Draft& draft) {
    if (common_fact(draft.records, "dirty").find("yes") != std::string::npos) {
        draft.paragraph("The source tree had uncommitted changes: these numbers belong to no commit.",
                        Paragraph::Style::warning);
    }
    if (draft.results.noise_floor() > 1.25) {
        draft.paragraph(
            fmt::format("Noisy machine: two processes of the same contestant differ by up to a factor {} in "
                        "their medians (95 % of all pairs of processes). Smaller ratios mean nothing here.",
                        format_number(draft.results.noise_floor())),
            Paragraph::Style::warning);
    }
    bool mixed = false;
    for (const char* key : {"binary", "cpu", "kernel"}) (void)common_fact(draft.records, key, &mixed);
    if (mixed) {
        draft.paragraph("The records come from more than one binary or machine; see the environment.",
                        Paragraph::Style::warning);
    }
}

/// Where the depth that is left is the scene's own, since nothing but the contact gives way there.
std::string compliance_note(const Draft& draft) {
    std::vector<std::string> scenes;
    for (const auto& [name, list] : draft.scenes_by_class()) {
        if (name == "I2I" || name == "I2R") scenes.insert(scenes.end(), list.begin(), list.end());
    }
    if (scenes.empty() || draft.mode != "closed_loop") return {};
    return fmt::format(
        " On {} nothing but the contact gives way: there the depth that is left is the scene's own compliance, the "
        "force of the hand over the scene's k, which the reference of equal k has too; it is no error (the way from "
        "that reference is), and a method that leaves less is stiffer than the scene says.",
        joined(scenes));
}

/// n_sub of every scene: no time of a tick means anything without it.
std::string substeps_note(const Draft& draft) {
    if (draft.mode != "closed_loop") return {};
    std::map<double, std::set<std::string>> scenes;
    for (const RunFigures& run : draft.results.runs()) {
        const RunSpec& spec = run.record->spec;
        if (spec.mode == draft.mode && !std::isnan(run.substeps)) scenes[run.substeps].insert(spec.scene);
    }
    std::vector<std::string> parts;
    parts.reserve(scenes.size());
    for (const auto& [substeps, names] : scenes) {
        parts.push_back(count_text(substeps) + " on " + joined({names.begin(), names.end()}));
    }
    return parts.empty() ? std::string()
                         : fmt::format(" Sub-steps of the integrator per tick (n_sub): {}.", fmt::join(parts, "; "));
}

/// Between judged ticks nobody has looked: a worst value is one of those that were.
std::string judged_note(const Draft& draft) {
    std::int64_t stride = 1;
    std::int64_t detail = 1;
    for (const Record& record : draft.records) {
        if (record.spec.mode != draft.mode) continue;
        stride = std::max(stride, record.spec.truth_stride);
        detail = std::max(detail, record.spec.detail_stride);
    }
    std::string text =
        stride == 1 ? std::string(" Pairs and depths are judged on every tick")
                    : fmt::format(
                          " Pairs and depths are judged on every {}th tick (truth_stride of the study): a peak between "
                          "two of them is not seen, a single run (`trocar run`) judges every tick",
                          stride);
    if (detail > 1) {
        text += fmt::format(
            "; near pairs, depth errors of contacts and overlaps, by which nothing is ranked, on every {}th of these",
            detail);
    }
    return text + ".";
}

std::string verdict_note(const Draft& draft) {
    return "Rows are sorted by the error over scenes: the geometric mean of the depths left at worst, each at least "
           "1 µm; in I2I and I2R of the largest way from the reference of equal stiffness. Of errors within a tenth "
           "of each other the row that misses and adds fewer pairs stands first, then the faster one; without a depth "
           "rows are sorted by what is missed, extra or never told. † = another row is at least as fast and as good, "
           "and better in one of the two. Times are geometric means over the scenes of the medians (p50) and 99 % "
           "values (p99) of a tick; a row that failed on a scene has none. Depths: median over scenes / worst of all; "
           "tear due = the depth in tissue that hard contact tears too and whose rupture the response told: the right "
           "answer, so it stands apart and takes no part in the error; torn = the worst is of a run whose response "
           "told a rupture that hard contact does not call for, or has no reference for. Force errors: worst over the "
           "scenes whose reference can tell; ≤: all lie within the references' own bound. " +
           draft.interval_note(draft.mode) +
           fmt::format(
               " Ratio: median tick over that of {} with the same response and source (of native contacts: "
               "with canonical ones), process by process; {}. Moving alike: the same motion and forces on every scene, "
               "bit "
               "by bit; such rows stand once, with the tick p50 / p99 of each that is named. n/a = does not apply; "
               "\"no reference\" = no reference solution in this study. The rule for the sentence: our first "
               "row against the first of another response where the study names ours, else against the first foreign "
               "row.",
               code(draft.reference),
               std::isnan(draft.results.noise_floor())
                   ? "with one process per contestant the noise of the machine is not known, and ratios near 1 say "
                     "nothing"
                   : fmt::format("≈ = within the noise floor of {} (factor between processes of the same contestant, "
                                 "95 %)",
                                 format_number(draft.results.noise_floor()))) +
           judged_note(draft) + substeps_note(draft) + compliance_note(draft);
}

}  // namespace

void add_verdict_page(Draft& draft, const Verdict& overall) {
    const auto [class_name, scenes] = draft.headline_scenes();
    const Verdict headline = make_verdict(draft.results, draft.reference, draft.mode, scenes);
    draft.sentence = verdict_sentence(headline, fmt::format("the {} scenes ({})", class_name, joined(headline.scenes)),
                                      draft.reference);
    if (draft.sentence.empty()) draft.sentence = ablation_sentence(draft);
    if (draft.sentence.empty()) draft.sentence = hard_case_sentence(draft);
    if (draft.sentence.empty()) draft.sentence = work_precision_sentence(draft);
    if (!draft.sentence.empty()) draft.paragraph(draft.sentence, Paragraph::Style::quote);
    warnings(draft);
    if (overall.rows.empty()) {
        const bool planned = std::any_of(draft.records.begin(), draft.records.end(), [](const Record& record) {
            return record.spec.mode == "closed_loop" || record.spec.mode == "replay";
        });
        if (planned) {
            draft.paragraph("No run of a detector or response could be made; see the failures and what is absent.");
        }
        draft.paragraph(origin(draft), Paragraph::Style::small);
        return;
    }
    Table table = verdict_table(overall, fmt::format("Verdict over all {} scenes", overall.scenes.size()),
                                draft.results.noise_floor());
    table.note = verdict_note(draft) + (table.note.empty() ? "" : " " + table.note);
    draft.add(std::move(table));
    draft.add(partial_table(overall,
                            "Contestants that were run on some of the scenes only: no row of these compares "
                            "with one of other scenes",
                            draft.results.noise_floor()));
    draft.figure(
        "speed_error", verdict_chart(overall),
        "Speed against error over all scenes; numbers are the rows of the table. Colour: detector; shape: "
        "response; hollow: native contacts. Lines join settings of one method. An error of exactly 0 stands on "
        "its own band, since a logarithmic axis has no place for it.");
    draft.paragraph(origin(draft), Paragraph::Style::small);
}

void add_verdict_by_class(Draft& draft) {
    const auto classes = draft.scenes_by_class();
    if (classes.size() < 2) return;
    draft.heading(2, "Verdict per class");
    for (const auto& [name, scenes] : classes) {
        const Verdict verdict = make_verdict(draft.results, draft.reference, draft.mode, scenes);
        draft.add(
            verdict_table(verdict, fmt::format("{}: {}", name, joined(verdict.scenes)), draft.results.noise_floor()));
        draft.add(
            partial_table(verdict, fmt::format("{}, on some of these scenes only", name), draft.results.noise_floor()));
    }
    draft.paragraph(
        "In I2I and I2R scenes the instruments are led by a simulated operator and pushed back by the contact; a "
        "scene whose bodies all follow a script has no depth of its own making, so it is n/a there. Columns as on "
        "page 1.",
        Paragraph::Style::small);
}

namespace {

/// Columns of a table under other headers, as lines for a terminal.
std::string plain_table(const Table& table, const std::vector<std::size_t>& shown,
                        const std::vector<std::string>& headers) {
    std::vector<std::vector<std::string>> lines{headers};
    for (const TableRow& row : table.rows) {
        std::vector<std::string> line;
        for (const std::size_t column : shown) {
            std::string cell = row.cells.at(column);
            cell.erase(std::remove(cell.begin(), cell.end(), '`'), cell.end());
            line.push_back(std::move(cell));
        }
        lines.push_back(std::move(line));
    }
    std::vector<std::size_t> widths(shown.size());
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
            const bool left_aligned = !table.columns[shown[i]].number;
            const bool last = i + 1 == line.size();
            text += left_aligned ? line[i] + (last ? "" : padding) : padding + line[i];
            text += last ? "\n" : "  ";
        }
    }
    return text;
}

}  // namespace

std::string terminal_text(const Draft& draft, const Verdict& verdict) {
    std::string text;
    if (!draft.sentence.empty()) {
        std::string plain = draft.sentence;
        plain.erase(std::remove(plain.begin(), plain.end(), '`'), plain.end());
        text += plain + "\n\n";
    }
    if (verdict.rows.empty()) {
        const Table table = ablation_table(draft);
        constexpr std::array<std::size_t, 7> wanted{0, 1, 2, 3, 4, 5, 6};
        std::vector<std::string> headers;
        for (const std::size_t column : wanted) {
            if (column < table.columns.size()) headers.push_back(table.columns[column].header);
        }
        return headers.empty() ? text : text + plain_table(table, {wanted.begin(), wanted.end()}, headers);
    }
    const Table table = verdict_table(verdict, "", draft.results.noise_floor());
    // What fits a terminal; the columns are found by their headers.
    constexpr std::array<const char*, 10> wanted{"row",
                                                 "detector",
                                                 "pairs missed / extra of true",
                                                 "contacts between frames never told",
                                                 "error over scenes (mm)",
                                                 "left after the tick, median / max (mm)",
                                                 "tick p50 (µs)",
                                                 "tick p99 (µs)",
                                                 "ratio to ",
                                                 "failures"};
    const std::array<std::string, 10> short_names{"row",
                                                  table.columns.at(1).header,
                                                  "missed / extra of true",
                                                  "never told",
                                                  "error (mm)",
                                                  "left p50 / max (mm)",
                                                  "tick p50 (µs)",
                                                  "tick p99 (µs)",
                                                  "ratio",
                                                  "failures"};
    std::vector<std::size_t> shown;
    std::vector<std::string> headers;
    for (std::size_t w = 0; w < wanted.size(); ++w) {
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            if (table.columns[c].header.rfind(wanted.at(w), 0) != 0) continue;
            shown.push_back(c);
            headers.emplace_back(short_names.at(w));
        }
    }
    return text + plain_table(table, shown, headers);
}

}  // namespace trocar
