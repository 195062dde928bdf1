// Parsing of numbers in texts, with one rule for all callers.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace trocar {

/// The number that the whole text represents, by the rules of std::from_chars: no blanks, no + in front, "inf" and
/// "nan" for a double. Empty for any other text and for numbers out of range.
template <typename Number>
std::optional<Number> number_of_text(std::string_view text) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

}  // namespace trocar
