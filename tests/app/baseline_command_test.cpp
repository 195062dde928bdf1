#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "support/program.hpp"
#include "support/recordings.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;

/// Triangle a in z = 0; b apart from it in frame 0, 0.5 below it with one corner in frame 1.
test::RecordingText two_frames(double depth) {
    test::RecordingText text;
    text.header["frames"] = 2;
    text.positions.clear();
    for (const double low : {1.0, -depth}) {
        text.positions.insert(text.positions.end(), {0, 0, 0, 1, 0, 0, 0, 1, 0});
        text.positions.insert(text.positions.end(), {0.25, 0.25, low, 0.25, 0.25, 2, 0.5, 0.25, 2});
    }
    return text;
}

class Baseline : public testing::Test {
protected:
    [[nodiscard]] test::ProgramResult run(const std::string& what, const std::string& options) const {
        return test::run_program("baseline " + what + " " + (folder.path() / "frames.trocrec").string() + " " +
                                 options);
    }
    void put(const test::RecordingText& text) const {
        std::ofstream(folder.path() / "frames.trocrec", std::ios::binary) << text.bytes();
    }
    [[nodiscard]] std::string state(const test::ProgramResult& result) const {
        return Json::parse(result.out)["sources"][0]["detectors"][0]["state"];
    }
    test::TemporaryFolder folder;
};

TEST_F(Baseline, StoresTheContactThatTheCoordinatesTell) {
    put(two_frames(0.5));
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    const Json stored = Json::parse(test::read_file(folder.path() / "baseline" / "frames.json"));
    ASSERT_EQ(stored["contacts"][0].size(), 1U) << "frame 0 is free";
    const Json& contact = stored["contacts"][0]["1"][0];
    EXPECT_EQ(contact[0], 0);
    EXPECT_EQ(contact[1], 1);
    EXPECT_EQ(contact[9], 0.5) << "the corner is 0.5 below the plane";
    EXPECT_EQ(run("check", "--detector ohc").status, 0);
}

TEST_F(Baseline, AMissingStaleOrExtraOneFails) {
    put(two_frames(0.5));
    test::ProgramResult result = run("check", "--detector ohc --json");
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(state(result), "missing");
    ASSERT_EQ(run("write", "--detector ohc --detector brute_force").status, 0);
    EXPECT_EQ(run("check", "--detector brute_force").status, 0);
    put(two_frames(0.25));
    result = run("check", "--detector ohc --json");
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(state(result), "stale");
    const std::filesystem::path file = folder.path() / "baseline" / "frames.json";
    put(two_frames(0.5));
    Json stored = Json::parse(test::read_file(file));
    stored["detectors"]["departed"] = {{"outcome", "ok"}, {"contacts", 0}};
    std::ofstream(file) << stored;
    EXPECT_EQ(run("check", "--detector ohc").status, 0) << "only what was asked for";
    result = run("check", "--detector all");
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.out.find("departed"), std::string::npos);
}

TEST_F(Baseline, AChangedContactIsToldBeforeAndAfterAndOnlyWriteTakesItOver) {
    put(two_frames(0.5));
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    const std::filesystem::path file = folder.path() / "baseline" / "frames.json";
    Json stored = Json::parse(test::read_file(file));
    stored["contacts"][0]["1"][0][9] = 0.5001;
    std::ofstream(file) << stored;
    const std::string kept = test::read_file(file);
    const test::ProgramResult result = run("check", "--detector ohc");
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.out.find("depth 0.5001 m"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("-> b_enters_a depth 0.5 m"), std::string::npos) << result.out;
    EXPECT_EQ(test::read_file(file), kept) << "a check writes nothing";
    EXPECT_EQ(run("check", "--detector ohc --tolerance 1e-3").status, 0);
    ASSERT_EQ(run("write", "--detector ohc").status, 0);
    EXPECT_EQ(run("check", "--detector ohc").status, 0);
}

TEST_F(Baseline, AParameterThatLosesPairsIsSeen) {
    put(two_frames(0.5));
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    // The same stored answer, now expected of a detector that a budget of nothing keeps from looking.
    const std::filesystem::path file = folder.path() / "baseline" / "frames.json";
    Json stored = Json::parse(test::read_file(file));
    stored["detectors"]["ohc:work_budget=1"] = stored["detectors"]["ohc"];
    std::ofstream(file) << stored;
    const test::ProgramResult result = run("check", "--detector ohc:work_budget=1");
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.out.find("1 missing"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("outcome ok -> truncated"), std::string::npos) << result.out;
}

TEST_F(Baseline, BadInputIsNamed) {
    EXPECT_EQ(run("check", "").status, 2) << "no such file";
    put(two_frames(0.5));
    EXPECT_EQ(run("keep", "").status, 2);
    EXPECT_EQ(run("check", "--detector nobody").status, 2);
    EXPECT_EQ(run("check", "--every 0").status, 2);
}

}  // namespace
}  // namespace trocar
