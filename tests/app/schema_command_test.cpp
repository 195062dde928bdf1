#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/program.hpp"

namespace trocar {
namespace {

TEST(Schema, PrintsAJsonSchemaOfEveryFormat) {
    for (const char* what : {"scene", "study", "recording"}) {
        const test::ProgramResult result = test::run_program(std::string("schema ") + what);
        ASSERT_EQ(result.status, 0) << result.err;
        const nlohmann::json document = nlohmann::json::parse(result.out);
        EXPECT_EQ(document["properties"]["format"]["const"], std::string("trocar-") + what + "-1");
        for (const auto& key : document["required"]) EXPECT_TRUE(document["properties"].contains(key)) << key;
    }
    EXPECT_EQ(test::run_program("schema film").status, 2);
}

}  // namespace
}  // namespace trocar
