// The 64-bit hash that identifies states, frames, scenes and stored results. It detects mistakes, not attacks.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace trocar {

/// FNV-1a of 64 bits (Fowler, Noll and Vo; IETF draft-eastlake-fnv).
class FnvHash {
public:
    /// Mixes in one octet; baselines and the bounded bench pass a whole word as one.
    void add(std::uint64_t octet) { value_ = (value_ ^ octet) * prime; }
    /// Mixes in eight octets, lowest first.
    void add_word(std::uint64_t word) {
        for (int shift = 0; shift < 64; shift += 8) add((word >> shift) & 0xffU);
    }
    void add_text(std::string_view bytes) {
        for (const char byte : bytes) add(static_cast<unsigned char>(byte));
    }
    [[nodiscard]] std::uint64_t value() const { return value_; }
    bool operator==(const FnvHash&) const = default;
    /// 16 hexadecimal digits.
    [[nodiscard]] std::string text() const { return fmt::format("{:016x}", value_); }

private:
    static constexpr std::uint64_t prime = 0x00000100000001b3ULL;
    std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace trocar
