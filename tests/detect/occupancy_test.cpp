// The first level of ohc's cascade: every instruction set says the same, and no triangle with a shared cell is lost.
#include "detect/occupancy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>

#include "detect/lattice.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {
namespace {

/// A window of 100 × 300 × 512 coarse cells of 2^shift lattice cells each.
CellWindow window_on(const Lattice& lattice, int shift) {
    CellWindow window;
    const std::int64_t count[3] = {100, 300, 512};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        window.base[axis] = lattice.base(static_cast<int>(axis));
        window.origin[axis] = -70.0;
        window.first[axis] = -70.0;
        window.last[axis] = -71.0 + static_cast<double>(count[axis] << shift);
    }
    window.inverse = lattice.inverse();
    window.shift = shift;
    window.row = 128;
    window.plane = 128 * 300;
    return window;
}

std::vector<double> points_around(double query_distance, std::size_t count, std::mt19937& random) {
    std::uniform_real_distribution<double> anywhere(-query_distance, query_distance);
    std::vector<double> points(3 * count);
    for (std::size_t i = 0; i < points.size(); ++i) {
        points[i] = anywhere(random);
        if (i % 5 == 0) points[i] = std::round(points[i] * 200.0) / 200.0;  // on a boundary of cells of 0.01
        if (i % 41 == 0) points[i] *= 1e200;
    }
    return points;
}

/// What the plain loop says is held by the tests below and, as answers, by those of ohc against the oracle.
TEST(OccupancyKernels, EveryInstructionSetSaysWhatThePlainLoopDoes) {
    Lattice lattice;
    lattice.set(0.01, Vector3(0.3, -0.2, 0.1));
    std::mt19937 random(1);
    std::vector<std::uint32_t> field(std::size_t{128} * 300 * 512 / 32);
    for (std::uint32_t& word : field) word = static_cast<std::uint32_t>(random());
    std::vector<Index> corners(3 * 3000);
    const OccupancyKernels& plain = occupancy_kernels().back();
    for (const int shift : {0, 2}) {
        const CellWindow window = window_on(lattice, shift);
        for (const Index count : {0, 1, 2, 3, 7, 8, 9, 400}) {
            // Close together for one shift, so that corners of a triangle lie in cells next to each other.
            const std::vector<double> points = points_around(shift == 0 ? 8.0 : 0.1, at(count), random);
            for (Index& corner : corners)
                corner = static_cast<Index>(random() % std::max(1U, static_cast<unsigned>(count)));
            std::vector<Extent> boxes(random() % (box_sides::most + 1));
            for (Extent& box : boxes) {
                for (std::size_t k = 0; k < 3; ++k) {
                    box.low[k] = count == 0 ? 0.0 : points[3 * (random() % at(count)) + k];
                    box.high[k] = box.low[k] + (k == 0 ? 0.0 : 0.15);  // flat: touching counts
                }
            }
            const auto answer = [&](const OccupancyKernels& kernels) {
                std::vector<std::uint32_t> codes(at(count) + 1, 77U);
                kernels.encode(points.data(), count, window, codes.data());
                kernels.mark(field.data(), count, window, codes.data());
                std::vector<std::uint32_t> words(at(count) + 1, 77U);
                kernels.beside(points.data(), count, boxes, words.data());
                EXPECT_EQ(codes.back(), 77U) << "wrote behind the end, " << kernels.target;
                EXPECT_EQ(words.back(), 77U) << "wrote behind the end, " << kernels.target;
                std::vector<std::vector<Index>> found;
                for (const std::uint32_t mark : {0U, cell_code::mark}) {
                    if (count == 0) continue;
                    found.emplace_back(2950);
                    found.back().resize(
                        at(kernels.select(codes.data(), corners.data(), 11, 2950, mark, found.back().data())));
                }
                return std::tuple(codes, words, found);
            };
            for (const OccupancyKernels& kernels : occupancy_kernels()) {
                EXPECT_EQ(answer(kernels), answer(plain)) << kernels.target << ' ' << count;
            }
        }
    }
}

/// Two bodies of as many triangles of their own vertices, the first body's with something around them.
struct TwoBodies {
    TwoBodies(Index count, double distance) : triangles(count), around(distance), corners(2 * 3 * at(count)) {
        frame.position.resize(3, 2 * 3 * count);
        for (std::size_t k = 0; k < corners.size(); ++k) corners[k] = static_cast<Index>(k);
        lattice.set(1.0, Vector3::Zero());
    }
    [[nodiscard]] CellRange range_of(Index t) const {
        const Vector3 wider = Vector3::Constant(t < triangles ? around : 0.0);
        CellRange range{lattice.cell(frame.position.col(3 * t) - wider),
                        lattice.cell(frame.position.col(3 * t) + wider)};
        for (int k = 1; k < 3; ++k) {
            range.low = cell_min(range.low, lattice.cell(frame.position.col(3 * t + k) - wider));
            range.high = cell_max(range.high, lattice.cell(frame.position.col(3 * t + k) + wider));
        }
        return range;
    }
    /// The triangles of both bodies that may hold a shared cell, ascending.
    std::vector<Index> kept(Occupancy& occupancy) const {
        CellRange group[2] = {range_of(0), range_of(triangles)};
        for (Index t = 0; t < 2 * triangles; ++t) {
            CellRange& all = group[t / triangles];
            all.low = cell_min(all.low, range_of(t).low);
            all.high = cell_max(all.high, range_of(t).high);
        }
        occupancy.prepare(2 * 3 * triangles);
        occupancy.start(lattice, {cell_max(group[0].low, group[1].low), cell_min(group[0].high, group[1].high)},
                        around);
        const int spread = occupancy.spread_for(around);
        EXPECT_LE(spread, Occupancy::most_spread);
        std::vector<Index> wide;
        occupancy.encode(frame, {0, 3 * triangles});
        occupancy.add_vertices({0, 3 * triangles});
        occupancy.collect_wide(corners.data(), {0, triangles}, wide);
        for (const Index t : wide) occupancy.add(range_of(t));
        occupancy.merge(group[0], spread);
        occupancy.search_for_any(1);
        std::vector<Index> found;
        occupancy.encode(frame, {3 * triangles, 3 * triangles});
        occupancy.mark({3 * triangles, 3 * triangles});
        occupancy.collect(corners.data(), {triangles, triangles}, found);
        std::vector<Index> shared;
        for (const Index t : found) {
            if (occupancy.share(range_of(t))) shared.push_back(t);
        }
        occupancy.search_for_shared(spread);
        occupancy.mark({0, 3 * triangles});
        found.clear();
        occupancy.collect(corners.data(), {0, triangles}, found);
        for (const Index t : found) {
            if (occupancy.any_shared(range_of(t))) shared.push_back(t);
        }
        std::sort(shared.begin(), shared.end());
        return shared;
    }

    Index triangles;
    double around;
    Frame frame;
    std::vector<Index> corners;
    Lattice lattice;
};

/// Small triangles strewn around, some far outside, some large, and which cells both bodies hold, found cell by cell:
/// no triangle that holds one may be lost.
class OccupancyAround : public testing::TestWithParam<double> {};

TEST_P(OccupancyAround, LosesNoTriangleWithASharedCell) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const double query_distance : {4.0, 40.0, 700.0, 1e4}) {
        constexpr Index triangles = 600;
        TwoBodies bodies(triangles, GetParam());
        Matrix3X& position = bodies.frame.position;
        for (Index t = 0; t < 2 * triangles; ++t) {
            // Each body fills a part of space; they overlap in a third of it.
            Vector3 middle =
                query_distance * (random_vector(unit, random) + (t < triangles ? 0.6 : -0.6) * Vector3::UnitX());
            if (t >= triangles && t % 10 == 0) middle = position.col(3 * (t - triangles));  // a sure meeting
            const double size = t % 50 == 0 ? 0.2 * query_distance : 0.6;
            for (int k = 0; k < 3; ++k) {
                position.col(3 * t + k) = middle + size * random_vector(unit, random);
            }
        }
        Occupancy occupancy;
        const std::vector<Index> shared = bodies.kept(occupancy);
        int meetings = 0;
        for (Index a = 0; a < triangles; ++a) {
            for (Index b = triangles; b < 2 * triangles; ++b) {
                if (!bodies.range_of(a).overlaps(bodies.range_of(b))) continue;
                ++meetings;
                EXPECT_TRUE(std::binary_search(shared.begin(), shared.end(), a)) << query_distance;
                EXPECT_TRUE(std::binary_search(shared.begin(), shared.end(), b)) << query_distance;
                const CellRange common{cell_max(bodies.range_of(a).low, bodies.range_of(b).low),
                                       cell_min(bodies.range_of(a).high, bodies.range_of(b).high)};
                std::int64_t cells = 0;
                if (common.cell_count() < 1e5) {
                    occupancy.for_each_shared(common, [&cells](Cell) { ++cells; });
                    EXPECT_EQ(static_cast<double>(cells), common.cell_count());
                }
            }
        }
        EXPECT_GT(meetings, 20) << query_distance;
        EXPECT_LT(shared.size(), 2U * triangles) << "everything is kept, nothing was ruled out";
    }
}

INSTANTIATE_TEST_SUITE_P(Metres, OccupancyAround, testing::Values(0.0, 0.2, 0.9, 1.7));

/// Cells hold one pair each, six cells apart, so that nothing but the pair's own bit leads to it; each triangle of one
/// body lies in one cell, the other's reaches in from the next cell, where its first corner is. Bits of 32 cells share
/// a word along x: the pairs stand at every place of a word and beyond its ends.
TEST(OccupancySparse, LosesNoPairWhereverItStandsInAWord) {
    constexpr Index triangles = 17;
    constexpr int apart = 6;
    for (const bool first_reaches : {false, true}) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const double side : {-1.0, 1.0}) {
                for (int phase = 0; phase < apart; ++phase) {
                    TwoBodies bodies(triangles, 0.0);
                    for (Index t = 0; t < triangles; ++t) {
                        const Vector3 cell(apart * t + phase, 3.0, 3.0);  // the middle of one
                        const Index inside = first_reaches ? triangles + t : t;
                        const Index reaching = first_reaches ? t : triangles + t;
                        for (int k = 0; k < 3; ++k) {
                            const Vector3 corner = cell + 0.2 * Vector3::Unit(k);
                            bodies.frame.position.col(3 * inside + k) = corner;
                            bodies.frame.position.col(3 * reaching + k) = corner;
                        }
                        bodies.frame.position.col(3 * reaching) = cell + side * Vector3::Unit(axis);
                        ASSERT_EQ(bodies.range_of(inside).cell_count(), 1.0);
                        ASSERT_EQ(bodies.range_of(reaching).cell_count(), 2.0);
                    }
                    Occupancy occupancy;
                    const std::vector<Index> shared = bodies.kept(occupancy);
                    EXPECT_EQ(shared.size(), 2U * triangles)
                        << "axis " << axis << " side " << side << " phase " << phase << " reaching " << first_reaches;
                }
            }
        }
    }
}

}  // namespace
}  // namespace trocar::test
