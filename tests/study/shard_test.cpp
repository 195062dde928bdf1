// Which shard makes a run.
#include "study/shard.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "geometry/input_error.hpp"
#include "study/runner.hpp"

namespace trocar {
namespace {

std::vector<PlannedRun> plan_of(int count, const std::string& group = {}) {
    std::vector<PlannedRun> plan;
    for (int i = 0; i < count; ++i) {
        PlannedRun run;
        run.spec.study = "s";
        run.spec.mode = "replay";
        run.spec.detector = "d" + std::to_string(i);
        run.group = group;
        plan.push_back(run);
    }
    return plan;
}

std::map<std::string, std::int64_t> shards_of(std::vector<PlannedRun> plan, std::int64_t count) {
    assign_shards(count, 60.0, plan);
    std::map<std::string, std::int64_t> shards;
    for (const PlannedRun& run : plan) shards[run.spec.detector] = run.shard;
    return shards;
}

TEST(ReadShard, IsANumberOfANumberAndNothingElse) {
    const Shard shard = read_shard("3/17");
    EXPECT_EQ(shard.number, 3);
    EXPECT_EQ(shard.count, 17);
    EXPECT_EQ(read_shard("1/1").count, 1);
    EXPECT_EQ(read_shard("100000/100000").number, 100'000);
    for (const char* text : {"", "0/3", "4/3", "-1/3", "1/0", "1", "1/", "/3", "a/b", "1a/3", "1/3a", "1/3/4", "1/3 ",
                             " 1/3", "1:3", "1/100001", "1/99999999999999999999"}) {
        EXPECT_THROW((void)read_shard(text), InputError) << text;
    }
}

TEST(AssignShards, DependsOnTheRunAloneAndFillsEveryShard) {
    const std::map<std::string, std::int64_t> all = shards_of(plan_of(400), 7);
    std::map<std::int64_t, int> sizes;
    for (const auto& [run, shard] : all) ++sizes[shard];
    ASSERT_EQ(sizes.size(), 7U);
    EXPECT_EQ(sizes.begin()->first, 1);
    EXPECT_EQ(sizes.rbegin()->first, 7);
    // Of 400 runs 57 in the mean, with a standard deviation of 7.
    for (const auto& [shard, size] : sizes) EXPECT_NEAR(size, 57, 35) << shard;

    std::vector<PlannedRun> part = plan_of(400);
    part.erase(part.begin(), part.begin() + 150);
    std::reverse(part.begin(), part.end());
    for (const auto& [run, shard] : shards_of(part, 7)) EXPECT_EQ(shard, all.at(run)) << run;
}

TEST(AssignShards, KeepsAGroupTogether) {
    std::vector<PlannedRun> plan = plan_of(40, "one");
    for (const PlannedRun& run : plan_of(40, "two")) plan.push_back(run);
    for (std::size_t i = 40; i < 80; ++i) plan[i].spec.scene = "other";
    assign_shards(1000, 60.0, plan);
    std::map<std::string, std::set<std::int64_t>> shards;
    for (const PlannedRun& run : plan) shards[run.group].insert(run.shard);
    EXPECT_EQ(shards["one"].size(), 1U);
    EXPECT_EQ(shards["two"].size(), 1U);
    EXPECT_NE(shards["one"], shards["two"]);
}

}  // namespace
}  // namespace trocar
