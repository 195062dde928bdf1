#include <algorithm>

#include "app/commands.hpp"
#include "fuzz_target.hpp"

namespace {

/// True when a case asks for 100 000 steps or more: valid, and no use in a test that wants thousands of inputs a
/// second.
bool asks_for_many_steps(std::string_view cases) {
    constexpr std::string_view key = "\"steps\"";
    for (std::size_t at = cases.find(key); at != std::string_view::npos; at = cases.find(key, at + 1)) {
        const std::size_t begin = cases.find_first_not_of(": \t\r\n", at + key.size());
        if (begin == std::string_view::npos) return false;
        const std::size_t end = std::min(cases.find_first_not_of("0123456789", begin), cases.size());
        if (end - begin > 5) return true;
    }
    return false;
}

}  // namespace

void trocar::fuzz::response_cases(std::string_view input) {
    if (asks_for_many_steps(input)) return;
    const std::filesystem::path file = as_file(input, "cases.json");
    taken([&] {
        const int status = app::respond({.json = true}, {.file = file});
        expect(status == app::done || status == app::comparison_failed, "respond ends with status 0 or 1");
    });
}
