#include "app/commands.hpp"
#include "fuzz_target.hpp"

void trocar::fuzz::pairs(std::string_view input) {
    const std::filesystem::path file = as_file(input, "pairs.txt");
    for (const char* test : {"exact", "interval", "moller"}) {
        taken([&] {
            const int status =
                status_with_json([&] { return app::tritri({.json = true}, {.file = file, .test = test}); });
            expect(status == app::done || status == app::comparison_failed, "tritri ends with status 0 or 1");
        });
    }
}
