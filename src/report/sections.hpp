// Sections of a report, one function per topic, and the draft that they append to. report.cpp selects and orders them.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "report/cell.hpp"
#include "report/chart.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"
#include "report/verdict.hpp"

namespace trocar {

/// Common value of a fact over all records, or the first eight values and how many more when they differ.
std::string common_fact(const std::vector<Record>& records, const std::string& key, bool* mixed = nullptr);
/// Command that makes the records anew, with what the command line changed of the study; empty: unknown.
std::string study_command(const std::vector<Record>& records);

/// Part of another published report that page 1 repeats.
struct QuotedReport {
    std::string name;           ///< of its folder
    std::string sentence = {};  ///< empty: it has none
    Table table = {};           ///< its first one; no rows: the report was not found, or has none
    /// Its runs that this study repeats, by name; of these, the ones that end in another state.
    std::vector<std::string> repeated = {};
    std::vector<std::string> different = {};
};

/// Nobody reads a longer table on a page.
inline constexpr std::size_t most_table_rows = 400;

/// True when the records name more than one machine.
bool are_of_several_machines(const std::vector<Record>& records);

/// Report under construction.
struct Draft {
    /// Precondition: at least one record. The records outlive the draft.
    explicit Draft(const std::vector<Record>& all);

    const std::vector<Record>& records;
    Results results;
    Document document;
    std::string reference;
    std::string study;
    std::string mode;      ///< mode of the verdict: closed_loop if present, else replay
    std::string sentence;  ///< summary sentence, set by add_page_one
    std::vector<QuotedReport> quoted = {};

    void heading(int level, const std::string& text);
    void paragraph(const std::string& text, Paragraph::Style style = Paragraph::Style::normal);
    /// Skips a table without rows; one of more than most_table_rows is named in a line.
    void add(Table table);
    /// A drawing that does not answer to the pointer.
    void drawing(const std::string& name, const std::string& svg, const std::string& caption);
    /// A chart that does; without a series there is no figure.
    template <typename Chart>
    void figure(const std::string& name, const Chart& chart, const std::string& caption) {
        const std::string description = interactive(chart);  // empty without a series
        if (!description.empty()) {
            document.blocks.emplace_back(Figure{"charts/" + name + ".svg", draw(chart), caption, description});
        }
    }

    /// Scenes of the verdict's mode by pair class, in alphabetical order.
    [[nodiscard]] std::map<std::string, std::vector<std::string>> scenes_by_class() const;
    /// Maximum number of processes of a method, in runs of this mode or (empty) of any.
    [[nodiscard]] int most_processes(const std::string& of_mode = {}) const;
    /// Truth was computed on every n-th tick of some run of the mode, at least.
    [[nodiscard]] std::int64_t widest_stride(const std::string& of_mode,
                                             std::int64_t RunSpec::*stride = &RunSpec::truth_stride) const;
    /// Scenes of the summary sentence: class I2T if present, else the class with most scenes.
    [[nodiscard]] std::pair<std::string, std::vector<std::string>> headline_scenes() const;
    [[nodiscard]] std::string interval_note(const std::string& of_mode) const;
};

// page_one_section.cpp
/// `worst_tick`: content of worst_tick.json, which only a study can write; empty: there is none.
void add_page_one(Draft& draft, const std::string& worst_tick);
/// The sentence and first table of that report's page 1, with their origin. `own`: the records of the study that
/// quotes.
QuotedReport quote_of(const std::string& name, const std::vector<Record>& records, const std::vector<Record>& own);
/// The sentence and the tables of page 1 as plain text for a terminal.
std::string terminal_text(const Draft& draft);

// verdict_section.cpp
/// Every method with all columns, over all scenes and per class.
void add_all_methods(Draft& draft, const Verdict& overall);
void add_verdict_by_class(Draft& draft);

// targets_section.cpp
/// A chart: the share of targets that the rows of page 1 meet over the time of a tick.
void add_targets_over_time(Draft& draft, const Verdict& overall);

// commands.cpp
/// Attaches to every row of one method, or of one method on one scene, the command that repeats it.
void add_commands(Draft& draft);
/// Shell command of a closed-loop method on these of its scenes, or on all; empty when there is no single one.
std::string run_command(const Draft& draft, const Method& method, const std::vector<std::string>& scenes);
std::string run_command(const Draft& draft, const Method& method);

// worst_tick.cpp
/// One scene at its worst tick, from worst_tick.json; when empty, explains how to create it.
void add_worst_tick(Draft& draft, const std::string& worst_tick);

// fairness_section.cpp
void add_environment(Draft& draft);
void add_fairness(Draft& draft);
void add_frames(Draft& draft);

// accuracy_section.cpp
void add_detection(Draft& draft);
void add_contacts_and_forces(Draft& draft);

// detection_effect_section.cpp
/// Compares rows of inexact detectors with the same rows of an exact detector.
void add_lost_by_the_detector(Draft& draft);

// between_ticks_section.cpp
void add_between_ticks(Draft& draft);
// outcome_section.cpp
void add_outcome(Draft& draft);

// time_section.cpp
void add_latency(Draft& draft);
void add_stages(Draft& draft);

// robustness_section.cpp
void add_rank_robustness(Draft& draft);

// failure_section.cpp
void add_failures(Draft& draft);

// hard_case_section.cpp
/// Table of case × method: ok, miss, extra, NaN, throw, time-out.
void add_hard_cases(Draft& draft);
/// Empty without such a part.
std::string hard_case_sentence(const Draft& draft);
/// Correct and wrong results per method, equal rows merged; no rows without such a part.
Table hard_case_tally(const Draft& draft, bool responses);

// metamorphic_section.cpp
void add_metamorphic(Draft& draft);

// paced_section.cpp
/// The loop paced by the clock: part of the haptic table.
void add_paced(Draft& draft);
/// Its subset on page 1 of a study with no other part.
Table paced_page(const Draft& draft);
/// Empty without such a part.
std::string paced_sentence(const Draft& draft);

// size_section.cpp
/// Time per tick and stage against the number of tissue triangles: one chart per family of scenes and methods.
void add_cost_by_size(Draft& draft);
/// Its subset on page 1 of a study without methods to compare: whole tick by scene and stepper.
Table size_page(const Draft& draft);

// side_by_side_section.cpp
/// Detectors that take turns on generated scenes: time over size, every detector on every scene, costs.
void add_side_by_side(Draft& draft);
/// The worst tick of scenes that repeat their motion.
void add_repeated_motion(Draft& draft);
/// Its table, for page 1 of a study with no other part.
Table repeated_motion_table(const Draft& draft);

// against_section.cpp
/// Steppers beside a second one that runs the scene in step.
void add_against(Draft& draft);
/// Its table, for page 1 of a study with no other part.
Table against_table(const Draft& draft);

// resolution_section.cpp
/// How responses resolve what an interval without contact has left: by group of scenes, causes, by scene.
void add_resolution(Draft& draft);
/// Its table over the scenes.
Table resolution_table(const Draft& draft);
/// Its subset on page 1: the best row of every response.
Table resolution_page(const Draft& draft);
/// Empty without such a part.
std::string resolution_sentence(const Draft& draft);

// external_section.cpp
/// Detectors on data of other groups, on page 1: a table per part with source, licence and command.
void add_external(Draft& draft);
/// The tables alone.
std::vector<Table> external_tables(const Draft& draft);
/// Methods without an error, by part; empty without a part.
std::string external_sentence(const Draft& draft);

// kind_section.cpp
/// Residual penetration by kind of drawn scene, with the median over all of them and its interval.
void add_kinds(Draft& draft);

// reference_law_section.cpp
/// Force and position against the stored references: hard contact, and the law of the scene.
void add_reference_laws(Draft& draft);

// table_3_1_section.cpp
/// Table 3.1 of the thesis, with numbers of detectors on generated scenes.
void add_table_3_1(Draft& draft);

// knob_section.cpp
void add_work_precision(Draft& draft);
/// Empty without such a part.
std::string work_precision_sentence(const Draft& draft);

// thesis_section.cpp
/// Table 2.1 of the thesis, with numbers where a response of the study represents a row.
void add_table_2_1(Draft& draft);
/// Row names of Table 2.1: the values of ResponseEntry::table_row other than "none".
std::vector<std::string> table_2_1_rows();

// results_section.cpp
void add_glossary(Draft& draft);
void add_rebuild(Draft& draft);

}  // namespace trocar
