// Inline text helpers for document writers: splitting at `…` code marks, replacing substrings.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trocar {

/// Calls plain(text) and code(text) for the parts outside and inside of `…`.
template <typename Plain, typename Code>
std::string inline_parts(const std::string& text, Plain plain, Code code) {
    std::string result;
    std::size_t from = 0;
    bool in_code = false;
    while (true) {
        const std::size_t tick = text.find('`', from);
        const std::string part = text.substr(from, tick == std::string::npos ? tick : tick - from);
        result += in_code ? code(part) : plain(part);
        if (tick == std::string::npos) return result;
        in_code = !in_code;
        from = tick + 1;
    }
}

/// Removes the code marks.
inline std::string without_code(std::string text) {
    std::erase(text, '`');
    return text;
}

/// Replaces every first of `by` by its second; at each position the first match of the list applies.
std::string replace_each(const std::string& text, const std::vector<std::pair<std::string_view, std::string_view>>& by);

/// Link anchor of a heading: letters and digits, all else as single hyphens.
std::string anchor(const std::string& text);

}  // namespace trocar
