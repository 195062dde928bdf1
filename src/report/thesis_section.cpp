#include <fmt/format.h>

#include <array>
#include <map>
#include <set>

#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// A row of Table 2.1 as the thesis prints it. The two systems that share their authors with another row carry their
/// reference number.
struct PreviousSystem {
    const char* authors;
    const char* real_time;
    const char* deformable;
    const char* mass_spring;
    const char* basis;
};
constexpr std::array<PreviousSystem, 17> previous_systems{
    {{"Uno et al", "N", "Y", "Y", "Conservation laws"},
     {"C. O'Sullivan et al [41]", "N", "N", "N", "Conservation of momentum and energy"},
     {"M. Moore et al", "Y", "N", "N", "Conservation of linear and angular momentum"},
     {"P. Volino et al [47]", "Y", "Y", "Y", "Combination of elastic model and the mass-spring model"},
     {"B. Geiger et al", "Y", "N", "N", "Compliant motion"},
     {"D. Baraff et al", "N", "Y", "Y", "Constraint"},
     {"J. Mezger et al", "N", "Y", "Y", "Coherence between consecutive frames"},
     {"B. Mirtich et al", "Y", "N", "N", "Impulse based"},
     {"P. Sovis et al", "Y", "Y", "N", "Impulse dynamics"},
     {"F. Policarpo et al", "Y", "N", "N", "Impulse dynamics"},
     {"P. Volino et al [48, 49]", "Y", "N", "Y", "Impulse based"},
     {"T. Kurihara et al", "N", "Y", "N", "Impulse dynamics"},
     {"V. Vuskovic et al", "N", "Y", "N", "Finite element modeling"},
     {"C. Basdogan et al", "Y", "Y", "Partially", "Hybrid of finite element model and particle system"},
     {"O. Etzmuß et al", "Y", "Y", "N", "Add/subtract virtual particles"},
     {"C. O'Sullivan et al [42]", "Y", "Y", "N", "Human perception of collision"},
     {"B. Lee et al", "Y", "Y", "N", "Fields of displacement"}}};

/// The number of scenes, and the names where they are few.
std::string scenes_text(const ResultSet& results) {
    std::set<std::string> scenes;
    for (const SceneResult* result : results.results) scenes.insert(result->scene());
    return scenes.size() > 2 ? std::to_string(scenes.size()) : fmt::format("{}", fmt::join(scenes, ", "));
}

/// Of the results that ended well, in all their processes.
MetricColumn ok_column(const std::string& header, Metric metric, Over over, double scale, const char* unknown,
                       const std::function<bool(const SceneResult&)>& keep = {}) {
    return {.header = header, .metric = metric, .text = [=](const ResultSet& results) {
                ResultSet some = results.ok();
                std::erase_if(some.results, [&keep](const SceneResult* one) { return keep && !keep(*one); });
                return scaled(value_over(over, some.values(Processes::every, metric)), scale, unknown);
            }};
}

std::vector<MetricColumn> measured_columns() {
    const auto residual = [](const char* header, bool tissue) {
        return ok_column(
            header, Metric::residual_penetration_max_m, Over::largest, mm, unknown_text,
            [tissue](const SceneResult& result) { return meets_tissue(result.record().spec.pair_class) == tissue; });
    };
    return {text_column("runs ok",
                        [](const ResultSet& results) {
                            return fmt::format("{} of {}", results.runs() - results.failed_runs(), results.runs());
                        }),
            text_column("scenes", scenes_text),
            ok_column("respond, median run (µs)", Metric::respond_median_ns, Over::median, us, unknown_text),
            ok_column("tick p99, worst run (µs)", Metric::total_p99_ns, Over::largest, us, too_few),
            {.header = "1 kHz misses",
             .metric = Metric::deadline_misses,
             .text = [](const ResultSet& results) { return misses_text(results.ok(), Metric::deadline_misses); }},
            residual("residual penetration, max, without tissue (mm)", false),
            residual("residual penetration, max, with tissue (mm)", true)};
}

}  // namespace

std::vector<std::string> table_2_1_rows() {
    std::vector<std::string> rows;
    rows.reserve(previous_systems.size());
    for (const PreviousSystem& system : previous_systems) rows.emplace_back(system.authors);
    return rows;
}

void add_table_2_1(Draft& draft) {
    // Row of the thesis' table -> response and contact generator -> results, over all detectors.
    std::map<std::string, std::map<Method, ResultSet>> measured;
    std::map<std::string, std::set<std::string>> without_tissue;  // what responses do there -> their names
    for (const Method& method : draft.results.methods("closed_loop")) {
        if (method.response.empty() || draft.results.fact(method, "detector.control") == "yes") continue;
        Method response = method;
        response.detector.clear();
        for (const SceneResult* result : possible(draft.results, method).results) {
            const std::string& row = fact_of(result->record(), "response.table_row");
            const std::string& elsewhere = fact_of(result->record(), "response.without_tissue");
            if (!elsewhere.empty()) without_tissue[elsewhere].insert(code(method.response));
            measured[row.empty() ? "none" : row][response].results.push_back(result);
        }
    }
    if (measured.empty()) return;
    draft.heading(2, "Table 2.1 of the thesis, measured");
    draft.paragraph(
        "The thesis compares earlier collision responses by yes and no. Where a response of this study stands for a "
        "row, its closed-loop runs give numbers instead, over all their scenes and all detectors but controls; the "
        "row's idea is measured on our scenes, not the authors' program. Printed: real-time / applicable to deformable "
        "objects / applicable to the mass-spring system.");
    std::vector<MetricRow> rows;
    const auto add = [&](const PreviousSystem& system, const std::string& printed, const auto& responses) {
        for (const auto& [response, results] : responses) {
            rows.push_back(
                {.names = {system.authors, system.basis, printed, response_name(response)}, .results = results});
        }
    };
    for (const PreviousSystem& system : previous_systems) {
        const std::string printed =
            fmt::format("{} / {} / {}", system.real_time, system.deformable, system.mass_spring);
        const auto found = measured.find(system.authors);
        if (found != measured.end()) {
            add(system, printed, found->second);
        } else {
            rows.push_back({.names = {system.authors, system.basis, printed, "not measured"},
                            .results = {},
                            .no_figures = true,
                            .style = TableRow::Style::dominated});
        }
    }
    add({"in no row", "", "", "", ""}, "", measured["none"]);
    Table table = table_of(
        {.caption = "",
         .columns = {{"authors", false},
                     {"basis of algorithm", false},
                     {"printed", false},
                     {"response that stands for it (contacts)", false}},
         .note =
             "Time and depth belong together: a response that leaves the bodies inside each other can be fast. Left at "
             "worst: greatest true depth after a tick; n/a where no run had both a depth and a truth. Without tissue "
             "only the contact gives way: that depth is the force over the scene's k, not an error. Rows of unlike "
             "scenes do not compare: those of a few scenes name them. Respond is what a response takes to say its law; "
             "impulses (impulse, reflection, ode_joints) are found in the tissue's sub-steps, whose time only the "
             "whole "
             "tick has."},
        measured_columns(), rows);
    for (const auto& [what, names] : without_tissue) {
        table.note += fmt::format(" Each of {} {}.", fmt::join(names, ", "), what);
    }
    draft.add(std::move(table));
}

}  // namespace trocar
