// The order in which interpolated vertices are relaxed, and that all of them are.
#include "tissue/far_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/tissue_samples.hpp"

namespace trocar {
namespace {

constexpr double edge = 0.002;  // m
constexpr double tool = 0.006;  // m, its extent from the middle

/// With a body beside its middle, that reaches so far from it along all three axes (m).
test::TissueSample disc_beside_a_tool(double reaches) {
    test::TissueSample s = test::make_disc(0.05, edge, 100.0, 0.2, 1.1e-5);
    const Index vertices = s.topology.vertex_count;
    s.topology = make_topology({{.name = "tissue", .kind = BodyKind::tissue, .vertex_count = vertices},
                                {.name = "tool", .kind = BodyKind::instrument, .vertex_count = 2}},
                               {{0, 1}});
    const auto all = at(vertices + 2);
    s.materials.mass.resize(all, 0.0);
    s.materials.pinned.resize(all, 0);
    s.materials.drag.resize(all, 0.0);
    s.materials.mean_stiffness.resize(all, 0.0);
    s.materials.area.resize(all, 0.0);
    s.materials.rest_bias.setZero(3, vertices + 2);
    s.frame.position.conservativeResize(3, vertices + 2);
    s.frame.position.rightCols(2).colwise() = Vector3::Constant(reaches);
    s.frame.position.col(vertices) *= -1.0;
    s.frame.previous = s.frame.position;
    s.frame.velocity.setZero(3, vertices + 2);
    return s;
}

/// A disc that is interpolated but for the nodes of the last level.
struct Sleeping {
    test::TissueSample s = disc_beside_a_tool(tool);
    MovingTissue tissue{s.topology, s.materials};
    WrittenVertices written{taken().state()};
    BodyBoxes boxes{s.topology};
    RegionTissue region{tissue, written, boxes, s.topology, s.frame.position, 60};
    FarField far{started()};

    MovingTissue& taken() {
        tissue.take_over(test::empty_output(s.topology), s.frame);
        return tissue;
    }
    RegionTissue& started() {
        boxes.start(s.frame);
        region.start();
        return region;
    }
    Sleeping() { far.start(); }
    NodeLevel& nodes() { return region.levels().back(); }
    void sink(Index node, double by) { nodes().displacement(2, node) -= by; }
    /// m, per vertex: how far it is from where it would be if nothing were late.
    [[nodiscard]] std::vector<double> late() const {
        Frame frame = s.frame;
        region.complete(frame);
        std::vector<double> late;
        for (std::size_t v = 0; v < tissue.state().size(); ++v) {
            const Vector3 place = tissue.state().position.col(eigen_index(v)).head<3>();
            late.push_back((place - frame.position.col(tissue.state().vertex[v])).norm());
        }
        return late;
    }
    [[nodiscard]] double latest() const {
        const std::vector<double> all = late();
        return *std::max_element(all.begin(), all.end());
    }
};

TEST(FarField, WhatHasGoneFurthestIsFollowedFirst) {
    Sleeping t;
    ASSERT_GE(t.region.levels().size(), 3U) << "nodes that own nodes that own vertices";
    // Two nodes far from each other; one goes ten times as far.
    const std::vector<Index>& active = t.nodes().active_nodes;
    const auto by_x = [&t](Index a, Index b) { return t.nodes().rest[at(a)].x() < t.nodes().rest[at(b)].x(); };
    const Index far = *std::min_element(active.begin(), active.end(), by_x);
    const Index little = *std::max_element(active.begin(), active.end(), by_x);
    t.sink(far, 1e-3);
    t.sink(little, 1e-4);
    const double most = t.latest();
    EXPECT_GT(most, 0.5e-3);
    t.region.next_moment();
    // Enough for the vertices of one node and what lies around them, not for those of two.
    const std::size_t all = t.tissue.state().size() / t.nodes().size();
    t.far.follow(4 * all, 0);
    double left_far = 0.0;
    double left_little = 0.0;
    const std::vector<double> late = t.late();
    for (std::size_t v = 0; v < late.size(); ++v) {
        const double x = t.s.frame.position(0, t.tissue.state().vertex[v]);
        double& left = x < 0.0 ? left_far : left_little;
        left = std::max(left, late[v]);
    }
    EXPECT_LT(left_far, 0.6 * most) << "what has most of its share in others stays";
    EXPECT_GT(left_little, 0.5e-4) << "its turn comes later";
}

TEST(FarField, AllOfItIsFollowedInTime) {
    Sleeping t;
    for (const Index node : t.nodes().active_nodes) t.sink(node, 1e-3 * (1.0 + 0.1 * (node % 7)));
    EXPECT_GT(t.latest(), 1e-3);
    const std::size_t most = t.tissue.state().size() / 16;
    for (int tick = 0; tick < 40; ++tick) {
        t.region.next_moment();
        t.far.follow(most, 0);
        EXPECT_LE(t.region.put(), most);
    }
    EXPECT_LT(t.latest(), 2e-3 * edge);
}

TEST(FarField, WhatRestsIsSearchedAtInASlowRoundAlone) {
    Sleeping t;
    const std::size_t most = t.tissue.state().size() / 16;
    for (int tick = 0; tick < 10; ++tick) {
        t.region.next_moment();
        t.far.follow(most, 0);
        EXPECT_LE(t.region.put(), tick % 4 == 3 ? most : 0) << tick;
        EXPECT_EQ(t.region.put() > 0, tick % 4 == 3) << tick;
    }
}

TEST(FarField, ANodeThatWakesGoesOnWithWhatTheOneAboveItOwed) {
    Sleeping t;
    const std::size_t below = t.region.levels().size() - 2;
    ASSERT_GE(below, 1U);
    for (const Index node : t.nodes().active_nodes) t.sink(node, 1e-3);
    t.region.next_moment();
    t.far.follow(8, 0);
    Index middle = 0;
    const NodeLevel& level = t.region.levels()[below];
    for (Index node = 0; at(node) < level.size(); ++node) {
        if (level.rest[at(node)].norm() < level.rest[at(middle)].norm()) middle = node;
    }
    t.region.activate(below, middle);
    const std::size_t most = t.tissue.state().size() / 16;
    for (int tick = 0; tick < 40; ++tick) {
        t.region.next_moment();
        t.far.follow(most, 0);
    }
    EXPECT_LT(t.latest(), 2e-3 * edge) << "its vertices, too, which nothing has moved since it woke";
}

TEST(FarField, WhatLiesBesideAnotherBodyIsNeverLate) {
    Sleeping t;
    for (std::size_t level = t.region.levels().size() - 1; level-- > 1;) {
        for (Index node = 0; at(node) < t.region.levels()[level].size(); ++node) t.region.activate(level, node);
    }
    NodeLevel& first = t.region.levels()[1];
    for (int tick = 0; tick < 7; ++tick) {
        for (const Index node : first.active_nodes) first.displacement(2, node) -= 1e-4;
        t.region.next_moment();
        t.far.follow(0, t.tissue.state().size());
        const std::vector<double> late = t.late();
        std::size_t others = 0;
        for (std::size_t v = 0; v < late.size(); ++v) {
            const Vector3 place = t.s.frame.position.col(t.tissue.state().vertex[v]);
            const double beyond = place.cwiseAbs().maxCoeff() - tool;
            if (beyond < 2.5 * edge) {
                EXPECT_LT(late[v], 1e-12) << v;
            } else if (beyond > 3.5 * edge && late[v] > 0.5e-4 * (tick + 1)) {
                ++others;
            }
        }
        EXPECT_GT(others, late.size() / 2) << "they wait for their turn";
    }
    t.far.start();
    constexpr std::size_t few = 7;
    first.displacement.row(2).array() -= 1e-4;
    t.region.next_moment();
    t.far.follow(0, few);
    EXPECT_EQ(t.region.put(), few);
}

}  // namespace
}  // namespace trocar
