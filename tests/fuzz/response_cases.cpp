#include <charconv>
#include <cstdint>

#include "app/commands.hpp"
#include "fuzz_target.hpp"

namespace {

/// True when a case gives `key` more than `most`.
bool asks_for_more(std::string_view cases, std::string_view key, std::uint64_t most) {
    for (std::size_t at = cases.find(key); at != std::string_view::npos; at = cases.find(key, at + 1)) {
        const std::size_t begin = cases.find_first_not_of(": \t\r\n", at + key.size());
        if (begin == std::string_view::npos) return false;
        std::uint64_t value = 0;
        const auto end = std::from_chars(cases.data() + begin, cases.data() + cases.size(), value);
        if (end.ec == std::errc::result_out_of_range || (end.ec == std::errc() && value > most)) return true;
    }
    return false;
}

/// Steps, and masses of a chain: valid, and no use in a test that wants thousands of inputs a second.
bool would_take_long(std::string_view cases) {
    return asks_for_more(cases, "\"steps\"", 99'999) || asks_for_more(cases, "\"N\"", 250);
}

}  // namespace

void trocar::fuzz::response_cases(std::string_view input) {
    if (would_take_long(input)) return;
    const std::filesystem::path file = as_file(input, "cases.json");
    taken([&] {
        const int status = status_with_json([&] { return app::respond({.json = true}, {.file = file}); });
        expect(status == app::done || status == app::comparison_failed, "respond ends with status 0 or 1");
    });
}
