// JSON of a detector's result on one frame, shared by `detect` and `replay`.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "contact/contact.hpp"
#include "measure/pair_truth.hpp"

namespace trocar::app {

struct PairAnswer {
    std::span<const TrianglePair> pairs;
    Index first_of_b = 0;          ///< subtracted from the second triangle number
    std::span<const Index> touch;  ///< positions in `pairs`
    std::optional<PairErrors> errors;
    std::optional<std::int64_t> update_ns;
    std::optional<std::int64_t> detect_ns;
};

/// Appends "pairs":[…],"touch":[…],"missing":…,"extra":…,"update_ns":…,"detect_ns":… without braces; null when absent.
void append_json(const PairAnswer& answer, fmt::memory_buffer& text);

/// JSON string with quotes; invalid UTF-8 bytes are replaced.
std::string quoted_json(const std::string& text);

}  // namespace trocar::app
