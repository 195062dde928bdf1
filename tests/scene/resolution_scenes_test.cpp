// Drawn scenes of interpenetration: their strata, and that each is what its name says by geometry alone.
#include "scene/resolution_scenes.hpp"

#include <gtest/gtest.h>

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

constexpr double window = 0.2;  // s

std::vector<TrianglePair> meeting(const Scene& scene, std::int64_t tick) {
    std::vector<TrianglePair> pairs;
    true_pairs(scene.topology, scripted_frame(scene, tick), pairs);
    return pairs;
}

std::int64_t first_with_contact(const Scene& scene) {
    std::int64_t tick = 0;
    while (static_cast<double>(tick) * scene.dt < scene.contact_off->to - 0.5 * scene.dt) ++tick;
    return tick;
}

/// m, true depth of the scripted frame at a tick, with sides followed from the first frame on and tissue at rest.
double scripted_depth(const Scene& scene, std::int64_t tick) {
    const std::int64_t first = -scene.prelude_ticks();
    DepthTruth truth(scene.topology, scripted_frame(scene, first));
    for (std::int64_t t = first + 1; t < tick; ++t) truth.follow(scripted_frame(scene, t));
    return truth.measure(scripted_frame(scene, tick)).residual_penetration;
}

TEST(ResolutionScenes, AreTwentyFourOfEachGroupAndOfTheSeedAlone) {
    const std::vector<DrawnScene> scenes = draw_resolution_scenes(1);
    const std::vector<DrawnScene> again = draw_resolution_scenes(1);
    const std::vector<DrawnScene> others = draw_resolution_scenes(2);
    std::map<std::string, int> groups;
    std::set<std::string> names;
    ASSERT_EQ(again.size(), scenes.size());
    ASSERT_EQ(others.size(), scenes.size());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        ++groups[scenes[i].group];
        names.insert(scenes[i].name);
        EXPECT_EQ(scenes[i].text, again[i].text);
        EXPECT_EQ(scenes[i].name.substr(0, scenes[i].name.find('_')),
                  others[i].name.substr(0, others[i].name.find('_')));
        EXPECT_NE(scenes[i].text, others[i].text);
        EXPECT_EQ(nlohmann::json::parse(scenes[i].text).at("name"), scenes[i].name);
    }
    EXPECT_EQ(names.size(), scenes.size());
    const std::map<std::string, int> expected{
        {"at rest", 24}, {"moving", 24}, {"silent detector", 24}, {"through in one tick", 24}, {"hand-held", 24}};
    EXPECT_EQ(groups, expected);
}

/// The seed of the shipped scenes is the first 8 hex digits of the SHA-256 of a former search's results, so that nobody
/// has chosen it: `git show d54d16e0:reports/response_search/results.csv | sha256sum`.
TEST(ResolutionScenes, OfTheStudyAreTheDrawOfItsSeed) {
    const std::filesystem::path folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/studies/scenes/resolution";
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) files += entry.is_regular_file() ? 1 : 0;
    const std::vector<DrawnScene> scenes = draw_resolution_scenes(0x39fc4971);
    EXPECT_EQ(files, scenes.size());
    for (const DrawnScene& scene : scenes) {
        EXPECT_EQ(read_whole(folder / (scene.name + ".json"), "a scene"), scene.text) << scene.name;
    }
}

TEST(ResolutionScenes, BeginApartMeetUnseenAndRestAtTheEndOfTheWindow) {
    for (const DrawnScene& drawn : draw_resolution_scenes(3)) {
        SCOPED_TRACE(drawn.name);
        const Scene scene = test::scene_from_text(drawn.text);
        ASSERT_TRUE(scene.contact_off);
        EXPECT_TRUE(meeting(scene, -scene.prelude_ticks()).empty()) << "the clean state";
        const std::int64_t begin = first_with_contact(scene);
        const bool is_blade = drawn.name.find("blade") != std::string::npos;
        EXPECT_EQ(meeting(scene, begin).empty(), is_blade);
        const std::int64_t end = begin + std::llround(window / scene.dt);
        EXPECT_LE(end, scene.ticks);
        EXPECT_EQ(scripted_frame(scene, end - 100).position, scripted_frame(scene, end - 1).position);
        EXPECT_GT(scripted_depth(scene, begin), 2e-4);
    }
}

TEST(ResolutionScenes, AToolAtRestIsAsDeepInASheetAsItsNameSays) {
    for (const DrawnScene& drawn : draw_resolution_scenes(4)) {
        if (!drawn.name.starts_with("rest_sheet") && !drawn.name.starts_with("rest_two")) continue;
        SCOPED_TRACE(drawn.name);
        const std::size_t number = drawn.name.find_first_of("0123456789");
        const double edges = std::stod(drawn.name.substr(number));
        EXPECT_NEAR(scripted_depth(test::scene_from_text(drawn.text), 0), edges * 0.005, 2e-4);
    }
}

TEST(ResolutionScenes, NoPinnedVertexIsInATool) {
    for (const DrawnScene& drawn : draw_resolution_scenes(5)) {
        SCOPED_TRACE(drawn.name);
        const Scene scene = test::scene_from_text(drawn.text);
        if (!scene.has_tissue()) continue;
        const std::int64_t tick = first_with_contact(scene) + 100;
        DepthTruth truth(scene.topology, scripted_frame(scene, tick));
        truth.follow(scripted_frame(scene, tick));
        for (Index tool = 0; tool < scene.topology.body_count(); ++tool) {
            if (scene.topology.bodies[at(tool)].kind != BodyKind::instrument) continue;
            for (Index v = 0; v < scene.topology.vertex_count; ++v) {
                if (scene.materials.mass[at(v)] > 0.0 && scene.materials.pinned[at(v)] != 0) {
                    EXPECT_EQ(truth.depth_of_vertex(v, tool), 0.0) << v;
                }
            }
        }
    }
}

}  // namespace
}  // namespace trocar
