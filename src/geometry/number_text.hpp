// Whether a text is a number, asked in one way by all who are given numbers in texts.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace trocar {

/// The number that the whole text is, in the words of std::from_chars: no blanks, no leading +, "inf" and "nan" for a
/// double. Nothing where it is none or one that the type cannot hold.
template <typename Number>
std::optional<Number> number_of_text(std::string_view text) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

}  // namespace trocar
