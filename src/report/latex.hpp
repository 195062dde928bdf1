// Tables as LaTeX for \input, fitted to a column of a two-column journal. Wider tables are split into panels that
// repeat the first columns.
#pragma once

#include <string>

#include "report/document.hpp"

namespace trocar {

/// Packages that latex_table needs, for \usepackage.
inline constexpr const char* latex_table_packages = "booktabs,array,textcomp";

/// Table without a float: \footnotesize, booktabs, widths as fractions of \linewidth. Lines fit a \linewidth of 229 pt
/// or more (LaTeX's twocolumn at 10 pt). Long tables are several tabulars, so that pages may break between them. The
/// caption is a LaTeX comment, the note small print.
std::string latex_table(const Table& table);

}  // namespace trocar
