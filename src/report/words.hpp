// What the headers of a report's tables mean, from the one list of figures (measure/metrics.hpp).
#pragma once

#include <string>

namespace trocar {

struct Table;

/// The figure behind a header in words, with its unit and what it is taken from; empty when the header is no figure.
std::string help_for(const std::string& header);

/// Fills the help of every column that has none.
void explain_headers(Table& table);

}  // namespace trocar
