#include "geometry/size_limits.hpp"

#include <cstdlib>
#include <string_view>

namespace trocar {
namespace {

constexpr const char* variable = "TROCAR_LARGE";

}  // namespace

bool are_sizes_limited() {
    const char* const value = std::getenv(variable);
    return value == nullptr || std::string_view(value) != "1";
}

void lift_size_limits() { setenv(variable, "1", 1); }

std::string limit_text(std::int64_t most, const std::string& of_what) {
    return "at most " + std::to_string(most) + " " + of_what + " (--large lifts this)";
}

}  // namespace trocar
