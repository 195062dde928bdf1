// What ohc_clustered promises beyond the contract of every detector: the same answer in every vertex order and with
// every instruction set, work only where something moved or is near, limits kept and reported.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <string>

#include "detect/answers.hpp"
#include "detect/cluster_kernels.hpp"
#include "detect/clusters.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {
namespace {

ContactSet answer(const World& world, const Settings& settings = {}, const std::string& name = "ohc_clustered") {
    return first_answer(name, world, settings);
}

TEST(ClusterKernels, EveryInstructionSetAgreesWithThePlainComparison) {
    std::mt19937 random(9);
    // Few values, so that boxes often touch exactly.
    std::uniform_int_distribution<int> number(-6, 6);
    for (const ClusterKernels& kernels : cluster_kernels()) {
        SCOPED_TRACE(kernels.target);
        for (int round = 0; round < 300; ++round) {
            SixteenBoxes boxes;
            FloatBox box{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t i = 0; i <= fan; ++i) {
                    const int a = number(random);
                    const int b = number(random);
                    (i < fan ? boxes.low[axis][i] : box.low[axis]) = 0.125F * static_cast<float>(std::min(a, b));
                    (i < fan ? boxes.high[axis][i] : box.high[axis]) = 0.125F * static_cast<float>(std::max(a, b));
                }
            }
            const std::uint32_t mask = kernels.overlaps(boxes, box);
            EXPECT_EQ(mask >> fan, 0U);
            for (std::size_t j = 0; j < fan; ++j) {
                bool overlap = true;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    overlap = overlap && boxes.low[axis][j] <= box.high[axis] && box.low[axis] <= boxes.high[axis][j];
                }
                ASSERT_EQ((mask >> j) & 1U, overlap ? 1U : 0U);
            }
        }
    }
}

TEST(ClusterKernels, FloatBoxesThatTouchInDoubleNeverLookApart) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const FloatFrame frame{.origin = {1e3, -1e3, 0.5}, .scale = 0.25};
    for (std::size_t at = 0; at < cluster_kernels().size(); ++at) {
        const ClusterKernels& kernels = cluster_kernels()[at];
        SCOPED_TRACE(kernels.target);
        for (int round = 0; round < 2000; ++round) {
            // Triangles 0 and 1 share exactly one coordinate plane: 0 ends where 1 begins.
            Matrix3X points(3, 6);
            for (double& x : points.reshaped()) x = uniform(random);
            const Eigen::Index axis = round % 3;
            const double common = 2.0 * uniform(random);
            for (Eigen::Index k = 0; k < 3; ++k) points(axis, k) = common - uniform(random);
            for (Eigen::Index k = 3; k < 6; ++k) points(axis, k) = common + uniform(random);
            points(axis, 1) = common;
            points(axis, 4) = common;
            for (Eigen::Index other = 0; other < 3; ++other) {
                if (other != axis) points.row(other).tail<3>() = points.row(other).head<3>();
            }
            points.colwise() += Vector3(frame.origin[0], frame.origin[1], frame.origin[2]);
            points.row(axis).segment<1>(4) = points.row(axis).segment<1>(1);
            const std::array<Index, 6> number{0, 1, 2, 3, 4, 5};
            std::array<FloatPoint, 6> floats{};
            FloatBox whole{};
            vertex_kernels()[at].to_floats(points.data(), number.data(), 6, frame, floats.data(), whole);
            for (std::size_t k = 0; k < 3; ++k) {
                const auto less = [k](const FloatPoint& a, const FloatPoint& b) { return a.x[k] < b.x[k]; };
                EXPECT_EQ(whole.low[k], std::min_element(floats.begin(), floats.end(), less)->x[k]);
                EXPECT_EQ(whole.high[k], std::max_element(floats.begin(), floats.end(), less)->x[k]);
            }
            ClusterCorners corners{};
            for (std::size_t t = 0; t < fan; ++t) {
                for (std::size_t k = 0; k < 3; ++k) corners[t][k] = static_cast<std::uint16_t>(t < 8 ? k : 3 + k);
            }
            SixteenBoxes boxes;
            kernels.boxes_of_triangles(floats.data(), corners, boxes);
            EXPECT_EQ(kernels.overlaps(boxes, box_of(boxes, 0)), 0xFFFFU);
            EXPECT_EQ(kernels.overlaps(boxes, box_of(boxes, 8)), 0xFFFFU);
            SixteenBoxes of_places = boxes;
            const std::array<std::uint16_t, 3> places{0, 1, 2};
            kernels.box_of_places(floats.data(), places.data(), 3, 5, of_places);
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_EQ(of_places.low[k][5], boxes.low[k][0]);
                EXPECT_EQ(of_places.high[k][5], boxes.high[k][0]);
            }
        }
    }
}

TEST(Clusters, BlocksArePartsOfTheOrderWithoutJumps) {
    // Two strips a hundred lengths apart, 37 vertices before the jump, in one body.
    constexpr Index before = 37;
    Shape strips;
    for (Index v = 0; v < 200; ++v) strips.vertices.emplace_back((v < before ? 0.0 : 1e4) + v / 2, v % 2, 0.0);
    for (Index t = 0; t < 198; ++t) strips.triangles.push_back({t, t + 1, t + 2});
    const World world = make_world("strips", {{BodyKind::instrument, strips}, {BodyKind::tissue, strips}});
    for (const ClusterOrder order : {ClusterOrder::given, ClusterOrder::local}) {
        const BodyRange& range = world.topology.bodies[1];
        const ClusteredBody body = cluster_body(world.topology, world.frame, range, order);
        ASSERT_EQ(body.block_begin.size(), static_cast<std::size_t>(body.block_count) + 1);
        EXPECT_EQ(body.block_begin.front(), 0);
        EXPECT_EQ(body.block_begin.back(), range.vertices.count);
        for (Index block = 0; block < body.block_count; ++block) {
            const Index begin = body.block_begin[static_cast<std::size_t>(block)];
            const Index end = body.block_begin[static_cast<std::size_t>(block) + 1];
            ASSERT_LT(begin, end);
            EXPECT_LE(end - begin, block_size);
            Box box;
            for (Index k = begin; k < end; ++k) {
                const Index v = order == ClusterOrder::given ? range.vertices.first + k
                                                             : body.vertex_order[static_cast<std::size_t>(k)];
                EXPECT_EQ(body.block_of[static_cast<std::size_t>(v - range.vertices.first)], block);
                if (k > begin && order == ClusterOrder::local) {
                    EXPECT_GT(v, body.vertex_order[static_cast<std::size_t>(k) - 1]);
                }
                box.add(world.frame.position.col(v));
            }
            EXPECT_LT((box.max - box.min).maxCoeff(), 100.0) << "block " << block;
        }
    }
}

TEST(OhcClustered, VectorsMakeNoDifference) {
    const World world = dipping(0, 30);
    const ContactSet best = answer(world);
    const ContactSet scalar = answer(world, {{"simd", "scalar"}});
    EXPECT_EQ(scalar.pairs, best.pairs);
    EXPECT_EQ(scalar.work.work(), best.work.work());
}

TEST(OhcClustered, WhatRestsCostsALookAndNoMore) {
    for (const char* order : {"given", "local"}) {
        World world = dipping(0, 30);
        const auto expected = answer(world, {}, "brute_force").pairs;
        ASSERT_GT(expected.size(), 20U);
        const auto detector = make_detector("ohc_clustered", {{"order", order}});
        detector->prepare(world.topology, world.frame);
        EXPECT_GT(tick(*detector, world.frame).work.triangle_tests, 0);
        // Without moved ranges all vertices are read, and nothing else.
        const ContactSet compared = tick(*detector, world.frame);
        EXPECT_EQ(compared.pairs, expected);
        EXPECT_EQ(compared.work.vertices_read, world.topology.vertex_count);
        EXPECT_EQ(compared.work.work(), world.topology.vertex_count);
        // An empty list of moved ranges: no work at all.
        world.frame.moved = std::vector<Range>{};
        const ContactSet rested = tick(*detector, world.frame);
        EXPECT_EQ(rested.pairs, expected);
        EXPECT_EQ(rested.work.work(), 0);
        // A listed range that rested: the blocks that hold it are examined as a whole.
        const BodyRange& range = world.topology.bodies[1];
        world.frame.moved = std::vector<Range>{{range.vertices.first, 20}};
        const ContactSet searched = tick(*detector, world.frame);
        EXPECT_EQ(searched.pairs, expected);
        const bool given = std::string(order) == "given";
        const ClusteredBody body =
            cluster_body(world.topology, world.frame, range, given ? ClusterOrder::given : ClusterOrder::local);
        const std::set<Index> blocks(body.block_of.begin(), body.block_of.begin() + 20);
        const auto in_blocks =
            std::count_if(body.block_of.begin(), body.block_of.end(), [&](Index b) { return blocks.count(b) > 0; });
        EXPECT_EQ(searched.work.work(), in_blocks);
    }
}

TEST(OhcClustered, BodiesThatTakeNoPartAreSearchedAtWhereTheyMoved) {
    World world = make_world("idle", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.0, 0.0, -0.004})},
                                      {BodyKind::rigid, shaft(0.02, 0.02, 12, 8).move({3.0, 0.0, 0.0})},
                                      {BodyKind::tissue, slab(0.1, 0.01, 30).shake(0.0003, 3)}});
    world.topology.body_pairs = {{0, 2}};
    const Range idle = world.topology.bodies[1].vertices;
    const auto detector = make_detector("ohc_clustered", {});
    detector->prepare(world.topology, world.frame);
    const auto expected = answer(world, {}, "brute_force").pairs;
    ASSERT_GT(expected.size(), 20U);
    tick(*detector, world.frame);
    world.frame.moved = std::vector<Range>{};
    EXPECT_EQ(tick(*detector, world.frame).work.work(), 0);
    world.frame.moved = std::vector<Range>{{idle.first + 3, 7}};
    const ContactSet searched = tick(*detector, world.frame);
    EXPECT_EQ(searched.pairs, expected);
    EXPECT_EQ(searched.work.work(), 7);
    world.frame.position(1, idle.first + 4) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(tick(*detector, world.frame).outcome.kind, OutcomeKind::not_finite);
}

TEST(OhcClustered, BodiesThatRestOrAreFarAwayAddNothingButTheLook) {
    const auto instrument = shaft(0.004, 0.1, 12, 30).move({0.0, 0.0003, -0.004});
    const auto tissue = slab(0.1, 0.01, 30).shake(0.0003, 3);
    const auto stone = shaft(0.02, 0.02, 12, 8);
    World alone = make_world("alone", {{BodyKind::instrument, instrument}, {BodyKind::tissue, tissue}});
    World more = make_world("more", {{BodyKind::instrument, instrument},
                                     {BodyKind::tissue, tissue},
                                     {BodyKind::rigid, Shape(stone).move({3.0, 0.0, 0.0})},
                                     {BodyKind::tissue, Shape(tissue).move({0.0, 0.0, 5.0})}});
    const auto first = make_detector("ohc_clustered", {});
    const auto second = make_detector("ohc_clustered", {});
    first->prepare(alone.topology, alone.frame);
    second->prepare(more.topology, more.frame);
    for (int step = 0; step < 6; ++step) {
        for (World* world : {&alone, &more}) {
            for (const std::size_t body : {std::size_t{0}, std::size_t{1}}) {
                const Range range = world->topology.bodies[body].vertices;
                world->frame.position.middleCols(range.first, range.count).array() += 1e-6 * (step + 1);
            }
        }
        const ContactSet less = tick(*first, alone.frame);
        const ContactSet all = tick(*second, more.frame);
        ASSERT_GT(less.pairs.size(), 20U);
        EXPECT_EQ(all.pairs.size(), less.pairs.size());
        if (step < 2) continue;  // the first ticks enter everything into the cells
        EXPECT_EQ(all.work.work() - less.work.work(), more.topology.vertex_count - alone.topology.vertex_count);
    }
}

TEST(OhcClustered, AnyMotionOfAnyPartIsAnswered) {
    for (const std::uint32_t seed : {1U, 2U, 3U, 4U}) {
        std::mt19937 random(seed);
        World world = make_world("parts", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.0, 0.0, -0.004})},
                                           {BodyKind::rigid, slab(0.05, 0.004, 12).move({0.02, 0.01, 0.003})},
                                           {BodyKind::tissue, slab(0.1, 0.01, 30).shake(0.0003, seed)}});
        const auto detector = make_detector("ohc_clustered", {{"order", seed % 2 == 0 ? "given" : "local"}});
        const auto truth = make_detector("brute_force", {});
        detector->prepare(world.topology, world.frame);
        truth->prepare(world.topology, world.frame);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        std::size_t seen = 0;
        for (int step = 0; step < 60; ++step) {
            world.frame.moved.reset();
            const bool report = step % 3 != 0;
            std::vector<Range> moved;
            const int ranges = static_cast<int>(random() % 4);
            for (int k = 0; k < ranges; ++k) {
                // Small and large runs, sometimes a whole body.
                const BodyRange& body = world.topology.bodies[random() % 3];
                Range range{
                    body.vertices.first + static_cast<Index>(random() % static_cast<unsigned>(body.vertices.count)),
                    1 + static_cast<Index>(random() % 100)};
                range.count = std::min(range.count, body.vertices.end() - range.first);
                if (random() % 4 == 0) range = body.vertices;
                const Vector3 by = 0.001 * random_vector(uniform, random);
                world.frame.position.middleCols(range.first, range.count).colwise() += by;
                moved.push_back(range);
            }
            if (step % 17 == 5) {
                // A frame that cannot be answered, then all goes on.
                Frame broken = world.frame;
                broken.position(1, static_cast<Index>(random() % static_cast<unsigned>(world.topology.vertex_count))) =
                    std::numeric_limits<double>::quiet_NaN();
                EXPECT_EQ(tick(*detector, broken).outcome.kind, OutcomeKind::not_finite);
            }
            if (report) world.frame.moved = moved;
            if (step % 7 == 3) detector->update(world.frame, 0.0);  // a second update on the frame changes nothing
            const ContactSet contacts = tick(*detector, world.frame);
            const ContactSet expected = tick(*truth, world.frame);
            ASSERT_EQ(contacts.pairs, expected.pairs) << "seed " << seed << ", step " << step;
            seen += expected.pairs.size();
        }
        EXPECT_GT(seen, 1000U);
    }
}

TEST(OhcClustered, ContactThatWandersIsAnsweredToItsEnd) {
    World world = make_world("wander", {{BodyKind::instrument, shaft(0.002, 0.03, 12, 40).move({-0.045, 0.0, -0.002})},
                                        {BodyKind::tissue, slab(0.1, 0.004, 100).shake(0.00005, 5)}});
    const auto detector = make_detector("ohc_clustered", {});
    const auto truth = make_detector("ohc", {});
    detector->prepare(world.topology, world.frame);
    truth->prepare(world.topology, world.frame);
    const Range shaft_vertices = world.topology.bodies[0].vertices;
    for (int step = 0; step < 90; ++step) {
        world.frame.position.middleCols(shaft_vertices.first, shaft_vertices.count).row(0).array() += 0.001;
        world.frame.position.middleCols(shaft_vertices.first, shaft_vertices.count).row(1).array() +=
            step % 30 < 15 ? 0.002 : -0.002;
        world.frame.moved = std::vector<Range>{shaft_vertices};
        ASSERT_EQ(tick(*detector, world.frame).pairs, tick(*truth, world.frame).pairs) << step;
    }
}

TEST(OhcClustered, WhatComesFromAfarMeetsWhatHasNeverMoved) {
    // The shaft is the larger of the two: it flies across ten cells of its own length to a slab that stays in the cells
    // of the first tick.
    World world = make_world("from afar", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({-1.0, 0.0, -0.004})},
                                           {BodyKind::tissue, slab(0.05, 0.01, 10).shake(0.0003, 3)}});
    const auto detector = make_detector("ohc_clustered", {});
    detector->prepare(world.topology, world.frame);
    EXPECT_EQ(tick(*detector, world.frame).pairs.size(), 0U);
    const Range shaft_vertices = world.topology.bodies[0].vertices;
    for (int step = 0; step < 4; ++step) {
        world.frame.position.middleCols(shaft_vertices.first, shaft_vertices.count).row(0).array() += 0.25;
        world.frame.moved = std::vector<Range>{shaft_vertices};
        const auto expected = answer(world, {}, "brute_force").pairs;
        EXPECT_EQ(expected.size() > 5, step == 3);
        EXPECT_EQ(tick(*detector, world.frame).pairs, expected) << step;
    }
}

TEST(OhcClustered, AfterAFrameThatDoesNotFitAllIsAsAtTheStart) {
    // Five of the six regions are 1 m long, and so are cells; the smaller one of each two that meet is the ball.
    std::vector<Part> parts{{BodyKind::instrument, sphere(0.01, 6)}};
    for (int k = 0; k < 5; ++k) parts.push_back({BodyKind::rigid, sheet(1.0, 4).move({0.0, 0.0, 0.001 * k})});
    const World world = make_world("ball in sheets", parts);
    const auto expected = answer(world, {}, "brute_force").pairs;
    ASSERT_GT(expected.size(), 20U);
    const auto detector = make_detector("ohc_clustered", {});
    detector->prepare(world.topology, world.frame);
    const ContactSet first = tick(*detector, world.frame);
    EXPECT_EQ(first.pairs, expected);
    Frame other = world.frame;
    other.position.conservativeResize(Eigen::NoChange, world.topology.vertex_count - 1);
    EXPECT_EQ(tick(*detector, other).outcome.kind, OutcomeKind::unsupported);
    const ContactSet again = tick(*detector, world.frame);
    EXPECT_EQ(again.pairs, expected);
    EXPECT_EQ(again.work.cells_visited, first.work.cells_visited);
    EXPECT_EQ(again.work.triangle_tests, first.work.triangle_tests);
}

TEST(OhcClustered, FarAwayTinyAndHugeScenesAreAnswered) {
    for (const double scale : {1e-300, 1e-160, 1e-12, 1.0, 1e12, 1e150, 1e300}) {
        for (const double offset : {0.0, 1e3, 1e6}) {
            if (scale * (1.0 + offset) > 1e306) continue;
            World world = dipping(2, 30);
            world.frame.position = (world.frame.position.array() * scale + offset * scale).matrix();
            const auto expected = answer(world, {}, "brute_force").pairs;
            EXPECT_GT(expected.size(), 20U);
            EXPECT_EQ(answer(world).pairs, expected) << scale << " " << offset;
            EXPECT_EQ(answer(world, {{"simd", "scalar"}}).pairs, expected) << scale << " " << offset;
        }
    }
}

TEST(OhcClustered, BodiesThatHaveTravelledFarAreAsMuchWorkAsThoseThatBeginThere) {
    // A scene of a tenth of a millimetre: seen in float from where it began, 100 m away, its triangles all appear
    // alike.
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        World world = dipping(0, 30);
        world.frame.position *= 0x1p-10;
        const auto detector = make_detector("ohc_clustered", {});
        detector->prepare(world.topology, world.frame);
        ASSERT_GT(tick(*detector, world.frame).pairs.size(), 20U);
        world.frame.position.row(axis).array() += 100.0;
        const ContactSet begun_there = answer(world);
        const ContactSet travelled = tick(*detector, world.frame);
        EXPECT_EQ(travelled.pairs, begun_there.pairs) << axis;
        EXPECT_EQ(travelled.work.triangle_tests, begun_there.work.triangle_tests) << axis;
    }
}

TEST(OhcClustered, VerticesFarAwayCostWhatTheirOwnTrianglesCost) {
    World world = make_world("far", {{BodyKind::instrument, shaft(0.002, 0.1, 24, 100).move({0.0, 0.0003, -0.002})},
                                     {BodyKind::tissue, slab(0.1, 0.01, 60).shake(0.0003, 3)}});
    const WorkCounters ordinary = answer(world).work;
    const Topology& topology = world.topology;
    for (const double far : {1e2, 1e30, -1e300}) {
        for (const std::vector<std::size_t>& bodies :
             {std::vector<std::size_t>{1}, std::vector<std::size_t>{0}, std::vector<std::size_t>{0, 1}}) {
            World broken = world;
            std::int64_t pairs_of_own = 0;  // of a triangle with such a corner and any triangle of the other body
            for (const std::size_t body : bodies) {
                const Index v = topology.bodies[body].vertices.first + 5;
                broken.frame.position.col(v) = Vector3(far, 0.5 * far, far);
                const auto own = (topology.triangles.array() == v).colwise().any().count();
                pairs_of_own += own * topology.bodies[1 - body].triangles.count;
            }
            SCOPED_TRACE(far);
            const ContactSet expected = answer(broken, {}, "brute_force");
            const auto detector = make_detector("ohc_clustered", {});
            detector->prepare(topology, world.frame);
            tick(*detector, world.frame);
            // From the first frame on, and later.
            for (const ContactSet& contacts : {answer(broken), tick(*detector, broken.frame)}) {
                EXPECT_EQ(contacts.pairs, expected.pairs);
                EXPECT_LE(contacts.work.triangle_tests, ordinary.triangle_tests + pairs_of_own);
                // Boxes come in sixteens.
                EXPECT_LE(contacts.work.box_tests, 2 * ordinary.box_tests + fan * pairs_of_own);
                EXPECT_LE(contacts.work.cells_visited, 2 * ordinary.cells_visited);
            }
        }
    }
}

TEST(OhcClustered, WhatBeginsBetweenFramesIsReportedInEveryTick) {
    for (const char* order : {"given", "local"}) {
        World world = make_world("run", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.0, 0.0, 0.004})},
                                         {BodyKind::tissue, slab(0.1, 0.01, 30).shake(0.0003, 8)},
                                         {BodyKind::rigid, shaft(0.02, 0.02, 12, 8).move({0.05, 0.0, 0.0})}});
        const auto detector = make_detector("ohc_clustered", {{"order", order}, {"swept", "on"}});
        const auto other = make_detector("ohc", {{"swept", "on"}});
        const auto plain = make_detector("brute_force", {});
        for (Detector* each : {detector.get(), other.get(), plain.get()}) each->prepare(world.topology, world.frame);
        std::mt19937 random(12);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        std::size_t begun = 0;
        for (int step = 0; step < 16; ++step) {
            Frame& frame = world.frame;
            frame.previous = frame.position;
            // Every fourth tick all rest, every fifth one the motion is unknown; jumps between.
            if (step % 4 != 3) {
                for (const BodyRange& body : world.topology.bodies) {
                    if (body.kind == BodyKind::rigid) continue;
                    Vector3 by = 0.3 * random_vector(uniform, random);
                    by.z() = step % 2 == 0 ? -1.0 : 1.0;
                    by *= step % 2 == 0 ? 0.006 : 0.001;
                    frame.position.middleCols(body.vertices.first, body.vertices.count).colwise() +=
                        body.kind == BodyKind::tissue ? Vector3(-0.8 * by) : by;
                }
            }
            if (step % 5 == 4) frame.previous(1, 7) = std::numeric_limits<double>::quiet_NaN();
            const ContactSet contacts = tick(*detector, frame);
            const ContactSet expected = tick(*other, frame);
            ASSERT_EQ(contacts.pairs, tick(*plain, frame).pairs) << step;
            ASSERT_EQ(contacts.swept.size(), expected.swept.size()) << step;
            for (std::size_t k = 0; k < expected.swept.size(); ++k) {
                EXPECT_EQ(contacts.swept[k].a, expected.swept[k].a);
                EXPECT_EQ(contacts.swept[k].b, expected.swept[k].b);
                EXPECT_EQ(contacts.swept[k].time, expected.swept[k].time);
            }
            begun += contacts.swept.size();
        }
        EXPECT_GT(begun, 50U);
    }
}

}  // namespace
}  // namespace trocar::test
