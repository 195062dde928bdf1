// The hard-case matrix: case by method, with what each said. The right answer of a case comes with the case (by
// reasoning, reported below the matrix), that of a family of triangle pairs with its file.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "measure/metrics.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

const std::string& case_fact(const Record& record, const std::string& key) {
    static const std::string none;
    const auto found = record.environment.find(key);
    return found == record.environment.end() ? none : found->second;
}

std::string word_of(OutcomeKind kind) {
    switch (kind) {
        case OutcomeKind::not_finite:
            return "NaN";
        case OutcomeKind::threw:
            return "throw";
        case OutcomeKind::timed_out:
            return "time-out";
        case OutcomeKind::crashed:
            return "crash";
        case OutcomeKind::ok:
        case OutcomeKind::absent:
        case OutcomeKind::unsupported:
        case OutcomeKind::unstable:
            break;
    }
    return std::string(name_of(kind));
}

struct Cell {
    std::string text;
    bool asked = false;  ///< neither absent nor without data
    bool right = false;
};

/// "residual_penetration_max_m 0.43 mm": metres as millimetres, everything else as it is.
std::string figure_text(const std::string& key, double value, const std::string& relation = " ") {
    const MetricInfo& figure = info_of(metric_of(key));
    if (std::isnan(value)) return key + " n/a";
    if (figure.unit == "m") return key + relation + format_number(value * mm) + " mm";
    return key + relation + format_number(value) + (figure.unit == "1" ? "" : " " + std::string(figure.unit));
}

Cell cell_of(const Record& record) {
    const OutcomeKind kind = record.outcome.kind;
    if (kind == OutcomeKind::absent) return {.text = "absent"};
    if (kind == OutcomeKind::unsupported && record.summary.empty()) return {.text = "no data"};
    Cell cell{.text = {}, .asked = true};
    const std::string& expected = case_fact(record, "case.outcome");
    if (!expected.empty() && expected != name_of(OutcomeKind::ok)) {
        cell.right = name_of(kind) == expected && !(summary_of(record, Metric::false_positives) > 0.0);
        cell.text = cell.right ? "ok" : kind == OutcomeKind::ok ? "not reported" : word_of(kind);
        return cell;
    }
    std::vector<std::string> faults;
    const double failed = summary_of(record, Metric::failed_ticks);
    if (kind != OutcomeKind::ok) {
        faults.push_back(word_of(kind) + (failed > 1.0 && case_fact(record, "case.of").empty()
                                              ? " " + count_text(failed)
                                              : std::string()));
    }
    if (const double false_negatives = summary_of(record, Metric::false_negatives);
        false_negatives > 0.0 && record.spec.response.empty()) {
        faults.push_back("FN " + count_text(false_negatives));
    }
    if (const double false_positives = summary_of(record, Metric::false_positives);
        false_positives > 0.0 && record.spec.response.empty()) {
        faults.push_back("FP " + count_text(false_positives));
    }
    constexpr std::string_view bound = "case.at_most.";
    for (const auto& [key, text] : record.environment) {
        if (key.rfind(bound, 0) != 0 || kind != OutcomeKind::ok) continue;
        const std::string figure = key.substr(bound.size());
        const double value = summary_of(record, metric_of(figure));
        if (value <= std::strtod(text.c_str(), nullptr)) continue;
        faults.push_back(figure_text(figure, value));
    }
    cell.right = faults.empty();
    cell.text = cell.right ? "ok" : joined(faults);
    return cell;
}

std::string expected_text(const Record& record) {
    const std::string& outcome = case_fact(record, "case.outcome");
    if (!outcome.empty() && outcome != name_of(OutcomeKind::ok)) return "reported as " + outcome;
    std::vector<std::string> bounds;
    constexpr std::string_view bound = "case.at_most.";
    for (const auto& [key, text] : record.environment) {
        if (key.rfind(bound, 0) != 0) continue;
        const std::string figure = key.substr(bound.size());
        bounds.push_back(figure_text(figure, std::strtod(text.c_str(), nullptr), " ≤ "));
    }
    if (!bounds.empty()) return joined(bounds);
    if (!case_fact(record, "case.expected").empty()) return case_fact(record, "case.expected");
    return fmt::format("{} of {} meet", count_text(summary_of(record, Metric::true_pairs)),
                       count_text(summary_of(record, Metric::judged_ticks)));
}

using Row = std::map<std::string, const Record*>;  ///< by method

struct Matrix {
    std::map<std::pair<std::string, std::string>, Row> rows;  ///< by what it is a case of, and name
    /// Those that this build has, or those that it lacks; ours first.
    [[nodiscard]] std::vector<std::string> methods(bool absent) const {
        std::set<std::pair<bool, std::string>> sorted;  // foreign, name
        std::set<std::string> present;
        for (const auto& [key, row] : rows) {
            for (const auto& [method, record] : row) {
                const bool response = !record->spec.response.empty();
                sorted.insert({case_fact(*record, response ? "response.own" : "detector.own") != "yes", method});
                if (record->outcome.kind != OutcomeKind::absent) present.insert(method);
            }
        }
        std::vector<std::string> list;
        for (const auto& [foreign, method] : sorted) {
            if (present.contains(method) != absent) list.push_back(method);
        }
        return list;
    }
};

Table table_of(const Matrix& matrix, const std::string& caption, const std::string& kind) {
    Table table;
    table.caption = caption;
    table.columns = {{kind, false}, {"right answer", false}};
    const std::vector<std::string> methods = matrix.methods(false);
    for (const std::string& method : methods) table.columns.push_back({code(method), false});
    std::vector<std::string> absent;
    for (const std::string& method : matrix.methods(true)) absent.push_back(code(method));
    if (!absent.empty()) table.note = "Absent from this build: " + joined(absent) + ".";
    std::map<std::string, std::pair<int, int>> tally;  // right, asked
    for (const auto& [key, row] : matrix.rows) {
        const Record* reported = nullptr;  // an absent method's record has no summary with the counts
        for (const auto& [method, record] : row) {
            if (reported == nullptr || reported->summary.size() < record->summary.size()) reported = record;
        }
        TableRow line{
            .cells = {(key.first.empty() ? "" : key.first + ": ") + code(key.second), expected_text(*reported)}};
        for (const std::string& method : methods) {
            const auto found = row.find(method);
            if (found == row.end()) {
                line.cells.emplace_back("");
                continue;
            }
            const Cell cell = cell_of(*found->second);
            line.cells.push_back(cell.text);
            tally[method].first += cell.right ? 1 : 0;
            tally[method].second += cell.asked ? 1 : 0;
        }
        table.rows.push_back(std::move(line));
    }
    if (table.rows.empty()) return table;
    TableRow sum{.cells = {"all: right", ""}, .style = TableRow::Style::own};
    for (const std::string& method : methods) {
        const auto [right, asked] = tally[method];
        sum.cells.push_back(asked == 0 ? "n/a" : fmt::format("{} of {}", right, asked));
    }
    table.rows.push_back(std::move(sum));
    return table;
}

}  // namespace

std::string hard_case_sentence(const Draft& draft) {
    std::map<std::string, std::pair<int, int>> tally;  // right, asked
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "hard_case" || spec.repetition != 0) continue;
        const Cell cell = cell_of(record);
        if (!cell.asked) continue;
        auto& [right, asked] = tally[spec.response.empty() ? spec.detector : spec.response];
        right += cell.right ? 1 : 0;
        ++asked;
    }
    if (tally.empty()) return {};
    std::vector<std::string> all;
    std::vector<std::string> some;
    for (const auto& [method, counts] : tally) {
        if (counts.first == counts.second) {
            all.push_back(code(method));
        } else {
            some.push_back(fmt::format("{} {} of {}", code(method), counts.first, counts.second));
        }
    }
    return fmt::format("Hard cases answered rightly: all by {}; {}.", all.empty() ? "none" : joined(all),
                       some.empty() ? "no method fails one" : joined(some));
}

Table hard_case_tally(const Draft& draft, bool responses) {
    constexpr std::size_t kinds = 5;
    constexpr std::array<const char*, kinds> names{"FN", "FP", "NaN", "crash, throw", "other fault"};
    struct Tally {
        int right = 0;
        int asked = 0;
        std::array<int, kinds> faults{};  ///< cases with such a fault, the first that is reported
        auto operator<=>(const Tally&) const = default;
    };
    std::map<std::string, Tally> by_method;
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "hard_case" || spec.repetition != 0) continue;
        if (spec.response.empty() == responses) continue;
        const Cell cell = cell_of(record);
        if (!cell.asked) continue;
        Tally& tally = by_method[responses ? spec.response : spec.detector];
        ++tally.asked;
        if (cell.right) {
            ++tally.right;
            continue;
        }
        const std::string& text = cell.text;
        const std::size_t kind = text.starts_with("FN")                                   ? 0
                                 : text.starts_with("FP")                                 ? 1
                                 : text.starts_with("NaN")                                ? 2
                                 : text.starts_with("crash") || text.starts_with("throw") ? 3
                                                                                          : 4;
        ++tally.faults.at(kind);
    }
    std::map<Tally, std::vector<std::string>> alike;
    for (const auto& [method, tally] : by_method) alike[tally].push_back(code(method));
    std::vector<std::pair<Tally, std::vector<std::string>>> sorted(alike.begin(), alike.end());
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        return a.first.right * b.first.asked > b.first.right * a.first.asked;
    });
    Table table;
    table.caption =
        responses ? "Responses on hard scenes, cases" : "Detectors on hard meshes and triangle pairs, cases";
    table.columns = {{.header = responses ? "response" : "detector", .wide = true}, {"right of N", true}};
    for (const char* name : names) table.columns.push_back({name, true});
    for (const auto& [tally, methods] : sorted) {
        TableRow row{.cells = {joined(methods), fmt::format("{} of {}", tally.right, tally.asked)}};
        for (const int count : tally.faults) row.cells.push_back(std::to_string(count));
        table.rows.push_back(std::move(row));
    }
    for (std::size_t column = kinds + 2; column-- > 2;) {  // a fault that nobody has needs no column
        const bool none = std::all_of(table.rows.begin(), table.rows.end(),
                                      [column](const TableRow& row) { return row.cells.at(column) == "0"; });
        if (!none) continue;
        table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(column));
        for (TableRow& row : table.rows) row.cells.erase(row.cells.begin() + static_cast<std::ptrdiff_t>(column));
    }
    table.note = "Methods with the same counts stand in one row. A case counts under its first fault.";
    return table;
}

void add_hard_cases(Draft& draft) {
    Matrix meshes;
    Matrix families;
    Matrix scenes;
    Table reasons;
    reasons.caption = "Why the right answers are right";
    reasons.columns = {{"case", false}, {"reason", false}};
    reasons.folded = true;
    std::map<std::string, std::string> reason_of;
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "hard_case" || spec.repetition != 0) continue;
        const std::string& of = case_fact(record, "case.of");
        if (!of.empty()) reason_of[spec.scene] = case_fact(record, "case.reason");
        if (!spec.response.empty()) {
            scenes.rows[{of, spec.scene}][spec.response] = &record;
        } else {
            Matrix& matrix = of.empty() ? families : meshes;
            matrix.rows[{of, spec.scene}][spec.detector] = &record;
        }
    }
    if (meshes.rows.empty() && families.rows.empty() && scenes.rows.empty()) return;
    draft.heading(2, "Hard cases");
    draft.paragraph(
        "Each method on every case, in a process of its own. ok = the right answer; FN, FP = false negatives, false "
        "positives: pairs (of a family: triangle pairs in it) that were not reported or are not there; NaN = the "
        "outcome not_finite, or a contact of the library's own that is no number; throw, crash, time-out, unstable = "
        "how the run ended; not reported = a frame that is no number, or a step beyond the limit, went unnoticed. "
        "Where a bound is broken, the figure is reported. No right answer comes from a method.");
    draft.add(table_of(meshes, "Detectors on meshes", "case"));
    draft.add(table_of(families, "Detectors on families of hard triangle pairs, truth from the files", "family"));
    Table moving = table_of(scenes, "Responses on scenes", "case");
    moving.note =
        "Contacts of the first detector of the study, intersection. Figures as in the list of words at the end.";
    draft.add(std::move(moving));
    for (const auto& [name, reason] : reason_of) reasons.rows.push_back({.cells = {code(name), reason}});
    draft.add(std::move(reasons));
}

}  // namespace trocar
