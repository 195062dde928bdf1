// Generated scenes are what their names say: the same bits for the same specification, closed surfaces, moving
// everywhere, and touching as much as the targets assume. Pairs are counted by the exact oracle, never by a method.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "measure/pair_truth.hpp"
#include "report/figures.hpp"
#include "report/report.hpp"
#include "simulate/generated_scene.hpp"
#include "simulate/interleaved.hpp"
#include "support/surfaces.hpp"

namespace trocar {
namespace {

Frame frame_of(const InstrumentInTissue& scene, std::int64_t step) {
    Frame frame;
    scene.write(step, frame);
    return frame;
}

std::size_t pairs_at(const InstrumentInTissue& scene, std::int64_t step) {
    std::vector<TrianglePair> pairs;
    true_pairs(scene.topology(), frame_of(scene, step), pairs);
    return pairs.size();
}

std::vector<InstrumentInTissueSpec> one_of_each() {
    std::vector<InstrumentInTissueSpec> specs;
    for (const Variant variant : {Variant::light, Variant::deep, Variant::near, Variant::far, Variant::rotating,
                                  Variant::strain, Variant::local}) {
        specs.push_back({.variant = variant, .tissue_triangles = 2000, .instrument_triangles = 500});
    }
    specs.push_back({.tissue_triangles = 2000, .instrument_triangles = 500, .tissues = 2, .instruments = 4});
    specs.push_back({.tissue_triangles = 2000, .instrument_triangles = 500, .order = VertexOrder::shuffled});
    specs.push_back({.tissue_triangles = 2000, .instrument_triangles = 500, .order = VertexOrder::generated});
    return specs;
}

TEST(GeneratedScene, SameSpecificationGivesTheSameBitsInAnyOrderOfSteps) {
    for (const InstrumentInTissueSpec& spec : one_of_each()) {
        const InstrumentInTissue first(spec);
        const InstrumentInTissue second(spec);
        Frame running;
        std::vector<std::uint64_t> hashes;
        for (std::int64_t step = 0; step < 4; ++step) {
            first.write(step, running);
            hashes.push_back(running.hash());
        }
        for (const std::int64_t step : {3, 0, 2, 1}) {
            const Frame alone = frame_of(second, step);
            EXPECT_EQ(alone.hash(), hashes[static_cast<std::size_t>(step)]) << spec.name();
            if (step != 3) continue;
            EXPECT_EQ(alone.previous, running.previous) << spec.name();
            EXPECT_EQ(alone.velocity, running.velocity) << spec.name();
        }
    }
}

TEST(GeneratedScene, PublishedDetectionWasMeasuredOnTheseFrames) {
    std::map<std::string, std::set<std::string>> published;
    std::map<std::string, std::string> found;
    for (const Record& record : read_records(std::filesystem::path(TROCAR_SOURCE_DIR) / "reports" / "detection")) {
        constexpr std::string_view prefix = "generated:";
        const RunSpec& spec = record.spec;
        const bool large = std::stoll("0" + fact_of(record, "scene.triangles")) > 300'000;  // seconds each
        if (!spec.scene_file.starts_with(prefix) || record.frames_hash.empty() || large) continue;
        const std::string scene = spec.scene_file.substr(prefix.size());
        const std::string name = scene + " " + std::to_string(spec.ticks);
        published[name].insert(record.frames_hash);
        if (found.contains(name)) continue;
        const std::unique_ptr<GeneratedScene> made = make_generated_scene(scene, spec.seed);
        FnvHash hash;
        Frame frame;
        for (std::int64_t block = 0; block < interleaved_blocks; ++block) {
            made->write(first_tick_of_block(block, ticks_per_block(spec.ticks)), frame);
            hash.add_word(frame.hash());
        }
        found[name] = hash.text();
    }
    EXPECT_GE(found.size(), 20U);
    for (const auto& [name, hash] : found) EXPECT_EQ(published[name], std::set<std::string>{hash}) << name;
}

TEST(GeneratedScene, AnotherSeedGivesOtherBits) {
    const InstrumentInTissue first({.tissue_triangles = 2000, .instrument_triangles = 500, .seed = 1});
    const InstrumentInTissue second({.tissue_triangles = 2000, .instrument_triangles = 500, .seed = 2});
    EXPECT_NE(frame_of(first, 0).hash(), frame_of(second, 0).hash());
}

TEST(GeneratedScene, TriangleCountsAreTheOnesAskedFor) {
    for (const auto& [n, m] : {std::pair{2000, 500}, {20000, 2000}, {200000, 10000}}) {
        const InstrumentInTissue scene({.tissue_triangles = n, .instrument_triangles = m});
        ASSERT_EQ(scene.topology().body_count(), 2);
        EXPECT_NEAR(scene.topology().bodies[0].triangles.count, m, 0.15 * m);
        EXPECT_NEAR(scene.topology().bodies[1].triangles.count, n, 0.05 * n);
    }
}

TEST(GeneratedScene, ACountThatAMeshHasIsMetExactly) {
    const InstrumentInTissue near({.tissue_triangles = 2000, .instrument_triangles = 500});
    const Index count = near.topology().bodies[0].triangles.count;
    const InstrumentInTissue exact({.tissue_triangles = 2000, .instrument_triangles = count});
    EXPECT_EQ(exact.topology().bodies[0].triangles.count, count);
}

TEST(GeneratedScene, InstrumentsThatShareATissueStandFourCentimetresApart) {
    const InstrumentInTissue scene({.tissue_triangles = 2000, .instrument_triangles = 500, .instruments = 2});
    const Frame frame = frame_of(scene, 0);
    const auto middle = [&](std::size_t body) {
        const Range own = scene.topology().bodies[body].vertices;
        const auto x = frame.position.row(0).segment(own.first, own.count);
        return 0.5 * (x.minCoeff() + x.maxCoeff());
    };
    EXPECT_NEAR(std::abs(middle(0) - middle(1)), 0.04, 0.002);
    EXPECT_NEAR(middle(0) + middle(1), 0.0, 0.002);
}

TEST(GeneratedScene, BodiesAreClosedAndTurnedOutward) {
    for (const InstrumentInTissueSpec& spec : one_of_each()) {
        const InstrumentInTissue scene(spec);
        EXPECT_TRUE(test::is_closed(scene.topology().triangles)) << spec.name();
        const Frame frame = frame_of(scene, 5);
        for (const BodyRange& body : scene.topology().bodies) {
            const double found = test::signed_volume(
                {frame.position, scene.topology().triangles.middleCols(body.triangles.first, body.triangles.count)});
            if (body.kind == BodyKind::tissue) {
                EXPECT_NEAR(found, 0.1 * 0.1 * 0.01, 5e-6) << spec.name();
            } else {
                // Shaft of 100 mm × 2.5 mm and two half capsules of 20 mm × 2 mm, less what flat facets cut off.
                EXPECT_GT(found, 1.6e-6) << spec.name();
                EXPECT_LT(found, 2.3e-6) << spec.name();
            }
        }
    }
}

TEST(GeneratedScene, ReorderingMovesNothing) {
    std::array<std::vector<std::array<double, 3>>, 3> corners;
    for (const VertexOrder order : {VertexOrder::renumbered, VertexOrder::generated, VertexOrder::shuffled}) {
        const InstrumentInTissue scene({.tissue_triangles = 2000, .instrument_triangles = 500, .order = order});
        const Frame frame = frame_of(scene, 3);
        const Range instrument = scene.topology().bodies[0].triangles;
        auto& list = corners.at(static_cast<std::size_t>(order));
        for (Index t = instrument.first; t < instrument.end(); ++t) {
            for (int k = 0; k < 3; ++k) {
                const Vector3 p = frame.position.col(scene.topology().triangles(k, t));
                list.push_back({p.x(), p.y(), p.z()});
            }
        }
        std::sort(list.begin(), list.end());
    }
    EXPECT_EQ(corners[0], corners[1]);
    EXPECT_EQ(corners[0], corners[2]);
}

TEST(GeneratedScene, EveryTissueVertexMovesEveryStepUnlessLocal) {
    for (const InstrumentInTissueSpec& spec : one_of_each()) {
        const InstrumentInTissue scene(spec);
        const Frame frame = frame_of(scene, 7);
        std::vector<std::uint8_t> may_move(static_cast<std::size_t>(frame.position.cols()), frame.moved ? 0 : 1);
        if (frame.moved) {
            for (const Range range : *frame.moved) {
                for (Index v = range.first; v < range.end(); ++v) may_move[static_cast<std::size_t>(v)] = 1;
            }
        }
        EXPECT_EQ(frame.moved.has_value(), spec.variant == Variant::local);
        Index still = 0;
        for (Index v = 0; v < frame.position.cols(); ++v) {
            const bool moved = frame.position.col(v) != frame.previous.col(v);
            if (!moved) ++still;
            EXPECT_TRUE(!moved || may_move[static_cast<std::size_t>(v)] == 1) << spec.name() << " vertex " << v;
        }
        if (spec.variant == Variant::local) {
            EXPECT_GT(still, frame.position.cols() / 2);
        } else {
            EXPECT_EQ(still, 0) << spec.name();
        }
    }
}

TEST(GeneratedScene, LightContactHasThePairsThatTheTargetsAssume) {
    for (const Index n : {2000, 20000, 200000}) {
        const InstrumentInTissue scene({.tissue_triangles = n, .instrument_triangles = 2000});
        for (const std::int64_t step : {0, 17, 41}) {
            const std::size_t pairs = pairs_at(scene, step);
            EXPECT_GE(pairs, 170U) << n << " triangles, step " << step;
            EXPECT_LE(pairs, 255U) << n << " triangles, step " << step;
        }
    }
}

TEST(GeneratedScene, DeepHasManyMorePairsNearAndFarHaveNone) {
    const InstrumentInTissueSpec base{.tissue_triangles = 20000, .instrument_triangles = 2000};
    for (const std::int64_t step : {0, 17, 41}) {
        InstrumentInTissueSpec spec = base;
        spec.variant = Variant::deep;
        EXPECT_GT(pairs_at(InstrumentInTissue(spec), step), 500U);
        for (const auto& [variant, boxes_meet] : {std::pair{Variant::near, true}, {Variant::far, false}}) {
            spec.variant = variant;
            const InstrumentInTissue scene(spec);
            EXPECT_EQ(pairs_at(scene, step), 0U) << spec.name();
            const Frame frame = frame_of(scene, step);
            std::array<Box, 2> boxes;
            for (Index v = 0; v < frame.position.cols(); ++v) {
                boxes.at(static_cast<std::size_t>(scene.topology().body_of_vertex(v))).add(frame.position.col(v));
            }
            EXPECT_EQ(boxes[0].overlaps(boxes[1]), boxes_meet) << spec.name();
        }
    }
}

TEST(GeneratedScene, StrainReachesTwentyPercent) {
    const InstrumentInTissue scene({.variant = Variant::strain, .tissue_triangles = 2000, .instrument_triangles = 500});
    const auto width = [&scene](std::int64_t step) {
        const Frame frame = frame_of(scene, step);
        const Range tissue = scene.topology().bodies[1].vertices;
        const auto x = frame.position.row(0).segment(tissue.first, tissue.count);
        return x.maxCoeff() - x.minCoeff();
    };
    EXPECT_NEAR(width(32) / width(0), 1.2, 0.01);
}

TEST(GeneratedScene, EveryInstrumentOfAMultiBodySceneTouchesItsTissue) {
    const InstrumentInTissue scene(
        {.tissue_triangles = 2000, .instrument_triangles = 500, .tissues = 5, .instruments = 10});
    std::vector<TrianglePair> pairs;
    true_pairs(scene.topology(), frame_of(scene, 9), pairs);
    std::map<std::pair<Index, Index>, int> count;
    for (const TrianglePair pair : pairs) {
        ++count[{scene.topology().body_of_triangle[static_cast<std::size_t>(pair.a)],
                 scene.topology().body_of_triangle[static_cast<std::size_t>(pair.b)]}];
    }
    EXPECT_EQ(count.size(), 10U);
    for (const auto& [bodies, pairs_of_bodies] : count) {
        EXPECT_LT(bodies.first, 10);
        EXPECT_EQ(bodies.second, 10 + bodies.first % 5);
        EXPECT_GT(pairs_of_bodies, 20);
    }
}

TEST(GeneratedScene, BallsTouchOnlyNeighbours) {
    for (const Index count : {2, 8, 64}) {
        const Balls scene(count, 200, 1);
        EXPECT_TRUE(test::is_closed(scene.topology().triangles));
        Frame frame;
        scene.write(11, frame);
        std::vector<TrianglePair> pairs;
        true_pairs(scene.topology(), frame, pairs);
        std::set<std::pair<Index, Index>> touching;
        for (const TrianglePair pair : pairs) {
            touching.emplace(scene.topology().body_of_triangle[static_cast<std::size_t>(pair.a)],
                             scene.topology().body_of_triangle[static_cast<std::size_t>(pair.b)]);
        }
        // A lattice of side s touches along x only: count - count / s pairs, each of consecutive bodies.
        const Index side = count == 2 ? 2 : count == 8 ? 2 : 4;
        EXPECT_EQ(touching.size(), static_cast<std::size_t>(count - count / side));
        for (const auto& [a, b] : touching) EXPECT_EQ(b, a + 1);
    }
}

TEST(GeneratedScene, ATextGivesTheSceneThatItsSettingsSay) {
    const std::string text =
        "instrument_in_tissue:tissues=2,tissue_triangles=2000,instruments=3,instrument_triangles=500";
    const GeneratedSceneFacts facts = generated_scene_facts(text);
    EXPECT_EQ(facts.name, "light 2 x 2k + 3 x 500");
    EXPECT_EQ(facts.text,
              "instrument_in_tissue:instrument_triangles=500,instruments=3,tissue_triangles=2000,tissues=2");
    EXPECT_EQ(facts.pair_class, "I2T");
    EXPECT_EQ(facts.triangles, 2 * 2000 + 3 * 500);
    const auto scene = make_generated_scene(text);
    EXPECT_NEAR(static_cast<double>(scene->topology().triangle_count()), 5500.0, 550.0);
    const InstrumentInTissue same(
        {.tissue_triangles = 2000, .instrument_triangles = 500, .tissues = 2, .instruments = 3});
    Frame of_text;
    scene->write(5, of_text);
    EXPECT_EQ(of_text.hash(), frame_of(same, 5).hash());
    // Scenes of one family differ in size only.
    const auto family = [](const std::string& of) { return generated_scene_facts(of).family; };
    EXPECT_EQ(family("instrument_in_tissue:tissue_triangles=2000"), family("instrument_in_tissue"));
    EXPECT_NE(family("instrument_in_tissue:variant=deep"), family("instrument_in_tissue"));
    EXPECT_NE(family("instrument_in_tissue:instrument_triangles=500"), family("instrument_in_tissue"));
    EXPECT_EQ(family("balls:count=2"), family("balls:count=4"));
    EXPECT_EQ(generated_scene_facts("balls:count=7").name, "7 balls");
    EXPECT_EQ(generated_scene_facts("balls").pair_class, "T2T");
    // Counts are short where nothing is lost by it.
    for (const auto& [count, word] :
         {std::pair{"1000000", "1M"}, {"1500000", "1500k"}, {"2000", "2k"}, {"2500", "2500"}}) {
        const GeneratedSceneFacts counted =
            generated_scene_facts(std::string("instrument_in_tissue:tissue_triangles=") + count);
        EXPECT_EQ(counted.name, std::string("light ") + word + " x 2k");
    }
    for (const char* bad : {"cube", "balls:count=1", "balls:size=3", "instrument_in_tissue:variant=soft",
                            "balls:count=1001", "instrument_in_tissue:tissue_triangles=99",
                            "instrument_in_tissue:tissue_triangles=3000000", "instrument_in_tissue:instruments=3"}) {
        EXPECT_THROW((void)generated_scene_facts(bad), InputError) << bad;
    }
}

}  // namespace
}  // namespace trocar
