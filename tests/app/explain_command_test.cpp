// `trocar explain` as a user meets it.
#include <gtest/gtest.h>

#include "method/registry.hpp"
#include "support/commands.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;
using test::json_of;

class ExplainCommand : public testing::Test {
protected:
    test::TemporaryFolder folder_;
    const std::string scene_ = folder_.write("poke.json", test::poke_text()).string();
};

TEST_F(ExplainCommand, AllDetectorsAnswerOnTheVeryFrameOfTheRun) {
    const Json json = json_of("explain " + scene_ + " --tick 38 --json");
    EXPECT_EQ(json.at("tick"), 38);
    const Json run = json_of("run " + scene_ + " --ticks 39 --json --detector ohc --response thesis:profile=faithful");
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
    const Json all = json_of("explain " + scene_ + " --tick 38 --json");
    const Json& first = all.at("truth").at("pairs").at(0);
    const std::string option = first.at("bodies").at(0).get<std::string>() + ":" + first.at("triangles").at(0).dump() +
                               "," + first.at("bodies").at(1).get<std::string>() + ":" +
                               first.at("triangles").at(1).dump();
    const Json json = json_of("explain " + scene_ + " --tick 38 --json --pair " + option);
    ASSERT_EQ(json.at("examined").size(), 1U);
    const Json& pair = json.at("examined").at(0);
    EXPECT_EQ(pair.at("bodies"), first.at("bodies"));
    EXPECT_EQ(pair.at("triangles"), first.at("triangles"));
    EXPECT_NE(pair.at("truth").at("class"), "disjoint");
    EXPECT_TRUE(pair.at("intersection").contains("depth"));
    // Plain numbers mean the bodies in the order of the scene.
    const std::string plain = first.at("triangles").at(0).dump() + "," + first.at("triangles").at(1).dump();
    EXPECT_EQ(json_of("explain " + scene_ + " --tick 38 --json --pair " + plain).at("examined"), json.at("examined"));
    EXPECT_EQ(test::run_program("explain " + scene_ + " --tick 38 --pair " + option).status, 0) << "as text";
}

TEST_F(ExplainCommand, BadRequestsEndWithTwo) {
    for (const char* arguments :
         {" --tick 60", " --tick -1", " --tick 3 --pair 1", " --tick 3 --pair a,b", " --tick 3 --pair 1,99999999",
          " --tick 3 --pair ghost:1,sheet:1", " --tick 3 --response no_such_method"}) {
        test::expect_refused("explain " + scene_ + arguments);
    }
}

}  // namespace
}  // namespace trocar
