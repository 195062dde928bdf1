// Random numbers that are equal with every standard library, and the multiplicative hash of tables.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace trocar {

/// 2^64 over the golden ratio, as an odd number: the step of splitmix64 and the factor of a multiplicative hash.
inline constexpr std::uint64_t golden_ratio = 0x9E3779B97F4A7C15ULL;

/// splitmix64 (Steele, Lea and Flood 2014). The distributions of the standard differ between libraries.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        state_ += golden_ratio;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
        return z ^ (z >> 31U);
    }
    /// 0 … count-1. Precondition: count > 0. The bias of the remainder is below 2^-40 for any count of ours.
    std::size_t below(std::size_t count) { return static_cast<std::size_t>(next() % count); }
    /// In [-1, 1).
    double signed_unit() { return static_cast<double>(next() >> 11U) * 0x1p-52 - 1.0; }
    /// Every order is as likely (Fisher and Yates).
    template <typename T>
    void shuffle(std::vector<T>& values) {
        for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[below(i)]);
    }

private:
    std::uint64_t state_;
};

/// Slot of a key in a table of 2^bits slots: the highest bits of the product (Knuth 1973, section 6.4). Precondition:
/// 0 < bits < 64.
inline std::size_t fibonacci_slot(std::uint64_t key, int bits) {
    return static_cast<std::size_t>((key * golden_ratio) >> (64 - bits));
}

}  // namespace trocar
