#include "simulate/frame_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/recording.hpp"
#include "simulate/runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

TEST(SceneFrames, ThePathOfATickInWhichTheToolComesThroughDoesNotCountAsDepth) {
    // The ball, with one vertex straight below its middle, comes down by 0.1 mm a tick and is 1 µm through the plane of
    // the sheet when the tenth tick ends. It is above the sheet in all sub-steps but the last, so that it pushes no
    // further than it goes in that one.
    constexpr double path = 1e-4;     // m, of the ball in a tick
    constexpr double through = 1e-6;  // m
    constexpr double height = 0.008 + 10.0 * path - through;
    const Scene scene = test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"fall","unit":"m","dt":0.001,"ticks":20,"seed":1,"bodies":[
      {{"name":"sheet","kind":"tissue","closed":false,"parts":[{{"shape":"sheet","size":[0.06,0.06],"edge":0.006}}]}},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{{"shape":"sphere","radius":0.008,"edge":0.0024}}],
       "motion":{{"drive":"prescribed","keys":[{{"time":0,"pose":[0.001,0.0007,{},0,0,0]}},
                                              {{"time":0.05,"pose":[0.001,0.0007,{},0,0,0]}}]}}}}]}})",
        height, height - 50.0 * path));
    const auto lowest = [&scene](const Frame& frame, BodyKind kind) {
        double low = 1.0;
        for (const BodyRange& body : scene.topology.bodies) {
            if (body.kind != kind) continue;
            low = std::min(low, frame.position.row(2).segment(body.vertices.first, body.vertices.count).minCoeff());
        }
        return low;
    };
    const auto source = scene_frames(scene, 15);
    Frame frame;
    for (int tick = 0; tick <= 10; ++tick) ASSERT_TRUE(source->next(frame));
    ASSERT_NEAR(lowest(frame, BodyKind::instrument), -through, 1e-9);
    EXPECT_NEAR(lowest(frame, BodyKind::tissue), 0.0, 1e-12);
    ASSERT_TRUE(source->next(frame));
    EXPECT_GE(lowest(frame, BodyKind::tissue), -1.01 * path / scene.materials.substeps);
    while (source->next(frame)) {
    }
    EXPECT_LT(lowest(frame, BodyKind::tissue), -0.5 * path) << "three ticks later it has been pushed";
}

TEST(SceneFrames, ThatCannotBeMadeToTheEndAreReportedByEveryRunThatIsGivenThem) {
    Scene scene = test::scene_from_text(test::poke_text());
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        scene.first.position(2, body.vertices.first + body.vertices.count / 2) = std::nan("");
    }
    const auto source = scene_frames(scene, 60);
    Frame frame;
    EXPECT_TRUE(source->outcome().ok());
    EXPECT_FALSE(source->next(frame));
    EXPECT_EQ(source->outcome().kind, OutcomeKind::not_finite);
    EXPECT_TRUE(source->outcome().message.starts_with("no frame after 0 of 60: ")) << source->outcome().message;
    for (const char* mode : {"replay", "metamorphic"}) {
        RunSpec spec;
        spec.mode = mode;
        spec.detector = "brute_force";
        spec.ticks = 60;
        const Record record = make_run(scene, spec);
        EXPECT_EQ(record.outcome.kind, OutcomeKind::not_finite) << mode << ": " << record.outcome.message;
        EXPECT_TRUE(record.rows.empty()) << mode;
    }
}

TEST(RecordedFrames, GiveBackWhatWasWritten) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "frames.trocrec";
    {
        RecordingWriter writer(file, scene.topology, scene.dt);
        const auto source = scene_frames(scene, 7);
        Frame frame;
        while (source->next(frame)) writer.write(frame);
        writer.finish();
    }
    const auto source = scene_frames(scene, 7);
    const auto recorded = recorded_frames(file);
    EXPECT_EQ(source->frame_count(), 7);
    EXPECT_EQ(recorded->frame_count(), 7);
    EXPECT_EQ(recorded->dt(), scene.dt);
    EXPECT_EQ(recorded->topology().triangles, scene.topology.triangles);
    Frame a;
    Frame b;
    for (std::int64_t tick = 0; tick < 7; ++tick) {
        ASSERT_TRUE(source->next(a) && recorded->next(b));
        EXPECT_EQ(a.tick, tick);
        EXPECT_EQ(a.hash(), b.hash());
    }
    EXPECT_FALSE(source->next(a) || recorded->next(b));
}

}  // namespace
}  // namespace trocar
