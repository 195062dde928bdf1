// Files that ask for more than a machine should give for a short text: refused with the figure and the way round, soon
// and in little memory; --large takes them.
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "geometry/gzip.hpp"
#include "support/commands.hpp"
#include "support/scene_samples.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using nlohmann::json;
using test::run_program;

class SizeLimits : public testing::Test {
protected:
    std::string write(const std::string& name, const std::string& text) const {
        return folder_.write(name, text).string();
    }
    /// A scene of one sheet of so many millimetres of edge, and of so many single triangles.
    [[nodiscard]] std::string scene(double edge, int bodies, int parts = 1) const {
        write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        json text{{"format", "trocar-scene-2"}, {"name", "large"}, {"ticks", 1}};
        text["bodies"] = {{{"name", "sheet"},
                           {"kind", "rigid"},
                           {"closed", false},
                           {"parts", {{{"shape", "sheet"}, {"size", {0.1, 0.1}}, {"edge", edge}}}}}};
        const json part{{"mesh", "one.obj"}};
        for (int i = 0; i < bodies; ++i) {
            text["bodies"].push_back({{"name", "body " + std::to_string(i)},
                                      {"kind", "rigid"},
                                      {"closed", false},
                                      {"parts", json(static_cast<std::size_t>(parts), part)}});
        }
        return write("scene.json", text.dump());
    }
    void expect_refused(const std::string& arguments, const std::string& what) const {
        test::expect_holds(test::expect_refused(arguments, what), {"--large lifts this"});
    }
    test::TemporaryFolder folder_;
};

TEST_F(SizeLimits, ShapesOfMoreTrianglesThanTwoMillionAreRefusedBeforeTheyAreMade) {
    const std::string fine = scene(5e-5, 0);  // 9 million
    for (const std::string command : {"run ", "run --explain-step ", "view ", "reference ", "scenes "}) {
        expect_refused(command + fine, "/bodies/0/parts/0/edge: expected an edge that gives at most 2000000 triangles");
    }
    EXPECT_EQ(run_program("scenes --large " + scene(1e-4, 0)).status, 0);  // 2.3 million
    expect_refused("scenes " + scene(1e-4, 0), "at most 2000000 triangles");
}

TEST_F(SizeLimits, MoreThanAThousandBodiesAndTenThousandPartsAreRefused) {
    expect_refused("run " + scene(0.05, 1000), "/bodies: expected at most 1000 bodies (--large lifts this), got 1001");
    EXPECT_EQ(run_program("scenes " + scene(0.05, 999)).status, 0);
    EXPECT_EQ(run_program("scenes --large " + scene(0.05, 1000)).status, 0);
    expect_refused("run " + scene(0.05, 1, 10'001), "/bodies/1/parts: expected at most 10000 parts of a body");
}

TEST_F(SizeLimits, ListsOfHundredThousandObjectsAreReadInATimeThatGrowsAsTheyDo) {
    const std::string large = scene(0.05, 1, 200'000);
    const auto begin = std::chrono::steady_clock::now();
    expect_refused("run " + large, "/bodies/1/parts: expected at most 10000 parts of a body");
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(SizeLimits, KeysOfAnObjectThatKeepsTheirOrderAreCountedBeforeTheyAreCompared) {
    // Kept one after the other, two million keys took hours.
    std::string keys;
    for (int i = 0; i < 2'000'000; ++i) keys += (i > 0 ? ",\"" : "\"") + std::to_string(i) + "\":1";
    expect_refused("respond " + write("cases.json", "{" + keys + "}"), "at most 1000 keys of an object");
    expect_refused("respond " + write("cases.json", "{\"cases\":[{\"input\":{" + keys + "}}]}"),
                   "/cases/0/input/1000: expected at most 1000 keys of an object");
}

TEST_F(SizeLimits, FacesOfHundredThousandCornersAndLargeFilesAreRefused) {
    std::string face = "f";
    std::string points;
    for (int i = 1; i <= 100'001; ++i) {
        points += "v " + std::to_string(i) + " " + std::to_string(i % 7) + " 0\n";
        face += " " + std::to_string(i);
    }
    expect_refused("mesh " + write("face.obj", points + face + "\n"), "at most 100000 corners of a face");
    const std::string mesh = write("empty.obj", "");
    std::filesystem::resize_file(mesh, 400'000'001);  // takes no room on the disk
    expect_refused("mesh " + mesh, "at most 400 MB");
    const std::string document = write("empty.json", "");
    std::filesystem::resize_file(document, 24'000'001);
    for (const std::string command : {"run ", "study ", "respond "})
        expect_refused(command + document, "at most 24 MB of JSON");
    const std::string lines = write("records.jsonl", "");
    std::filesystem::resize_file(lines, 20'000'000'000);
    for (const std::string command : {"report ", "table "})
        expect_refused(command + folder_.path().string(), "at most 24 MB of a line");
    expect_refused("tritri " + lines, "at most 400 MB");
    // In the other format it is the size unpacked that counts.
    write("records.jsonl.gz", gzipped(std::string(24'100'000, 'x')));
    for (const std::string command : {"report ", "table "})
        expect_refused(command + folder_.path().string(), "records.jsonl.gz: expected at most 24 MB of a line");
}

TEST_F(SizeLimits, StudiesOfMoreThanHundredThousandRunsAreRefused) {
    write("scene.json", test::poke_text());
    const auto study = [this](std::int64_t repetitions, std::size_t scenes) {
        json text{{"format", "trocar-study-3"}, {"name", "many"}, {"repetitions", repetitions}};
        text["experiments"] = json(1, json{{"frames", "replay"},
                                           {"scenes", json(scenes, "scene.json")},
                                           {"detectors", json(1, json{{"method", "ohc"}})}});
        return "study --plan " + write("study.json", text.dump());
    };
    expect_refused(study(4294967295, 1), "at most 100000 runs");
    expect_refused(study(100'001, 1), "at most 100000 runs");
    EXPECT_EQ(run_program(study(100, 1)).status, 0);
}

TEST_F(SizeLimits, NumbersOfTheCommandLineAreTakenAsTheyStandOrRefused) {
    const std::string scene = write("scene.json", test::poke_text());
    for (const std::string number : {"9223372036854775808", "99999999999999999999999", "''", "1e3", "0x10", "'3 '"}) {
        for (const std::string command : {"run ", "view ", "export --to obj --output out "}) {
            const std::string line = test::expect_refused(command + scene + " --ticks " + number, "--ticks");
            EXPECT_EQ(line.find("9223372036854775807'"), std::string::npos) << "reported otherwise than given";
        }
    }
    for (const std::string command : {"run ", "run --explain-step ", "view ", "export --to obj --output out "}) {
        test::expect_refused(command + scene + " --ticks 9223372036854775807",
                             "--ticks: expected an integer from 1 to 1000000000, got 9223372036854775807");
    }
    for (const std::string option :
         {"--detector", "--response", "--contacts", "--stepper", "--device", "--record", "--ticks"}) {
        test::expect_refused("run " + scene + " " + option + " ''", option + ": expected something, got ''");
    }
    EXPECT_EQ(run_program("run " + scene + " --ticks +2").status, 0);
}

}  // namespace
}  // namespace trocar
