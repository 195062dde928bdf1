// The figures that the published default study reports of the replays and of the thesis' runs come out again.
#include "support/published_runs.hpp"

#include <gtest/gtest.h>

#include <set>

namespace trocar {
namespace {

TEST(PublishedFigures, ReplaysAndRunsOfTheThesisHaveTheSame) {
    std::set<std::string> seen;
    const std::vector<Record> runs = test::published_runs([&seen](const RunSpec& spec) {
        const bool replay = spec.mode == "replay" && spec.detector == "ohc_clustered";
        const bool thesis = spec.mode == "closed_loop" && spec.truth_stride > 0 && spec.response.starts_with("thesis");
        return (replay || thesis) && seen.insert(spec.mode + spec.scene).second;
    });
    ASSERT_GE(runs.size(), 16U);
    test::expect_the_same_again(runs);
}

}  // namespace
}  // namespace trocar
