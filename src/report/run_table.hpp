// Runs as a flat table: one column per field of the specification, method parameter and figure. Names are those of
// results.csv, figures.csv and `trocar table`.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct RunColumn {
    std::string name;     ///< letters, digits, '_' and '.': "residual_penetration_max_m", "detector.bv"
    std::string unit;     ///< as MetricInfo: SI, "ns", "1"; "text" for words
    std::string better;   ///< "lower", "higher" or "neither"
    std::string meaning;  ///< begins with a capital and explains an empty cell
    std::string source;   ///< origin of the value
    bool number = false;
    std::optional<Metric> metric = {};  ///< none for the specification and the outcome
};

/// A cell: a number (NaN: unknown) or a word (empty: not set).
struct RunValue {
    std::string word;
    double number = 0.0;
};

class RunTable {
public:
    /// Columns that occur in any record, in this order. First the specification, then method parameters (alphabetical,
    /// after their method), outcome and hashes, then metrics in the order of their list. The records outlive the
    /// object.
    explicit RunTable(std::span<const Record> records);

    [[nodiscard]] const std::vector<RunColumn>& columns() const { return columns_; }
    [[nodiscard]] std::size_t row_count() const { return records_.size(); }
    [[nodiscard]] const Record& record(std::size_t row) const { return records_[row]; }
    [[nodiscard]] RunValue value(std::size_t row, std::size_t column) const;
    /// CSV text: all digits of a number, empty for unknown.
    [[nodiscard]] std::string text(std::size_t row, std::size_t column) const;
    /// Indices of the columns that any row fills: the columns of results.csv.
    [[nodiscard]] std::vector<std::size_t> filled_columns() const;
    /// Index of the column; -1 when absent.
    [[nodiscard]] std::int64_t find(const std::string& name) const;

private:
    std::span<const Record> records_;
    std::vector<RunColumn> columns_;
    /// per row: column -> word, for columns other than figures
    std::vector<std::map<std::string, std::string>> words_;
};

/// The metrics that any run has, in the order of their list.
std::set<Metric> used_metrics(std::span<const Record> records);

/// CSV files by name. results.csv: one row per run, of every mode, without columns that no run fills. figures.csv: its
/// columns with unit, better direction and meaning.
std::map<std::string, std::string> results_files(const std::vector<Record>& records);

}  // namespace trocar
