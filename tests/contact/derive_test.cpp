#include "contact/derive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "geometry/triangle_families.hpp"
#include "support/meshes.hpp"

namespace trocar {
namespace {

/// Two bodies of one triangle each; `exchanged` puts the second first.
struct Scene {
    Scene(const Corners& first, const Corners& second, bool exchanged = false) {
        topology =
            make_topology({test::triangle_body("one", BodyKind::tissue), test::triangle_body("two", BodyKind::rigid)});
        frame.position.resize(3, 6);
        for (Eigen::Index i = 0; i < 3; ++i) {
            frame.position.col(i + (exchanged ? 3 : 0)) = first[static_cast<std::size_t>(i)];
            frame.position.col(i + (exchanged ? 0 : 3)) = second[static_cast<std::size_t>(i)];
        }
    }
    [[nodiscard]] Contact contact() const {
        ContactSet contacts;
        contacts.pairs = {{0, 1}};
        derive(topology, frame, contacts);
        EXPECT_EQ(contacts.contacts.size(), 1U);
        return contacts.contacts.at(0);
    }
    Topology topology;
    Frame frame;
};

const Corners face{Vector3(-0.02, -0.02, 0.0), Vector3(0.04, -0.02, 0.0), Vector3(-0.02, 0.04, 0.0)};
const Corners tip{Vector3(0.005, 0.0, 0.006), Vector3(-0.003, 0.0, 0.006), Vector3(0.001, 0.0, -0.002)};

TEST(Derive, VertexBelowAFaceGivesItsDepthAndTheFacesNormal) {
    const Contact into_b = Scene(tip, face).contact();
    EXPECT_EQ(into_b.kind, ContactCase::a_enters_b);
    EXPECT_EQ(into_b.a, 0);
    EXPECT_EQ(into_b.b, 1);
    EXPECT_NEAR(into_b.depth, 0.002, 1e-15);
    EXPECT_TRUE(into_b.normal.isApprox(-Vector3::UnitZ(), 1e-15));
    EXPECT_TRUE(into_b.point.isApprox(tip[2], 1e-15));
    EXPECT_EQ(into_b.vertex_a, 2);
    EXPECT_EQ(into_b.vertex_b, 3);  // (-0.02, -0.02, 0) is the nearest
    EXPECT_NEAR(into_b.interval_length, 0.002, 1e-15);

    const Contact into_a = Scene(face, tip).contact();
    EXPECT_EQ(into_a.kind, ContactCase::b_enters_a);
    EXPECT_NEAR(into_a.depth, 0.002, 1e-15);
    EXPECT_TRUE(into_a.normal.isApprox(Vector3::UnitZ(), 1e-15));
    EXPECT_EQ(into_a.vertex_b, 5);
    EXPECT_EQ(into_a.vertex_a, 0);
}

TEST(Derive, NormalLeadsFromAToBSoThatMovingBAlongItPartsVertexAndFace) {
    for (const bool exchanged : {false, true}) {
        Scene scene(tip, face, exchanged);
        const Contact contact = scene.contact();
        scene.frame.position.rightCols(3).colwise() += 1.0001 * contact.depth * contact.normal;
        const Corners a{scene.frame.position.col(0), scene.frame.position.col(1), scene.frame.position.col(2)};
        const Corners b{scene.frame.position.col(3), scene.frame.position.col(4), scene.frame.position.col(5)};
        EXPECT_FALSE(triangles_intersect(a, b));
    }
}

/// An edge along y of a face of a roof from below, an edge along x of one from above, 1 mm through each other at right
/// angles: lines 1 mm apart along z, and only along z.
TEST(Derive, CrossingEdgesGiveTheirCommonNormalAndDepth) {
    const Corners lower{Vector3(0, -0.01, 0), Vector3(0, 0.01, 0), Vector3(0.002, 0, -0.02)};
    const Corners upper{Vector3(-0.01, 0.001, -0.001), Vector3(0.01, 0.001, -0.001), Vector3(0, 0.004, 0.02)};
    const Contact contact = Scene(lower, upper).contact();
    ASSERT_EQ(contact.kind, ContactCase::edges_cross);
    EXPECT_NEAR(contact.depth, 0.001, 1e-15);
    EXPECT_TRUE(contact.normal.isApprox(Vector3::UnitZ(), 1e-12));
    EXPECT_GT(contact.interval_direction.z(), 0.0);
    EXPECT_GT(contact.interval_length, contact.depth);
    // The overlap's middle lies on both planes, between the edges.
    EXPECT_LT(contact.point.z(), 0.0);
    EXPECT_GT(contact.point.z(), -0.001);
}

TEST(Derive, CrossingEdgesTouchAfterMovingByTheDepth) {
    std::mt19937_64 random(1);
    int edges = 0;
    for (int n = 0; n < 20000 && edges < 500; ++n) {
        const test::TrianglePairCase pair = test::random_pair(random);
        const Corners first = test::scaled(pair.first, 0.01);  // m
        const Corners second = test::scaled(pair.second, 0.01);
        if (!triangles_intersect(first, second)) continue;
        const Contact contact = Scene(first, second).contact();
        if (contact.kind != ContactCase::edges_cross) continue;
        ++edges;
        ASSERT_LE(contact.depth, contact.interval_length * (1.0 + 1e-12));
        ASSERT_GT(contact.normal.dot(contact.interval_direction), 0.0);
        // Some two edges' lines meet once b has moved by depth along the normal: their distance is then 0.
        double nearest = 1.0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                const Vector3 e = first[(i + 1) % 3] - first[i];
                const Vector3 f = second[(j + 1) % 3] - second[j];
                const Vector3 common = e.cross(f).normalized();
                if (std::abs(common.dot(contact.normal)) < 1.0 - 1e-9) continue;
                const Vector3 gap = second[j] + contact.depth * contact.normal - first[i];
                nearest = std::min(nearest, std::abs(gap.dot(common)));
            }
        }
        ASSERT_LT(nearest, 1e-14);
    }
    EXPECT_EQ(edges, 500);
}

TEST(Derive, ExchangedBodiesGiveMirroredContacts) {
    std::mt19937_64 random(2);
    std::array<int, 4> seen{};
    for (int n = 0; n < 20000; ++n) {
        const test::TrianglePairCase pair = test::random_pair(random);
        const Corners first = test::scaled(pair.first, 0.01);  // m
        const Corners second = test::scaled(pair.second, 0.01);
        if (!triangles_intersect(first, second)) continue;
        const Contact contact = Scene(first, second).contact();
        const Contact mirror = Scene(first, second, true).contact();
        ASSERT_LE(contact.kind, ContactCase::edges_cross);
        ++seen[static_cast<std::size_t>(contact.kind)];
        const ContactCase expected = contact.kind == ContactCase::a_enters_b   ? ContactCase::b_enters_a
                                     : contact.kind == ContactCase::b_enters_a ? ContactCase::a_enters_b
                                                                               : ContactCase::edges_cross;
        ASSERT_EQ(mirror.kind, expected);
        ASSERT_NEAR(mirror.depth, contact.depth, 1e-12);
        ASSERT_NEAR(mirror.interval_length, contact.interval_length, 1e-11);
        ASSERT_LT((mirror.normal + contact.normal).norm(), 1e-8);
        ASSERT_LT((mirror.interval_direction + contact.interval_direction).norm(), 1e-8);
        ASSERT_LT((mirror.point - contact.point).norm(), 1e-9);
        ASSERT_EQ((mirror.vertex_a + 3) % 6, contact.vertex_b);
        ASSERT_EQ((mirror.vertex_b + 3) % 6, contact.vertex_a);
    }
    for (const std::size_t kind : {1U, 2U, 3U}) EXPECT_GT(seen[kind], 50);
}

TEST(Derive, LabelsTouchCoplanarAndDegenerate) {
    const Corners on_face{Vector3(0, 0, 0), Vector3(0.001, 0, 0.005), Vector3(-0.001, 0, 0.005)};
    const Contact touch = Scene(on_face, face).contact();
    EXPECT_EQ(touch.kind, ContactCase::touch);
    const Contact coplanar = Scene(face, face).contact();
    EXPECT_EQ(coplanar.kind, ContactCase::coplanar);
    EXPECT_TRUE(std::isnan(coplanar.depth));
    EXPECT_EQ(coplanar.vertex_a, -1);
    const Corners needle{Vector3(0, 0, -0.001), Vector3(0, 0, 0.01), Vector3(1e-7, 0, 0.01)};
    const Contact degenerate = Scene(needle, face).contact();
    EXPECT_EQ(degenerate.kind, ContactCase::degenerate);
    EXPECT_TRUE(std::isnan(degenerate.depth));
    const Corners above{Vector3(0, 0, 0.001), Vector3(0.001, 0, 0.005), Vector3(-0.001, 0, 0.005)};
    EXPECT_EQ(Scene(above, face).contact().kind, ContactCase::unset);
}

TEST(Derive, DeepestVertexWinsAndTheLowestNumberOnATie) {
    // Two corners below the face: 1 mm and 2 mm.
    const Corners two_below{Vector3(0.001, 0.001, -0.001), Vector3(0.002, 0.001, -0.002), Vector3(0.001, 0.002, 0.01)};
    const Contact deeper = Scene(two_below, face).contact();
    EXPECT_EQ(deeper.kind, ContactCase::a_enters_b);
    EXPECT_EQ(deeper.vertex_a, 1);
    EXPECT_NEAR(deeper.depth, 0.002, 1e-15);
    const Corners tied{Vector3(0.001, 0.002, 0.01), Vector3(0.002, 0.001, -0.002), Vector3(0.001, 0.001, -0.002)};
    EXPECT_EQ(Scene(tied, face).contact().vertex_a, 1);
    Scene renumbered(tied, face);
    renumbered.topology.triangles.col(0) << 2, 0, 1;
    EXPECT_EQ(renumbered.contact().vertex_a, 1);
}

TEST(Derive, KeepsTheOrderOfPairsAndItsMemory) {
    Scene scene(tip, face);
    ContactSet contacts;
    contacts.pairs = {{0, 1}, {0, 1}, {0, 1}};
    derive(scene.topology, scene.frame, contacts);
    ASSERT_EQ(contacts.contacts.size(), 3U);
    const Contact* const memory = contacts.contacts.data();
    contacts.pairs.pop_back();
    derive(scene.topology, scene.frame, contacts);
    EXPECT_EQ(contacts.contacts.size(), 2U);
    EXPECT_EQ(contacts.contacts.data(), memory);
}

}  // namespace
}  // namespace trocar
