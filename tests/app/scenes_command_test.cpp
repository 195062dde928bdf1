// `trocar scenes`: a line a scene, counted from files that are written here.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "support/commands.hpp"

namespace trocar {
namespace {

using test::ProgramResult;
using test::run_program;

class ScenesCommand : public testing::Test {
protected:
    void SetUp() override {
        // Two triangles and one.
        folder_.write("two.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n");
        folder_.write("one.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n");
    }
    [[nodiscard]] std::string write(const std::string& name, const nlohmann::json& description) const {
        const auto body = [](const char* kind, const std::string& mesh) {
            return nlohmann::json{
                {"name", mesh}, {"kind", kind}, {"closed", false}, {"parts", {{{"mesh", mesh + ".obj"}}}}};
        };
        nlohmann::json scene{{"format", "trocar-scene-2"}, {"name", name}, {"ticks", 17}, {"dt", 0.002}};
        scene["description"] = description;
        scene["bodies"] = {body("rigid", "two"), body("instrument", "one")};
        scene["contact"] = {{{"bodies", {"two", "one"}}, {"k", 1000}}};
        return folder_.write(name + ".json", scene.dump()).string();
    }
    test::TemporaryFolder folder_;
};

TEST_F(ScenesCommand, ReportsWhatAFileHolds) {
    const std::string file = write("above", "A triangle over two. More of it, 1.5 m up.");
    EXPECT_EQ(test::json_of("scenes --json " + file),
              (nlohmann::json{{"scenes",
                               {{{"name", "above"},
                                 {"file", file},
                                 {"class", "I2R"},
                                 {"bodies", 2},
                                 {"triangles", 3},
                                 {"ticks", 17},
                                 {"dt", 0.002},
                                 {"description", "A triangle over two. More of it, 1.5 m up."}}}}}));
    const std::string shown = run_program("scenes " + file).out;
    EXPECT_NE(shown.find("A triangle over two.\n"), std::string::npos) << shown;
}

TEST_F(ScenesCommand, AFullStopEndsASentenceOnlyBeforeACapitalLetter) {
    for (const auto& [description, first] : {std::pair{"Goes approx. 2 mm deep, i.e. through the skin. It stays there.",
                                                       "Goes approx. 2 mm deep, i.e. through the skin."},
                                             {"Two of them. And a third. And a fourth.", "Two of them."},
                                             {"Has no end", "Has no end"},
                                             {"Only one. of its kind", "Only one. of its kind"}}) {
        const std::string shown = run_program("scenes " + write("reported", description)).out;
        EXPECT_NE(shown.find(std::string("  ") + first + "\n"), std::string::npos) << shown;
    }
}

TEST_F(ScenesCommand, ListsAFolderByName) {
    (void)write("second", "b");
    (void)write("first", "a");
    const ProgramResult names = run_program("scenes --names " + folder_.path().string());
    EXPECT_EQ(names.out, "first\nsecond\n") << names.err;
    const std::string shown = run_program("scenes " + folder_.path().string()).out;
    EXPECT_EQ(std::count(shown.begin(), shown.end(), '\n'), 3) << shown;
}

TEST_F(ScenesCommand, ADescriptionThatIsNoTextIsOneLineThatNamesTheFile) {
    const std::string file = write("odd", 5);
    test::expect_refused("scenes " + file, file + ": /description: expected a text");
}

TEST_F(ScenesCommand, ANameWithALetterTooFewTooManyOrWrongIsReportedItsNeighbour) {
    for (const char* name : {"i2tpoke", "i2t__poke", "i2t_pole"}) {
        test::expect_refused(std::string("run ") + name, "(near: i2t_poke");
    }
}

TEST_F(ScenesCommand, ANameGetsAtMostThreeThatHoldItAndNoneWhenAllAreFarAway) {
    const std::string holding = run_program("run stab").err;  // four scenes have a stab in their names
    const std::size_t from = holding.find("(near: ");
    ASSERT_NE(from, std::string::npos) << holding;
    const std::string names = holding.substr(from + 7, holding.find(')', from) - from - 7);
    int reported = 0;
    std::istringstream list(names);
    for (std::string name; std::getline(list, name, ','); ++reported) {
        EXPECT_NE(name.find("stab"), std::string::npos) << name;
    }
    EXPECT_EQ(reported, 3) << names;
    const ProgramResult far = run_program("run zzzzzzzzzzzz");
    EXPECT_EQ(far.status, 2);
    EXPECT_NE(far.err.find("neither"), std::string::npos) << far.err;
    EXPECT_EQ(far.err.find("proximity:"), std::string::npos) << far.err;
}

/// `trocar draw`: what it writes is what the other commands take, and an occupied folder stays as it is.
TEST_F(ScenesCommand, DrawnScenesAreFilesOfANewFolder) {
    const std::string drawn = (folder_.path() / "drawn").string();
    const ProgramResult written = run_program("draw resolution " + drawn + " --seed 7 --json");
    ASSERT_EQ(written.status, 0) << written.err;
    const nlohmann::json answer = nlohmann::json::parse(written.out);
    EXPECT_EQ(answer.at("seed"), 7);
    ASSERT_EQ(answer.at("scenes").size(), 120U);
    EXPECT_EQ(answer.at("scenes").at(0).at("group"), "at rest");
    const std::string names = run_program("scenes --names " + drawn).out;
    EXPECT_EQ(std::count(names.begin(), names.end(), '\n'), 120);
    test::expect_refused("draw resolution " + drawn, drawn + ": expected a new or empty folder");
    test::expect_refused("draw resolution " + drawn + "2 --seed -1", "--seed");
    EXPECT_EQ(run_program("draw judged " + drawn + "_judged").status, 0);
    const std::string judged = run_program("scenes --names " + drawn + "_judged").out;
    EXPECT_EQ(std::count(judged.begin(), judged.end(), '\n'), 60);
    test::expect_refused("draw anything " + drawn + "2", "family");
    EXPECT_FALSE(std::filesystem::exists(drawn + "2"));
}

}  // namespace
}  // namespace trocar
