// Selects columns and rows of stored records for a paper's table.
#pragma once

#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct TableChoice {
    /// Names of RunTable, each with an optional target unit: "residual_penetration_max_m:mm". Empty: method, scene,
    /// outcome, and up to five available figures of depth, force, position and time.
    std::vector<std::string> columns;
    /// "NAME=VALUE" or "NAME!=VALUE". Values of one name are alternatives; conditions on several names must all hold. A
    /// method matches by name, or by name and parameters as `run` takes them; an empty value matches unknown. Defaults:
    /// the study's main mode without "mode=", and the first process without "repetition=" or that column.
    std::vector<std::string> where;
    /// "NAME" or "NAME:desc", most significant first; ties are ordered by the shown columns. Unknown numbers come last.
    std::vector<std::string> sort = {};
};

struct ChosenColumn {
    std::string name;  ///< name of RunTable, with the suffix of the chosen unit: "residual_max_mm"
    std::string unit;  ///< unit of the numbers; "text" for words
    bool number = false;
    std::string header;  ///< display name: "residual max (mm)"
};

struct ChosenCell {
    std::string word;
    double number = 0.0;  ///< NaN: not known
};

struct ChosenTable {
    std::vector<ChosenColumn> columns;
    std::vector<std::vector<ChosenCell>> rows;  ///< in the requested order
    std::vector<std::string> notes;             ///< rows omitted by default, and hidden columns in which rows differ
};

/// Throws a one-line InputError for an unknown column (with similar names), an inconvertible unit, a value that no run
/// has, or an empty result.
ChosenTable choose_table(const std::vector<Record>& records, const TableChoice& choice);

/// The runs that fit the conditions of TableChoice::where, of every mode and process. Throws InputError as
/// choose_table.
std::vector<const Record*> choose_runs(const std::vector<Record>& records, const std::vector<std::string>& where);

/// Markdown, LaTeX (latex_table) or CSV. CSV has all digits and column names as heads. The others round to three digits
/// and print n/a for unknown.
std::string table_as_markdown(const ChosenTable& table);
std::string table_as_latex(const ChosenTable& table);
std::string table_as_csv(const ChosenTable& table);

}  // namespace trocar
