// A tree of boxes against every triangle asked one after the other.
#include "geometry/surface_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "geometry/signed_crossing.hpp"
#include "geometry/triangle_distance.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"
#include "support/world_triangles.hpp"

namespace trocar::test {
namespace {

TEST(SurfaceTree, AnswersAreThoseOfAllTriangles) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-0.08, 0.08);
    int found = 0;
    for (const Shape& shape : {soup(300, 0.02, 0.1, 3), sphere(0.05, 16), slab(0.1, 0.02, 9), sheet(0.1, 1)}) {
        // Behind another body, whose triangles must not be reported.
        const World world = make_world("tree", {{BodyKind::instrument, sphere(0.04, 6)}, {BodyKind::tissue, shape}});
        const Range triangles = world.topology.bodies[1].triangles;
        std::vector<Index> chosen(static_cast<std::size_t>(triangles.count));
        std::iota(chosen.begin(), chosen.end(), triangles.first);
        const SurfaceTree tree(world.topology.triangles, chosen, world.frame.position);
        for (int k = 0; k < 300; ++k) {
            const Vector3 from = random_vector(uniform, random);
            const Vector3 to = random_vector(uniform, random);
            EXPECT_EQ(tree.nearest(from), nearest_of_all(world, triangles, from));
            int sum = 0;
            for (Index t = triangles.first; t < triangles.end(); ++t) {
                const Corners c = corners_of(world, t);
                sum += segment_crossing(from, to, c[0], c[1], c[2]);
            }
            EXPECT_EQ(tree.crossings(from, to), sum);
            found += sum != 0 ? 1 : 0;
            const Corners apart{from + Vector3(0.2, 0.0, 0.0), to + Vector3(0.2, 0.0, 0.0), Vector3(0.3, 0.0, 0.0)};
            double least = 0.2;
            for (Index t = triangles.first; t < triangles.end(); ++t) {
                least = std::min(least, std::sqrt(triangle_distance(apart, corners_of(world, t)).squared_distance));
            }
            EXPECT_EQ(tree.distance_to(apart, 0.2), least);
        }
    }
    EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace trocar::test
