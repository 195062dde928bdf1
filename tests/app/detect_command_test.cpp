// The command on meshes whose intersecting pairs are known by hand, and against the oracle.
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/mesh_file.hpp"
#include "support/commands.hpp"

namespace trocar {
namespace {

using test::ProgramResult;
using test::run_program;
using Json = nlohmann::json;

// A face with a small one far away before it, so that numbers are not all zero.
const std::string two_faces = "v 50 50 50\nv 51 50 50\nv 50 51 50\nv -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\nf 4 5 6\n";
// A tetrahedron on z = -1 with its tip at z = 1: base is triangle 0, the sides are 1, 2, 3.
const std::string spike = "OFF\n4 4 0\n1 0 -1\n-1 1 -1\n-1 -1 -1\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

class DetectCommand : public testing::Test {
protected:
    DetectCommand() {
        folder_.write("face.obj", two_faces);
        folder_.write("spike.off", spike);
        folder_.write("empty.off", "OFF\n0 0 0\n");
    }
    [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
    [[nodiscard]] std::string words(const std::string& options, const std::string& a = "face.obj",
                                    const std::string& b = "spike.off") const {
        return "detect " + file(a) + " " + file(b) + " " + options;
    }
    [[nodiscard]] ProgramResult run(const std::string& options, const std::string& a = "face.obj",
                                    const std::string& b = "spike.off") const {
        return run_program(words(options, a, b));
    }
    static Json row(const ProgramResult& result, const std::string& name) {
        const Json document = Json::parse(result.out);
        for (const Json& detector : document.at("detectors")) {
            if (detector.at("name") == name) return detector;
        }
        return {};
    }
    test::TemporaryFolder folder_;
};

TEST_F(DetectCommand, PairsAreNumbersOfTheFilesAndKeysAreTheAgreedOnes) {
    const Json document = test::json_of(words("--json"));
    EXPECT_EQ(document.size(), 2U);
    EXPECT_TRUE(document.at("truth").is_null());
    ASSERT_EQ(document.at("detectors").size(), 1U);
    const Json detector = document.at("detectors")[0];
    EXPECT_EQ(detector.size(), 9U);
    EXPECT_EQ(detector.at("name"), "ohc");
    EXPECT_EQ(detector.at("outcome"), "ok");
    EXPECT_EQ(detector.at("message"), "");
    EXPECT_EQ(detector.at("pairs"), Json::parse("[[1,1],[1,2],[1,3]]"));
    EXPECT_EQ(detector.at("touch"), Json::array());
    EXPECT_TRUE(detector.at("false_negatives").is_null());
    EXPECT_TRUE(detector.at("false_positives").is_null());
    EXPECT_GE(detector.at("update_ns").get<double>(), 0.0);
    EXPECT_GT(detector.at("detect_ns").get<double>(), 0.0);
}

TEST_F(DetectCommand, SwappedFilesGiveSwappedPairs) {
    EXPECT_EQ(row(run("--json", "spike.off", "face.obj"), "ohc").at("pairs"), Json::parse("[[1,1],[2,1],[3,1]]"));
}

TEST_F(DetectCommand, TouchingPairsAreMarkedByPosition) {
    // The tip comes down to z = 0 and touches; then it ends just below.
    const Json touching = row(run("--pose-b \"0 0 -1 0 0 0\" --json --detector brute_force"), "brute_force");
    EXPECT_EQ(touching.at("pairs"), Json::parse("[[1,1],[1,2],[1,3]]"));
    EXPECT_EQ(touching.at("touch"), Json::parse("[0,1,2]"));
    EXPECT_EQ(row(run("--pose-b \"0 0 -1.0000000000000003 0 0 0\" --json"), "ohc").at("pairs"), Json::array());
}

TEST_F(DetectCommand, PoseTakesNegativeFirstNumbersAndScaleComesFirst) {
    EXPECT_EQ(row(run("--pose-b \"-20 0 0 0 0 0\" --json"), "ohc").at("pairs"), Json::array());
    EXPECT_EQ(row(run("--pose-b \"-0.5 0 0 0 0 0\" --json"), "ohc").at("pairs").size(), 3U);
    EXPECT_EQ(row(run("--pose-a \"-0.5 0 0 0 0 0\" --pose-b=\"-.5 0 0 0 0 -1e1\" --json"), "ohc").at("pairs").size(),
              3U);
    // Half as large and half a unit up: the base comes to z = 0 and lies on the face, which is a fourth pair.
    const Json half = row(run("--scale-b 0.5 --pose-b \"0 0 0.5 0 0 0\" --json"), "ohc");
    EXPECT_EQ(half.at("pairs"), Json::parse("[[1,0],[1,1],[1,2],[1,3]]"));
    EXPECT_EQ(half.at("touch"), Json::parse("[1,2,3]"));
    // Upside down the tip points to z = -1 and the sides still pierce.
    EXPECT_EQ(row(run("--pose-b \"0 0 0 180 0 0\" --json"), "ohc").at("pairs"), Json::parse("[[1,1],[1,2],[1,3]]"));
}

TEST_F(DetectCommand, AllHoldsEveryDetectorAgainstTheOracle) {
    const ProgramResult result = run("--detector all --json");
    EXPECT_EQ(result.status, 0) << result.err;
    const Json document = Json::parse(result.out);
    EXPECT_EQ(document.at("truth"), 3);
    Json list = Json::array();
    const Json all = test::json_of("list --json");
    for (const Json& known : all.at("detectors")) {
        if (!known.at("available").get<bool>() || !known.at("control").get<bool>()) list.push_back(known);
    }
    ASSERT_EQ(document.at("detectors").size(), list.size());
    for (const Json& known : list) {
        const Json detector = row(result, known.at("name"));
        ASSERT_FALSE(detector.is_null()) << known.at("name");
        if (!known.at("available").get<bool>()) {
            EXPECT_EQ(detector.at("outcome"), "absent");
            EXPECT_EQ(detector.at("message"), known.at("reason"));
            EXPECT_TRUE(detector.at("false_negatives").is_null());
        } else if (known.at("claims_exact").get<bool>()) {
            EXPECT_EQ(detector.at("false_negatives"), 0) << known.at("name");
            EXPECT_EQ(detector.at("false_positives"), 0) << known.at("name");
        }
    }
    const ProgramResult table = run("--detector all");
    EXPECT_EQ(table.status, 0);
    EXPECT_LT(table.out.find("exact oracle"), table.out.find("brute_force"));
    for (const Json& known : list) EXPECT_NE(table.out.find(known.at("name").get<std::string>()), std::string::npos);
}

TEST_F(DetectCommand, WhoGaveNoAnswerHasNoCountsInTheTable) {
    const ProgramResult table = run("--detector all --time-limit 1e-9");
    std::istringstream lines(table.out);
    int late = 0;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        const std::vector<std::string> row{std::istream_iterator<std::string>(words), {}};
        if (row.size() < 9 || row[1] != "timed_out") continue;
        ++late;
        EXPECT_EQ(std::vector(row.begin() + 2, row.begin() + 9),
                  (std::vector<std::string>{"0", "-", "-", "-", "-", "-", "-"}))
            << line;
    }
    EXPECT_GT(late, 2) << table.out;
}

TEST_F(DetectCommand, OneDetectorPrintsAPairPerLine) {
    const ProgramResult result = run("--pose-b \"0 0 -1 0 0 0\"");
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.out.rfind("1 1 touch\n1 2 touch\n1 3 touch\n# ohc: 3 pairs, 3 of them only touch", 0), 0U)
        << result.out;
}

TEST_F(DetectCommand, AMeshWithoutTrianglesHasNoPairs) {
    for (const char* b : {"spike.off", "empty.off"}) {
        EXPECT_EQ(test::json_of(words("--detector all --json", "empty.off", b)).at("truth"), 0);
    }
}

TEST_F(DetectCommand, WritesTheVeryVerticesItTested) {
    const std::string pose = " --pose-b \"0.1 -0.2 0.3 10 20 30\" --scale-b 0.7";
    EXPECT_EQ(run("--write-posed " + file("out/deep") + pose).status, 0);
    const Mesh b = read_mesh(folder_.path() / "out/deep/b.obj");
    Mesh expected = read_mesh(folder_.path() / "spike.off");
    pose_vertices(0.7, Vector3(0.1, -0.2, 0.3), Vector3(10, 20, 30), expected.vertices);
    EXPECT_EQ(b.vertices, expected.vertices);
    EXPECT_EQ(b.triangles, expected.triangles);
    EXPECT_EQ(read_mesh(folder_.path() / "out/deep/a.obj").triangles.cols(), 2);
    const Json again = test::json_of(words("--json", "out/deep/a.obj", "out/deep/b.obj"));
    EXPECT_EQ(again.at("detectors")[0].at("pairs"), row(run("--json" + pose), "ohc").at("pairs"));
}

TEST_F(DetectCommand, BadInputEndsWithStatusTwoAndNothingOnStdout) {
    const std::pair<std::string, std::string> cases[] = {
        {"--pose-b \"0 0 0 0 0\"", "--pose-b: expected six numbers \"x y z rx ry rz\", got 5"},
        {"--pose-b \"0 0 0 0 0 0 0\"", "got 7"},
        {"--pose-a \"0 0 0 0 0 nan\"", "--pose-a: expected six finite numbers, got 'nan'"},
        {"--pose-a \"0 0 zero 0 0 0\"", "'zero'"},
        {"--scale-b 0", "--scale-b: expected a finite number > 0, got 0"},
        {"--scale-a -1", "--scale-a: expected a finite number > 0, got -1"},
        {"--scale-a 1e308", "stay finite"},
        {"--time-limit 0", "--time-limit: expected seconds > 0, got 0"},
        {"--detector nobody", "nobody"},
        {"--detector brute_force:key=1", "key"},
        {"--detector ohc:", "ohc"},
    };
    for (const auto& [options, part] : cases) {
        test::expect_refused(words(options + " --json"), part);
    }
    EXPECT_EQ(run("", "face.obj", "missing.stl").status, 2);
    EXPECT_EQ(run("--write-posed " + file("face.obj")).status, 2);
}

TEST_F(DetectCommand, AnAbsentMethodAskedForByNameIsBadInput) {
    const Json list = test::json_of("list --json");
    for (const Json& known : list.at("detectors")) {
        if (known.at("available").get<bool>()) continue;
        EXPECT_EQ(run("--detector " + known.at("name").get<std::string>()).status, 2);
        return;
    }
    GTEST_SKIP() << "every detector is present in this build";
}

TEST_F(DetectCommand, ADetectorThatTakesTooLongIsTimedOutAndStatusThree) {
    const ProgramResult result = run("--detector ohc --time-limit 1e-9 --json");
    EXPECT_EQ(result.status, 3);
    EXPECT_EQ(row(result, "ohc").at("outcome"), "timed_out");
    EXPECT_TRUE(row(result, "ohc").at("detect_ns").is_null());
    EXPECT_EQ(run("--detector all --time-limit 1e-9").status, 0);
}

}  // namespace
}  // namespace trocar
