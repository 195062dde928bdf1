#include "app/commands.hpp"
#include "fuzz_target.hpp"

void trocar::fuzz::response_cases(std::string_view input) {
    const std::filesystem::path file = as_file(input, "cases.json");
    taken([&] {
        const int status = app::respond({.json = true}, {.file = file});
        expect(status == app::done || status == app::comparison_failed, "respond ends with status 0 or 1");
    });
}
