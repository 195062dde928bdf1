// What a run on a hard case records: counted against lists made by hand, never against another method.
#include <gtest/gtest.h>

#include <fstream>

#include "method/registry.hpp"
#include "simulate/external_runs.hpp"
#include "simulate/hard_case.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

const std::filesystem::path folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "hard";

RunSpec asked(const std::string& detector) {
    RunSpec spec;
    spec.mode = "hard_case";
    spec.detector = detector;
    return spec;
}

HardCase case_named(const std::string& name) { return read_hard_case(folder / name / "expected.json"); }

TEST(HardCaseRun, CountsAgainstTheCasesOwnList) {
    HardCase one = case_named("needle_through_one_face");
    const Record right = run_hard_case(one, asked("brute_force"));
    EXPECT_TRUE(right.outcome.ok());
    EXPECT_EQ(right.summary.at(Metric::true_pairs), 3.0);
    EXPECT_EQ(right.summary.at(Metric::false_negatives), 0.0);
    EXPECT_EQ(right.summary.at(Metric::false_positives), 0.0);
    // With a wrong list the same answer is one pair short and two too many.
    one.pairs = {{{3, 0}}};
    const Record wrong = run_hard_case(one, asked("brute_force"));
    EXPECT_EQ(wrong.summary.at(Metric::false_negatives), 1.0);
    EXPECT_EQ(wrong.summary.at(Metric::false_positives), 3.0);
}

TEST(HardCaseRun, AFrameThatIsNoNumberIsReported) {
    EXPECT_EQ(run_hard_case(case_named("nan_in_a_frame"), asked("brute_force")).outcome.kind, OutcomeKind::not_finite);
}

TEST(HardCaseRun, AFamilyCountsItsLines) {
    const test::TemporaryFolder temporary;
    const std::filesystem::path file = temporary.path() / "pairs.txt";
    // The unit triangle in z = 0 against one that crosses it, one above it, and the first again with the wrong truth.
    std::ofstream(file) << "0 0 0 1 0 0 0 1 0  0.2 0.2 -1 0.2 0.2 1 2 0.2 0  1 transversal\n"
                           "0 0 0 1 0 0 0 1 0  0 0 1 1 0 1 0 1 1  0 disjoint\n"
                           "0 0 0 1 0 0 0 1 0  0.2 0.2 -1 0.2 0.2 1 2 0.2 0  0 disjoint\n"
                           "0 0 0 1 0 0 0 1 0  0 0 1 1 0 1 0 1 1  1 transversal\n";
    const Record record = run_pair_family(file, asked("brute_force"));
    EXPECT_TRUE(record.outcome.ok());
    EXPECT_EQ(record.summary.at(Metric::judged_ticks), 4.0);
    EXPECT_EQ(record.summary.at(Metric::true_pairs), 2.0);
    EXPECT_EQ(record.summary.at(Metric::false_negatives), 1.0);
    EXPECT_EQ(record.summary.at(Metric::false_positives), 1.0);
}

}  // namespace
}  // namespace trocar
