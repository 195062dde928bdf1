// Runs as a flat table: one column per word of the specification, per parameter of a method and per figure, under the
// names by which results.csv, figures.csv and `trocar table` know them.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct RunColumn {
    std::string name;     ///< letters, digits, '_' and '.': "residual_penetration_max_m", "detector.bv"
    std::string unit;     ///< as summary_figures(): SI, "ns", "1"; "text" where the values are words
    std::string better;   ///< "lower", "higher" or "neither"
    std::string meaning;  ///< one sentence, with what an empty field means
    std::string source;   ///< what it is taken from
    bool number = false;
};

/// A cell: a number (NaN: not known) or a word (empty: not set).
struct RunValue {
    std::string word;
    double number = 0.0;
};

class RunTable {
public:
    /// All columns that any of the records has: words of the specification, parameters of its methods (in alphabetical
    /// order behind the method), outcome and hashes, then the figures in the order of summary_figures(). The records
    /// outlive the object.
    explicit RunTable(std::span<const Record* const> records);

    [[nodiscard]] const std::vector<RunColumn>& columns() const { return columns_; }
    [[nodiscard]] std::size_t row_count() const { return records_.size(); }
    [[nodiscard]] const Record& record(std::size_t row) const { return *records_[row]; }
    [[nodiscard]] RunValue value(std::size_t row, std::size_t column) const;
    /// As CSV has it: all digits of a number, empty where there is none.
    [[nodiscard]] std::string text(std::size_t row, std::size_t column) const;
    /// Position of the column; -1 when there is none of that name.
    [[nodiscard]] std::int64_t find(const std::string& name) const;

private:
    std::vector<const Record*> records_;
    std::vector<RunColumn> columns_;
    std::vector<std::map<std::string, std::string>> words_;  ///< per row: column -> word, of what is no figure
};

/// The files of a study's numbers, by name. results.csv: the runs of the study's main kind (`main_mode`, or where it
/// has none the first that there is), one row each; results_MODE.csv: those of every other kind. A number that
/// no run of the kind knows has no column. figures.csv: every
/// column of these with unit, which way is better and meaning.
std::map<std::string, std::string> results_files(const std::vector<Record>& records, const std::string& main_mode);

}  // namespace trocar
