// Nearest approach against every pair of triangles of every tick, and against a scene whose gap is known.
#include "simulate/nearest.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/triangle_distance.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"
#include "simulate/simulation.hpp"
#include "support/meshes.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

const BodyRange& body_of(const Scene& scene, const std::string& name) {
    const auto found = std::find_if(scene.topology.bodies.begin(), scene.topology.bodies.end(),
                                    [&name](const BodyRange& body) { return body.name == name; });
    return *found;
}

TEST(NearestApproach, OfAToolThatHoversIsTheGapOfItsFile) {
    const Scene scene = test::shipped_scene("hover");
    RunSpec spec;
    spec.mode = "closed_loop";
    spec.detector = "ohc";
    spec.response = "unilateral";
    spec.contacts = "tracked_proximity";
    spec.ticks = 30;
    spec.truth_stride = 0;
    NearestApproach nearest;
    double every_pair = std::numeric_limits<double>::infinity();
    RunLimits limits;
    limits.observe = [&](const Simulation& simulation, const StepRow&) {
        const Frame& frame = simulation.seen();
        nearest.observe(scene.topology, frame);
        if (frame.tick % 10 != 0) return;
        const auto corners = [&](Index t) { return corners_of(scene.topology.triangles, frame.position, t); };
        const Range sheet = body_of(scene, "sheet").triangles;
        const Range tool = body_of(scene, "tool").triangles;
        for (Index s = sheet.first; s < sheet.end(); ++s) {
            for (Index t = tool.first; t < tool.end(); ++t) {
                const double squared = triangle_distance(corners(s), corners(t)).squared_distance;
                every_pair = std::min(every_pair, std::sqrt(squared));
            }
        }
    };
    const Record record = run_closed_loop(scene, spec, limits);
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_NEAR(nearest.distance, 1e-4, 1e-12);  // "0.1 mm above it"
    EXPECT_NEAR(nearest.distance, every_pair, 1e-12);
    const bool first = scene.topology.bodies[static_cast<std::size_t>(nearest.body_a)].name == "sheet";
    const Box& sheet = first ? nearest.box_a : nearest.box_b;
    EXPECT_NEAR(sheet.max.x() - sheet.min.x(), 0.1, 1e-12);  // its size
}

TEST(NearestApproach, TakesTheTickInWhichTheyWereNearest) {
    Scene scene = test::shipped_scene("hover");
    NearestApproach nearest;
    Frame frame = scene.first;
    const Range tool = body_of(scene, "tool").vertices;
    for (const double up : {0.02, 0.001, 0.0305, 0.004}) {
        frame.tick += 1;
        frame.position = scene.first.position;
        for (Index v = tool.first; v < tool.end(); ++v) frame.position(2, v) += up;
        nearest.observe(scene.topology, frame);
    }
    EXPECT_EQ(nearest.tick, scene.first.tick + 2);
    EXPECT_NEAR(nearest.distance, 0.0011, 1e-12);
    EXPECT_NEAR(std::max(nearest.box_a.min.z(), nearest.box_b.min.z()), 0.0011, 1e-12);
}

}  // namespace
}  // namespace trocar
