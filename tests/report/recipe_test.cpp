// The recipes of docs/RECIPES.md hold: their code compiles, and their files are read.
#include <gtest/gtest.h>

#include <filesystem>

#include "report/metric_table.hpp"
#include "report/sections.hpp"
#include "report/synthetic.hpp"
#include "study/study.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

// [a section]
void add_strain(Draft& draft) {
    const MetricTable strain{
        .caption = "Strain of the tissue",
        .mode = "closed_loop",
        .rows = MetricTable::Rows::motion,
        .columns = {{.header = "largest strain / above the limit",
                     .metric = Metric::max_strain,
                     .second = Metric::strain_over_max},
                    {.header = "tears", .metric = Metric::ruptures, .processes = Processes::every, .count = true},
                    {.header = "tick p50 (µs)",
                     .metric = Metric::total_median_ns,
                     .processes = Processes::interval,
                     .scale = us}}};
    draft.heading(2, "Strain");
    draft.add(table_of(draft, strain));
}
// [a section]

const std::filesystem::path root = TROCAR_SOURCE_DIR;

/// The text between the first two places of a marker behind `from`.
std::string between(const std::string& text, const std::string& from, const std::string& begin,
                    const std::string& end) {
    const std::size_t start = text.find(begin, text.find(from));
    if (start == std::string::npos) return {};
    const std::size_t first = start + begin.size();
    return text.substr(first, text.find(end, first) - first);
}

std::string recipes() { return test::read_file(root / "docs/RECIPES.md"); }

TEST(Recipes, ASectionIsThisFunction) {
    const std::string code = between(recipes(), "## A section", "```cpp\n", "```");
    EXPECT_FALSE(code.empty());
    EXPECT_EQ(code, between(test::read_file(root / "tests/report/recipe_test.cpp"), "", "// [a section]\n",
                            "// [a section]"));
}

TEST(Recipes, ASectionHoldsEveryRunAndOutcome) {
    std::vector<Record> records{
        test::synthetic({.scene = "a", .response = "good"}), test::synthetic({.scene = "a", .response = "good"}),
        test::synthetic({.scene = "a", .response = "late"}), test::synthetic({.scene = "b", .response = "good"})};
    records[1].spec.repetition = 1;
    records[0].summary[Metric::max_strain] = 0.25;
    records[0].summary[Metric::strain_over_max] = 0.125;
    records[0].summary[Metric::ruptures] = 2.0;
    records[1].summary[Metric::ruptures] = 3.0;
    records[2].outcome = {OutcomeKind::timed_out, "ended after the limit of 5 s"};
    records[3].summary[Metric::max_strain] = not_known;
    records[3].summary[Metric::strain_over_max] = not_known;
    Draft draft(records);
    add_strain(draft);
    const std::string markdown = to_markdown(draft.document);
    test::expect_holds(markdown,
                       {"## Strain", "| `mine + good (intersection)` | 0.250 / 0.125 | 3 |",
                        "timed_out (ended after the limit of 5 s)", "| n/a | 0 |", "Order: class, scene, method."});
}

TEST(Recipes, AMetricHasItsTwoLines) {
    const std::string entry = between(recipes(), "## A metric", "```\n   ", "\n");
    const std::string computation = between(recipes(), "2. Its computation", "```\n   ", "\n");
    EXPECT_FALSE(entry.empty() || computation.empty());
    EXPECT_NE(test::read_file(root / "src/measure/metrics.def").find(entry), std::string::npos) << entry;
    EXPECT_NE(test::read_file(root / "src/measure/metrics.cpp").find(computation), std::string::npos) << computation;
}

TEST(Recipes, AnExperimentHasTheRunsThatItSays) {
    test::TemporaryFolder folder;
    const std::string text = between(recipes(), "## An experiment", "```json\n", "```");
    std::vector<std::filesystem::path> shipped;
    for (const char* scene : {"i2t_poke.json", "i2t_stab.json"}) shipped.push_back(root / "scenes" / scene);
    EXPECT_EQ(make_plan(read_study(folder.write("study.json", text), {}, shipped)).size(), 2U * 2U * 3U);
}

}  // namespace
}  // namespace trocar
