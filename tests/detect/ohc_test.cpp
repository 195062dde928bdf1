// What ohc promises beyond the contract of every detector (METHODS §14, I1–I8): no setting changes the answer, and
// limits are kept and reported.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "detect/answers.hpp"
#include "detect/lattice.hpp"
#include "detect/ohc_meeting.hpp"
#include "support/world_triangles.hpp"

namespace trocar::test {
namespace {

using Pairs = std::vector<TrianglePair>;

ContactSet answer(const World& world, const Settings& settings = {}, const std::string& name = "ohc") {
    return first_answer(name, world, settings);
}

/// Positive and negative coordinates, spread over cells, with some vertices exactly on cell boundaries of h = 1/64 m.
World boundary_world() {
    World world = make_world("boundaries", {{BodyKind::instrument, soup(200, 0.02, 0.2, 31)},
                                            {BodyKind::tissue, soup(300, 0.01, 0.2, 32)},
                                            {BodyKind::tissue, sheet(0.25, 16)}});
    for (Index v = 0; v < world.topology.vertex_count; v += 3) {
        world.frame.position.col(v) = (world.frame.position.col(v) * 128.0).array().round().matrix() / 128.0;
    }
    return world;
}

TEST(Ohc, NoSettingChangesTheAnswer) {
    for (const double offset : {0.0, 1e4}) {
        World world = boundary_world();
        world.frame.position.array() += offset;
        const Pairs expected = pairs_of_oracle(world);
        ASSERT_GT(expected.size(), 50U);
        const std::vector<Settings> variants{{{"cell", "0.015625"}}, {{"cell", "0.0001"}},   {{"cell", "0.003"}},
                                             {{"cell", "0.1"}},      {{"cell", "10"}},       {{"cell", "1e-9"}},
                                             {{"cell", "1e6"}},      {{"hash", "teschner"}}, {{"work_budget", "1e12"}}};
        for (const Settings& settings : variants) {
            const ContactSet contacts = answer(world, settings);
            EXPECT_EQ(contacts.pairs, expected) << settings.begin()->first << "=" << settings.begin()->second;
            EXPECT_FALSE(contacts.truncated);
        }
    }
}

TEST(Ohc, AQueryDistanceOfManyCellsIsNotPutIntoCells) {
    World world = make_world("shaft, slab and a soup",
                             {{BodyKind::instrument, shaft(0.004, 0.1, 10, 20).move({0.001, 0.0003, -0.012})},
                              {BodyKind::tissue, slab(0.1, 0.01, 12).shake(0.0003, 3)},
                              {BodyKind::tissue, soup(120, 0.006, 0.05, 42)}});
    const auto truth = make_detector("brute_force", {});
    const auto detector = make_detector("ohc", {});
    truth->prepare(world.topology, world.frame);
    detector->prepare(world.topology, world.frame);
    // Three ticks of a tool that flies by, and one at rest: with 8 m around it a triangle covers 10^8 cells.
    for (const double query_distance : {0.001, 8.0, 0.3, 0.001}) {
        ++world.frame.tick;
        const ContactSet found = tick(*detector, world.frame, query_distance);
        const ContactSet expected = tick(*truth, world.frame, query_distance);
        EXPECT_EQ(found.pairs, expected.pairs) << query_distance;
        EXPECT_EQ(found.near, expected.near) << query_distance;
        EXPECT_LT(found.work.cells_visited, 2'000'000) << query_distance;
    }
}

TEST(Ohc, EveryOverlappingBoxPairIsTestedOnce) {
    // Where no triangle is cut into pieces, every two overlapping boxes become one triangle test: none lost, none
    // twice.
    const World world = boundary_world();
    std::int64_t overlapping = 0;
    std::vector<Box> boxes;
    for (Index t = 0; t < world.topology.triangle_count(); ++t) boxes.push_back(box_of(world, t));
    for (Index a = 0; a < world.topology.triangle_count(); ++a) {
        for (Index b = a + 1; b < world.topology.triangle_count(); ++b) {
            const auto body_a = world.topology.body_of_triangle[static_cast<std::size_t>(a)];
            const auto body_b = world.topology.body_of_triangle[static_cast<std::size_t>(b)];
            if (body_a != body_b && boxes[static_cast<std::size_t>(a)].overlaps(boxes[static_cast<std::size_t>(b)])) {
                ++overlapping;
            }
        }
    }
    for (const char* cell : {"0.0234", "0.05", "3"}) {
        EXPECT_EQ(answer(world, {{"cell", cell}}).work.triangle_tests, overlapping) << cell;
    }
}

/// Random boxes of bodies in a row of 1 m, each with random boxes of triangles inside it.
struct BoxedBodies {
    std::vector<Extent> bodies;
    std::vector<Primitive> triangles;

    BoxedBodies(std::size_t count, double query_distance, unsigned seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> part(0.0, 1.0);
        const auto inside = [&](double low, double high, double size, std::size_t k, Primitive& p) {
            p.low[k] = low + (high - low) * part(random);
            p.high[k] = std::min(high, p.low[k] + size * part(random));
        };
        for (std::size_t body = 0; body < count; ++body) {
            Extent box;
            for (std::size_t k = 0; k < 3; ++k) {
                box.low[k] = (k == 0 ? 1.0 : 0.3) * part(random);
                box.high[k] = box.low[k] + query_distance * part(random);
            }
            bodies.push_back(box);
            for (int t = 0; t < 40; ++t) {
                Primitive p{};
                p.body = static_cast<Index>(body);
                for (std::size_t k = 0; k < 3; ++k) inside(box.low[k], box.high[k], 0.05, k, p);
                triangles.push_back(p);
            }
        }
    }
};

TEST(MeetingBoxes, KeepEveryTriangleThatReachesIntoAnotherBodysBoxAndWithFewNeighboursNoOther) {
    // Second derivation: each triangle's box against the box of every body that its own may hit.
    const auto may_hit = [](Index a, Index b) { return (a + b) % 3 != 0; };
    std::size_t crowded = 0;
    std::size_t ruled_out = 0;
    for (const double query_distance : {0.05, 0.15, 0.6}) {
        const BoxedBodies scene(24, query_distance, 71);
        std::vector<Index> taking_part;
        for (Index body = 0; body < 24; ++body) {
            if (body != 5) taking_part.push_back(body);
        }
        MeetingBoxes meeting;
        meeting.prepare(24);
        for (int again = 0; again < 2; ++again) meeting.find(taking_part, scene.bodies, may_hit);
        EXPECT_FALSE(meeting.any(5));
        for (const Primitive& p : scene.triangles) {
            if (p.body == 5) continue;
            std::size_t neighbours = 0;
            bool reaches = false;
            for (const Index other : taking_part) {
                const Extent& box = scene.bodies[static_cast<std::size_t>(other)];
                if (other == p.body || !may_hit(p.body, other) ||
                    !box.overlaps(scene.bodies[static_cast<std::size_t>(p.body)])) {
                    continue;
                }
                ++neighbours;
                Extent own;
                std::copy_n(p.low.begin(), 3, own.low.begin());
                std::copy_n(p.high.begin(), 3, own.high.begin());
                reaches = reaches || box.overlaps(own);
            }
            EXPECT_EQ(meeting.any(p.body), neighbours > 0);
            if (neighbours <= 4) {
                EXPECT_EQ(meeting.may_meet(p), reaches);
            } else {
                EXPECT_TRUE(meeting.may_meet(p) || !reaches);
                ++crowded;
            }
            ruled_out += meeting.may_meet(p) ? 0 : 1;
        }
    }
    EXPECT_GT(crowded, 100U);
    EXPECT_GT(ruled_out, 100U);
}

TEST(Ohc, CellNumbersAreMonotone) {
    Lattice lattice;
    lattice.set(0.001, Vector3(-3.0, 2.0, 1e4));
    std::mt19937 random(5);
    std::uniform_real_distribution<double> near(-4.0, 4.0);
    for (int k = 0; k < 20000; ++k) {
        double x = near(random) + (k % 3 == 0 ? 1e4 : 0.0);
        if (k % 5 == 0) x = std::round(x * 1000.0) / 1000.0;
        if (k % 7 == 0) x *= 1e12;
        const double next = std::nextafter(x, INFINITY);
        const double far = x + std::abs(near(random));
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LE(lattice.number(x, axis), lattice.number(next, axis));
            EXPECT_LE(lattice.number(x, axis), lattice.number(far, axis));
        }
    }
}

TEST(Ohc, ARangeThatReachesTheLastCellIsReportedOnEveryAxisAndAtBothEnds) {
    Lattice lattice;
    lattice.set(1.0, Vector3::Zero());  // m: a whole number's cell has that number, up to 2^30 - 1 on both sides
    constexpr double last = 1073741823.0;
    for (int axis = 0; axis < 3; ++axis) {
        for (const bool at_low : {true, false}) {
            for (const double beyond : {-1.0, 0.0, 1e15}) {
                Vector3 low(-3.0, 2.0, 0.0);
                Vector3 high(5.0, 7.0, 1.0);
                (at_low ? low : high)[axis] = at_low ? -last - beyond : last + beyond;
                const CellRange range = lattice.range(Two{low[0], low[1]}, Two{high[0], high[1]}, Two{low[2], high[2]});
                EXPECT_EQ(Lattice::at_limit(range), beyond >= 0.0) << axis << " " << at_low << " " << beyond;
                const CellRange of_points{lattice.cell(low), lattice.cell(high)};
                EXPECT_EQ(Lattice::at_limit(of_points), beyond >= 0.0) << axis << " " << at_low << " " << beyond;
            }
        }
    }
}

TEST(Ohc, DistantBodiesCostNoCandidates) {
    const World world = make_world("apart", {{BodyKind::instrument, sphere(0.02, 20)},
                                             {BodyKind::tissue, sphere(0.02, 20).move({0.3, 0.0, 0.0})}});
    const ContactSet contacts = answer(world);
    EXPECT_EQ(contacts.work.box_tests, 0);
    EXPECT_EQ(contacts.work.triangle_tests, 0);
    EXPECT_TRUE(contacts.pairs.empty());
}

TEST(Ohc, ACellHasTheLengthThatTheFirstFrameWithAnyEdgesGivesItAndKeepsIt) {
    // 1.5 times the mean edge of the moving body with the shortest edges, the shaft; or the mean edge of all, where the
    // slab is so coarse that this is more. Two runs with cells of one length do the same work.
    for (const int quads : {30, 16}) {
        const World world =
            make_world("dip", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.0, 0.0003, -0.004})},
                               {BodyKind::tissue, slab(0.1, 0.01, quads).shake(0.0003, 3)},
                               {BodyKind::rigid, sphere(0.003, 12).move({0.004, 0.0, 0.001})}});
        std::array<double, 3> mean{};
        double sum = 0.0;
        for (std::size_t body = 0; body < 3; ++body) {
            const Range range = world.topology.bodies[body].triangles;
            for (Index t = range.first; t < range.end(); ++t) {
                for (int k = 0; k < 3; ++k) {
                    const Index from = world.topology.triangles(k, t);
                    const Index to = world.topology.triangles((k + 1) % 3, t);
                    mean[body] += (world.frame.position.col(to) - world.frame.position.col(from)).norm();
                }
            }
            sum += mean[body];
            mean[body] /= 3.0 * range.count;
        }
        const double mean_of_all = sum / (3.0 * world.topology.triangle_count());
        ASSERT_EQ(1.5 * mean[0] > mean_of_all, quads == 30);
        ASSERT_LT(mean[2], mean[0]) << "finer, but it does not move";
        const double cell = std::max(1.5 * mean[0], mean_of_all);

        const auto work = [&world](const std::string& edge, const Frame& first, const Frame& frame) -> WorkCounters {
            const auto detector = make_detector("ohc", {{"cell", edge}});
            detector->prepare(world.topology, first);
            return tick(*detector, frame).work;
        };
        const auto is_same = [](const WorkCounters& one, const WorkCounters& other) {
            return one.cells_visited == other.cells_visited && one.box_tests == other.box_tests;
        };
        const WorkCounters expected = work(fmt::format("{}", cell), world.frame, world.frame);
        EXPECT_FALSE(is_same(work(fmt::format("{}", 1.2 * cell), world.frame, world.frame), expected));
        Frame collapsed = world.frame;
        collapsed.position.setZero();
        Frame broken = world.frame;
        broken.position(1, 5) = std::numeric_limits<double>::quiet_NaN();
        for (const Frame* first : std::array<const Frame*, 3>{&world.frame, &collapsed, &broken}) {
            EXPECT_TRUE(is_same(work("auto", *first, world.frame), expected)) << quads;
        }
        Frame grown = world.frame;
        grown.position *= 4.0;
        EXPECT_TRUE(is_same(work("auto", world.frame, grown), work(fmt::format("{}", cell), world.frame, grown)));
    }
}

TEST(Ohc, EveryTriangleCountsInTheMeanEdgeThatACellHas) {
    // Edges of 3, 4 and 5 m twice and a hundredth of that once: (12 + 12 + 0.12) m over nine edges. With one edge more
    // a cell ended at 3.618 m and not at 4.02 m along x, and what both large boxes hold would be in three and not two.
    const World world =
        make_world("three", {{BodyKind::instrument, triangle({10.0, 1.0, 0.0}, {10.04, 1.0, 0.0}, {10.0, 1.03, 0.0})},
                             {BodyKind::tissue, triangle({0.1, 0.2, 0.0}, {4.1, 0.2, 0.0}, {0.1, 3.2, 0.0})},
                             {BodyKind::tissue, triangle({-0.2, 0.1, 0.0}, {3.8, 0.1, 0.0}, {-0.2, 3.1, 0.0})}});
    const auto cells_visited = [&world](const std::string& cell) {
        return answer(world, {{"cell", cell}}).work.cells_visited;
    };
    EXPECT_EQ(cells_visited("auto"), cells_visited(fmt::format("{}", 24.12 / 9.0)));
    EXPECT_NE(cells_visited("auto"), cells_visited(fmt::format("{}", 24.12 / 10.0)));
}

TEST(Ohc, StormOfEqualHashesIsStillRight) {
    // Cells along lines whose Teschner hashes agree in the 12 low bits, with which the map begins.
    Shape line;
    Shape crossing;
    for (int k = 0; k < 60; ++k) {
        const Vector3 x(4096.0 * k, 0.0, 0.0);
        line.add(triangle({0.1, 0.1, 0.5}, {0.9, 0.1, 0.5}, {0.4, 0.9, 0.5}).move(x));
        crossing.add(triangle({0.4, 0.3, 0.1}, {0.45, 0.35, 0.9}, {0.5, 0.3, 0.9}).move(x));
    }
    const World world = make_world("storm", {{BodyKind::tissue, line}, {BodyKind::tissue, crossing}});
    const Pairs expected = pairs_of_oracle(world);
    ASSERT_EQ(expected.size(), 60U);
    for (const char* hash : {"fibonacci", "teschner"}) {
        EXPECT_EQ(answer(world, {{"cell", "1"}, {"hash", hash}}).pairs, expected) << hash;
    }
}

TEST(OhcLimits, PairsOfTheLastTickComeFirst) {
    const World before = dipping(0, 20);
    const World after = dipping(1, 20);
    const Pairs old_pairs = answer(before).pairs;
    const Pairs new_pairs = answer(after).pairs;
    Pairs lasting;
    std::set_intersection(old_pairs.begin(), old_pairs.end(), new_pairs.begin(), new_pairs.end(),
                          std::back_inserter(lasting));
    ASSERT_GT(lasting.size(), 10U);
    ASSERT_LT(lasting.size(), new_pairs.size());
    const std::int64_t whole = answer(after).work.work();
    int cut = 0;
    for (std::int64_t budget = whole / 64; budget < whole; budget += whole / 64) {
        const auto detector = make_detector("ohc", {{"work_budget", std::to_string(budget)}});
        detector->prepare(before.topology, before.frame);
        const Pairs first = tick(*detector, before.frame).pairs;
        Pairs of_first;
        std::set_intersection(first.begin(), first.end(), lasting.begin(), lasting.end(), std::back_inserter(of_first));
        const ContactSet contacts = tick(*detector, after.frame);
        Pairs found = contacts.pairs;
        std::sort(found.begin(), found.end());
        Pairs added;
        std::set_difference(found.begin(), found.end(), first.begin(), first.end(), std::back_inserter(added));
        if (!contacts.truncated || added.empty()) continue;
        EXPECT_TRUE(std::includes(found.begin(), found.end(), of_first.begin(), of_first.end())) << budget;
        if (!of_first.empty()) ++cut;
    }
    EXPECT_GE(cut, 3);
}

/// Two tissues with very many pairs among themselves, all of lower numbers and inserted first, and an instrument that
/// meets them in a few places: the few must not be crowded out by the many, nor those of the tick before by new ones.
TEST(OhcLimits, InstrumentsComeBeforeTheCrowd) {
    const auto world_at = [](double x) {
        return make_world("crowd", {{BodyKind::tissue, soup(250, 0.012, 0.06, 51)},
                                    {BodyKind::tissue, soup(250, 0.012, 0.06, 52)},
                                    {BodyKind::instrument, shaft(0.002, 0.06, 8, 12).move({x, 0.0, 0.01})},
                                    {BodyKind::rigid, sphere(0.02, 10)}});
    };
    const auto touches_instrument = [](const World& world, const TrianglePair& pair) {
        const auto kind_of = [&world](Index t) {
            const Index body = world.topology.body_of_triangle[static_cast<std::size_t>(t)];
            return world.topology.bodies[static_cast<std::size_t>(body)].kind;
        };
        return kind_of(pair.a) == BodyKind::instrument || kind_of(pair.b) == BodyKind::instrument;
    };
    const auto count_touching = [&](const World& world, const Pairs& pairs) {
        return std::count_if(pairs.begin(), pairs.end(),
                             [&](const TrianglePair& pair) { return touches_instrument(world, pair); });
    };
    const World world = world_at(0.0);
    const Pairs all = pairs_of_oracle(world);
    const auto of_instrument = count_touching(world, all);
    ASSERT_GT(of_instrument, 20);
    ASSERT_GT(static_cast<std::ptrdiff_t>(all.size()), 4 * of_instrument);
    // A budget that ends among the instrument's pairs leaves nothing but those.
    const std::int64_t whole = answer(world).work.work();
    bool seen = false;
    for (std::int64_t budget = whole / 4; budget < whole; budget += whole / 64) {
        const ContactSet contacts = answer(world, {{"work_budget", std::to_string(budget)}});
        ASSERT_TRUE(contacts.truncated || contacts.pairs == all);
        const auto touching = count_touching(world, contacts.pairs);
        if (touching < of_instrument) {
            EXPECT_EQ(touching, static_cast<std::ptrdiff_t>(contacts.pairs.size()));
        }
        seen = seen || (touching > 0 && contacts.truncated);
    }
    EXPECT_TRUE(seen);
    // Second tick: what lasts of the first answer, whoever it concerns, then the instrument's.
    const World after = world_at(0.004);
    const Pairs all_after = pairs_of_oracle(after);
    int filled = 0;
    for (std::int64_t budget = whole / 2; budget < whole; budget += whole / 64) {
        const auto detector = make_detector("ohc", {{"work_budget", std::to_string(budget)}});
        detector->prepare(world.topology, world.frame);
        const Pairs first = tick(*detector, world.frame).pairs;
        const ContactSet contacts = tick(*detector, after.frame);
        Pairs lasting;
        std::set_intersection(first.begin(), first.end(), all_after.begin(), all_after.end(),
                              std::back_inserter(lasting));
        Pairs added;
        std::set_difference(contacts.pairs.begin(), contacts.pairs.end(), lasting.begin(), lasting.end(),
                            std::back_inserter(added));
        if (added.empty()) continue;
        EXPECT_TRUE(std::includes(contacts.pairs.begin(), contacts.pairs.end(), lasting.begin(), lasting.end()));
        const auto new_of_instrument = count_touching(after, all_after) - count_touching(after, lasting);
        EXPECT_EQ(count_touching(after, added),
                  std::min(static_cast<std::ptrdiff_t>(added.size()), static_cast<std::ptrdiff_t>(new_of_instrument)))
            << budget;
        if (contacts.truncated) ++filled;
    }
    EXPECT_GE(filled, 3);
}

}  // namespace
}  // namespace trocar::test
