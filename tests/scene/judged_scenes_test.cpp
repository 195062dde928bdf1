// Judged scenes: their kinds, and by geometry alone that bodies begin apart, meet, and can bear their tool.
#include "scene/judged_scenes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "geometry/whole_file.hpp"
#include "measure/depth_truth.hpp"
#include "measure/pair_truth.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

std::vector<TrianglePair> meeting_at(const Scene& scene, std::int64_t tick) {
    std::vector<TrianglePair> pairs;
    true_pairs(scene.topology, scripted_frame(scene, tick), pairs);
    return pairs;
}

bool is_tissue(const Scene& scene, Index triangle) {
    return scene.topology.bodies[at(scene.topology.body_of_triangle[at(triangle)])].kind == BodyKind::tissue;
}

/// The tick at which the scripts alone are deepest: in the middle of the hold, or of the drag.
std::int64_t deepest_tick(const Scene& scene) {
    const std::vector<MotionKey>* keys = nullptr;
    for (const SceneBody& body : scene.bodies) {
        if (body.motion) keys = &body.motion->keys;
    }
    return std::llround(0.5 * ((*keys)[1].time + (*keys)[2].time) / scene.dt);
}

TEST(JudgedScenes, AreFiveOfEachOfTwelveKindsAndOfTheSeedAlone) {
    const std::vector<DrawnScene> scenes = draw_judged_scenes(1);
    const std::vector<DrawnScene> again = draw_judged_scenes(1);
    const std::vector<DrawnScene> others = draw_judged_scenes(2);
    std::map<std::string, int> kinds;
    std::set<std::string> names;
    ASSERT_EQ(again.size(), scenes.size());
    ASSERT_EQ(others.size(), scenes.size());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        ++kinds[scenes[i].group];
        names.insert(scenes[i].name);
        EXPECT_EQ(scenes[i].name.substr(0, scenes[i].name.rfind('_')), scenes[i].group);
        EXPECT_EQ(scenes[i].text, again[i].text);
        EXPECT_EQ(scenes[i].name, others[i].name);
        EXPECT_NE(scenes[i].text, others[i].text);
        EXPECT_EQ(nlohmann::json::parse(scenes[i].text).at("name"), scenes[i].name);
    }
    EXPECT_EQ(names.size(), 60U);
    EXPECT_EQ(kinds.size(), 12U);
    for (const auto& [kind, count] : kinds) EXPECT_EQ(count, 5) << kind;
}

/// First 8 hex digits of the SHA-256 of a file, by coreutils.
std::uint64_t seed_of(const std::filesystem::path& file) {
    std::array<char, 9> digits{};
    FILE* sum = popen(("sha256sum '" + file.string() + "'").c_str(), "r");
    if (sum == nullptr || std::fread(digits.data(), 1, 8, sum) != 8) ADD_FAILURE() << "sha256sum does not run";
    if (sum != nullptr) pclose(sum);
    return std::strtoull(digits.data(), nullptr, 16);
}

/// The seed of the shipped scenes follows from the file of tuned settings, so that nobody has chosen it.
TEST(JudgedScenes, OfTheStudyAreTheDrawOfItsSeed) {
    const std::filesystem::path folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/studies/scenes/judged";
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) files += entry.is_regular_file() ? 1 : 0;
    const std::vector<DrawnScene> scenes =
        draw_judged_scenes(seed_of(std::string(TROCAR_SOURCE_DIR) + "/bench/tuned.json"));
    EXPECT_EQ(files, scenes.size());
    for (const DrawnScene& scene : scenes) {
        EXPECT_EQ(read_whole(folder / (scene.name + ".json"), "a scene"), scene.text) << scene.name;
    }
}

TEST(JudgedScenes, OfTheSearchAreOfAnotherSeedAndOfNoKindThatIsKeptFromIt) {
    const std::filesystem::path folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/studies/scenes/training";
    std::map<std::string, std::string> drawn;
    for (const DrawnScene& scene : draw_judged_scenes(1)) drawn[scene.name] = scene.text;
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (!entry.is_regular_file()) continue;
        const std::string name = entry.path().stem().string();
        ++files;
        EXPECT_EQ(read_whole(entry.path(), "a scene"), drawn[name]) << name;
        for (const char* kept : {"drag_organ", "side_organ", "held_organ", "over_bone"}) {
            EXPECT_FALSE(name.starts_with(kept)) << name;
        }
    }
    EXPECT_EQ(files, 12U);
}

class JudgedScenesOfSeeds : public testing::TestWithParam<std::uint64_t> {};

TEST_P(JudgedScenesOfSeeds, BeginApartAndMeet) {
    for (const DrawnScene& drawn : draw_judged_scenes(GetParam())) {
        SCOPED_TRACE(drawn.name);
        const Scene scene = test::scene_from_text(drawn.text);
        EXPECT_TRUE(scene.has_tissue());
        EXPECT_GE(scene.ticks, 500);
        EXPECT_LE(scene.ticks, 750);
        EXPECT_TRUE(meeting_at(scene, 0).empty());
        DepthTruth truth(scene.topology, scripted_frame(scene, 0));
        EXPECT_EQ(truth.measure(scripted_frame(scene, 0)).wrong_side, 0) << "no body is inside another one";
        EXPECT_FALSE(meeting_at(scene, deepest_tick(scene)).empty()) << "the tool is in tissue at rest";
        EXPECT_TRUE(meeting_at(scene, scene.ticks - 1).empty()) << "the tool has left";
    }
}

TEST_P(JudgedScenesOfSeeds, NothingRigidMeetsAndNoPinnedVertexIsInATool) {
    for (const DrawnScene& drawn : draw_judged_scenes(GetParam())) {
        SCOPED_TRACE(drawn.name);
        const Scene scene = test::scene_from_text(drawn.text);
        DepthTruth truth(scene.topology, scripted_frame(scene, 0));
        for (std::int64_t tick = 0; tick < scene.ticks; tick += 20) {
            for (const TrianglePair& pair : meeting_at(scene, tick)) {
                ASSERT_TRUE(is_tissue(scene, pair.a) || is_tissue(scene, pair.b)) << "tick " << tick;
            }
            truth.follow(scripted_frame(scene, tick));
            for (Index tool = 0; tool < scene.topology.body_count(); ++tool) {
                if (scene.topology.bodies[at(tool)].kind == BodyKind::tissue) continue;
                for (Index v = 0; v < scene.topology.vertex_count; ++v) {
                    if (scene.materials.mass[at(v)] > 0.0 && scene.materials.pinned[at(v)] != 0) {
                        ASSERT_EQ(truth.depth_of_vertex(v, tool), 0.0) << "tick " << tick << ", vertex " << v;
                    }
                }
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Seeds, JudgedScenesOfSeeds, testing::Values(0xbb2f629dULL, 1ULL, 15ULL));

}  // namespace
}  // namespace trocar
