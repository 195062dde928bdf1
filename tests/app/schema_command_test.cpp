#include <gtest/gtest.h>

#include <set>
#include <string>

#include "support/commands.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

TEST(Schema, PrintsAJsonSchemaOfEveryFormat) {
    for (const auto& [what, oldest] :
         {std::pair{"scene", "2"}, {"study", "3"}, {"recording", "1"}, {"baseline", "1"}}) {
        const nlohmann::json document = test::json_of(std::string("schema ") + what);
        const nlohmann::json& format = document["properties"]["format"];
        EXPECT_EQ(format.contains("const") ? format["const"] : format["enum"][0],
                  std::string("trocar-") + what + "-" + oldest);
        for (const auto& key : document["required"]) EXPECT_TRUE(document["properties"].contains(key)) << key;
    }
    EXPECT_EQ(test::run_program("schema film").status, 2);
}

TEST(Schema, FiguresReportUnitDirectionMeaningAndSourceOnce) {
    std::set<std::string> names;
    for (const auto& figure : test::json_of("schema figures")) {
        EXPECT_TRUE(names.insert(figure["name"]).second) << figure;
        for (const char* key : {"unit", "better", "meaning", "source"}) EXPECT_TRUE(figure.contains(key)) << figure;
    }
    for (const char* name :
         {"ticks_to_clear_max", "overlap_volume_max_m3", "paced_age_p99_ns", "force_error_rms_hard"}) {
        EXPECT_TRUE(names.contains(name)) << name;
    }
}

TEST(CommandLine, AnUnknownCommandIsOneLineThatNamesTheKnownOnes) {
    for (const auto& [words, found] : {std::pair{"studdy x.json", "got 'studdy'"}, std::pair{"", "got nothing"}}) {
        test::expect_holds(test::expect_refused(words, found), {"expected one of run, ", "study"});
    }
    EXPECT_EQ(test::run_program("--help").status, 0);
    EXPECT_EQ(test::run_program("--version").status, 0);
}

}  // namespace
}  // namespace trocar
