// Help texts of table headers, from the list of figures (measure/metrics.hpp).
#pragma once

#include <string>

namespace trocar {

struct Table;

/// Help text of the figure with this header: meaning, unit, origin. Empty when the header is no figure.
std::string help_for(const std::string& header);

/// Fills empty help texts of columns.
void explain_headers(Table& table);

}  // namespace trocar
