#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "support/program.hpp"

namespace trocar {
namespace {

TEST(Schema, PrintsAJsonSchemaOfEveryFormat) {
    for (const char* what : {"scene", "study", "recording", "baseline"}) {
        const test::ProgramResult result = test::run_program(std::string("schema ") + what);
        ASSERT_EQ(result.status, 0) << result.err;
        const nlohmann::json document = nlohmann::json::parse(result.out);
        EXPECT_EQ(document["properties"]["format"]["const"], std::string("trocar-") + what + "-1");
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

}  // namespace
}  // namespace trocar
