#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "support/program.hpp"

namespace trocar {
namespace {

TEST(Schema, PrintsAJsonSchemaOfEveryFormat) {
    for (const auto& [what, oldest] :
         {std::pair{"scene", "2"}, {"study", "2"}, {"recording", "1"}, {"baseline", "1"}}) {
        const test::ProgramResult result = test::run_program(std::string("schema ") + what);
        ASSERT_EQ(result.status, 0) << result.err;
        const nlohmann::json document = nlohmann::json::parse(result.out);
        const nlohmann::json& format = document["properties"]["format"];
        EXPECT_EQ(format.contains("const") ? format["const"] : format["enum"][0],
                  std::string("trocar-") + what + "-" + oldest);
        for (const auto& key : document["required"]) EXPECT_TRUE(document["properties"].contains(key)) << key;
    }
    EXPECT_EQ(test::run_program("schema film").status, 2);
}

TEST(Schema, FiguresReportUnitDirectionMeaningAndSourceOnce) {
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
