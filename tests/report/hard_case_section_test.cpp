// Every word of the hard-case matrix and of the metamorphic test, from records made by hand.
#include <gtest/gtest.h>

#include <algorithm>

#include "report/report.hpp"
#include "support/program.hpp"
#include "support/text.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

Record hard_case(const std::string& name, const std::string& detector, OutcomeKind kind = OutcomeKind::ok,
                 double missing = 0.0, double extra = 0.0) {
    Record record = test::synthetic({.mode = "replay", .scene = name, .detector = detector, .ticks = 1});
    record.spec.mode = "hard_case";
    record.rows.clear();
    record.outcome = {kind, ""};
    record.summary = {{Metric::true_pairs, 2.0},
                      {Metric::judged_ticks, 1.0},
                      {Metric::false_negatives, missing},
                      {Metric::false_positives, extra}};
    record.environment["case.of"] = "made up";
    record.environment["case.reason"] = "because";
    record.environment["case.outcome"] = "ok";
    record.environment["case.expected"] = "2 pairs";
    return record;
}

std::string page_of(const std::vector<Record>& records) { return test::whole(make_report(records)); }

TEST(HardCaseSection, EveryAnswerHasItsWord) {
    const std::string page =
        page_of({hard_case("one", "a"), hard_case("one", "b", OutcomeKind::ok, 1.0, 2.0),
                 hard_case("one", "c", OutcomeKind::not_finite), hard_case("one", "d", OutcomeKind::threw),
                 hard_case("one", "e", OutcomeKind::timed_out), hard_case("one", "f", OutcomeKind::crashed),
                 hard_case("one", "g", OutcomeKind::absent)});
    test::expect_holds(page, {"| made up: `one` | 2 pairs | ok | FN 1, FP 2 | NaN | throw | time-out | crash |\n",
                              "| all: right |  | 1 of 1 | 0 of 1 | 0 of 1 | 0 of 1 | 0 of 1 | 0 of 1 |",
                              "Absent from this build: `g`."});
    EXPECT_EQ(page.find("Failed runs"), std::string::npos);
}

TEST(HardCaseSection, OurOwnMethodsStandFirst) {
    Record theirs = hard_case("one", "a");
    theirs.environment["detector.own"] = "no";
    test::expect_holds(page_of({theirs, hard_case("one", "z")}), {"| case | right answer | `z` | `a` |"});
}

TEST(HardCaseSection, WhereAFailureIsTheRightAnswerSilenceIsWrong) {
    Record reported = hard_case("nan", "a", OutcomeKind::not_finite);
    Record silent = hard_case("nan", "b");
    Record other = hard_case("nan", "c", OutcomeKind::crashed);
    for (Record* record : {&reported, &silent, &other}) record->environment["case.outcome"] = "not_finite";
    test::expect_holds(page_of({reported, silent, other}), {"| reported as not_finite | ok | not reported | crash |"});
}

TEST(HardCaseSection, ABrokenBoundIsReportedWithItsFigure) {
    std::vector<Record> records{hard_case("stab", "a"), hard_case("stab", "a"), hard_case("stab", "a")};
    const double left[] = {1e-4, 2.5e-4, std::nan("")};
    for (std::size_t k = 0; k < 3; ++k) {
        records[k].spec.response = "r" + std::to_string(k);
        records[k].summary[Metric::residual_penetration_max_m] = left[k];
        records[k].environment["case.at_most.residual_penetration_max_m"] = "0.0001";
    }
    test::expect_holds(page_of(records),
                       {"| residual penetration max m ≤ 0.100 mm | ok | residual penetration max m 0.250 mm | "
                        "residual penetration max m n/a |"});
}

TEST(HardCaseSection, PageOneCountsCasesByTheirFirstFaultAndPutsMethodsThatCountAlikeIntoOneRow) {
    Record second_process = hard_case("one", "a", OutcomeKind::crashed);
    second_process.spec.repetition = 1;
    Record moving = hard_case("stab", "a");
    moving.spec.response = "r";
    const std::vector<Record> records{hard_case("one", "a"),
                                      hard_case("two", "a"),
                                      hard_case("one", "b", OutcomeKind::ok, 1.0, 2.0),
                                      hard_case("two", "b"),
                                      hard_case("one", "c", OutcomeKind::not_finite),
                                      hard_case("two", "c", OutcomeKind::ok, 0.0, 1.0),
                                      hard_case("one", "d", OutcomeKind::threw),
                                      hard_case("two", "d", OutcomeKind::crashed),
                                      hard_case("one", "e", OutcomeKind::crashed),
                                      hard_case("two", "e", OutcomeKind::threw),
                                      hard_case("one", "f", OutcomeKind::timed_out),
                                      hard_case("two", "f"),
                                      hard_case("one", "g", OutcomeKind::absent),
                                      second_process,
                                      moving};
    const std::string page = make_report(records).files.at("report.md");
    test::expect_holds(page, {"> Hard cases answered rightly: all by `a`, `r`; `b` 1 of 2, `c` 0 of 2, `d` 0 of 2, `e` "
                              "0 of 2, `f` 1 of 2.\n"});
    std::vector<std::size_t> places;
    for (const char* row : {"| detector | right of N | FN | FP | NaN | crash, throw | other fault |\n",
                            "| `a` | 2 of 2 | 0 | 0 | 0 | 0 | 0 |\n", "| `b` | 1 of 2 | 1 | 0 | 0 | 0 | 0 |\n",
                            "| `c` | 0 of 2 | 0 | 1 | 1 | 0 | 0 |\n"}) {
        places.push_back(page.find(row));
        EXPECT_NE(places.back(), std::string::npos) << row << page;
    }
    EXPECT_TRUE(std::is_sorted(places.begin(), places.end())) << "those that are right more often stand first";
    test::expect_holds(page, {"| `f` | 1 of 2 | 0 | 0 | 0 | 0 | 1 |\n", "| `d`, `e` | 0 of 2 | 0 | 0 | 0 | 2 | 0 |\n"});
    EXPECT_EQ(page.find("| `g` |"), std::string::npos) << "nobody could ask it";
    EXPECT_NE(page.find("| response | right of N |\n"), std::string::npos) << "no column of faults that nobody has";
    EXPECT_NE(page.find("| `r` | 1 of 1 |\n"), std::string::npos) << page;
}

TEST(HardCaseSection, EveryTableStandsUnderItsNameWithTheCasesThatAreItsOwn) {
    Record family = hard_case("pairs.txt", "a");
    family.environment.erase("case.of");
    family.environment.erase("case.expected");
    family.summary[Metric::judged_ticks] = 5.0;
    Record moving = hard_case("stab", "a");
    moving.spec.response = "r";
    const std::string page = page_of({hard_case("one", "a"), family, moving});
    for (const char* table :
         {"**Detectors on meshes**\n\n| case | right answer | `a` |\n|---|---|---|\n| made up: `one` | 2 pairs | ok |\n"
          "| all: right |  | 1 of 1 |\n",
          "**Detectors on families of hard triangle pairs, truth from the files**\n\n| family | right answer | `a` |\n"
          "|---|---|---|\n| `pairs.txt` | 2 of 5 meet | ok |\n| all: right |  | 1 of 1 |\n",
          "**Responses on scenes**\n\n| case | right answer | `r` |\n|---|---|---|\n"
          "| made up: `stab` | 2 pairs | ok |\n| all: right |  | 1 of 1 |\n",
          "**Why the right answers are right**\n\n| case | reason |\n|---|---|\n| `one` | because |\n"
          "| `stab` | because |\n"}) {
        EXPECT_NE(page.find(table), std::string::npos) << table << page;
    }
}

Record metamorphic(const std::string& detector, const std::string& response, std::int64_t repetition,
                   const std::string& hash) {
    Record record = hard_case("scene", detector);
    record.spec.mode = "metamorphic";
    record.spec.response = response;
    record.spec.repetition = repetition;
    record.state_hash = hash;
    record.summary = {{Metric::metamorphic_pairs, 50.0}};
    return record;
}

TEST(MetamorphicSection, ReportsYesHowFarOffAndNotApplicable) {
    std::vector<Record> records;
    for (const std::int64_t repetition : {0, 1}) {
        Record good = metamorphic("good", "", repetition, "aa");
        good.summary[Metric::metamorphic_twice_pairs] = 0.0;
        Record bad = metamorphic("bad", "", repetition, repetition == 0 ? "aa" : "bb");
        bad.summary[Metric::metamorphic_twice_pairs] = 3.0;
        Record near = metamorphic("good", "proximity", repetition, "cc");
        near.summary[Metric::metamorphic_twice_m] = 2e-12;
        near.summary[Metric::metamorphic_twice_n] = 3e-10;
        Record far = metamorphic("good", "wide", repetition, "dd");
        far.summary[Metric::metamorphic_twice_m] = 2e-3;
        far.summary[Metric::metamorphic_twice_n] = 0.5;
        Record farther = metamorphic("good", "farther", repetition, "ee");
        farther.summary[Metric::metamorphic_twice_m] = 1.5e-9;
        farther.summary[Metric::metamorphic_twice_n] = 0.5e-6;
        Record stronger = metamorphic("good", "stronger", repetition, "ff");
        stronger.summary[Metric::metamorphic_twice_m] = 0.5e-9;
        stronger.summary[Metric::metamorphic_twice_n] = 1.5e-6;
        records.insert(records.end(), {good, bad, near, far, farther, stronger});
    }
    test::expect_holds(page_of(records),
                       {"| detector | `good` | scene | yes | yes | n/a |",
                        "| detector | `bad` | scene | no (3 of 50 pairs) | no | n/a |",
                        "| response | `proximity` | scene | yes, to 2.0e-09 mm, 3.0e-10 N | yes |",
                        "| response | `wide` | scene | no (2.0e+00 mm, 5.0e-01 N, scene) | yes |",
                        "| response | `farther` | scene | no (1.5e-06 mm, 5.0e-07 N, scene) | yes |",
                        "| response | `stronger` | scene | no (5.0e-07 mm, 1.5e-06 N, scene) | yes |"});
}

}  // namespace
}  // namespace trocar
