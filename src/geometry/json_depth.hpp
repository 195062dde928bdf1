// How deep a JSON text is nested, reported without a parser: documents are walked, copied and freed by functions that
// call themselves for every level, so that a text which is too deep has to be refused before anything is made of it.
#pragma once

#include <string_view>

namespace trocar {

/// Levels of lists and objects that any JSON text may have; the formats of trocar need fewer than 10.
inline constexpr int deepest_json = 100;

/// Whether lists and objects are open inside each other more than `deepest_json` times at some place. Brackets inside
/// of texts do not count. What is no JSON gets an answer, too.
bool is_nested_too_deep(std::string_view json);

}  // namespace trocar
