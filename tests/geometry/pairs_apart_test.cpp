#include "geometry/pairs_apart.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include "geometry/exact.hpp"
#include "support/meshes.hpp"
#include "support/random_vectors.hpp"

namespace trocar {
namespace {

using test::Faces;
using test::TriangleMesh;

/// A cone and the fan that closes it below: all boxes of either overlap those of the other.
TriangleMesh cone(Index sides) {
    std::vector<Vector3> points{{0, 0, 1}, {0, 0, 0}};
    Faces faces;
    for (Index s = 0; s < sides; ++s) {
        const double angle = 2.0 * std::numbers::pi * s / sides;
        points.emplace_back(std::cos(angle), std::sin(angle), 0.0);
        faces.push_back({0, 2 + s, 2 + (s + 1) % sides});
        faces.push_back({1, 2 + (s + 1) % sides, 2 + s});
    }
    return {points, faces};
}

/// A flat fan whose triangles have each a centre of their own, all but at one place.
TriangleMesh flat_fan(Index sides) {
    std::vector<Vector3> points;
    Faces faces;
    for (Index s = 0; s < sides; ++s) {
        const double from = 2.0 * std::numbers::pi * s / sides;
        const double to = 2.0 * std::numbers::pi * (s + 1) / sides;
        points.insert(points.end(), {Vector3(1e-9 * s, 0.0, 0.25), Vector3(std::cos(from), std::sin(from), 0.25),
                                     Vector3(std::cos(to), std::sin(to), 0.25)});
        faces.push_back({3 * s, 3 * s + 1, 3 * s + 2});
    }
    return {points, faces};
}

/// Corners on a coarse lattice: degenerate, coplanar and repeated triangles among them.
TriangleMesh lattice_heap(std::mt19937_64& random, Index count, Index vertices) {
    std::uniform_int_distribution<int> place(0, 3);
    std::uniform_int_distribution<Index> number(0, vertices - 1);
    std::vector<Vector3> points;
    for (Index v = 0; v < vertices; ++v) points.push_back(test::random_vector(place, random));
    Faces faces;
    while (static_cast<Index>(faces.size()) < count) {
        const std::array<Index, 3> c{number(random), number(random), number(random)};
        if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) faces.push_back(c);
    }
    return {points, faces};
}

bool share_a_vertex(const TriangleMesh& heap, Index s, Index t) {
    for (int i = 0; i < 9; ++i) {
        if (heap.triangles(i / 3, s) == heap.triangles(i % 3, t)) return true;
    }
    return false;
}

bool have_one_plane(const TriangleMesh& heap, Index s, Index t) {
    const Corners first = heap.corners(s);
    const Corners second = heap.corners(t);
    if (oracle_class(first, second) == PairClass::degenerate) return false;
    return std::all_of(second.begin(), second.end(),
                       [&first](const Vector3& p) { return orientation_sign(first[0], first[1], first[2], p) == 0; });
}

TEST(PairsApart, AreAllThatMeetWithoutACommonVertexOrPlane) {
    std::mt19937_64 random(4);
    std::vector<TriangleMesh> heaps{cone(40), flat_fan(40)};
    for (int round = 0; round < 4; ++round) {
        heaps.push_back(lattice_heap(random, 120, 40));
        heaps.push_back(lattice_heap(random, 120, 300));
        heaps.push_back(test::needles_and_faces(random, 150));
        heaps.push_back(cone(30));
        heaps.back().position += 0.02 * Matrix3X::Random(3, heaps.back().position.cols());
    }
    heaps.push_back(lattice_heap(random, 1, 9));
    heaps.push_back(TriangleMesh({}, {}));
    std::int64_t meeting = 0;
    std::int64_t reported = 0;
    for (const TriangleMesh& heap : heaps) {
        std::set<std::pair<Index, Index>> pairs;
        PairsApart(heap.position, heap.triangles).for_each([&](Index s, Index t) {
            EXPECT_TRUE(pairs.insert(std::minmax(s, t)).second);
            EXPECT_FALSE(share_a_vertex(heap, s, t));
            return true;
        });
        reported += static_cast<std::int64_t>(pairs.size());
        for (Index s = 0; s < heap.count(); ++s) {
            for (Index t = s + 1; t < heap.count(); ++t) {
                if (share_a_vertex(heap, s, t) || !oracle_intersect(heap.corners(s), heap.corners(t))) continue;
                if (have_one_plane(heap, s, t)) continue;
                ++meeting;
                EXPECT_TRUE(pairs.contains({s, t})) << s << ' ' << t;
            }
        }
    }
    EXPECT_GT(meeting, 5000);
    EXPECT_LT(reported, 5 * meeting);
}

/// Pairs of nodes examined, and pairs of triangles reported.
std::array<std::int64_t, 2> work_of(const TriangleMesh& heap) {
    std::int64_t reported = 0;
    const std::int64_t examined = PairsApart(heap.position, heap.triangles).for_each([&](Index, Index) {
        ++reported;
        return true;
    });
    return {examined, reported};
}

TEST(PairsApart, OfAConeGrowLittleFasterThanItsSides) {
    const auto [small, small_reported] = work_of(cone(500));
    const auto [large, large_reported] = work_of(cone(8000));
    EXPECT_LT(large, 32 * small);
    EXPECT_LT(large, 16000 * 100);
    EXPECT_LT(large_reported, 16000 * 20);
}

TEST(PairsApart, OfAFlatFaceAreNone) {
    const auto [examined, reported] = work_of(flat_fan(20000));
    EXPECT_EQ(examined, 1);
    EXPECT_EQ(reported, 0);
}

TEST(PairsApart, OfALineAreNoneAndItsHalvesAreSearchedAtOnceWhateverTheirOrder) {
    // 2 n - 1 nodes against themselves, and the two halves of n - 1 of them, which lie apart, against each other.
    constexpr Index count = 1000;
    std::vector<Vector3> points;
    Faces faces;
    for (Index t = 0; t < count; ++t) {
        const Vector3 x(t, 0.0, 0.0);
        points.insert(points.end(), {x, Vector3(x + Vector3(0.5, 0.0, 0.0)), Vector3(x + Vector3(0.0, 0.5, 0.25))});
        faces.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    std::mt19937_64 random(12);
    for (int order = 0; order < 3; ++order) {
        const TriangleMesh heap(points, faces);
        std::int64_t reported = 0;
        const auto report = [&reported](Index, Index) {
            ++reported;
            return true;
        };
        EXPECT_EQ(PairsApart(heap.position, heap.triangles).for_each(report, true), 3 * count - 2) << order;
        EXPECT_EQ(reported, 0) << order;
        std::shuffle(faces.begin(), faces.end(), random);
    }
}

TEST(PairsApart, OfNeedlesSideBySideAreThoseWhoseOwnBoxesOverlap) {
    // Both are 8 long and 0.25 wide; the second is moved, in the same units, along, beside and above the first. Aslant
    // to the axes the boxes that all triangles have overlap in any case.
    struct Move {
        Vector3 by;
        int reported;
    };
    const std::vector<Move> moves{{{0.5, 0.125, 0.0}, 1}, {{0.5, -0.125, 0.0}, 1}, {{-7.5, 0.0, 0.0}, 1},
                                  {{0.5, 0.375, 0.0}, 0}, {{0.5, -0.375, 0.0}, 0}, {{0.5, 0.125, 0.0625}, 0},
                                  {{8.5, 0.0, 0.0}, 0}};
    std::mt19937_64 random(13);
    std::normal_distribution<double> normal;
    for (int round = 0; round < 20; ++round) {
        Matrix3 axes;
        axes << 1, -1, 0, 1, 1, 0, 0, 0, 1;
        if (round > 0) axes = test::random_turn(normal, random).toRotationMatrix();
        for (const Move& move : moves) {
            std::vector<Vector3> points{{0.0, 0.0, 0.0}, {8.0, 0.0, 0.0}, {4.0, 0.25, 0.0}};
            for (std::size_t k = 0; k < 3; ++k) points.push_back(Vector3(points[k] + move.by));
            for (Vector3& point : points) point = Vector3(axes * point);
            const TriangleMesh heap(points, {{0, 1, 2}, {3, 4, 5}});
            int reported = 0;
            PairsApart(heap.position, heap.triangles)
                .for_each(
                    [&reported](Index, Index) {
                        ++reported;
                        return true;
                    },
                    true);
            EXPECT_EQ(reported, move.reported) << round << ": " << move.by.transpose();
        }
    }
}

}  // namespace
}  // namespace trocar
