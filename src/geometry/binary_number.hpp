// Numbers as bytes of a file, in either byte order.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace trocar {

struct BinaryType {
    std::size_t bytes = 8;  ///< 4 or 8 of a real number; 1, 2, 4 or 8 of a whole one
    char kind = 'f';        ///< 'f': real, 'i': signed, 'u': unsigned
};

/// `count` bytes, at most 8, as an unsigned number.
inline std::uint64_t word_of(const char* bytes, std::size_t count, bool big_endian) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
        value = value << 8U | static_cast<unsigned char>(bytes[big_endian ? i : count - 1 - i]);
    }
    return value;
}

/// Whole numbers beyond 2^53 are rounded.
inline double real_of(const char* bytes, BinaryType type, bool big_endian) {
    const std::uint64_t word = word_of(bytes, type.bytes, big_endian);
    if (type.kind == 'u') return static_cast<double>(word);
    if (type.kind == 'f') {
        return type.bytes == 4 ? double{std::bit_cast<float>(static_cast<std::uint32_t>(word))}
                               : std::bit_cast<double>(word);
    }
    const unsigned unused = 64U - 8U * static_cast<unsigned>(type.bytes);
    return static_cast<double>(static_cast<std::int64_t>(word << unused) >> unused);
}

}  // namespace trocar
