// A table for a paper out of stored records: columns and rows as a person names them, numbers as the records have them.
#pragma once

#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct TableChoice {
    /// Names of RunTable, each with an optional unit that its numbers are brought to: "residual_penetration_max_m:mm".
    /// Empty: who, where, how it ended, and up to five figures of depth, force, position and time that the rows have.
    std::vector<std::string> columns;
    /// "NAME=VALUE" or "NAME!=VALUE". Of one name any value will do that is not excluded, of several names all must
    /// hold. A method's value may be its name, or name and parameters as `run` takes them; an empty one is what is not
    /// known. Without "mode=" the study's main kind of run, and without "repetition=" or that column the first process
    /// of each.
    std::vector<std::string> where;
    /// "NAME" or "NAME:desc", the first decides first; what they leave equal is ordered by the columns shown, left to
    /// right. Numbers that are not known come last.
    std::vector<std::string> sort = {};
};

struct ChosenColumn {
    std::string name;  ///< as RunTable, with its ending changed where the unit is not its own: "residual_max_mm"
    std::string unit;  ///< that the numbers are in; "text" of words
    bool number = false;
    std::string header;  ///< for people: "residual max (mm)"
};

struct ChosenCell {
    std::string word;
    double number = 0.0;  ///< NaN: not known
};

struct ChosenTable {
    std::vector<ChosenColumn> columns;
    std::vector<std::vector<ChosenCell>> rows;  ///< in the order asked for
    std::vector<std::string> notes;  ///< what was left out without being asked for; what rows differ in unseen
};

/// Throws InputError, in one line, for a name that no column has (with those that are like it), a unit that the column
/// cannot be brought to, a value that no run has, and when no run is left.
ChosenTable choose_table(const std::vector<Record>& records, const TableChoice& choice);

/// Markdown, LaTeX (latex_table) or CSV. CSV has all digits and names for heads. The others round to three digits and
/// say n/a where a number is not known.
std::string table_as_markdown(const ChosenTable& table);
std::string table_as_latex(const ChosenTable& table);
std::string table_as_csv(const ChosenTable& table);

}  // namespace trocar
