#include "study/study.hpp"

#include "fuzz_target.hpp"

void trocar::fuzz::study(std::string_view input) {
    const std::filesystem::path file = as_file(input, "bench/studies/study.json");
    taken([&] { static_cast<void>(reference_notes(read_study(file))); });
}
