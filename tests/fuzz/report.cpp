// `trocar report`, `trocar table` with `--sqlite` too and `trocar report --against` on records that nobody wrote: a
// line each. A first line that is no record stands for worst_tick.json.
#include "report/report.hpp"

#include "fuzz_target.hpp"
#include "report/regression.hpp"
#include "report/run_database.hpp"
#include "report/table_choice.hpp"

void trocar::fuzz::report(std::string_view input) {
    std::vector<Record> records;
    std::string worst_tick;
    for (std::int64_t line = 1; !input.empty(); ++line) {
        const std::string text(input.substr(0, input.find('\n')));
        input.remove_prefix(std::min(text.size() + 1, input.size()));
        Record record;
        if (taken([&] { record = record_from_json_line(text, "input", line); })) {
            records.push_back(std::move(record));
        } else if (line == 1) {
            worst_tick = text;
        }
    }
    if (records.empty()) return;
    // Most of a report compares: a method that is alone gets a baseline.
    Record baseline = records.front();
    baseline.spec.response = "another";
    records.push_back(std::move(baseline));

    Report made;
    if (!taken([&] { made = make_report(records, worst_tick); })) return;
    for (const auto& [name, content] : made.files) {
        expect(!content.empty(), "no file of a report is empty");
        if (!name.ends_with(".svg")) continue;
        expect(content.find("=\"nan") == std::string::npos && content.find("=\"inf") == std::string::npos &&
                   content.find("=\"-inf") == std::string::npos,
               "a drawing has numbers for places");
    }
    taken([&] {
        const ChosenTable table = choose_table(records, {});
        expect(!table_as_markdown(table).empty() && !table_as_latex(table).empty() && !table_as_csv(table).empty(),
               "a table has heads");
    });
    // Nothing is written there.
    taken([&] { write_run_database(records, "/dev/null"); });
    taken([&] {
        // Nothing at all is compared where nothing was measured in a first process.
        const StudyComparison same = compare_studies(records, records, 0.0);
        expect(same.missing.empty() && same.extra.empty() && same.stale.empty() && same.changes.empty(),
               "records are what they are");
    });
}
