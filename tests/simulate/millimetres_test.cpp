// The same scene described in metres and in millimetres differs by the rounding of its numbers. A method that has a
// reason for everything it decides shows the same force; one that lets rounding decide is named with its reason.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "measure/permutation.hpp"
#include "method/registry.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

constexpr const char* check = "MillimetresMakeNoDifference";

std::map<std::string, std::string> known_gaps() {
    std::ifstream file(std::string(TROCAR_SOURCE_DIR) + "/tests/known_gaps.json");
    std::map<std::string, std::string> gaps;
    const auto list = nlohmann::json::parse(file);
    for (const auto& gap : list.at("responses")) {
        EXPECT_EQ(gap.at("check").get<std::string>(), check);
        gaps[gap.at("method").get<std::string>()] = gap.at("reason").get<std::string>();
    }
    return gaps;
}

/// Largest difference of the force on the tool over the run, N; none where it cannot read these contacts.
std::optional<double> difference(const Scene& scene, const std::string& response) {
    constexpr std::int64_t ticks = 620;
    constexpr std::int64_t never = 1'000'000;
    const RunLimits limits{.watched = false};  // what jitters beyond its scripts' work goes on
    // Meeting triangles where they are read: ties among faces are theirs.
    const std::string contacts = test::meeting_triangles_or_own(parse_method(response));
    const Record one = test::run_scene_with(scene, response, never, ticks, limits, {}, contacts);
    const Record other = test::run_scene_with(through_millimetres(scene), response, never, ticks, limits, {}, contacts);
    if (one.outcome.kind == OutcomeKind::unsupported) return std::nullopt;
    EXPECT_EQ(one.outcome.kind, other.outcome.kind) << response;
    EXPECT_GT(one.summary.at(Metric::force_max_n), 0.1) << response;
    double most = 0.0;
    for (std::size_t i = 0; i < std::min(one.rows.size(), other.rows.size()); ++i) {
        most = std::max(most, (one.rows[i].tool_force - other.rows[i].tool_force).norm());
    }
    return most;
}

TEST(OwnResponses, MillimetresMakeNoDifference) {
    // Two tissues and a tool, every contact many faces' at once: what decides ties by rounding shows other forces.
    const Scene scene = test::shipped_scene("t2t_press");
    const std::map<std::string, std::string> gaps = known_gaps();
    constexpr double rounding = 1e-6;  // N, as in the metamorphic test of determinism
    std::size_t asked = 0;
    for (const ResponseEntry& entry : registry().responses()) {
        if (!entry.own) continue;
        const std::optional<double> most = difference(scene, entry.name);
        if (!most) continue;
        ++asked;
        const auto gap = gaps.find(entry.name);
        if (gap == gaps.end()) {
            EXPECT_LT(*most, rounding) << entry.name;
        } else {
            EXPECT_GE(*most, rounding) << "the known gap of " << entry.name << " is closed, remove it: " << gap->second;
        }
    }
    EXPECT_GT(asked, 3U);
}

}  // namespace
}  // namespace trocar
