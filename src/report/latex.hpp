// A table as LaTeX, to be read by \input into anybody's paper. It fits the column of a two-column journal: what is too
// wide is set as several panels that repeat the first columns.
#pragma once

#include <string>

#include "report/document.hpp"

namespace trocar {

/// What latex_table wants: \usepackage{…}.
inline constexpr const char* latex_table_packages = "booktabs,array,textcomp";

/// The table without a float around it: \footnotesize, booktabs, widths as shares of \linewidth, no line wider than
/// that where \linewidth is 229 pt or more (the narrowest of LaTeX's own twocolumn at 10 pt); long tables as several
/// tabulars, so that a page may break between them. Caption and note: a comment, and small print below.
std::string latex_table(const Table& table);

}  // namespace trocar
