#include "simulate/balance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/scene_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

/// Moves the operator's ball of press_text by hand: force and place per tick come from a formula.
class BallByHand {
public:
    explicit BallByHand(const Scene& scene) : balance(scene), seen_(scene.first), load_(scene.topology.bodies.size()) {
        for (Index body = 0; body < scene.topology.body_count(); ++body) {
            if (scene.topology.bodies[static_cast<std::size_t>(body)].kind == BodyKind::instrument) tool_ = body;
        }
        range_ = scene.topology.bodies[static_cast<std::size_t>(tool_)].vertices;
    }
    void tick(bool contact, double dz, double force_z) {
        Frame after = seen_;
        after.position.middleCols(range_.first, range_.count).row(2).array() += dz;
        load_[static_cast<std::size_t>(tool_)].force = Vector3(0, 0, force_z);
        balance.observe(contact, seen_, after, load_);
        seen_ = after;
    }
    Balance balance;

private:
    Frame seen_;
    std::vector<Wrench> load_;
    Index tool_ = 0;
    Range range_;
};

TEST(Balance, ElasticBounceCreatesNothingAndAStrongerWayOutDoes) {
    const Scene scene = test::scene_from_text(test::press_text(0.002));
    for (const double gain_out : {1.0, 3.0}) {
        BallByHand ball(scene);
        // Down 1 mm and up again against a spring of 1000 N/m: 0.5 mJ each way.
        constexpr int steps = 100;
        for (int i = 0; i < 2 * steps; ++i) {
            const bool down = i < steps;
            const double depth = 1e-3 * ((down ? i : 2 * steps - i - 1) + 0.5) / steps;
            ball.tick(true, (down ? -1e-3 : 1e-3) / steps, 1000.0 * depth * (down ? 1.0 : gain_out));
        }
        for (int i = 0; i < 10; ++i) ball.tick(false, 0.0, 0.0);
        const auto figures = ball.balance.figures();
        const double created = (gain_out - 1.0) * 0.5e-3;
        EXPECT_NEAR(figures.at("energy_created_worst_j"), created, 1e-12);
        EXPECT_NEAR(figures.at("energy_created_share_worst"), created / ((1.0 + gain_out) * 0.5e-3), 1e-9);
        EXPECT_NEAR(figures.at("net_work_j"), created, 1e-12) << "the path closes";
        EXPECT_NEAR(figures.at("energy_given_worst_j"), created, 1e-12);
        EXPECT_EQ(figures.at("contact_spells"), 1.0);
        EXPECT_TRUE(std::isnan(figures.at("momentum_error_worst_n_s"))) << "nobody tells what the block takes";
    }
}

TEST(Balance, SpellsAreBridgedOverShortGapsOnly) {
    const Scene scene = test::scene_from_text(test::press_text(0.002));
    BallByHand ball(scene);
    for (const int gap : {Balance::bridged_ticks, Balance::bridged_ticks + 1}) {
        ball.tick(true, 1e-4, 1.0);
        for (int i = 0; i < gap; ++i) ball.tick(false, 1e-4, 0.0);
    }
    ball.tick(true, 1e-4, 1.0);
    const auto figures = ball.balance.figures();
    EXPECT_EQ(figures.at("contact_spells"), 2.0);
    EXPECT_TRUE(std::isnan(figures.at("net_work_j"))) << "the ball did not come back";
}

/// The sheet of poke_text let go from a bump: nobody touches it. Bent and stretched it gives back what hinges and
/// stiffening springs hold, which the books have to know.
class FreeSheet : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Each, FreeSheet,
                         testing::Values("{}", R"({"bending":0.01,"preload":0})",
                                         R"({"stiffening":1e5,"preload":0,"strain_limit":0.02})"));

TEST_P(FreeSheet, KeepsItsMomentumAndGainsNoEnergy) {
    std::string text = test::poke_text();
    const std::string parts = R"("edge":0.006}])";
    text.insert(text.find(parts) + parts.size(), std::string(R"(,"tissue":)") + GetParam());
    const Scene scene = test::scene_from_text(text);
    Frame frame = scene.first;
    for (Index v = 0; v < scene.topology.vertex_count; ++v) {
        if (!(scene.materials.mass[static_cast<std::size_t>(v)] > 0.0) ||
            scene.materials.pinned[static_cast<std::size_t>(v)] != 0) {
            continue;
        }
        const double x = frame.position(0, v) / 0.06;
        const double y = frame.position(1, v) / 0.06;
        frame.position(2, v) += 0.002 * std::cos(std::numbers::pi * x) * std::cos(std::numbers::pi * y);
    }
    MassSpring tissue(scene.topology, scene.materials);
    Effect effect;
    effect.resize(scene.topology.vertex_count, scene.topology.body_count());
    std::vector<Wrench> reaction(scene.topology.bodies.size());
    const std::vector<Wrench> none(scene.topology.bodies.size());
    // The same frames booked with an outer force that is not there show what an error looks like.
    std::vector<Wrench> invented = none;
    for (Index body = 0; body < scene.topology.body_count(); ++body) {
        if (scene.topology.bodies[static_cast<std::size_t>(body)].kind == BodyKind::instrument) {
            invented[static_cast<std::size_t>(body)].force = Vector3(0, 0, 0.1);
        }
    }
    Balance balance(scene);
    Balance cheated(scene);
    double internal = 0.0;
    Matrix3X force;
    for (int tick = 0; tick < 50; ++tick) {
        const Frame seen = frame;
        internal_force(scene.materials, seen.position, seen.velocity, force);
        for (Index v = 0; v < scene.topology.vertex_count; ++v) internal += scene.dt * force.col(v).norm();
        ASSERT_TRUE(tissue.advance(effect, scene.dt, frame, reaction).ok());
        balance.observe(true, seen, frame, none);
        cheated.observe(true, seen, frame, invented);
    }
    const auto figures = balance.figures();
    EXPECT_LT(figures.at("momentum_error_worst_n_s"), 0.01 * internal);
    EXPECT_EQ(figures.at("energy_created_worst_j"), 0.0);
    EXPECT_NEAR(cheated.figures().at("momentum_error_worst_n_s"), 50 * scene.dt * 0.1,
                figures.at("momentum_error_worst_n_s") + 1e-12);
}

}  // namespace
}  // namespace trocar
