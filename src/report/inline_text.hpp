// What the writers of a document share: inline text, in which `…` marks code, taken apart, and letters replaced.
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

/// Without the marks of code.
inline std::string without_code(std::string text) {
    std::erase(text, '`');
    return text;
}

/// Every text of `by` replaced by the one beside it, the first that fits.
std::string replace_each(const std::string& text, const std::vector<std::pair<std::string_view, std::string_view>>& by);

/// The name under which a heading is linked to: letters and digits, the rest as single hyphens.
std::string anchor(const std::string& text);

}  // namespace trocar
