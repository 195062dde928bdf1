// The page of external truth: who missed and invented what, ratios of times, and what could not run.
#include <gtest/gtest.h>

#include <string>

#include "report/report.hpp"
#include "report/sections.hpp"
#include "support/text.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

Record external(const std::string& format, const std::string& scene, const std::string& detector, bool own) {
    Record record = test::synthetic(
        {.mode = "external", .scene = scene, .detector = detector, .response = "", .contacts = "", .own = own});
    record.environment["case.format"] = format;
    record.environment["case.path"] = "external/" + scene;
    record.environment["case.source"] = "Somebody 2023";
    record.environment["case.licence"] = "MIT";
    record.environment["case.reference"] = "theirs";
    return record;
}

/// Missed and invented beginnings of 10 on a scene, with a median time.
Record begun(const std::string& scene, const std::string& detector, double missed, double invented, double time) {
    Record record = external("scalable_ccd", scene, detector, detector == "mine");
    record.summary[Metric::true_swept] = 10.0;
    record.summary[Metric::swept_false_negatives] = missed;
    record.summary[Metric::swept_false_positives] = invented;
    record.summary[Metric::total_median_ns] = time;
    return record;
}

TEST(ExternalSection, CountsErrorsOverScenesAndTakesRatiosPerScene) {
    const std::vector<Record> all{begun("roll", "theirs", 3, 0, 200), begun("fall", "theirs", 0, 1, 400),
                                  begun("roll", "mine", 0, 0, 100), begun("fall", "mine", 0, 0, 100)};
    const Draft draft(all);
    const std::vector<Table> tables = external_tables(draft);
    ASSERT_EQ(tables.size(), 1U);
    const Table& table = tables.front();
    ASSERT_EQ(table.rows.size(), 2U);
    EXPECT_EQ(table.columns[1].header, "missed of N beginnings");
    EXPECT_EQ(table.columns[4].header, "time ratio, fall");
    EXPECT_EQ(table.rows[0].cells,
              (std::vector<std::string>{"`mine`", "0 of 20", "0", "2 of 2", "0.250", "0.500", "0"}));
    EXPECT_EQ(table.rows[1].cells,
              (std::vector<std::string>{"`theirs`", "3 of 20", "1", "0 of 2", "1.00", "1.00", "0"}));
    const std::string page = make_report(all).files.at("report.md");
    test::expect_holds(page, {"Contacts that begin between two frames (20 beginnings): without an error `mine`.",
                              "Source: Somebody 2023. Licence: MIT. Command: `TROCAR_DATA=FOLDER trocar study"});
}

TEST(ExternalSection, FailedPairsAreCountedAndBringARowToTheEnd) {
    std::vector<Record> all;
    for (const auto& [detector, missed, failed] :
         {std::tuple<std::string, double, double>{"theirs", 0.0, 2.0}, {"mine", 5.0, 0.0}}) {
        Record record = external("triangle_pairs", "random", detector, detector == "mine");
        record.summary[Metric::true_pairs] = 30.0;
        record.summary[Metric::false_negatives] = missed;
        record.summary[Metric::false_positives] = 0.0;
        record.summary[Metric::failed_ticks] = failed;
        if (failed > 0.0) record.outcome = {OutcomeKind::threw, "no"};
        all.push_back(std::move(record));
    }
    const Draft draft(all);
    const Table table = external_tables(draft).at(0);
    EXPECT_EQ(table.rows[0].cells, (std::vector<std::string>{"`mine`", "5 of 30", "0", "0 of 1", "0"}));
    EXPECT_EQ(table.rows[1].cells, (std::vector<std::string>{"`theirs`", "0 of 30", "0", "0 of 1", "2"}));
}

TEST(ExternalSection, MissingDataIsSaidInOneLine) {
    Record record = external("fcl_scenario", "model", "mine", true);
    record.summary.clear();
    record.rows.clear();
    record.outcome = {OutcomeKind::unsupported, "no data"};
    const std::string page = make_report({record}).files.at("report.md");
    test::expect_holds(page, {"Licence: MIT.", "Skipped: no data folder (TROCAR_DATA) with `external/model`."});
    EXPECT_EQ(page.find("Time ratio"), std::string::npos) << "there is no table to read";
}

}  // namespace
}  // namespace trocar
