// Tables and reports as LaTeX. A table is a file of its own, to be read by \input into anybody's paper, and fits the
// column of a two-column journal: what is too wide is set as several panels that repeat the first columns.
#pragma once

#include <map>
#include <string>

#include "report/document.hpp"

namespace trocar {

/// What the files of latex_tables want: \usepackage{…}.
inline constexpr const char* latex_table_packages = "booktabs,array,textcomp";

/// Text for LaTeX; `…` becomes typewriter. Runs that TeX could not break are given places to break at.
std::string latex_inline(const std::string& text);

/// The table without a float around it: \footnotesize, booktabs, widths as shares of \linewidth, no line wider than
/// that where \linewidth is 229 pt or more (the narrowest of LaTeX's own twocolumn at 10 pt); long tables as several
/// tabulars, so that a page may break between them. Caption and note: a comment, and small print below.
std::string latex_table(const Table& table);

/// All tables of the document as files "tables/WORDS_OF_THE_CAPTION.tex".
std::map<std::string, std::string> latex_tables(const Document& document);

}  // namespace trocar
