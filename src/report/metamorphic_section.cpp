// Metamorphic test of determinism: what each method answers when the same question is asked again or in other words, as
// the runs of mode "metamorphic test" found it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

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
        if (records.size() < 2) continue;
        known = true;
        for (const Record* record : records) same = same && record->state_hash == records.front()->state_hash;
    }
    return known ? yes_no(same) : "n/a";
}

std::string detector_cell(const RunsOfScene& runs, const std::string& name) {
    double differ = 0.0;
    double pairs = 0.0;
    bool known = false;
    for (const auto& [scene, records] : runs) {
        const double here = summary_of(*records.front(), metric_of("metamorphic_" + name + "_pairs"));
        if (std::isnan(here)) continue;
        known = true;
        differ += here;
        pairs += summary_of(*records.front(), Metric::metamorphic_pairs);
    }
    if (!known) return "n/a";
    return differ > 0.0 ? fmt::format("no ({} of {} pairs)", count_text(differ), count_text(pairs)) : "yes";
}

std::string response_cell(const RunsOfScene& runs, const std::string& name) {
    double path = not_known;
    double force = not_known;
    std::string worst;
    for (const auto& [scene, records] : runs) {
        const double here = summary_of(*records.front(), metric_of("metamorphic_" + name + "_m"));
        if (std::isnan(here)) continue;
        if (std::isnan(path) || here > path) worst = scene;
        path = std::fmax(path, here);
        force = std::fmax(force, summary_of(*records.front(), metric_of("metamorphic_" + name + "_n")));
    }
    if (std::isnan(path)) return "n/a";
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
    std::map<std::string, RunsOfScene> detectors;
    std::map<std::string, RunsOfScene> responses;
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "metamorphic") continue;
        (spec.response.empty() ? detectors[spec.detector] : responses[spec.response])[spec.scene].push_back(&record);
    }
    if (detectors.empty() && responses.empty()) return;
    draft.heading(2, "Metamorphic test of determinism");
    Table table;
    table.caption = "Does a method answer the same question alike?";
    table.columns = {{"kind", false}, {"method", false}, {"scenes", false}};
    for (const Question& question : questions) table.columns.push_back({question.header, false});
    const auto add_rows = [&table](std::map<std::string, RunsOfScene>& methods, const std::string& kind, auto cell) {
        for (auto& [method, runs] : methods) {
            for (auto& [scene, records] : runs) {
                std::sort(records.begin(), records.end(),
                          [](const Record* a, const Record* b) { return a->spec.repetition < b->spec.repetition; });
            }
            std::vector<std::string> scenes;
            for (const auto& [scene, records] : runs) scenes.push_back(scene);
            TableRow row{.cells = {kind, code(method), joined(scenes)}};
            const std::string failed = failed_text(runs);
            for (const Question& question : questions) {
                const std::string name = question.name;
                row.cells.push_back(!failed.empty() ? failed : name.empty() ? fresh_cell(runs) : cell(runs, name));
            }
            if (!failed.empty() && failed != "absent") row.style = TableRow::Style::failed;
            table.rows.push_back(std::move(row));
        }
    };
    add_rows(detectors, "detector", detector_cell);
    add_rows(responses, "response", response_cell);
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
