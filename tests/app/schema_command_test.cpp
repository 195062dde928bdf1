#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "support/program.hpp"
#include "support/recordings.hpp"

namespace trocar {
namespace {

TEST(Schema, PrintsAJsonSchemaOfEveryFormat) {
    for (const char* what : {"scene", "study", "recording", "baseline"}) {
        const test::ProgramResult result = test::run_program(std::string("schema ") + what);
        ASSERT_EQ(result.status, 0) << result.err;
        const nlohmann::json document = nlohmann::json::parse(result.out);
        const nlohmann::json& format = document["properties"]["format"];
        EXPECT_EQ(format.contains("const") ? format["const"] : format["enum"][0], std::string("trocar-") + what + "-1");
        for (const auto& key : document["required"]) EXPECT_TRUE(document["properties"].contains(key)) << key;
    }
    EXPECT_EQ(test::run_program("schema film").status, 2);
}

TEST(Schema, FiguresTellUnitDirectionMeaningAndSourceOnce) {
    const test::ProgramResult result = test::run_program("schema figures");
    ASSERT_EQ(result.status, 0) << result.err;
    std::set<std::string> names;
    for (const auto& figure : nlohmann::json::parse(result.out)) {
        EXPECT_TRUE(names.insert(figure["name"]).second) << figure;
        for (const char* key : {"unit", "better", "meaning", "source"})
            EXPECT_FALSE(figure[key].get<std::string>().empty()) << figure;
    }
    for (const char* name : {"ticks_to_clear_max", "overlap_volume_max_m3", "paced_p99_ns", "force_error_rms_hard"}) {
        EXPECT_TRUE(names.contains(name)) << name;
    }
}

/// Paths of all leaves: [] for an element of a list, names of the maps whose names are free replaced by *.
void collect_keys(const nlohmann::json& value, const std::string& path, std::set<std::string>& keys) {
    if (value.is_object()) {
        const bool free_names = path == "rows[].stage_ns" || path == "cases[].got" || path == "confusion" ||
                                path.ends_with("].truth") || path.ends_with("].truth_kept");
        for (const auto& [name, inner] : value.items()) {
            const bool figure = path == "summary" && name != "state_hash";
            const bool contact = path.ends_with("worst[]") && inner.is_object();
            const std::string key = free_names || figure || contact ? "*" : name;
            collect_keys(inner, path.empty() ? key : path + "." + key, keys);
        }
    } else if (value.is_array()) {
        const bool vector = path.ends_with("_force") || path.ends_with("_moment") || path.ends_with("*.point_m") ||
                            path.ends_with("*.normal");
        for (const auto& inner : value) collect_keys(inner, vector ? path : path + "[]", keys);
    } else {
        keys.insert(path);
    }
}

TEST(Schema, OutputTellsEveryKeyThatACommandPrints) {
    const test::TemporaryFolder folder;
    const std::string in = folder.path().string() + "/";
    const std::string scene = std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_poke.json";
    ASSERT_EQ(test::run_program("run " + scene + " --ticks 30 --record " + in + "poke.rec").status, 0);
    // A tetrahedron whose tip stands in another one's face.
    std::ofstream(in + "a.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::ofstream(in + "b.obj")
        << "v .2 .2 .4\nv 1.2 .2 1.4\nv .2 1.2 1.4\nv .2 .2 2.4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::ofstream(in + "pairs.txt") << "0 0 0 1 0 0 0 1 0 .2 .2 -1 .3 .2 1 .2 .3 1 1 transversal\n";
    std::ofstream(in + "cases.json")
        << R"({"cases":[{"id":"3.4-x","input":{"tri1":[[0,0,0],[0.02,0,0],[0,0.02,0]],)"
        << R"("tri2":[[0.004,0.005,-0.0005],[0.004,0.006,0.03],[0.007,0.004,0.03]],"vel1":[[0,0,0],[0,0,0],[0,0,0]],)"
        << R"("vel2":[[0,0,0],[0,0,0],[0,0,0]],"k":1000,"mu":0.5},"expected":{"F_scalar":0.25}}]})";
    const std::map<std::string, std::string> commands{
        {"run", "run " + scene + " --ticks 30 --json"},
        {"run --explain-step",
         "run " + std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_operator_press.json --explain-step --json"},
        {"export", "export " + scene + " --ticks 3 --to obj --output " + in + "posed --json"},
        {"table", "table " + std::string(TROCAR_SOURCE_DIR) + "/reports/steppers --json"},
        {"detect", "detect " + in + "a.obj " + in + "b.obj --detector ohc --truth --json"},
        {"replay", "replay " + in + "poke.rec --detector ohc --truth --json"},
        {"baseline", "baseline check " + in + "frames.rec --folder " + in + "kept --json"},
        {"mesh", "mesh " + in + "a.obj --json"},
        {"tritri", "tritri " + in + "pairs.txt --test exact --json"},
        {"respond", "respond " + in + "cases.json --json"},
    };
    // A pair that meets in frame 1, kept with another depth.
    test::RecordingText frames;
    frames.header["frames"] = 2;
    frames.positions.clear();
    for (const double low : {1.0, -0.5}) {
        frames.positions.insert(frames.positions.end(), {0, 0, 0, 1, 0, 0, 0, 1, 0});
        frames.positions.insert(frames.positions.end(), {0.25, 0.25, low, 0.25, 0.25, 2, 0.5, 0.25, 2});
    }
    std::ofstream(in + "frames.rec", std::ios::binary) << frames.bytes();
    ASSERT_EQ(test::run_program("baseline write " + in + "frames.rec --detector ohc --folder " + in + "kept").status,
              0);
    nlohmann::json kept = nlohmann::json::parse(test::read_file(in + "kept/frames.json"));
    kept["contacts"][0]["1"][0][9] = 1.0;
    std::ofstream(in + "kept/frames.json") << kept;
    std::map<std::string, std::set<std::string>> told;
    for (const auto& entry : nlohmann::json::parse(test::run_program("schema output").out)) {
        EXPECT_TRUE(told[entry["command"]].insert(entry["key"]).second) << entry;
        for (const char* key : {"unit", "meaning"}) EXPECT_FALSE(entry[key].get<std::string>().empty()) << entry;
    }
    for (const auto& [command, line] : commands) {
        const test::ProgramResult result = test::run_program(line);
        ASSERT_TRUE(nlohmann::json::accept(result.out)) << line << "\n" << result.err;
        std::set<std::string> printed;
        collect_keys(nlohmann::json::parse(result.out), "", printed);
        ASSERT_GE(printed.size(), command == "table" ? 3U : 6U) << line;
        for (const std::string& key : printed) EXPECT_TRUE(told[command].contains(key)) << command << " prints " << key;
    }
}

TEST(CommandLine, AnUnknownCommandIsOneLineThatNamesTheKnownOnes) {
    for (const auto& [words, found] : {std::pair{"studdy x.json", "got 'studdy'"}, std::pair{"", "got nothing"}}) {
        const test::ProgramResult result = test::run_program(words);
        EXPECT_EQ(result.status, 2);
        EXPECT_TRUE(result.out.empty());
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_NE(result.err.find("expected one of run, "), std::string::npos) << result.err;
        EXPECT_NE(result.err.find("study"), std::string::npos) << result.err;
        EXPECT_NE(result.err.find(found), std::string::npos) << result.err;
    }
    EXPECT_EQ(test::run_program("--help").status, 0);
    EXPECT_EQ(test::run_program("--version").status, 0);
}

}  // namespace
}  // namespace trocar
