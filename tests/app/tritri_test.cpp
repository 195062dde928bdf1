#include <gtest/gtest.h>

#include "support/commands.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::ProgramResult;
using test::run_program;

const std::string face = "0 0 0 4 0 0 0 4 0";
const std::string stabbing = "1 1 -1 1 1 1 2 2 1";
const std::string above = "1 1 1 1 2 2 2 1 2";
const std::string touching = "1 1 0 1 2 2 2 1 2";

class Tritri : public testing::Test {
protected:
    std::string words(const std::string& text, const std::string& options = "") {
        return "tritri " + folder_.write("pairs.txt", text).string() + " " + options;
    }
    ProgramResult run(const std::string& text, const std::string& options = "") {
        return run_program(words(text, options));
    }

private:
    test::TemporaryFolder folder_;
};

TEST_F(Tritri, PrintsOneVerdictPerPairInFileOrder) {
    const std::string pairs = face + " " + stabbing + "\n" + face + " " + above + "\r\n\n" + face + " " + touching;
    const ProgramResult text = run(pairs);
    EXPECT_EQ(text.status, 0);
    EXPECT_EQ(text.out, "1\n0\n1\n");
    for (const std::string name : {"exact", "interval", "moller"}) {
        const nlohmann::json json = test::json_of(words(pairs, "--json --test " + name));
        EXPECT_EQ(json.at("verdicts"), nlohmann::json({1, 0, 1})) << name;
    }
}

TEST_F(Tritri, LineOfMillionsOfWordsIsRefusedAfterTheFirst) {
    std::string ones;
    for (int i = 0; i < 1'000'000; ++i) ones += "1 ";
    test::expect_refused(words(ones),
                         "line 1: expected 18 numbers, then optionally truth and class, got more than 20 words");
}

TEST_F(Tritri, HoldsVerdictsAgainstTruthPerClass) {
    const ProgramResult right = run(face + " " + stabbing + " 1 transversal\n" + face + " " + above + " 0 disjoint\n" +
                                        face + " " + touching + " 1 touch-vertex\n" + face + " " + above + " 0\n",
                                    "--json");
    EXPECT_EQ(right.status, 0);
    const nlohmann::json confusion = nlohmann::json::parse(right.out).at("confusion");
    EXPECT_EQ(confusion.size(), 4U);
    EXPECT_EQ(confusion.at("transversal").at("true_positive"), 1);
    EXPECT_EQ(confusion.at("disjoint").at("true_negative"), 1);
    EXPECT_EQ(confusion.at("touch-vertex").at("true_positive"), 1);
    EXPECT_EQ(confusion.at("no-class").at("pairs"), 1);
}

TEST_F(Tritri, EndsWithStatusOneOnlyWhereExactnessIsClaimed) {
    const std::string wrong = face + " " + stabbing + " 0 disjoint\n" + face + " " + above + " 1 transversal\n";
    const ProgramResult exact = run(wrong, "--json");
    EXPECT_EQ(exact.status, 1);
    const nlohmann::json document = nlohmann::json::parse(exact.out);
    EXPECT_EQ(document.at("confusion").at("disjoint").at("false_positive"), 1);
    EXPECT_EQ(document.at("confusion").at("transversal").at("false_negative"), 1);
    EXPECT_EQ(document.at("wrong_lines"), nlohmann::json({1, 2}));
    EXPECT_NE(exact.err.find("2 lines: 1 2"), std::string::npos) << exact.err;
    EXPECT_EQ(run(wrong, "--test interval").status, 0);
    EXPECT_EQ(run(wrong, "--test moller").status, 0);
    EXPECT_EQ(run(face + " " + stabbing + " 1 touch-edge\n").status, 1);
}

TEST_F(Tritri, NamesTheLineOfBadInput) {
    const std::string good = face + " " + stabbing + "\n";
    const struct {
        std::string line;
        std::string expectation;
    } cases[] = {
        {face, "line 2: expected 18 numbers"},
        {face + " " + stabbing + " 1 disjoint 7", "line 2: expected 18 numbers"},
        {"nan 0 0 4 0 0 0 4 0 " + above, "word 1, got 'nan'"},
        {face + " 1 1 1 1 2 2 2 1 1e999", "word 18, got '1e999'"},
        {face + " 1 1 1 1 2 2 2 1 2x", "word 18, got '2x'"},
        {face + " " + above + " 2", "expected 0 or 1 as truth, got '2'"},
        {face + " " + above + " 0 apart", "got 'apart'"},
    };
    for (const auto& bad : cases) {
        const std::string line = test::expect_refused(words(good + bad.line + "\n"), bad.expectation);
        test::expect_holds(line, {"pairs.txt: line 2: "});
    }
    EXPECT_EQ(run_program("tritri does/not/exist").status, 2);
    EXPECT_EQ(run(good, "--test sometimes").status, 2);
}

TEST_F(Tritri, ReadsNumbersToTheLastBit) {
    // 0.1 + 0.2 = 0.30000000000000004: the tip is one rounding unit above or on the face at z = 0.3.
    const std::string high_face = "0 0 0.29999999999999999 4 0 0.29999999999999999 0 4 0.29999999999999999 ";
    EXPECT_EQ(run(high_face + "1 1 0.30000000000000004 1 2 2 2 1 2").out, "0\n");
    EXPECT_EQ(run(high_face + "1 1 0.3 1 2 2 2 1 2").out, "1\n");
    EXPECT_EQ(run("0 0 0 4 0 0 0 4 0 1 1 4.9406564584124654e-324 1 2 2 2 1 2").out, "0\n");
    EXPECT_EQ(run("+0 0 0 4 0 0 0 4 0 1 1 1e-999 1 2 2 2 1 2").out, "1\n");
}

}  // namespace
}  // namespace trocar
