// The closed loops that the published default study reports end where they ended, with the same figures. Published
// tables are records of this program, or they are made anew.
#include "support/published_runs.hpp"

#include <gtest/gtest.h>

#include <set>

namespace trocar {
namespace {

/// One run of each scene in these modes. Those of the thesis' response stand in tests/measure.
void expect_same_runs(std::size_t least, const std::set<std::string>& modes) {
    std::set<std::string> scenes;
    const std::vector<Record> runs = test::published_runs([&](const RunSpec& spec) {
        if (!modes.contains(spec.mode) || spec.truth_stride == 0) return false;
        return parse_method(spec.response).name != "thesis" && scenes.insert(spec.mode + spec.scene).second;
    });
    ASSERT_GE(runs.size(), least);
    test::expect_the_same_again(runs);
}

TEST(PublishedRun, ClosedLoopsEndInTheSameStateWithTheSameFigures) { expect_same_runs(8, {"closed_loop"}); }

TEST(PublishedRun, RunsWithATwinAndSweepsDoToo) { expect_same_runs(5, {"resolution", "work_precision"}); }

}  // namespace
}  // namespace trocar
