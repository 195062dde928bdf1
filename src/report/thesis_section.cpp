#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "measure/statistics.hpp"

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

/// What the closed-loop runs of one response with one contact generator say, over all scenes and detectors.
struct Measured {
    std::vector<double> respond_p50;  ///< ns, per run
    double total_p99_ns = not_known;  ///< ns, worst run
    double misses = 0.0;
    double ticks = 0.0;
    double left_rigid = not_known;   ///< m, worst run on a scene without tissue
    double left_tissue = not_known;  ///< m, worst run on a scene with tissue
    int ok = 0;
    int runs = 0;
    std::set<std::string> scenes;
};

/// The number, and the names where they are few.
std::string scenes_text(const std::set<std::string>& scenes) {
    return scenes.size() > 2 ? std::to_string(scenes.size()) : fmt::format("{}", fmt::join(scenes, ", "));
}

void raise(double& worst, double value) {
    if (!std::isnan(value) && !(worst >= value)) worst = value;
}

}  // namespace

std::vector<std::string> table_2_1_rows() {
    std::vector<std::string> rows;
    rows.reserve(previous_systems.size());
    for (const PreviousSystem& system : previous_systems) rows.emplace_back(system.authors);
    return rows;
}

void add_table_2_1(Draft& draft) {
    // Row of the thesis' table -> response and contact generator -> figures.
    std::map<std::string, std::map<std::string, Measured>> measured;
    std::map<std::string, std::set<std::string>> without_tissue;  // what responses do there -> their names
    for (const RunFigures& run : draft.results.runs()) {
        const RunSpec& spec = run.record->spec;
        if (spec.mode != "closed_loop" || spec.response.empty()) continue;
        if (run.record->outcome.kind == OutcomeKind::absent || run.record->outcome.kind == OutcomeKind::unsupported) {
            continue;
        }
        const auto fact = run.record->environment.find("response.table_row");
        const std::string row = fact == run.record->environment.end() ? "none" : fact->second;
        const auto elsewhere = run.record->environment.find("response.without_tissue");
        if (elsewhere != run.record->environment.end()) without_tissue[elsewhere->second].insert(code(spec.response));
        Measured& m = measured[row][code(spec.response) + " (" + spec.contacts + ")" + by_stepper(spec.stepper)];
        ++m.runs;
        m.scenes.insert(spec.scene);
        if (!run.ok()) continue;
        ++m.ok;
        const double respond = run[Metric::respond_median_ns];
        if (!std::isnan(respond)) m.respond_p50.push_back(respond);
        raise(m.total_p99_ns, run[Metric::total_p99_ns]);
        m.misses += run[Metric::deadline_misses];
        m.ticks += run[Metric::timed_ticks];
        const bool tissue = meets_tissue(spec.pair_class);
        raise(tissue ? m.left_tissue : m.left_rigid, run[Metric::residual_penetration_max_m]);
    }
    if (measured.empty()) return;
    draft.heading(2, "Table 2.1 of the thesis, measured");
    draft.paragraph(
        "The thesis compares earlier collision responses by yes and no. Where a response of this study stands for a "
        "row, its closed-loop runs give numbers instead, over all their scenes and detectors; the row's idea is "
        "measured on our scenes, not the authors' program. Printed: real-time / applicable to deformable objects / "
        "applicable to the mass-spring system.");
    Table table;
    table.columns = {{"authors", false},
                     {"basis of algorithm", false},
                     {"printed", false},
                     {"response that stands for it (contacts)", false},
                     {"runs ok", true},
                     {"scenes", true},
                     {"respond, median run (µs)", true},
                     {"tick p99, worst run (µs)", true, Metric::total_p99_ns},
                     {"1 kHz misses", true, Metric::paced_misses},
                     {"residual penetration, max, without tissue (mm)", true, Metric::residual_penetration_max_m},
                     {"residual penetration, max, with tissue (mm)", true, Metric::residual_penetration_max_m}};
    const auto scaled = [](double value, double scale) {
        return std::isnan(value) ? std::string("n/a") : format_number(value * scale);
    };
    const auto add = [&](const std::string& authors, const std::string& basis, const std::string& printed,
                         const std::map<std::string, Measured>& responses) {
        for (const auto& [response, m] : responses) {
            const double median = m.respond_p50.empty() ? not_known : quantile(m.respond_p50, 0.5);
            table.rows.push_back(
                {.cells = {authors, basis, printed, response, fmt::format("{} of {}", m.ok, m.runs),
                           scenes_text(m.scenes), scaled(median, us),
                           std::isnan(m.total_p99_ns) ? "n too small" : format_number(m.total_p99_ns * us),
                           m.ticks > 0.0 ? fmt::format("{} of {}", count_text(m.misses), count_text(m.ticks)) : "n/a",
                           scaled(m.left_rigid, mm), scaled(m.left_tissue, mm)}});
        }
    };
    for (const PreviousSystem& system : previous_systems) {
        const std::string printed =
            fmt::format("{} / {} / {}", system.real_time, system.deformable, system.mass_spring);
        const auto found = measured.find(system.authors);
        if (found != measured.end()) {
            add(system.authors, system.basis, printed, found->second);
            continue;
        }
        std::vector<std::string> cells(table.columns.size(), "");
        cells[0] = system.authors;
        cells[1] = system.basis;
        cells[2] = printed;
        cells[3] = "not measured";
        table.rows.push_back({.cells = std::move(cells), .style = TableRow::Style::dominated});
    }
    const auto none = measured.find("none");
    if (none != measured.end()) add("in no row", "", "", none->second);
    table.note =
        "Time and depth belong together: a response that leaves the bodies inside each other can be fast. Left at "
        "worst: greatest true depth after a tick; n/a where no run had both a depth and a truth. Without tissue only "
        "the contact gives way: that depth is the force over the scene's k, not an error. Rows of unlike scenes do not "
        "compare: those of a few scenes name them. Respond is what a response takes to say its law; impulses (impulse, "
        "reflection, ode_joints) are found in the tissue's sub-steps, whose time only the whole tick has.";
    for (const auto& [what, names] : without_tissue) {
        table.note += fmt::format(" Each of {} {}.", fmt::join(names, ", "), what);
    }
    draft.add(std::move(table));
}

}  // namespace trocar
