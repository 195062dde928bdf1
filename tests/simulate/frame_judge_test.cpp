// Passages on frames whose bodies change their shape. The courses say how many there are, whatever the bodies do
// besides: they wobble and turn all the while.
#include "simulate/frame_judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/shapes.hpp"

namespace trocar {
namespace {

using test::make_world;
using test::Shape;

/// Motion of both bodies besides their course.
struct Manner {
    std::string name;
    double wobble;  ///< change of shape as a part of the size
    double turn;    ///< rad a frame, of everything together
};

const std::vector<Manner> manners{
    {"stiff", 0.0, 0.0}, {"stiff, turning", 0.0, 0.3}, {"soft", 0.12, 0.0}, {"soft, turning", 0.12, 0.3}};

/// Stretches along x and y, and bends along z.
Vector3 wobbled(const Vector3& p, double wobble, double size, int frame) {
    const double stretch = 1.0 + wobble * std::sin(0.7 * frame);
    const double bend = wobble * std::sin(0.4 * frame) / size;
    return {p.x() * stretch, p.y() / stretch, p.z() + bend * p.x() * p.x()};
}

/// Passages of all frames: `moving` goes through `places` (m), `other` stays.
/// Both are centred; `size` (m) of each.
std::int64_t passages(const test::Part& moving, double size_moving, const test::Part& other, double size_other,
                      const std::vector<Vector3>& places, const Manner& manner, FrameStart start) {
    const test::World world = make_world("judged", {moving, other});
    const auto count = static_cast<Eigen::Index>(moving.shape.vertices.size());
    const auto frame_at = [&](std::size_t number) {
        Frame frame = world.frame;
        const int time = static_cast<int>(number);
        const Matrix3 turned =
            Eigen::AngleAxisd(manner.turn * time, Vector3(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
        for (Eigen::Index v = 0; v < frame.position.cols(); ++v) {
            const bool moves = v < count;
            const Vector3 p = world.frame.position.col(v);
            const Vector3 now = moves ? wobbled(p, manner.wobble, size_moving, time + 3) + places[number]
                                      : wobbled(p, manner.wobble, size_other, time);
            frame.position.col(v) = turned * now + Vector3(0.1, 0.02, -0.05) * (manner.turn * time);
        }
        frame.tick = time;
        return frame;
    };
    FrameJudge judge(world.topology, frame_at(0), start, false, manner.name);
    std::int64_t sum = 0;
    for (std::size_t number = 0; number < places.size(); ++number) {
        sum += judge.judge(frame_at(number)).row.passed_through;
    }
    return sum;
}

/// From the first place to each of the next, `step` (m) a frame.
std::vector<Vector3> along(const std::vector<Vector3>& places, double step) {
    std::vector<Vector3> all{places.front()};
    for (std::size_t i = 1; i < places.size(); ++i) {
        const auto parts = static_cast<int>(std::ceil((places[i] - places[i - 1]).norm() / step));
        for (int k = 1; k <= parts; ++k) {
            all.push_back(places[i - 1] + (places[i] - places[i - 1]) * (static_cast<double>(k) / parts));
        }
    }
    return all;
}

struct Course {
    std::string name;
    std::vector<Vector3> places;
    std::int64_t passages;
};

test::Part part(Shape shape, bool closed = true) { return {BodyKind::tissue, std::move(shape), "", closed}; }

/// A rod of 6 mm and 60 mm length along z about its middle, and a ball of 20 mm.
TEST(FrameJudge, ARodPassesThroughABallThatChangesItsShapeAsOftenAsThroughAStiffOne) {
    Shape rod = test::shaft(0.003, 0.06, 8, 20);
    Vector3 middle = Vector3::Zero();
    for (const Vector3& p : rod.vertices) middle += p / static_cast<double>(rod.vertices.size());
    rod = rod.move(-middle);
    const Vector3 off(0.0013, -0.0007, 0.0);
    const Vector3 above = off + Vector3(0, 0, 0.06);
    const Vector3 below = off - Vector3(0, 0, 0.06);
    const std::vector<Course> courses{
        {"through, slowly", along({above, below}, 0.002), 1},
        {"through in one step", {above, above, below, below}, 1},
        {"through and back after a rest outside", along({above, below, below - 0.02 * Vector3::UnitZ(), above}, 0.003),
         2},
        {"pressed in to the middle and drawn back", along({above, off + Vector3(0, 0, 0.03), above}, 0.002), 0},
        {"sideways through the middle", along({off + Vector3(0.04, 0, 0), off - Vector3(0.04, 0, 0)}, 0.0015), 1},
        {"sideways through in one step", {off + Vector3(0.04, 0, 0), off - Vector3(0.04, 0, 0)}, 1},
        {"past it", along({Vector3(0.04, 0.03, 0.01), Vector3(-0.04, 0.03, 0.01)}, 0.002), 0},
        {"grazing it", along({Vector3(0.04, 0.0225, 0.0), Vector3(-0.04, 0.0225, 0.0)}, 0.002), 0},
    };
    for (const Course& course : courses) {
        for (const Manner& manner : manners) {
            EXPECT_EQ(passages(part(rod), 0.06, part(test::sphere(0.02, 16)), 0.02, course.places, manner,
                               FrameStart::unknown),
                      course.passages)
                << course.name << ", " << manner.name;
        }
    }
}

TEST(FrameJudge, ABallPassesThroughAClothThatWavesAsOftenAsThroughAStiffOne) {
    const Vector3 above(0.0007, 0.0011, 0.03);
    const Vector3 below(0.0007, 0.0011, -0.03);
    const std::vector<Course> courses{
        {"through, slowly", along({above, below}, 0.002), 1},
        {"through in one step", {above, above, below, below}, 1},
        {"through and back", along({above, below, above}, 0.003), 2},
        {"pressed in and drawn back", along({above, {0.0007, 0.0011, 0.004}, above}, 0.001), 0},
        {"through, round the rim and through again",
         along({above, below, {0.09, 0.0, -0.03}, {0.09, 0.0, 0.03}, above, below}, 0.004), 2},
        {"round the rim and back under it", along({above, {0.09, 0.0, 0.03}, {0.09, 0.0, -0.03}, below}, 0.004), 0},
    };
    // Meshes whose edges are longer and shorter than the ball is thick: through the inside of a triangle, too.
    for (const int n : {3, 24}) {
        for (const Course& course : courses) {
            for (const Manner& manner : manners) {
                for (const FrameStart start : {FrameStart::clean, FrameStart::unknown}) {
                    EXPECT_EQ(passages(part(test::sphere(0.002, 8)), 0.002, part(test::sheet(0.1, n), false), 0.1,
                                       course.places, manner, start),
                              course.passages)
                        << course.name << ", " << manner.name << ", " << n;
                }
            }
        }
    }
}

/// A closed plate of 60 x 60 x 1 mm that bulges by `bulge` (m) in its middle, frame by frame, and a ball of 3 mm whose
/// middle is `height` (m) above that of the plate at rest.
std::int64_t bulging(const std::vector<std::array<double, 2>>& bulge_and_height) {
    const test::World world = make_world("plate", {part(test::slab(0.06, 0.001, 14)), part(test::sphere(0.003, 10))});
    const Eigen::Index own = world.topology.bodies[0].vertices.count;
    const auto frame_at = [&](std::size_t number) {
        Frame frame = world.frame;
        const auto [bulge, height] = bulge_and_height[number];
        for (Eigen::Index v = 0; v < own; ++v) {
            const Vector3 p = world.frame.position.col(v);
            frame.position(2, v) += bulge * std::exp(-p.head<2>().squaredNorm() / (0.012 * 0.012));
        }
        frame.position.rightCols(frame.position.cols() - own).colwise() += Vector3(0.0004, 0.0007, height);
        frame.tick = static_cast<std::int64_t>(number);
        return frame;
    };
    FrameJudge judge(world.topology, frame_at(0), FrameStart::unknown, false, "plate");
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < bulge_and_height.size(); ++i) sum += judge.judge(frame_at(i)).row.passed_through;
    return sum;
}

TEST(FrameJudge, WhatRidesOnAThinPlateDoesNotPassThroughItAndWhatThePlatePassesOverDoes) {
    std::vector<std::array<double, 2>> ride;
    std::vector<std::array<double, 2>> pass_slowly;
    for (int i = 0; i <= 30; ++i) {
        const double bulge = -0.012 * std::sin(std::numbers::pi * i / 30.0);
        ride.push_back({bulge, 0.0032 + bulge});
        pass_slowly.push_back({-0.009 + 0.0006 * i, 0.0});
    }
    EXPECT_EQ(bulging(ride), 0) << "pressed down and released, 1.3 mm a frame at most";
    EXPECT_EQ(bulging({{-0.009, -0.0058}, {-0.003, 0.0002}, {0.003, 0.0062}, {0.009, 0.0122}}), 0) << "upwards";
    EXPECT_EQ(bulging({{0.009, 0.0122}, {0.003, 0.0062}, {-0.003, 0.0002}, {-0.009, -0.0058}}), 0) << "downwards";
    EXPECT_EQ(bulging(pass_slowly), 1);
    EXPECT_EQ(bulging({{-0.009, 0.0}, {0.009, 0.0}, {0.009, 0.0}}), 1) << "in one frame";
    EXPECT_EQ(bulging({{0.0, 0.0032}, {0.0, 0.0027}, {0.0, 0.0032}}), 0) << "into it and back while it keeps its shape";
}

TEST(FrameJudge, AClothPassesThroughAnotherThatWaves) {
    const std::vector<Vector3> through = along({{0.001, 0.002, 0.03}, {0.001, 0.002, -0.03}}, 0.003);
    const std::vector<Vector3> back = along({{0.001, 0.002, 0.03}, {0.001, 0.002, 0.006}, {0.001, 0.002, 0.03}}, 0.003);
    for (const Manner& manner : manners) {
        const auto count = [&](const std::vector<Vector3>& places) {
            return passages(part(test::sheet(0.03, 6), false), 0.03, part(test::sheet(0.1, 12), false), 0.1, places,
                            manner, FrameStart::unknown);
        };
        EXPECT_EQ(count(through), 1) << manner.name;
        EXPECT_EQ(count(back), 0) << manner.name;
    }
}

}  // namespace
}  // namespace trocar
