#include <gtest/gtest.h>

#include <fstream>

#include "support/commands.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;

class Export : public testing::Test {
protected:
    [[nodiscard]] std::string words(const std::string& to, const std::string& rest = "") const {
        return "export " + scene.string() + " --to " + to + " --output " + output.string() + " " + rest;
    }
    void expect_refused(const std::string& line, const std::string& named) const {
        test::expect_refused(line, named);
        EXPECT_FALSE(std::filesystem::exists(output)) << "nothing half-written";
    }
    test::TemporaryFolder folder;
    std::filesystem::path scene = folder.write("poke.json", test::poke_text());
    std::filesystem::path output = folder.path() / "out";
};

TEST_F(Export, WritesTheFormatsThatAreNamed) {
    for (const auto& [to, one, files] :
         {std::tuple{"paraview", "poke.pvd", 9}, {"gltf", "poke.glb", 1}, {"obj", "sheet_000020.obj", 8}}) {
        const Json reported = test::json_of(words(to, "--every 20 --json"));
        EXPECT_TRUE(std::filesystem::exists(output / one)) << to;
        EXPECT_EQ(reported["ticks"], Json({0, 20, 40, 59}))
            << "every 20th and the last, which is the deepest or not deeper";
        EXPECT_EQ(reported["files"].size(), static_cast<std::size_t>(files)) << reported["files"];
        for (const Json& file : reported["files"])
            EXPECT_TRUE(std::filesystem::exists(output / file.get<std::string>()));
        std::filesystem::remove_all(output);
    }
}

TEST_F(Export, IsTheRunThatRunReports) {
    const std::string methods = " --detector ohc --response penalty --stepper semi_implicit --ticks 30";
    const Json ran = test::json_of("run " + scene.string() + methods + " --json");
    const Json reported = test::json_of(words("obj", methods + " --every 10 --tick 7 --json"));
    EXPECT_EQ(reported["state_hash"], ran["summary"]["state_hash"]);
    EXPECT_EQ(reported["response"], ran["response"]);
    EXPECT_TRUE(std::filesystem::exists(output / "tool_000007.obj"));
}

TEST_F(Export, TakesRecordings) {
    const std::string recording = (folder.path() / "poke.trocrec").string();
    ASSERT_EQ(test::run_program("run " + scene.string() + " --ticks 10 --record " + recording).status, 0);
    const Json reported =
        test::json_of("export " + recording + " --to paraview --output " + output.string() + " --every 5 --json");
    EXPECT_EQ(reported["ticks"], Json({0, 5, 9}));
    EXPECT_TRUE(reported["state_hash"].is_null());
}

TEST_F(Export, AnInterruptionLeavesNothingBehind) {
    const std::string interrupted = "timeout --preserve-status --signal=INT 2 " + std::string(TROCAR_PROGRAM);
    EXPECT_EQ(test::run_program(words("obj", "--ticks 10000000 --every 10000000"), interrupted).status, 130);
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
        EXPECT_EQ(entry.path().filename(), "poke.json") << "neither the folder nor a part of it";
    }
}

TEST_F(Export, RefusesWithOneLineAndWritesNothing) {
    expect_refused(words("paraview", "--every 0"), "--every");
    expect_refused(words("paraview", "--tick 60"), "from 0 to 59");
    expect_refused(words("paraview", "--ticks 0"), "--ticks");
    expect_refused(words("gltf", "--ticks 200 --every 1"), "--every 4");
    expect_refused(words("obj", "--response nobody"), "nobody");
    expect_refused(words("film"), "film");
    expect_refused("export nowhere.json --to obj --output " + output.string(), "nowhere.json");
    std::filesystem::create_directories(folder.path() / "full");
    std::ofstream(folder.path() / "full" / "mine") << "mine";
    expect_refused("export " + scene.string() + " --to obj --output " + (folder.path() / "full").string(), "full");
    EXPECT_EQ(test::read_file(folder.path() / "full" / "mine"), "mine");
}

}  // namespace
}  // namespace trocar
