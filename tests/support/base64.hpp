// A strict reader of base64, without any code of src.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace trocar::test {

inline std::string from_base64(const std::string& text) {
    if (text.size() % 4 != 0) throw std::runtime_error("base64 that is no multiple of four");
    std::string bytes;
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < text.size(); i += 4) {
        std::uint32_t three = 0;
        std::size_t filled = 0;
        for (std::size_t j = 0; j < 4; ++j) {
            const std::size_t digit = digits.find(text[i + j]);
            if (digit == std::string::npos && (text[i + j] != '=' || i + 4 != text.size())) {
                throw std::runtime_error("no base64");
            }
            three = three * 64 + (digit == std::string::npos ? 0 : static_cast<std::uint32_t>(digit));
            filled += digit == std::string::npos ? 0 : 1;
        }
        for (std::size_t j = 0; j + 1 < filled; ++j) bytes += static_cast<char>(three >> (16 - 8 * j) & 0xffU);
    }
    return bytes;
}

}  // namespace trocar::test
