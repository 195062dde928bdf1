// Truth against a second implementation of it on all shipped scenes, as closed loops of responses that leave little,
// and much, behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <string>

#include "measure/depth_truth.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"
#include "simulate/simulation.hpp"
#include "support/second_truth.hpp"
#include "support/shipped_scenes.hpp"
#include "support/test_name.hpp"

namespace trocar {
namespace {

constexpr std::array responses{"thesis:profile=corrected", "thesis:profile=faithful", "penalty"};

struct Case {
    std::string scene;
    std::string response;
    std::int64_t number;  ///< of the response
};

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    for (const std::string& scene : test::scene_names()) {
        for (std::size_t number = 0; number < responses.size(); ++number) {
            cases.push_back({scene, responses.at(number), static_cast<std::int64_t>(number)});
        }
    }
    return cases;
}

Vector3 point_of(const DepthTruth::Judgement& sample, const Topology& topology, const Matrix3X& at) {
    if (sample.vertex >= 0) return at.col(sample.vertex);
    Vector3 point = Vector3::Zero();
    for (int i = 0; i < 3; ++i) point += sample.place.weights[i] * at.col(topology.triangles(i, sample.place.triangle));
    return point;
}

std::string text_of(const DepthTruth::Judgement& sample, const Topology& topology) {
    const auto name = [&](Index body) { return topology.bodies[static_cast<std::size_t>(body)].name; };
    return name(sample.from) + (sample.vertex >= 0 ? " vertex " + std::to_string(sample.vertex) : " area sample") +
           " against " + name(sample.into);
}

/// What the second truth says of one frame, held against the first.
struct Comparison {
    std::int64_t compared = 0;
    std::int64_t wrong = 0;
    std::int64_t too_near = 0;  ///< to the surface to be compared
    double deepest = 0.0;

    void frame(const Scene& scene, const Frame& frame, const DepthTruth& truth, const DepthTruth::Result& reported,
               test::SecondTruth& second) {
        second.examine(frame);
        std::set<std::array<Index, 2>> pierced;  // by the rim of the first body: the second
        if (reported.side_undecided > 0) {
            for (const auto& [a, b] : scene.topology.body_pairs) {
                if (second.rim_pierces(a, b)) pierced.insert({a, b});
                if (second.rim_pierces(b, a)) pierced.insert({b, a});
            }
        }
        double depth = 0.0;
        std::int64_t reported_wrong = 0;
        truth.each_sample([&](const DepthTruth::Judgement& sample) {
            if (sample.side == Side::wrong) ++reported_wrong;
            if (sample.side == Side::undecided) {
                EXPECT_TRUE(pierced.contains({sample.into, sample.from}))
                    << "tick " << frame.tick << ": " << text_of(sample, scene.topology) << " is reported undecided";
                return;
            }
            const Vector3 now = point_of(sample, scene.topology, frame.position);
            const bool closed = scene.topology.bodies[static_cast<std::size_t>(sample.into)].closed;
            ASSERT_TRUE(closed || second.rim_is_held(sample.into)) << "the second truth knows held rims alone";
            const bool is_wrong =
                closed ? second.is_inside(sample.into, now)
                       : second.crossed(sample.from, sample.into,
                                        point_of(sample, scene.topology, scene.first.position), now) != 0;
            const bool reported_so = sample.side == Side::wrong;
            const double away = is_wrong || reported_so ? second.distance(sample.into, now) : 0.0;
            ++compared;
            if (is_wrong != reported_so) {
                ++too_near;
                EXPECT_LE(away, test::SecondTruth::undecidable)
                    << "tick " << frame.tick << ": " << text_of(sample, scene.topology) << " is reported "
                    << (reported_so ? "wrong" : "right");
                return;
            }
            if (!is_wrong) return;
            ++wrong;
            depth = std::max(depth, away);
            EXPECT_NEAR(sample.depth, away, 1e-14) << "tick " << frame.tick << ": " << text_of(sample, scene.topology);
        });
        test::SecondTruth::Edges edges;
        for (std::size_t pair = 0; pair < scene.topology.body_pairs.size(); ++pair) {
            const auto [a, b] = scene.topology.body_pairs[pair];
            for (const auto& [from, into] : {std::array{a, b}, std::array{b, a}}) {
                if (!scene.topology.bodies[static_cast<std::size_t>(into)].closed) continue;
                const auto one = second.edges_inside(from, into);
                edges.stretches += one.stretches;
                edges.shallow += one.shallow;
                edges.depth = std::max(edges.depth, one.depth);
            }
        }
        // Each searches for the deepest point of an edge in steps of its own.
        depth = std::max(depth, edges.depth);
        EXPECT_NEAR(reported.residual_penetration, depth, test::SecondTruth::undecidable + 0.01 * depth)
            << "tick " << frame.tick;
        EXPECT_NEAR(static_cast<double>(reported.wrong_side - reported_wrong), edges.stretches, edges.shallow)
            << "tick " << frame.tick;
        deepest = std::max(deepest, depth);
    }
};

class ShippedScenes : public testing::TestWithParam<Case> {};

TEST_P(ShippedScenes, SecondTruthAgreesOnSidesAndDepthAndNeitherNeedsTheFramesBetween) {
    const std::filesystem::path file = test::scene_folder / (GetParam().scene + ".json");
    if (lacks_data(file, test::data_folder())) GTEST_SKIP() << "no data: meshes of " << GetParam().scene;
    const Scene scene = read_scene(file, test::data_folder());
    DepthTruth truth(scene.topology, scene.first);
    test::SecondTruth second(scene.topology, scene.first);
    Comparison comparison;
    // The second one is slow: the responses take turns, and large meshes are examined less often.
    // The first one sees every fifth tick, all that are compared among them.
    constexpr std::int64_t seen = 5;
    const std::int64_t between =
        scene.topology.triangle_count() > 3000 ? std::max<std::int64_t>(scene.ticks / (9 * seen), 1) * seen : 25;
    const std::int64_t stride = between * static_cast<std::int64_t>(responses.size());
    RunSpec spec;
    spec.mode = "closed_loop";
    spec.detector = "ohc_clustered";
    spec.response = GetParam().response;
    spec.contacts = "intersection";
    spec.truth_stride = scene.ticks;
    RunLimits limits;
    limits.observe = [&](const Simulation& simulation, const StepRow& row) {
        if (!simulation.outcome().ok() || row.tick % seen != 0) return;
        const DepthTruth::Result reported = truth.measure(simulation.frame());
        if (row.tick % stride != between * GetParam().number || reported.wrong_side < 0) return;
        comparison.frame(scene, simulation.frame(), truth, reported, second);
        DepthTruth forgetful(scene.topology, scene.first);
        const DepthTruth::Result alone = forgetful.measure(simulation.frame());
        EXPECT_EQ(alone.wrong_side, reported.wrong_side) << "tick " << row.tick;
        EXPECT_EQ(alone.side_undecided, reported.side_undecided) << "tick " << row.tick;
        EXPECT_EQ(alone.residual_penetration, reported.residual_penetration) << "tick " << row.tick;
    };
    const Record record = run_closed_loop(scene, spec, limits);
    EXPECT_GT(comparison.compared, 0);
    RecordProperty("compared", std::to_string(comparison.compared));
    RecordProperty("wrong", std::to_string(comparison.wrong));
    RecordProperty("too_near", std::to_string(comparison.too_near));
    RecordProperty("deepest_mm", std::to_string(comparison.deepest * 1e3));
}

INSTANTIATE_TEST_SUITE_P(AllScenes, ShippedScenes, testing::ValuesIn(all_cases()),
                         [](const testing::TestParamInfo<Case>& one) {
                             return test::test_name(one.param.scene + "_" + one.param.response);
                         });

}  // namespace
}  // namespace trocar
