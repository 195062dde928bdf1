// What ohc_clustered promises beyond the contract of every detector: the same answer in every vertex order and with
// every instruction set, work only where something moved or is near, limits kept and told.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "detect/box_kernel.hpp"
#include "detect/clusters.hpp"
#include "method/registry.hpp"
#include "support/shapes.hpp"

namespace trocar::test {
namespace {

using Settings = std::map<std::string, std::string>;

World dipping(int tick) {
    return make_world("dip", {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.0007 * tick, 0.0003, -0.004})},
                              {BodyKind::tissue, slab(0.1, 0.01, 30).shake(0.0003, 3)}});
}

ContactSet answer(const World& world, const Settings& settings = {}, const std::string& name = "ohc_clustered") {
    const auto detector = make_detector(name, settings);
    detector->prepare(world.topology, world.frame);
    ContactSet contacts;
    detector->update(world.frame);
    detector->detect(world.frame, contacts);
    return contacts;
}

TEST(BoxKernels, EveryInstructionSetAgreesWithThePlainComparison) {
    std::mt19937 random(9);
    // Few values, so that boxes often touch exactly.
    std::uniform_int_distribution<int> number(-6, 6);
    for (const BoxKernels& kernels : all_box_kernels()) {
        SCOPED_TRACE(kernels.target);
        for (int round = 0; round < 300; ++round) {
            ClusterBoxes first;
            ClusterBoxes second;
            for (ClusterBoxes* boxes : {&first, &second}) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    for (std::size_t i = 0; i < 16; ++i) {
                        const int a = number(random);
                        const int b = number(random);
                        boxes->low[axis][i] = 0.5F * static_cast<float>(std::min(a, b));
                        boxes->high[axis][i] = 0.5F * static_cast<float>(std::max(a, b));
                    }
                }
            }
            const auto overlap = [&](std::size_t i, std::size_t j) {
                bool all = true;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    all =
                        all && first.low[axis][i] <= second.high[axis][j] && second.low[axis][j] <= first.high[axis][i];
                }
                return all;
            };
            const auto wanted = static_cast<std::uint32_t>(random()) & 0xffffU;
            std::array<std::uint16_t, 16> result{};
            kernels.overlaps(first, wanted, second, result);
            for (std::size_t i = 0; i < 16; ++i) {
                const std::uint32_t mask = kernels.mask(second, {first.low[0][i], first.low[1][i], first.low[2][i]},
                                                        {first.high[0][i], first.high[1][i], first.high[2][i]});
                for (std::size_t j = 0; j < 16; ++j) {
                    ASSERT_EQ((mask >> j) & 1U, overlap(i, j) ? 1U : 0U);
                    const bool asked = ((wanted >> i) & 1U) != 0;
                    ASSERT_EQ((static_cast<unsigned>(result[i]) >> j) & 1U, asked && overlap(i, j) ? 1U : 0U);
                }
            }
        }
    }
}

TEST(Clusters, HoldEveryTriangleOnceAndTheChunksOfItsCorners) {
    const World world = dipping(0);
    for (const ClusterOrder order : {ClusterOrder::automatic, ClusterOrder::given, ClusterOrder::local}) {
        for (const BodyRange& range : world.topology.bodies) {
            const ClusteredBody body = cluster_body(world.topology, world.frame, range, order);
            std::vector<Index> seen;
            for (std::size_t k = 0; k < body.triangle.size(); ++k) {
                if (body.triangle[k] < 0) continue;
                seen.push_back(body.triangle[k]);
                const auto cluster = static_cast<Index>(k) / cluster_size;
                const Lists& lists = body.chunks_of_cluster;
                for (const Index v : body.corner[k]) {
                    const Index chunk = body.chunk_of[static_cast<std::size_t>(v - range.vertices.first)];
                    EXPECT_TRUE(std::find(lists.begin(cluster), lists.end(cluster), chunk) != lists.end(cluster));
                    const Lists& groups = body.chunk_groups_of_group;
                    const Index group = cluster / cluster_size;
                    EXPECT_TRUE(std::find(groups.begin(group), groups.end(group), chunk / chunk_group_size) !=
                                groups.end(group));
                }
            }
            std::sort(seen.begin(), seen.end());
            ASSERT_EQ(static_cast<Index>(seen.size()), range.triangles.count);
            for (Index t = 0; t < range.triangles.count; ++t) {
                EXPECT_EQ(seen[static_cast<std::size_t>(t)], range.triangles.first + t);
            }
        }
    }
}

TEST(OhcClustered, VertexOrderMakesNoDifference) {
    const World world = dipping(0);
    const auto expected = answer(world, {}, "brute_force").pairs;
    ASSERT_GT(expected.size(), 20U);
    for (const char* order : {"auto", "given", "local"}) {
        EXPECT_EQ(answer(world, {{"order", order}}).pairs, expected) << order;
    }
}

TEST(OhcClustered, ReadsOnlyWhatMovedAndWhatIsNear) {
    World world = dipping(0);
    const auto detector = make_detector("ohc_clustered", {{"order", "given"}});
    detector->prepare(world.topology, world.frame);
    ContactSet contacts;
    detector->update(world.frame);
    detector->detect(world.frame, contacts);
    const std::int64_t everything = contacts.work.vertices_read;
    world.frame.moved = std::vector<Range>{};
    detector->update(world.frame);
    detector->detect(world.frame, contacts);
    EXPECT_EQ(contacts.work.vertices_read, everything - world.topology.vertex_count);
    EXPECT_EQ(contacts.pairs, answer(world, {}, "brute_force").pairs);
    world.frame.moved = std::vector<Range>{{world.topology.bodies[1].vertices.first, 20}};
    detector->update(world.frame);
    detector->detect(world.frame, contacts);
    EXPECT_EQ(contacts.work.vertices_read, everything - world.topology.vertex_count + 20);
}

TEST(OhcClusteredLimits, WorkStaysWithinTheBudgetAndTheCutIsTold) {
    const World world = dipping(0);
    const ContactSet whole = answer(world);
    for (std::int64_t budget = 0; budget < 2 * whole.work.work(); budget += 211) {
        const ContactSet contacts = answer(world, {{"work_budget", std::to_string(budget)}});
        EXPECT_LE(contacts.work.work(), budget);
        if (!contacts.truncated) {
            EXPECT_EQ(contacts.pairs, whole.pairs) << "cut without a word at " << budget;
        }
    }
    EXPECT_FALSE(answer(world, {{"work_budget", std::to_string(4 * whole.work.work())}}).truncated);
}

TEST(OhcClusteredLimits, MaximumOfPairsIsKeptAndTold) {
    const World world = dipping(0);
    const auto whole = answer(world).pairs;
    for (const std::size_t most : {std::size_t{0}, std::size_t{3}, whole.size() - 1}) {
        const ContactSet contacts = answer(world, {{"max_pairs", std::to_string(most)}});
        EXPECT_EQ(contacts.pairs.size(), most);
        EXPECT_TRUE(contacts.truncated);
    }
}

}  // namespace
}  // namespace trocar::test
