// The first level of ohc's cascade: codes, marks and choices of every instruction set against their plain meaning.
#include "detect/occupancy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

TEST(OccupancyKernels, CodesAreTheLatticesNumbersClampedToTheWindow) {
    Lattice lattice;
    lattice.set(0.01, Vector3(0.3, -0.2, 0.1));
    std::mt19937 random(1);
    for (const OccupancyKernels& kernels : occupancy_kernels()) {
        for (const int shift : {0, 2}) {
            const CellWindow window = window_on(lattice, shift);
            for (const std::size_t count : {0U, 1U, 2U, 3U, 7U, 8U, 9U, 400U}) {
                const std::vector<double> points = points_around(8.0, count, random);
                std::vector<std::uint32_t> codes(count + 1, 77U);
                kernels.encode(points.data(), static_cast<Index>(count), window, codes.data());
                EXPECT_EQ(codes.back(), 77U) << "wrote behind the end, " << kernels.target;
                for (std::size_t v = 0; v < count; ++v) {
                    for (unsigned axis = 0; axis < 3; ++axis) {
                        const double cell = lattice.number(points[3 * v + axis], static_cast<int>(axis));
                        const double inside = std::min(std::max(cell, window.first[axis]), window.last[axis]);
                        EXPECT_EQ(cell_code::axis(codes[v], axis),
                                  std::floor((inside - window.origin[axis]) / (1 << shift)))
                            << kernels.target;
                    }
                }
            }
        }
    }
}

TEST(OccupancyKernels, MarksAreTheFieldsBits) {
    Lattice lattice;
    lattice.set(0.01, Vector3(0.0, 0.0, 0.0));
    const CellWindow window = window_on(lattice, 0);
    std::mt19937 random(2);
    std::vector<std::uint32_t> field(std::size_t{window.plane} * 512 / 32);
    for (std::uint32_t& word : field) word = static_cast<std::uint32_t>(random());
    const std::vector<double> points = points_around(4.0, 501, random);
    for (const OccupancyKernels& kernels : occupancy_kernels()) {
        std::vector<std::uint32_t> codes(501);
        kernels.encode(points.data(), 501, window, codes.data());
        const std::vector<std::uint32_t> plain = codes;
        kernels.mark(field.data(), 501, window, codes.data());
        for (std::size_t v = 0; v < codes.size(); ++v) {
            const std::size_t place = cell_code::axis(plain[v], 0) + std::size_t{128} * cell_code::axis(plain[v], 1) +
                                      std::size_t{128} * 300 * cell_code::axis(plain[v], 2);
            const bool set = ((field[place / 32] >> (place % 32)) & 1U) != 0;
            EXPECT_EQ(codes[v], plain[v] | (set ? 0x80000000U : 0U)) << kernels.target;
        }
    }
}

TEST(OccupancyKernels, TrianglesAreChosenByTheirFirstCornersMarkAndTheirWidth) {
    std::mt19937 random(3);
    std::vector<std::uint32_t> codes(64);
    std::vector<Index> corners(3 * 3000);
    for (Index& corner : corners) corner = static_cast<Index>(random() % codes.size());
    for (unsigned round = 0; round < 40; ++round) {
        // Numbers close together, so that differences of 0, 1 and 2 all come often; also at both ends of an axis.
        const std::uint32_t from[3] = {round % 3 == 0 ? 0U : 200U, round % 4 == 0 ? 508U : 31U, 300U};
        for (std::uint32_t& code : codes) {
            code = static_cast<std::uint32_t>(random() % 2) << 31U;
            for (unsigned axis = 0; axis < 3; ++axis)
                code |= (from[axis] + static_cast<std::uint32_t>(random() % (1U + round % 4U))) << (10 * axis);
        }
        for (const std::uint32_t mark : {0U, cell_code::mark}) {
            std::vector<Index> expected;
            for (Index t = 11; t < 11 + 2950; ++t) {
                const Index* const corner = &corners[3 * static_cast<std::size_t>(t)];
                bool chosen = (codes[static_cast<std::size_t>(corner[0])] & mark) != 0;
                for (const int k : {1, 2}) {
                    for (unsigned axis = 0; axis < 3; ++axis) {
                        const auto a =
                            static_cast<int>(codes[static_cast<std::size_t>(corner[0])] >> (10 * axis)) & 511;
                        const auto b =
                            static_cast<int>(codes[static_cast<std::size_t>(corner[k])] >> (10 * axis)) & 511;
                        chosen = chosen || std::abs(a - b) > 1;
                    }
                }
                if (chosen) expected.push_back(t);
            }
            for (const OccupancyKernels& kernels : occupancy_kernels()) {
                std::vector<Index> found(2950);
                const Index count = kernels.select(codes.data(), corners.data(), 11, 2950, mark, found.data());
                found.resize(static_cast<std::size_t>(count));
                EXPECT_EQ(found, expected) << kernels.target;
            }
        }
    }
}

TEST(OccupancyKernels, SidesReportWhetherATrianglesBoxOverlapsOneOfTheBoxes) {
    // Second derivation: the smallest and largest coordinate of the three corners against each box.
    std::mt19937 random(9);
    std::uniform_real_distribution<double> anywhere(-0.5, 0.5);
    constexpr std::size_t count = 301;
    for (const OccupancyKernels& kernels : occupancy_kernels()) {
        for (std::size_t box_count = 0; box_count <= box_sides::most; ++box_count) {
            std::vector<double> points = points_around(0.5, count, random);
            std::vector<Extent> boxes(box_count);
            for (Extent& box : boxes) {
                for (std::size_t k = 0; k < 3; ++k) {
                    box.low[k] = std::round(anywhere(random) * 200.0) / 200.0;
                    box.high[k] = box.low[k] + (k == 0 ? 0.0 : 0.15);  // flat: touching counts
                    points[3 * (7 * k + 1) + k] = box.low[k];
                }
            }
            std::vector<std::uint32_t> words(count + 1, 77U);
            kernels.beside(points.data(), count, boxes, words.data());
            EXPECT_EQ(words.back(), 77U) << "wrote behind the end, " << kernels.target;
            std::size_t overlapping = 0;
            for (std::size_t t = 0; t < 3000; ++t) {
                const std::array<std::size_t, 3> corner{random() % count, random() % count,
                                                        (t % 2 == 0 ? random() : t) % count};
                bool expected = false;
                for (const Extent& box : boxes) {
                    bool overlaps = true;
                    for (std::size_t k = 0; k < 3; ++k) {
                        const auto [least, most] = std::minmax(
                            {points[3 * corner[0] + k], points[3 * corner[1] + k], points[3 * corner[2] + k]});
                        overlaps = overlaps && least <= box.high[k] && box.low[k] <= most;
                    }
                    expected = expected || overlaps;
                }
                overlapping += expected ? 1 : 0;
                ASSERT_EQ(box_sides::any_overlap(words[corner[0]], words[corner[1]], words[corner[2]]), expected)
                    << kernels.target << ", " << box_count << " boxes";
            }
            EXPECT_LT(overlapping, 3000U);
            EXPECT_EQ(overlapping > 100, box_count > 0) << box_count;
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
