#include "measure/environment.hpp"

#include <gtest/gtest.h>

#include "measure/allocations.hpp"

namespace trocar {
namespace {

TEST(Environment, ReportsMachineBuildAndSource) {
    const auto facts = environment();
    for (const char* key : {"cpu", "cores", "governor", "kernel", "load", "compiler", "flags", "build_type",
                            "assertions", "sanitizers", "allocations_counted", "version", "commit", "dirty"}) {
        ASSERT_TRUE(facts.contains(key)) << key;
        EXPECT_FALSE(facts.at(key).empty()) << key;
    }
    EXPECT_NE(facts.at("flags").find("-ffp-contract=off"), std::string::npos) << facts.at("flags");
    const std::string& commit = facts.at("commit");
    EXPECT_TRUE(commit == "unknown" || commit.size() == 40) << commit;
    const std::string& dirty = facts.at("dirty");
    EXPECT_TRUE(dirty == "yes" || dirty == "no" || dirty == "unknown") << dirty;
    EXPECT_EQ(facts.at("dirty") == "unknown", commit == "unknown");
}

TEST(Allocations, WithoutACounterTheCountIsNotKnown) {
    EXPECT_EQ(allocation_count(), -1);
    set_allocation_counter([]() -> std::int64_t { return 42; });
    EXPECT_EQ(allocation_count(), 42);
    set_allocation_counter(nullptr);
}

}  // namespace
}  // namespace trocar
