#include "contact/outcome.hpp"

#include <array>

#include "geometry/input_error.hpp"

namespace trocar {
namespace {
constexpr std::array<std::string_view, 8> names{"ok",         "absent",   "unsupported", "threw",
                                                "not_finite", "unstable", "timed_out",   "crashed"};
}

std::string_view name_of(OutcomeKind kind) { return names[static_cast<std::size_t>(kind)]; }

OutcomeKind outcome_kind_from(std::string_view name) {
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i] == name) return static_cast<OutcomeKind>(i);
    }
    throw InputError("outcome", "", "one of ok, absent, unsupported, threw, not_finite, unstable, timed_out, crashed",
                     "'" + std::string(name) + "'");
}

}  // namespace trocar
