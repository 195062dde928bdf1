// Metamorphic test of determinism: what each method answers when the same question is asked again or in other words, as
// the runs of mode "metamorphic test" found it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "report/sections.hpp"

namespace trocar {
namespace {

constexpr double rounding_m = 1.0e-9;  ///< up to here a distance is rounding
constexpr double rounding_n = 1.0e-6;

struct Question {
    const char* name;
    const char* header;
};
constexpr std::array questions{Question{"twice", "twice in one process"},   Question{"", "fresh process"},
                               Question{"triangles", "triangles permuted"}, Question{"bodies", "bodies permuted"},
                               Question{"swapped", "pair swapped"},         Question{"origin", "origin moved"},
                               Question{"unit", "metres ↔ millimetres"}};

using RunsOfScene = std::map<std::string, std::vector<const Record*>>;  ///< by scene, in order of repetition

std::string fresh_cell(const RunsOfScene& runs) {
    bool same = true;
    bool known = false;
    for (const auto& [scene, records] : runs) {
        known = known || records.size() > 1;
        for (const Record* record : records) same = same && record->state_hash == records.front()->state_hash;
    }
    return known ? yes_no(same) : unknown_text;
}

/// Value of the first process on every scene, by scene.
double first_value(const std::vector<const Record*>& records, const std::string& question, const char* unit) {
    return value_of(records.front()->summary, metric_of("metamorphic_" + question + unit));
}

std::string detector_cell(const RunsOfScene& runs, const std::string& question) {
    double differ = not_known;
    double pairs = 0.0;
    for (const auto& [scene, records] : runs) {
        const double here = first_value(records, question, "_pairs");
        if (std::isnan(here)) continue;
        differ = known_sum({differ, here});
        pairs += value_of(records.front()->summary, Metric::metamorphic_pairs);
    }
    if (differ > 0.0) return "no (" + of_text(differ, pairs) + " pairs)";
    return yes_no(differ == 0.0 ? 1.0 : differ, unknown_text);
}

std::string response_cell(const RunsOfScene& runs, const std::string& question) {
    double path = not_known;
    double force = not_known;
    std::string worst;
    for (const auto& [scene, records] : runs) {
        const double here = first_value(records, question, "_m");
        if (std::isnan(here)) continue;
        if (!(here <= path)) worst = scene;
        path = std::fmax(path, here);
        force = std::fmax(force, first_value(records, question, "_n"));
    }
    if (std::isnan(path)) return unknown_text;
    if (path == 0.0 && force == 0.0) return "yes";
    if (std::isinf(path)) return "no (ends otherwise)";
    const std::string far = fmt::format("{:.1e} mm, {:.1e} N", path * mm, force);
    return (path <= rounding_m && force <= rounding_n ? "yes, to " + far : "no (" + far + ", " + worst + ")");
}

std::string failed_text(const RunsOfScene& runs) {
    for (const auto& [scene, records] : runs) {
        for (const Record* record : records) {
            if (record->outcome.kind == OutcomeKind::absent) return "absent";
            if (!record->outcome.ok()) return fmt::format("{} on {}", name_of(record->outcome.kind), scene);
        }
    }
    return {};
}

}  // namespace

void add_metamorphic(Draft& draft) {
    std::map<std::pair<bool, std::string>, RunsOfScene> methods;  // responses behind detectors
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        const bool responds = !spec.response.empty();
        if (spec.mode == "metamorphic")
            methods[{responds, responds ? spec.response : spec.detector}][spec.scene].push_back(&record);
    }
    if (methods.empty()) return;
    draft.heading(2, "Metamorphic test of determinism");
    Table table;
    table.caption = "Does a method answer the same question alike?";
    for (auto& [who, runs] : methods) {
        const auto& [responds, method] = who;
        std::vector<std::string> scenes;
        for (auto& [scene, records] : runs) {
            scenes.push_back(scene);
            std::sort(records.begin(), records.end(),
                      [](const Record* a, const Record* b) { return a->spec.repetition < b->spec.repetition; });
        }
        const std::string failed = failed_text(runs);
        table.rows.push_back(
            {.style = failed.empty() || failed == "absent" ? TableRow::Style::normal : TableRow::Style::failed});
        add_cell(table, {"kind"}, responds ? "response" : "detector");
        add_cell(table, {"method"}, code(method));
        add_cell(table, {"scenes"}, joined(scenes));
        for (const auto& [question, header] : questions) {
            add_cell(table, {header},
                     !failed.empty()     ? failed
                     : *question == '\0' ? fresh_cell(runs)
                     : responds          ? response_cell(runs, question)
                                         : detector_cell(runs, question));
        }
    }
    table.note = fmt::format(
        "yes = the same answer bit by bit; \"yes, to\" = up to rounding (at most {:g} mm and {:g} N over the whole "
        "run), with how far off; no = not the same, with how far off: pairs that are in one of two answers only, "
        "or the largest distance of a vertex and the largest difference of a contact force. Detectors: sets of pairs "
        "on about "
        "20 frames of each scene; triangles, their corners and the vertices of each body in a random order, all "
        "bodies in the opposite order, every pair of bodies alone in both orders, coordinates on a grid on which the "
        "shift by (16, -8, 4) m and the factor 1000 are exact. Responses: the whole closed loop on the contacts of "
        "one detector; bodies of one kind in the opposite order (n/a: there are not two of a kind, or no such pair is "
        "tested), the same shift, lengths read from a file in millimetres, which rounds them once.",
        rounding_m * mm, rounding_n);
    draft.add(std::move(table));
}

}  // namespace trocar
