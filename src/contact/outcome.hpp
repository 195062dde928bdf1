// Outcome of a method's call. A failure is recorded as data in every table; no exception crosses an interface.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace trocar {

enum class OutcomeKind : std::uint8_t { ok, absent, unsupported, threw, not_finite, unstable, timed_out, crashed };

/// The word used in every report and JSON document: "ok", "absent", …
std::string_view name_of(OutcomeKind kind);
/// Inverse of name_of; throws InputError for an unknown word.
OutcomeKind outcome_kind_from(std::string_view name);

struct Outcome {
    OutcomeKind kind = OutcomeKind::ok;
    std::string message;  ///< one sentence; empty when ok
    [[nodiscard]] bool ok() const { return kind == OutcomeKind::ok; }
};

}  // namespace trocar
