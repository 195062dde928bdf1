#include "geometry/input_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace trocar {
namespace {

/// Length in bytes of the printable character at the start of text; 0 when there is none.
std::size_t printable_bytes(std::string_view text) {
    const auto byte = [text](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])); };
    const std::uint32_t first = byte(0);
    if (first < 0x80U) return first >= 0x20U && first != 0x7fU ? 1 : 0;
    const std::size_t size = first >= 0xf0U ? 4 : first >= 0xe0U ? 3 : 2;
    if (first < 0xc2U || first > 0xf4U || text.size() < size) return 0;
    std::uint32_t code = first & (0xffU >> (size + 1));
    for (std::size_t i = 1; i < size; ++i) {
        if ((byte(i) & 0xc0U) != 0x80U) return 0;
        code = code << 6U | (byte(i) & 0x3fU);
    }
    constexpr std::array<std::uint32_t, 5> least{0, 0, 0x80, 0x800, 0x10000};  // no longer form than needed
    const bool surrogate = code >= 0xd800U && code <= 0xdfffU;
    if (code < least.at(size) || code > 0x10ffffU || surrogate) return 0;
    // C1 controls, line and paragraph separators, and characters that change the direction of writing.
    const bool acts = code < 0xa0U || code == 0x61cU || (code >= 0x200eU && code <= 0x200fU) ||
                      (code >= 0x2028U && code <= 0x202eU) || (code >= 0x2066U && code <= 0x2069U);
    return acts ? 0 : size;
}

}  // namespace

std::string printable_line(std::string_view text, std::size_t longest) {
    std::string line;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t bytes = printable_bytes(text.substr(i));
        if (bytes == 0)
            line += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[i]));
        else
            line += text.substr(i, bytes);
        i += std::max<std::size_t>(bytes, 1);
    }
    if (line.size() <= longest) return line;
    constexpr std::string_view left_out = " [...] ";
    const auto inside = [&line](std::size_t at) {  // inside a character
        return (static_cast<unsigned char>(line[at]) & 0xc0U) == 0x80U;
    };
    const std::size_t kept = longest - left_out.size();
    std::size_t head = kept * 2 / 3;
    std::size_t tail = line.size() - (kept - head);
    while (head > 0 && inside(head)) --head;
    while (tail < line.size() && inside(tail)) ++tail;
    return line.substr(0, head).append(left_out).append(line, tail);
}

}  // namespace trocar
