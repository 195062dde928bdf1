// The sections of a report, one function and one place for each topic, and the draft that they add to. Only report.cpp
// decides which there are and in what order.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "report/chart.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"
#include "report/verdict.hpp"

namespace trocar {

inline constexpr double us = 1.0e-3;  ///< ns to µs
inline constexpr double mm = 1.0e3;   ///< m to mm

std::string code(const std::string& text);
/// Without its parameters.
std::string method_name(const std::string& text);
std::string outcome_text(const Outcome& outcome);
std::string joined(const std::vector<std::string>& items);
/// "1.000" but "0.99987": a share that is not one never resembles one.
std::string share_text(double part, double whole);
std::string count_text(double value);
/// "n/a" where it is not known.
std::string scaled(double value, double scale = 1.0);
std::string yes_no(bool value);
/// The common value of a fact over all records, or all values when they differ.
std::string common_fact(const std::vector<Record>& records, const std::string& key, bool* mixed = nullptr);

/// The report while it is written.
struct Draft {
    /// At least one record; they outlive the draft.
    explicit Draft(const std::vector<Record>& all);

    const std::vector<Record>& records;
    Results results;
    Document document;
    std::string reference;
    std::string study;
    std::string mode;      ///< of the verdict: closed_loop where there is one, else replay
    std::string sentence;  ///< the quotable one; written by add_page_one

    void heading(int level, const std::string& text);
    void paragraph(const std::string& text, Paragraph::Style style = Paragraph::Style::normal);
    /// Leaves out a table without rows.
    void add(Table table);
    /// Leaves out a drawing without content.
    void figure(const std::string& name, const std::string& svg, const std::string& caption);
    /// The same with a chart that answers to the pointer.
    void figure(const std::string& name, const ScatterChart& chart, const std::string& caption);
    void figure(const std::string& name, const LineChart& chart, const std::string& caption);

    /// Scenes of the verdict's mode by class, classes in alphabetical order.
    [[nodiscard]] std::map<std::string, std::vector<std::string>> scenes_by_class() const;
    /// Most processes of one method, in runs of this mode or (empty) of any.
    [[nodiscard]] int most_processes(const std::string& of_mode = {}) const;
    /// The scenes that the quotable sentence speaks of: I2T where there is one, else the class with most scenes.
    [[nodiscard]] std::pair<std::string, std::vector<std::string>> headline_scenes() const;
    [[nodiscard]] std::string interval_note(const std::string& of_mode) const;
};

// page_one_section.cpp
/// `worst_tick`: content of worst_tick.json, which only a study can write; empty: there is none.
void add_page_one(Draft& draft, const std::string& worst_tick);
/// The sentence and the tables of page 1 as plain text for a terminal.
std::string terminal_text(const Draft& draft);

// verdict_section.cpp
/// Every method with all columns, over all scenes and per class.
void add_all_methods(Draft& draft, const Verdict& overall);
void add_verdict_by_class(Draft& draft);

// commands.cpp
/// Gives every row that reports one method, or of one on one scene, the command that runs it again.
void add_commands(Draft& draft);
/// Of a method of the closed loop on all its scenes, for a shell; empty when there is no single one.
std::string run_command(const Draft& draft, const Method& method);

// worst_tick.cpp
/// One scene at its worst tick, from worst_tick.json; says how to make it when that is empty.
void add_worst_tick(Draft& draft, const std::string& worst_tick);

// fairness_section.cpp
void add_environment(Draft& draft);
void add_fairness(Draft& draft);
void add_frames(Draft& draft);

// accuracy_section.cpp
void add_detection(Draft& draft);
void add_contacts_and_forces(Draft& draft);

// detection_effect_section.cpp
/// Rows with a detector that is not exact against the same with one that is.
void add_lost_by_the_detector(Draft& draft);

// between_ticks_section.cpp
void add_between_ticks(Draft& draft);
// outcome_section.cpp
void add_outcome(Draft& draft);

// time_section.cpp
void add_latency(Draft& draft);
void add_stages(Draft& draft);
void add_work_profile(Draft& draft);

// robustness_section.cpp
void add_rank_robustness(Draft& draft);

// failure_section.cpp
void add_failures(Draft& draft);

// hard_case_section.cpp
/// Case by method: ok, miss, extra, NaN, throw, time-out.
void add_hard_cases(Draft& draft);
/// Empty without such a part.
std::string hard_case_sentence(const Draft& draft);
/// Right and wrong answers by method, those that answer alike in one row; without rows when there are none.
Table hard_case_tally(const Draft& draft, bool responses);

// metamorphic_section.cpp
void add_metamorphic(Draft& draft);

// paced_section.cpp
/// The loop released by the clock: part of the haptic table.
void add_paced(Draft& draft);
/// Of it what page 1 shows of a study that does nothing else.
Table paced_page(const Draft& draft);

// size_section.cpp
/// What a tick costs against the number of tissue triangles, stages apart: one chart per family of scenes and methods.
void add_cost_by_size(Draft& draft);
/// Of it what page 1 shows of a study without detectors or responses to compare: the whole tick by scene and stepper.
Table size_page(const Draft& draft);

// knob_section.cpp
void add_work_precision(Draft& draft);
/// Empty without such a part.
std::string work_precision_sentence(const Draft& draft);

// ablation_section.cpp
void add_ablation(Draft& draft);
/// Empty without an ablation part.
std::string ablation_sentence(const Draft& draft);
/// Every switch by its largest effect; without rows when there is no ablation part.
Table ablation_table(const Draft& draft);

// thesis_section.cpp
void add_thesis_table(Draft& draft);
/// Table 2.1 with numbers where a response of the study stands for a row.
void add_table_2_1(Draft& draft);
/// Names of its rows: what ResponseEntry::table_row may hold beside "none".
std::vector<std::string> table_2_1_rows();

// results_section.cpp
void add_glossary(Draft& draft);
void add_rebuild(Draft& draft);

}  // namespace trocar
