// Passages on frames whose bodies change their shape. What each motion is follows from how it is made; the bodies
// wobble and turn all the while.
#include "simulate/frame_judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/shapes.hpp"

namespace trocar {
namespace {

using test::make_world;
using test::Shape;

/// How the frames are made of what moves.
struct Manner {
    std::string name;
    double wobble;  ///< change of shape as a part of the size
    double turn;    ///< rad a frame, of everything together
};

const std::vector<Manner> manners{
    {"stiff", 0.0, 0.0}, {"stiff, turning", 0.0, 0.3}, {"soft", 0.12, 0.0}, {"soft, turning", 0.12, 0.3}};

/// Stretches along x and y, and bends along z; 0 in the first frame.
Vector3 wobbled(const Vector3& p, double wobble, double size, int frame) {
    const double stretch = 1.0 + wobble * std::sin(0.7 * frame);
    const double bend = wobble * std::sin(0.4 * frame) / size;
    return {p.x() * stretch, p.y() / stretch, p.z() + bend * p.x() * p.x()};
}

/// Passages of all frames; -1: a frame behind the first cannot say. `moving` goes through `places` (m), `other` stays.
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
        const std::int64_t now = judge.judge(frame_at(number)).row.passed_through;
        if (now < 0 && number > 0) return -1;
        sum += std::max<std::int64_t>(now, 0);
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
        {"round the rim and back under it", along({above, {0.09, 0.0, 0.03}, {0.09, 0.0, -0.03}, below}, 0.004), 0},
    };
    // Meshes whose edges are longer and shorter than the ball is thick.
    for (const int n : {4, 24}) {
        for (const Course& course : courses) {
            for (const Manner& manner : manners) {
                EXPECT_EQ(passages(part(test::sphere(0.006, 8)), 0.006, part(test::sheet(0.1, n), false), 0.1,
                                   course.places, manner, FrameStart::clean),
                          course.passages)
                    << course.name << ", " << manner.name << ", " << n;
            }
        }
    }
}

TEST(FrameJudge, OfTwoClothsThatWaveAPassageIsKnownFromACleanStartAlone) {
    const std::vector<Vector3> through = along({{0.001, 0.002, 0.03}, {0.001, 0.002, -0.03}}, 0.003);
    const auto count = [&](const Manner& manner, FrameStart start) {
        return passages(part(test::sheet(0.03, 6), false), 0.03, part(test::sheet(0.1, 12), false), 0.1, through,
                        manner, start);
    };
    for (const Manner& manner : manners) EXPECT_EQ(count(manner, FrameStart::clean), 1) << manner.name;
    EXPECT_EQ(count(manners.front(), FrameStart::unknown), 1) << "a stiff sheet is followed itself";
    EXPECT_EQ(count(manners.back(), FrameStart::unknown), -1);
}

}  // namespace
}  // namespace trocar
