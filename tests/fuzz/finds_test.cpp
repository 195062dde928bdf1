// What the fuzz targets have found stays found: every input under finds/TARGET goes through its target once more, those
// of a command through the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "fuzz_target.hpp"
#include "support/program.hpp"
#include "support/test_name.hpp"

namespace trocar::fuzz {
namespace {

const std::filesystem::path finds_folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "tests/fuzz/finds";

using Target = void (*)(std::string_view);
const std::map<std::string, Target>& readers() {
    static const std::map<std::string, Target> targets{{"mesh_obj", mesh_obj},
                                                       {"mesh_off", mesh_off},
                                                       {"mesh_ply", mesh_ply},
                                                       {"mesh_stl", mesh_stl},
                                                       {"mesh_vrml", mesh_vrml},
                                                       {"scene", scene},
                                                       {"study", study},
                                                       {"recording", recording},
                                                       {"baseline", baseline},
                                                       {"lines", lines},
                                                       {"record", record},
                                                       {"report", report},
                                                       {"external_data", external_data},
                                                       {"mesh_vtk", mesh_vtk},
                                                       {"mesh_vtp", mesh_vtp},
                                                       {"frames", frames},
                                                       {"shard", shard}};
    return targets;
}

std::vector<std::string> finds() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(finds_folder)) {
        if (entry.is_regular_file()) names.push_back(std::filesystem::relative(entry.path(), finds_folder).string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

/// The command that reads such a file, and its file in quotes. The first line of a run names its methods.
std::string command_of(const std::string& target, const std::string& content) {
    if (target == "pairs") return "tritri --json --test interval " + as_file(content, "pairs.txt").string();
    if (target == "replay") return "replay --json --detector all " + as_file(content, "frames.trocrec").string();
    if (target == "response_cases") return "respond --json " + as_file(content, "cases.json").string();
    if (target != "run") throw std::logic_error("no command reads finds of " + target);
    const std::size_t end = content.find('\n');
    std::string command = "run --json " + as_file(content.substr(end + 1), "scene.json").string() + " --ticks 20";
    std::istringstream words(content.substr(0, end));
    for (const char* option : {"--detector", "--response", "--contacts", "--stepper"}) {
        std::string word;
        if (words >> word && word != "-") command += std::string(" ") + option + " '" + word + "'";
    }
    return command;
}

class Find : public testing::TestWithParam<std::string> {};

TEST_P(Find, EndsAsPromised) {
    const std::string target = GetParam().substr(0, GetParam().find('/'));
    const std::string content = test::read_file(finds_folder / GetParam());
    const auto reader = readers().find(target);
    if (reader != readers().end()) {
        EXPECT_NO_THROW(reader->second(content));
        return;
    }
    const test::ProgramResult result = test::run_program(command_of(target, content));
    EXPECT_GE(result.status, 0) << result.err;
    EXPECT_LE(result.status, 3) << result.err;
    EXPECT_EQ(result.err.find("internal error"), std::string::npos) << result.err;
    if (result.status != 2) {
        EXPECT_TRUE(nlohmann::json::accept(result.out)) << result.out;
        return;
    }
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Find, testing::ValuesIn(finds()),
                         [](const auto& parameter) { return test::test_name(parameter.param); });

TEST(FuzzTarget, ARefusalIsNoFindAndEverythingElseThrownIs) {
    EXPECT_TRUE(taken([] {}));
    EXPECT_FALSE(taken([] { throw InputError("mesh.obj", "line 3", "a number", "'x'"); }));
    EXPECT_THROW(taken([] { throw std::length_error("vector::_M_default_append"); }), std::length_error);
    EXPECT_THROW(taken([] { expect(false, "every vertex has a position"); }), std::logic_error);
}

TEST(FuzzTarget, ScenesOfManyTrianglesAreLeftOut) {
    const std::string head = R"({"bodies": [{"parts": [{"shape": "sheet", "size": [0.1, 0.1], "edge": )";
    EXPECT_FALSE(asks_for_much(head + "0.01}]}]}"));
    EXPECT_TRUE(asks_for_much(head + "0.0001}]}]}"));
    EXPECT_TRUE(asks_for_much(head + R"(0.01}], "tissue": {"substeps": 1000}}]})"));
    EXPECT_FALSE(asks_for_much("no JSON"));
    EXPECT_FALSE(asks_for_much(R"({"bodies": [[], {"parts": [7]}, {"parts": {"edge": []}}]})"));
}

}  // namespace
}  // namespace trocar::fuzz
