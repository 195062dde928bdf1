// Whether a vertex of tissue can have met another body on its way: by boxes that turn with the bodies.
#include "tissue/body_boxes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace trocar {
namespace {

constexpr double half = 0.05;    // m, of the shaft's length
constexpr double thick = 0.002;  // m, likewise across

/// Two sheets, of which only the first is tested against a long thin shaft, and the second against the first.
struct Scene {
    Topology topology = make_topology({{.name = "sheet", .kind = BodyKind::tissue, .vertex_count = 2},
                                       {.name = "patch", .kind = BodyKind::tissue, .vertex_count = 2},
                                       {.name = "shaft", .kind = BodyKind::instrument, .vertex_count = 8}},
                                      {{0, 1}, {0, 2}});
    Frame frame;

    Scene() {
        frame.position.resize(3, 12);
        frame.position.col(0) = Vector3(0.2, 0.0, 0.0);
        frame.position.col(1) = Vector3(0.2, 0.1, 0.0);
        frame.position.col(2) = Vector3(0.5, 0.5, 0.5);
        frame.position.col(3) = Vector3(0.6, 0.5, 0.5);
        frame.pose.resize(3);
        turn(0.0, Vector3::Zero());
    }
    /// Lays the shaft along x, then turns it about z (rad) and moves it (m).
    void turn(double angle, const Vector3& to) {
        frame.pose[2].rotation = Eigen::AngleAxisd(angle, Vector3::UnitZ());
        frame.pose[2].translation = to;
        for (int corner = 0; corner < 8; ++corner) {
            const Vector3 own((corner & 1) != 0 ? half : -half, (corner & 2) != 0 ? thick : -thick,
                              (corner & 4) != 0 ? thick : -thick);
            frame.position.col(4 + corner) = frame.pose[2].rotation * own + to;
        }
    }
};

TEST(BodyBoxes, APathThatComesNearABodyCountsAndOneThatStaysAwayDoesNot) {
    Scene scene;
    BodyBoxes boxes(scene.topology);
    boxes.start(scene.frame);
    const auto meets = [&](const Vector3& from, const Vector3& to, double distance) {
        return boxes.may_meet(0, from, to, distance);
    };
    EXPECT_TRUE(meets({0.0, 0.01, 0.0}, {0.0, -0.01, 0.0}, 0.0)) << "through the shaft";
    EXPECT_TRUE(meets({0.0, 0.004, 0.0}, {0.01, 0.004, 0.0}, 0.0025));
    EXPECT_FALSE(meets({0.0, 0.004, 0.0}, {0.01, 0.004, 0.0}, 0.0015));
    EXPECT_FALSE(meets({0.0, 0.01, 0.0}, {0.0, 0.004, 0.0}, 0.0015)) << "towards it, and it stops";
}

TEST(BodyBoxes, ABoxTurnsWithItsBody) {
    Scene scene;
    BodyBoxes boxes(scene.topology);
    scene.turn(std::numbers::pi / 4.0, Vector3(0.0, 0.0, 0.1));
    boxes.start(scene.frame);
    // Beside the middle of the shaft, within the box that its corners have along the axes of the world.
    const Vector3 beside(0.03, -0.03, 0.1);
    EXPECT_FALSE(boxes.may_meet(0, beside, beside + Vector3(0.0, 0.0, 0.001), 0.03));
    const Vector3 upon(0.03, 0.03, 0.1);
    EXPECT_TRUE(boxes.may_meet(0, upon, upon, 0.0));
}

TEST(BodyBoxes, FollowsWhatTheFrameSaysHasMoved) {
    Scene scene;
    BodyBoxes boxes(scene.topology);
    boxes.start(scene.frame);
    const Vector3 there(0.0, 0.0, 1.0);
    scene.turn(0.0, there);
    scene.frame.moved.emplace();
    boxes.follow(scene.frame);
    EXPECT_FALSE(boxes.may_meet(0, there, there, 0.0)) << "nothing was said to have moved";
    scene.frame.moved->push_back({11, 1});
    boxes.follow(scene.frame);
    EXPECT_TRUE(boxes.may_meet(0, there, there, 0.0));
    scene.turn(0.0, Vector3::Zero());
    scene.frame.moved.reset();
    boxes.follow(scene.frame);
    EXPECT_FALSE(boxes.may_meet(0, there, there, 0.0)) << "all may have moved";
}

TEST(BodyBoxes, TissueReachesWhereItHasBeenReportedTo) {
    Scene scene;
    BodyBoxes boxes(scene.topology);
    boxes.start(scene.frame);
    EXPECT_TRUE(boxes.has_opposite_tissue(0));
    EXPECT_TRUE(boxes.has_opposite_tissue(1));
    const Vector3 high(0.55, 0.5, 0.9);
    EXPECT_FALSE(boxes.may_meet(0, high, high, 0.01));
    boxes.extend(1, high);
    EXPECT_TRUE(boxes.may_meet(0, high, high, 0.01));
    EXPECT_FALSE(boxes.may_meet(1, high, high, 0.01)) << "a body does not meet itself, and the shaft is not its own";
}

TEST(BodyBoxes, WhatIsTestedAgainstNothingMayMeetAnything) {
    const Topology alone = make_topology({{.name = "sheet", .kind = BodyKind::tissue, .vertex_count = 1}});
    Frame frame;
    frame.position = Matrix3X::Zero(3, 1);
    BodyBoxes boxes(alone);
    boxes.start(frame);
    EXPECT_TRUE(boxes.may_meet(0, Vector3::Ones(), Vector3::Ones(), 0.0));
}

}  // namespace
}  // namespace trocar
