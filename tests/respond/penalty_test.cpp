#include <gtest/gtest.h>

#include <algorithm>

#include "support/response_samples.hpp"

namespace trocar {
namespace {

using test::edges_crossing;
using test::PairSample;
using test::vertex_of_a_in_b;
using test::vertex_of_b_in_a;

TEST(Penalty, PushesAlongTheNormalAndNeverPulls) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    s.frame.velocity.col(3) = Vector3(0.5, 0.0, -0.25);
    s.respond("penalty:k=1000,mu=2");
    ASSERT_EQ(s.effect.contacts.size(), 1U);
    EXPECT_FALSE(s.effect.contacts[0].adhesive);
    EXPECT_NEAR(s.effect.tip_force[0].z(), -1.0, 1e-12);
    s.frame.velocity.col(3) = Vector3(0.0, 0.0, 5.0);
    s.respond("penalty:k=1000,mu=2");
    EXPECT_EQ(s.effect.tip_force[0].norm(), 0.0);
}

TEST(Penalty, ActsAlikeOnEveryClassOfBodies) {
    for (const BodyKind other : {BodyKind::instrument, BodyKind::rigid, BodyKind::tissue}) {
        PairSample s = vertex_of_a_in_b(BodyKind::instrument, other);
        s.respond("penalty:k=1000");
        EXPECT_LT((s.effect.tip_force[0] - Vector3(0, 0, 1.5)).norm(), 1e-12);
        PairSample e = edges_crossing(BodyKind::instrument, other);
        e.respond("penalty:k=8");
        EXPECT_LT((e.effect.tip_force[0] + Vector3(1.0, 0, 0)).norm(), 1e-12);
    }
}

TEST(Penalty, NativeContactWithoutVerticesLoadsTheTissueAtItsPoint) {
    PairSample s = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    Contact native;
    native.a = 0;
    native.b = 1;
    native.point = Vector3(0.002, 0.003, -0.0007);
    native.normal = -Vector3::UnitZ();
    native.depth = 0.002;
    s.contacts.contacts = {native};
    s.respond("penalty:k=100");
    ASSERT_EQ(s.effect.contacts.size(), 1U);
    EXPECT_NEAR(s.effect.contacts[0].weights[0], 0.5, 1e-12);
    EXPECT_NEAR(s.effect.contacts[0].weights[2], 0.3, 1e-12);
    EXPECT_NEAR(s.effect.tip_force[0].z(), 0.2, 1e-12);
    native.depth = Contact::unset;
    s.contacts.contacts = {native};
    s.respond("penalty:k=100");
    EXPECT_EQ(s.effect.skipped, 1);
}

TEST(Penalty, ReductionKeepsTheDeepestContactOfAVertex) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    const Contact contact = s.contacts.contacts[0];
    for (const double depth : {0.0002, 0.003, 0.001}) {
        s.contacts.contacts.push_back(contact);
        s.contacts.contacts.back().depth = depth;
    }
    s.respond("penalty:k=100");
    EXPECT_EQ(s.effect.contacts.size(), 1U);
    EXPECT_NEAR(s.effect.tip_force[0].z(), -0.3, 1e-12);
    s.respond("penalty:k=100,reduction=pair");
    EXPECT_EQ(s.effect.contacts.size(), 4U);
    EXPECT_NEAR(s.effect.tip_force[0].z(), -0.47, 1e-12);
}

TEST(Penalty, BoneAndASecondTissuePushTissueToo) {
    PairSample bone = vertex_of_b_in_a(BodyKind::rigid, BodyKind::tissue);
    bone.respond("penalty:k=100");
    ASSERT_EQ(bone.effect.contacts.size(), 1U);
    EXPECT_EQ(bone.effect.contacts[0].reaction_body, -1);
    EXPECT_EQ(bone.effect.contacts[0].reaction_vertices[0], -1);
    PairSample tissue = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
    tissue.respond("penalty:k=100");
    ASSERT_EQ(tissue.effect.contacts.size(), 1U);
    EXPECT_EQ(tissue.effect.contacts[0].vertices[0], 3);
    EXPECT_EQ(tissue.effect.contacts[0].reaction_vertices[0], 0);
}

TEST(PointResponses, BothTissuesOfAPairGetOppositeMomentum) {
    // I21: what one side gains the other loses, with masses that differ.
    for (const char* method : {"impulse", "impulse:e=0.5", "reflection:bump=0.5,friction=0.5", "xpbd"}) {
        PairSample s = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
        for (std::size_t v = 0; v < 6; ++v) s.materials.mass[v] = 1e-3 * static_cast<double>(1 + v);
        s.frame.velocity.col(3) = Vector3(0.3, 0.1, -0.4);
        s.respond(method);
        Vector3 momentum = Vector3::Zero();
        double largest = 0.0;
        for (const Placement& placement : s.effect.placements) {
            const Vector3 change = s.materials.mass[static_cast<std::size_t>(placement.vertex)] *
                                   (placement.velocity - s.frame.velocity.col(placement.vertex));
            momentum += change;
            largest = std::max(largest, change.norm());
        }
        EXPECT_GT(largest, 1e-4) << method;
        EXPECT_LT(momentum.norm(), 1e-14 * (1.0 + largest)) << method;
    }
}

}  // namespace
}  // namespace trocar
