// `trocar explain` as a user meets it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "method/registry.hpp"
#include "support/program.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;
using test::run_program;

class ExplainCommand : public testing::Test {
protected:
    void SetUp() override {
        scene_ = (folder_.path() / "poke.json").string();
        std::ofstream(scene_) << test::poke_text();
    }
    test::TemporaryFolder folder_;
    std::string scene_;
};

TEST_F(ExplainCommand, AllDetectorsAnswerOnTheVeryFrameOfTheRun) {
    const test::ProgramResult result = run_program("explain " + scene_ + " --tick 38 --json");
    ASSERT_EQ(result.status, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json.at("tick"), 38);
    const Json run = Json::parse(
        run_program("run " + scene_ + " --ticks 39 --json --detector ohc --response thesis:profile=faithful").out);
    const auto pairs = run.at("rows").at(38).at("pairs").get<std::size_t>();
    ASSERT_GT(pairs, 0U);
    EXPECT_EQ(json.at("truth").at("pairs").size(), pairs);
    const auto& registered = registry().detectors();
    const auto methods =
        std::count_if(registered.begin(), registered.end(), [](const DetectorEntry& entry) { return !entry.control; });
    ASSERT_EQ(static_cast<std::ptrdiff_t>(json.at("detectors").size()), methods);
    for (const Json& answer : json.at("detectors")) {
        if (!registry().detector(answer.at("name").get<std::string>()).claims_exact) continue;
        EXPECT_EQ(answer.at("pairs"), pairs) << answer;
        EXPECT_TRUE(answer.at("false_negatives").empty());
        EXPECT_TRUE(answer.at("false_positives").empty());
    }
}

TEST_F(ExplainCommand, OnePairIsReportedInFullInTheNumbersOfTheFiles) {
    const Json all = Json::parse(run_program("explain " + scene_ + " --tick 38 --json").out);
    const Json& first = all.at("truth").at("pairs").at(0);
    const std::string option = first.at("bodies").at(0).get<std::string>() + ":" + first.at("triangles").at(0).dump() +
                               "," + first.at("bodies").at(1).get<std::string>() + ":" +
                               first.at("triangles").at(1).dump();
    const test::ProgramResult result = run_program("explain " + scene_ + " --tick 38 --json --pair " + option);
    ASSERT_EQ(result.status, 0) << result.err;
    const Json json = Json::parse(result.out);
    ASSERT_EQ(json.at("examined").size(), 1U);
    const Json& pair = json.at("examined").at(0);
    EXPECT_EQ(pair.at("bodies"), first.at("bodies"));
    EXPECT_EQ(pair.at("triangles"), first.at("triangles"));
    EXPECT_NE(pair.at("truth").at("class"), "disjoint");
    EXPECT_TRUE(pair.at("intersection").contains("depth"));
    // Plain numbers mean the bodies in the order of the scene.
    const std::string plain = first.at("triangles").at(0).dump() + "," + first.at("triangles").at(1).dump();
    EXPECT_EQ(Json::parse(run_program("explain " + scene_ + " --tick 38 --json --pair " + plain).out).at("examined"),
              json.at("examined"));
    const test::ProgramResult text = run_program("explain " + scene_ + " --tick 38 --pair " + option);
    for (const char* word : {"truth", "intersection", "overlap", "reports the pair"}) {
        EXPECT_NE(text.out.find(word), std::string::npos) << word << '\n' << text.out;
    }
}

TEST_F(ExplainCommand, BadRequestsEndWithTwo) {
    for (const char* arguments :
         {" --tick 60", " --tick -1", " --tick 3 --pair 1", " --tick 3 --pair a,b", " --tick 3 --pair 1,99999999",
          " --tick 3 --pair ghost:1,sheet:1", " --tick 3 --response no_such_method"}) {
        const test::ProgramResult result = run_program("explain " + scene_ + arguments);
        EXPECT_EQ(result.status, 2) << arguments << result.out;
        EXPECT_EQ(result.out, "") << arguments;
    }
}

}  // namespace
}  // namespace trocar
