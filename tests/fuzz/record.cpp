#include "measure/record.hpp"
#include "fuzz_target.hpp"

void trocar::fuzz::record(std::string_view input) {
    Record record;
    if (!taken([&] { record = record_from_json_line(std::string(input), "input", 1); })) return;
    const std::string line = to_json_line(record);
    Record again;
    expect(taken([&] { again = record_from_json_line(line, "written", 1); }), "what is written can be read");
    expect(to_json_line(again) == line, "a record reads back the same");
}
