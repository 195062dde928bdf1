// Serializes numbers and texts from a child process to its parent, as raw bytes.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

namespace trocar::app {

template <typename Number>
void append(const Number& number, std::string& bytes) {
    std::array<char, sizeof(Number)> raw{};
    std::memcpy(raw.data(), &number, sizeof(Number));
    bytes.append(raw.data(), raw.size());
}

inline void append(const std::string& text, std::string& bytes) {
    append(static_cast<std::uint64_t>(text.size()), bytes);
    bytes += text;
}

/// Deserializes the output of append.
class AnswerBytes {
public:
    explicit AnswerBytes(const std::string& bytes) : rest_(bytes) {}
    template <typename Number>
    Number number() {
        Number value{};
        std::memcpy(&value, take(sizeof(Number)).data(), sizeof(Number));
        return value;
    }
    std::string text() { return std::string(take(number<std::uint64_t>())); }

private:
    std::string_view take(std::size_t count) {
        if (count > rest_.size()) throw std::runtime_error("a child's answer ends early");
        const std::string_view part = rest_.substr(0, count);
        rest_.remove_prefix(count);
        return part;
    }
    std::string_view rest_;
};

}  // namespace trocar::app
