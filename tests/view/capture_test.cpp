#include "view/capture.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_samples.hpp"

namespace trocar {
namespace {

PlayedFrame frame_at(const Scene& scene, std::int64_t tick, double depth, double force) {
    PlayedFrame frame;
    frame.tick = tick;
    frame.position = scene.first.position;
    frame.displacement = Matrix3X::Zero(3, scene.first.position.cols());
    frame.depth.assign(static_cast<std::size_t>(scene.topology.vertex_count), 0.0);
    frame.strain.assign(frame.depth.size(), 0.0);
    frame.row.tick = tick;
    frame.row.residual_penetration = depth;
    frame.row.tool_force = Vector3(0.0, 0.0, force);
    return frame;
}

std::vector<std::int64_t> ticks_of(const ViewedRun& run) {
    std::vector<std::int64_t> ticks;
    for (const ViewedFrame& frame : run.frames) ticks.push_back(frame.tick);
    return ticks;
}

TEST(RunCapture, KeepsEveryEighthTickTheWorstOnesAndTheLast) {
    const Scene scene = test::scene_from_text(test::poke_text());
    RunCapture capture(scene.topology, 8, true);
    for (std::int64_t tick = 0; tick < 31; ++tick) {
        capture.see(frame_at(scene, tick, tick == 13 ? 2e-3 : 1e-3, tick == 22 ? 5.0 : 1.0));
    }
    const ViewedRun run = capture.finish();
    EXPECT_EQ(ticks_of(run), (std::vector<std::int64_t>{0, 8, 13, 16, 22, 24, 30}));
    EXPECT_EQ(run.worst_depth.tick, 13);
    EXPECT_DOUBLE_EQ(run.worst_depth.value, 2e-3);
    EXPECT_EQ(run.worst_force.tick, 22);
    EXPECT_EQ(run.depth.size(), 31U) << "numbers are of every tick";
}

TEST(RunCapture, ATipBeyondASheetIsPaintedOnTheNearestTissueVertex) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const std::vector<Index> tissue = tissue_vertices(scene.topology);
    ASSERT_FALSE(tissue.empty());
    Index tool = -1;
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind == BodyKind::instrument) tool = body.vertices.first;
    }
    ASSERT_GE(tool, 0);
    const std::size_t target = tissue.size() / 2;
    PlayedFrame frame = frame_at(scene, 0, 3e-3, 1.0);
    frame.position.col(tool) = frame.position.col(tissue[target]) + Vector3(0.0, 0.0, -1e-6);
    frame.depth[static_cast<std::size_t>(tool)] = 3e-3;
    RunCapture capture(scene.topology, 8, true);
    capture.see(frame);
    const ViewedRun run = capture.finish();
    for (std::size_t k = 0; k < tissue.size(); ++k) {
        EXPECT_DOUBLE_EQ(run.frames.front().depth[k], k == target ? 3e-3 : 0.0);
    }
    EXPECT_DOUBLE_EQ(run.depth_max, 3e-3);
}

TEST(RunCapture, TheToolIsPushedWhereItsContactsAreByTheirForce) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const auto contact = [](Index other, double x, double force) {
        PlayedContact one;
        one.kind = ActingKind::pushed;
        one.body = 1;
        one.other = other;
        one.point = Vector3(x, 0.0, 0.0);
        one.force = Vector3(0.0, 0.0, -force);
        return one;
    };
    PlayedFrame frame = frame_at(scene, 0, 0.0, 1.0);
    for (const double newton : {1.0, 1e-6, 0.0}) {
        frame.contacts = {contact(0, 0.1, 3.0 * newton), contact(0, 0.5, newton), contact(2, 9.0, 5.0 * newton)};
        RunCapture capture(scene.topology, 8, true, 0);
        capture.see(frame);
        const ViewedRun run = capture.finish();
        EXPECT_DOUBLE_EQ(run.contact_force_max, 5.0 * newton);
        const Vector3& point = run.frames.front().tool_point;
        if (newton > 0.0) {
            EXPECT_NEAR(point.x(), (3.0 * 0.1 + 1.0 * 0.5) / 4.0, 1e-12) << newton;
        } else {
            EXPECT_TRUE(std::isnan(point.x())) << "no contact pushes";
        }
    }
}

TEST(RunCapture, FeaturesThatAreOnlyNearAreNoContactsToLookAt) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const auto reported = [](ActingKind kind, double depth, double x) {
        PlayedContact one;
        one.kind = kind;
        one.body = 1;
        one.other = 0;
        one.depth = depth;
        one.point = Vector3(x, 0.0, 0.0);
        return one;
    };
    PlayedFrame frame = frame_at(scene, 0, 0.0, 0.0);
    frame.contacts = {reported(ActingKind::found, -1e-4, 1.0), reported(ActingKind::found, 0.0, 2.0),
                      reported(ActingKind::found, 1e-9, 3.0), reported(ActingKind::pushed, -1e-4, 4.0),
                      reported(ActingKind::found, 1e-3, std::nan(""))};
    RunCapture capture(scene.topology, 8, true);
    capture.see(frame);
    const ViewedRun run = capture.finish();
    std::vector<double> seen;
    for (const ViewedContact& contact : run.frames.front().contacts) seen.push_back(contact.point.x());
    EXPECT_EQ(seen, (std::vector<double>{3.0, 4.0}));
}

TEST(RunCapture, WithoutAJudgeTheDepthIsThatOfTheDeepestVertex) {
    const Scene scene = test::scene_from_text(test::poke_text());
    PlayedFrame frame = frame_at(scene, 0, std::nan(""), 0.0);
    frame.depth.back() = 4e-3;
    RunCapture capture(scene.topology, 8, false);
    capture.see(frame);
    EXPECT_DOUBLE_EQ(capture.finish().worst_depth.value, 4e-3);
}

}  // namespace
}  // namespace trocar
