// Nesting depth of a JSON text, without a parser. Parsing, copying and freeing a document recurse per level, so a text
// that is too deep must be refused before it is parsed.
#pragma once

#include <string_view>

namespace trocar {

/// Levels of lists and objects that any JSON text may have; the formats of trocar need fewer than 10.
inline constexpr int deepest_json = 100;

/// Whether lists and objects are nested more than `deepest_json` levels at any place. Brackets inside strings do not
/// count. Text that is not JSON gets an answer, too.
bool is_nested_too_deep(std::string_view json);

}  // namespace trocar
