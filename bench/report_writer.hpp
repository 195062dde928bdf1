// Writer of the benchmark's report, shared by all tables. Each report_*.cpp has the tables of one subject;
// bench_report.cpp orders them.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "bench_report.hpp"
#include "report/chart.hpp"
#include "report/document.hpp"
#include "report_figures.hpp"

namespace trocar::bench {

class Writer {
public:
    explicit Writer(const std::vector<CellRecord>& records) : records_(records) {}

    BenchReport write();

private:
    // ---- access ----

    [[nodiscard]] const CellRecord* cell(std::string_view id) const;
    [[nodiscard]] const MethodResult* row(std::string_view id, std::string_view label) const;
    [[nodiscard]] double time(std::string_view id, std::string_view label) const;
    [[nodiscard]] std::vector<const CellRecord*> group(Group wanted) const;
    /// Labels in order of appearance for which `wanted` holds.
    [[nodiscard]] std::vector<std::string> labels(const std::vector<const CellRecord*>& cells,
                                                  const std::function<bool(const MethodResult&)>& wanted) const;
    /// Labels of our default detectors of the cascade, in table order.
    [[nodiscard]] std::vector<std::string> own_labels() const;

    void find_floor();

    // ---- text ----

    void add(Paragraph paragraph);
    void add_text(std::string text);
    void add_heading(std::string text);
    void add_table(Table table);
    void add_figure(const std::string& name, const ScatterChart& chart, std::string caption);
    static TableRow::Style style_of(const MethodResult& entry);

    // ---- page one ----

    [[nodiscard]] std::string summary_sentence() const;
    void page_one();
    void broken_claim(const std::string& label, const std::string& cell, const std::string& what);
    /// "375, `embree_collide:leaf=cluster`"
    static std::string fastest_baseline(const CellRecord& record);
    void targets();
    /// Ratios of the time or work of each own method to its own time or work in other cases.
    void own_growth(const std::vector<std::string>& own);
    /// Assigns each default and each bounding volume one colour and shape, equal in all charts.
    MarkStyle mark_of(const std::string& label);

    using Axis = std::function<double(const CellRecord&)>;
    ScatterChart chart_over(const std::vector<const CellRecord*>& cells, const std::vector<std::string>& names,
                            const Axis& x, const std::function<double(const MethodResult&, const CellRecord&)>& y);
    static double time_of(const MethodResult& entry, const CellRecord& /*record*/);
    static bool in_charts(const MethodResult& entry);
    void time_against_size();

    // ---- groups of cells ----

    void matrix(const std::string& caption, const std::vector<const CellRecord*>& cells, const std::string& note);
    void sizes();
    void reaches();
    void stages();
    void bounded();
    void bodies();
    void cell_sweep();
    void orders();

    // ---- machine, libraries, default, recommended and tuned settings ----

    void origin();
    void fairness();
    void settings();
    /// Mean time of a step over the first or second half of a row's steps, µs; includes periodic rebuilds.
    static double half_mean(const MethodResult& entry, bool second);

    void tuning();
    void tune(const CellRecord& record, const Search& search, Table& table, Table& every) const;

    // ---- the thesis' Table 3.1 ----

    [[nodiscard]] std::string quotient(std::string_view above, std::string_view below, const std::string& label) const;
    [[nodiscard]] std::string per_body(const std::string& label, bool work) const;
    void table_31();

    // ---- all cells, CSV files, rebuild instructions ----

    void every_cell();
    void rebuild();
    void csv_files();

    struct Floor {
        std::string cell;
        std::string method;
        Ratio ratio;
    };

    const std::vector<CellRecord>& records_;
    Document document_;
    BenchReport report_;
    std::vector<Floor> floors_;
    double floor_ = 0.0;  ///< |log ratio| of repeated measurements of one method, not exceeded in nine of ten cells
    std::vector<std::string> marked_;
};

}  // namespace trocar::bench
