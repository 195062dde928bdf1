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

std::string word_of(OutcomeKind kind) {
    static const std::map<OutcomeKind, std::string> words{{OutcomeKind::not_finite, "NaN"},
                                                          {OutcomeKind::threw, "throw"},
                                                          {OutcomeKind::timed_out, "time-out"},
                                                          {OutcomeKind::crashed, "crash"}};
    const auto found = words.find(kind);
    return found == words.end() ? std::string(name_of(kind)) : found->second;
}

struct Cell {
    std::string text;
    bool asked = false;  ///< neither absent nor without data
    bool right = false;
};

/// Cases that a method was asked, and those that it answered rightly.
struct Tally {
    int right = 0;
    int asked = 0;
    void take(const Cell& cell) {
        right += cell.right ? 1 : 0;
        asked += cell.asked ? 1 : 0;
    }
    [[nodiscard]] std::string text() const { return asked == 0 ? unknown_text : fmt::format("{} of {}", right, asked); }
    auto operator<=>(const Tally&) const = default;
};

const std::string& method_asked(const RunSpec& spec) { return spec.response.empty() ? spec.detector : spec.response; }

/// First processes of all cases, whoever could answer them or not.
std::vector<const Record*> cases_of(const Draft& draft) {
    std::vector<const Record*> cases;
    for (const Record& record : draft.records) {
        if (record.spec.mode == "hard_case" && record.spec.repetition == 0) cases.push_back(&record);
    }
    return cases;
}

constexpr std::string_view bound_key = "case.at_most.";

/// Bounds on metrics that the case sets, by the metric's name.
std::map<std::string, double> bounds_of(const Record& record) {
    std::map<std::string, double> bounds;
    for (const auto& [key, text] : record.environment) {
        if (key.starts_with(bound_key)) bounds[key.substr(bound_key.size())] = std::strtod(text.c_str(), nullptr);
    }
    return bounds;
}

/// The outcome that is the right answer; empty where it is ok.
std::string right_outcome(const Record& record) {
    const std::string& outcome = fact_of(record, "case.outcome");
    return outcome == name_of(OutcomeKind::ok) ? std::string() : outcome;
}

/// "residual_penetration_max_m 0.43 mm": metres as millimetres, everything else as it is.
std::string figure_text(const std::string& key, double value, const std::string& relation = " ") {
    const MetricInfo& figure = info_of(metric_of(key));
    std::string words = key;  // that may break between two lines
    std::replace(words.begin(), words.end(), '_', ' ');
    if (std::isnan(value)) return words + " " + unknown_text;
    if (figure.unit == "m") return words + relation + scaled(value, mm) + " mm";
    return words + relation + scaled(value) + (figure.unit == "1" ? "" : " " + std::string(figure.unit));
}

Cell cell_of(const Record& record) {
    const OutcomeKind kind = record.outcome.kind;
    if (kind == OutcomeKind::absent) return {.text = "absent"};
    if (kind == OutcomeKind::unsupported && record.summary.empty()) return {.text = "no data"};
    Cell cell{.text = {}, .asked = true};
    const auto figure = [&record](Metric metric) { return value_of(record.summary, metric); };
    if (const std::string expected = right_outcome(record); !expected.empty()) {
        cell.right = name_of(kind) == expected && !(figure(Metric::false_positives) > 0.0);
        cell.text = cell.right ? "ok" : kind == OutcomeKind::ok ? "not reported" : word_of(kind);
        return cell;
    }
    std::vector<std::string> faults;
    if (kind != OutcomeKind::ok) {
        const double failed = figure(Metric::failed_ticks);
        const bool one_pair = fact_of(record, "case.of").empty();
        faults.push_back(word_of(kind) + (failed > 1.0 && one_pair ? " " + count_text(failed) : std::string()));
    }
    for (const auto& [name, metric] : {std::pair("FN ", Metric::false_negatives), {"FP ", Metric::false_positives}}) {
        if (figure(metric) > 0.0 && record.spec.response.empty()) faults.push_back(name + count_text(figure(metric)));
    }
    for (const auto& [name, bound] : bounds_of(record)) {
        const double value = figure(metric_of(name));
        if (kind == OutcomeKind::ok && !(value <= bound)) faults.push_back(figure_text(name, value));
    }
    cell.right = faults.empty();
    cell.text = cell.right ? "ok" : joined(faults);
    return cell;
}

std::string expected_text(const Record& record) {
    if (const std::string outcome = right_outcome(record); !outcome.empty()) return "reported as " + outcome;
    std::vector<std::string> bounds;
    for (const auto& [name, bound] : bounds_of(record)) bounds.push_back(figure_text(name, bound, " ≤ "));
    if (!bounds.empty()) return joined(bounds);
    if (const std::string& expected = fact_of(record, "case.expected"); !expected.empty()) return expected;
    return of_text(value_of(record.summary, Metric::true_pairs), value_of(record.summary, Metric::judged_ticks)) +
           " meet";
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
                sorted.insert({fact_of(*record, response ? "response.own" : "detector.own") != "yes", method});
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
    const std::vector<std::string> methods = matrix.methods(false);
    if (const std::string absent = joined_code(matrix.methods(true)); !absent.empty())
        table.note = "Absent from this build: " + absent + ".";
    std::map<std::string, Tally> tally;
    for (const auto& [key, row] : matrix.rows) {
        // An absent method's record has no summary with the counts.
        const auto reported = std::max_element(row.begin(), row.end(), [](const auto& a, const auto& b) {
            return a.second->summary.size() < b.second->summary.size();
        });
        table.rows.push_back({});
        add_cell(table, {kind}, (key.first.empty() ? "" : key.first + ": ") + code(key.second));
        add_cell(table, {"right answer"}, expected_text(*reported->second));
        for (const std::string& method : methods) {
            const auto found = row.find(method);
            const Cell cell = found == row.end() ? Cell{} : cell_of(*found->second);
            add_cell(table, {code(method)}, cell.text);
            tally[method].take(cell);
        }
    }
    if (table.rows.empty()) return table;
    TableRow sum{.cells = {"all: right", ""}, .style = TableRow::Style::own};
    for (const std::string& method : methods) sum.cells.push_back(tally[method].text());
    table.rows.push_back(std::move(sum));
    return table;
}

}  // namespace

std::string hard_case_sentence(const Draft& draft) {
    std::map<std::string, Tally> tally;
    for (const Record* record : cases_of(draft)) {
        const Cell cell = cell_of(*record);
        if (cell.asked) tally[method_asked(record->spec)].take(cell);
    }
    if (tally.empty()) return {};
    std::vector<std::string> all;
    std::vector<std::string> some;
    for (const auto& [method, counts] : tally) {
        const bool right = counts.right == counts.asked;
        (right ? all : some).push_back(code(method) + (right ? "" : " " + counts.text()));
    }
    return fmt::format("Hard cases answered rightly: all by {}; {}.", all.empty() ? "none" : joined(all),
                       some.empty() ? "no method fails one" : joined(some));
}

Table hard_case_tally(const Draft& draft, bool responses) {
    constexpr std::array names{"FN", "FP", "NaN", "crash, throw", "other fault"};
    using Faults = std::array<int, names.size()>;  // cases with such a fault, the first that is reported
    std::map<std::string, std::pair<Tally, Faults>> by_method;
    Faults all{};
    for (const Record* record : cases_of(draft)) {
        if (record->spec.response.empty() == responses) continue;
        const Cell cell = cell_of(*record);
        if (!cell.asked) continue;
        auto& [tally, faults] = by_method[method_asked(record->spec)];
        tally.take(cell);
        if (cell.right) continue;
        const auto named = [&cell](std::string_view name) { return cell.text.starts_with(name); };
        const auto first = std::find_if(names.begin(), names.begin() + 3, named);
        const auto kind = static_cast<std::size_t>(first - names.begin());
        const std::size_t fault = kind < 3 || named("crash") || named("throw") ? kind : names.size() - 1;
        ++faults.at(fault);
        ++all.at(fault);
    }
    std::map<std::pair<Tally, Faults>, std::vector<std::string>> alike;
    for (const auto& [method, counts] : by_method) alike[counts].push_back(method);
    std::vector<std::pair<std::pair<Tally, Faults>, std::vector<std::string>>> sorted(alike.begin(), alike.end());
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        const Tally& first = a.first.first;
        const Tally& second = b.first.first;
        return first.right * second.asked > second.right * first.asked;
    });
    Table table;
    table.caption =
        responses ? "Responses on hard scenes, cases" : "Detectors on hard meshes and triangle pairs, cases";
    for (const auto& [counts, methods] : sorted) {
        const auto& [tally, faults] = counts;
        table.rows.push_back({});
        add_cell(table, {.header = responses ? "response" : "detector", .wide = true}, joined_code(methods));
        add_cell(table, {"right of N", true}, tally.text());
        for (std::size_t kind = 0; kind < names.size(); ++kind) {  // a fault that nobody has needs no column
            if (all.at(kind) > 0) add_cell(table, {names.at(kind), true}, std::to_string(faults.at(kind)));
        }
    }
    table.note = "Methods with the same counts stand in one row. A case counts under its first fault.";
    return table;
}

void add_hard_cases(Draft& draft) {
    Matrix meshes;
    Matrix families;
    Matrix scenes;
    Table reasons{
        .caption = "Why the right answers are right", .columns = {{"case", false}, {"reason", false}}, .folded = true};
    std::map<std::string, std::string> reason_of;
    for (const Record* record : cases_of(draft)) {
        const RunSpec& spec = record->spec;
        const std::string& of = fact_of(*record, "case.of");
        if (!of.empty()) reason_of[spec.scene] = fact_of(*record, "case.reason");
        Matrix& matrix = !spec.response.empty() ? scenes : of.empty() ? families : meshes;
        matrix.rows[{of, spec.scene}][method_asked(spec)] = record;
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
        "Each response reads the contacts of the generator that is its own by default, or that the study names. "
        "Figures "
        "as in the list of words at the end.";
    draft.add(std::move(moving));
    for (const auto& [name, reason] : reason_of) reasons.rows.push_back({.cells = {code(name), reason}});
    draft.add(std::move(reasons));
}

}  // namespace trocar
