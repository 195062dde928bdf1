// Texts as other formats want them, and names that are near a misspelt one.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace trocar {

/// Escapes the five XML entities.
std::string escape_xml(std::string_view text);

/// The text as one word of a POSIX shell's command line, in single quotes.
std::string shell_word(std::string_view text);

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// Up to `most` of `names`, nearest first by edit distance (Levenshtein); one that holds the word comes first. Names
/// that differ from the word in more than `part` of the longer one's letters, and in more than two, are left out.
std::vector<std::string> near_names(const std::string& word, const std::vector<std::string>& names, std::size_t most,
                                    double part = 1.0);

}  // namespace trocar
