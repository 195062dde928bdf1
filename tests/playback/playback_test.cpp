#include "playback/playback.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact/response_output.hpp"
#include "geometry/input_error.hpp"
#include "playback/frame_fields.hpp"
#include "scene/recording.hpp"
#include "simulate/simulation.hpp"
#include "support/scene_samples.hpp"
#include "support/second_truth.hpp"

namespace trocar {
namespace {

RunSpec closed_loop(const std::string& response, const std::string& contacts) {
    RunSpec spec;
    spec.mode = "closed_loop";
    spec.detector = "ohc";
    spec.response = response;
    spec.contacts = contacts;
    return spec;
}

std::vector<PlayedFrame> frames_of(const Scene& scene, const RunSpec& spec, const PlaybackChoice& choice = {}) {
    std::vector<PlayedFrame> frames;
    const Record record = play(scene, spec, {}, choice, [&](const PlayedFrame& frame) { frames.push_back(frame); });
    EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
    return frames;
}

std::vector<std::int64_t> ticks_of(const std::vector<PlayedFrame>& frames) {
    std::vector<std::int64_t> ticks;
    for (const PlayedFrame& frame : frames) ticks.push_back(frame.tick);
    return ticks;
}

TEST(Playback, IsTheVeryRunOfTheRecord) {
    const Scene scene = test::scene_from_text(test::poke_text());
    for (const RunSpec& spec :
         {closed_loop("unilateral", "tracked_proximity"), closed_loop("penalty", "intersection")}) {
        const Record recorded = run_closed_loop(scene, spec);
        std::vector<PlayedFrame> frames;
        const Record played = play(scene, spec, {}, {}, [&](const PlayedFrame& frame) { frames.push_back(frame); });
        EXPECT_EQ(played.state_hash, recorded.state_hash);
        ASSERT_EQ(frames.size(), recorded.rows.size());
        EXPECT_EQ(fmt::format("{:016x}", frames.back().hash), recorded.state_hash);
        double deepest = 0.0;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            EXPECT_EQ(frames[i].tick, recorded.rows[i].tick);
            EXPECT_DOUBLE_EQ(frames[i].row.residual_penetration, recorded.rows[i].residual_penetration);
            EXPECT_LE(frames[i].deepest_vertex(), recorded.rows[i].residual_penetration)
                << "the record examines vertices too";
            deepest = std::max(deepest, frames[i].deepest_vertex());
        }
        EXPECT_TRUE(deepest > 0.0 || spec.response == "unilateral") << "what is held does not cross";
    }
}

TEST(Playback, TurnsTheKnobsOfTheSpecification) {
    const Scene scene = test::scene_from_text(test::poke_text());
    RunSpec spec = closed_loop("penalty", "intersection");
    const std::string plain = run_closed_loop(scene, spec).state_hash;
    spec.overrides = "k=400";
    std::uint64_t last = 0;
    const Record played = play(scene, spec, {}, {}, [&](const PlayedFrame& frame) { last = frame.hash; });
    EXPECT_EQ(played.state_hash, make_run(scene, spec).state_hash);
    EXPECT_EQ(fmt::format("{:016x}", last), played.state_hash);
    EXPECT_EQ(played.spec.overrides, spec.overrides);
    EXPECT_NE(played.state_hash, plain);
}

TEST(Playback, ShowsAReplayWithoutForces) {
    const Scene scene = test::scene_from_text(test::poke_text());
    RunSpec spec;
    spec.mode = "replay";
    spec.detector = "ohc";
    const Record recorded = run_replay(scene, spec);
    std::size_t found = 0;
    std::int64_t frames = 0;
    const Record played = play(scene, spec, {}, {}, [&](const PlayedFrame& frame) {
        ++frames;
        EXPECT_TRUE(frame.tools.empty());
        for (const PlayedContact& contact : frame.contacts) {
            EXPECT_EQ(contact.kind, ActingKind::found);
            ++found;
        }
    });
    EXPECT_EQ(played.frames_hash, recorded.frames_hash);
    EXPECT_EQ(frames, scene.ticks);
    EXPECT_GT(found, 0U);
}

TEST(Playback, RefusesWhatHasNoSingleMotion) {
    const Scene scene = test::scene_from_text(test::poke_text());
    RunSpec spec = closed_loop("penalty", "intersection");
    for (const char* mode : {"metamorphic", "no_such_mode"}) {
        spec.mode = mode;
        EXPECT_THROW(play(scene, spec, {}, {}, [](const PlayedFrame&) {}), InputError) << mode;
    }
}

/// Depth of a point in a closed body by solid angles and brute force; 0 outside.
double depth_in(const Topology& topology, Index body, const Matrix3X& position, const Vector3& p) {
    double turns = 0.0;
    double nearest = std::numeric_limits<double>::infinity();
    const Range range = topology.bodies[static_cast<std::size_t>(body)].triangles;
    for (Index t = range.first; t < range.end(); ++t) {
        test::Corners3 corners;
        for (int i = 0; i < 3; ++i) corners.at(static_cast<std::size_t>(i)) = position.col(topology.triangles(i, t));
        turns += test::half_solid_angle(corners[0] - p, corners[1] - p, corners[2] - p);
        nearest = std::min(nearest, test::distance_to(corners, p));
    }
    return std::abs(turns) > std::numbers::pi ? nearest : 0.0;
}

TEST(Playback, DepthOfTissueIsThatOfSolidAnglesAndBruteForce) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const Index tool = 0;
    ASSERT_EQ(scene.topology.bodies[0].name, "tool");
    const Range sheet = scene.topology.bodies[1].vertices;
    int inside = 0;
    for (const PlayedFrame& frame : frames_of(scene, closed_loop("penalty", "intersection"), {.every = 7})) {
        for (Index vertex = sheet.first; vertex < sheet.end(); ++vertex) {
            const double depth = frame.depth[static_cast<std::size_t>(vertex)];
            EXPECT_NEAR(depth, depth_in(scene.topology, tool, frame.position, frame.position.col(vertex)), 1e-12);
            if (depth > 0.0) ++inside;
        }
    }
    EXPECT_GT(inside, 0);
}

TEST(Playback, ToolPushesTissueAsTissuePushesTheTool) {
    const Scene scene = test::scene_from_text(test::poke_text());
    double largest = 0.0;
    for (const PlayedFrame& frame : frames_of(scene, closed_loop("unilateral", "tracked_proximity"))) {
        ASSERT_EQ(frame.tools.size(), 1U);
        EXPECT_EQ(scene.topology.bodies[static_cast<std::size_t>(frame.tools[0].body)].name, "tool");
        EXPECT_TRUE(frame.tools[0].force.isApprox(frame.row.tool_force, 1e-12) || frame.row.tool_force.norm() == 0.0);
        EXPECT_LT((frame.tools[0].moment - frame.row.tool_moment).norm(), 1e-12);
        Vector3 on_tissue = Vector3::Zero();
        for (const PlayedContact& contact : frame.contacts) {
            if (contact.kind != ActingKind::pushed) continue;
            EXPECT_EQ(scene.topology.bodies[static_cast<std::size_t>(contact.body)].name, "sheet");
            EXPECT_EQ(contact.other, frame.tools[0].body);
            EXPECT_GE(contact.depth, 0.0);
            EXPECT_NEAR(contact.normal.norm(), 1.0, 1e-12);
            on_tissue += contact.force;
        }
        EXPECT_LT((on_tissue + frame.tools[0].force).norm(), 1e-9 * (1.0 + on_tissue.norm()));
        largest = std::max(largest, on_tissue.norm());
    }
    EXPECT_GT(largest, 1e-3);
}

TEST(Playback, OfTheContactsOfAResponseThoseThatPenetrateOrPushAreShownWithTheirDepthAndForce) {
    struct Acting {
        double depth;  // m
        Vector3 force;
    };
    const Scene scene = test::scene_from_text(test::poke_text());
    std::vector<std::vector<Acting>> reported;  // by tick, as response and stepper say themselves
    std::size_t idle = 0;
    std::size_t deep = 0;
    RunLimits limits;
    limits.observe = [&](const Simulation& simulation, const StepRow&) {
        reported.emplace_back();
        const std::vector<ContactForceLaw>& contacts = simulation.output().contacts;
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            const Vector3 force = simulation.contact_forces().at(c).force;
            const bool is_inside = contacts[c].gap < 0.0;
            if (is_inside || force.norm() > 0.0) {
                reported.back().push_back({is_inside ? -contacts[c].gap : 0.0, force});
            } else {
                ++idle;
            }
            deep += is_inside ? 1U : 0U;
        }
    };
    std::vector<PlayedFrame> frames;
    const Record record = play(scene, closed_loop("unilateral", "tracked_proximity"), limits, {},
                               [&](const PlayedFrame& frame) { frames.push_back(frame); });
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    ASSERT_EQ(frames.size(), reported.size());
    for (std::size_t tick = 0; tick < frames.size(); ++tick) {
        std::vector<PlayedContact> shown = frames[tick].contacts;
        std::erase_if(shown, [](const PlayedContact& contact) { return contact.kind != ActingKind::pushed; });
        ASSERT_EQ(shown.size(), reported[tick].size()) << tick;
        for (std::size_t c = 0; c < shown.size(); ++c) {
            EXPECT_EQ(shown[c].depth, reported[tick][c].depth) << tick;
            EXPECT_EQ(shown[c].force, reported[tick][c].force) << tick;
        }
    }
    EXPECT_GT(idle, 0U) << "some are only near";
    EXPECT_GT(deep, 0U);
}

TEST(Playback, ShowsTheTicksThatAreAskedForOnce) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const RunSpec spec = closed_loop("none", "intersection");  // deepest where its script ends
    std::int64_t deepest = -1;
    double depth = -1.0;
    for (const StepRow& row : run_closed_loop(scene, spec).rows) {
        if (row.residual_penetration > depth) {
            depth = row.residual_penetration;
            deepest = row.tick;
        }
    }
    ASSERT_NE(deepest % 25, 0) << "the test wants a deepest tick that `every` does not bring";
    ASSERT_NE(deepest, 59);
    EXPECT_EQ(ticks_of(frames_of(scene, spec, {.every = 25})), (std::vector<std::int64_t>{0, 25, 50}));
    EXPECT_EQ(ticks_of(frames_of(scene, spec, {.every = 0, .ticks = {7, 3}})), (std::vector<std::int64_t>{3, 7}));
    EXPECT_EQ(ticks_of(frames_of(scene, spec, {.every = 25, .deepest = true, .last = true})),
              (std::vector<std::int64_t>{0, 25, 50, deepest, 59}));
    EXPECT_EQ(ticks_of(frames_of(scene, spec, {.every = 0, .ticks = {deepest, 59}, .deepest = true, .last = true})),
              (std::vector<std::int64_t>{deepest, 59}));
}

TEST(Playback, DisplacementStartsAtZeroAndIsThePathFromTheFirstFrame) {
    const Scene scene = test::scene_from_text(test::poke_text());
    for (const PlayedFrame& frame : frames_of(scene, closed_loop("unilateral", "tracked_proximity"), {.every = 20})) {
        EXPECT_EQ(frame.displacement, frame.position - scene.first.position);
        const Range tool = scene.topology.bodies[0].vertices;
        const double down = std::min(1.0, frame.time / 0.04) * 0.005;
        for (Index vertex = tool.first; vertex < tool.end(); ++vertex) {
            EXPECT_NEAR(frame.displacement(2, vertex), -down, 1e-12) << "as its script drives it";
        }
    }
}

/// Two triangles in a row, stretched by a tenth along x and pressed together by a fifth along y on the second frame.
struct StretchedStrip {
    Topology topology;
    Frame rest;
    Frame stretched;
    StretchedStrip() {
        Body strip{.name = "strip", .kind = BodyKind::tissue, .closed = false, .vertex_count = 4};
        strip.triangles.resize(3, 2);
        strip.triangles << 0, 0,  //
            1, 2,                 //
            2, 3;
        topology = make_topology({strip});
        rest.position.resize(3, 4);
        rest.position << 0.0, 0.01, 0.01, 0.0,  //
            0.0, 0.0, 0.01, 0.01,               //
            0.0, 0.0, 0.0, 0.0;
        rest.previous = rest.position;
        rest.velocity.setZero(3, 4);
        stretched = rest;
        stretched.tick = 1;
        stretched.time = 0.001;
        stretched.position.row(0) *= 1.1;
        stretched.position.row(1) *= 0.8;
    }
    [[nodiscard]] std::filesystem::path record_in(const test::TemporaryFolder& folder) const {
        std::filesystem::path file = folder.path() / "strip.trocrec";
        RecordingWriter writer(file, topology, 0.001);
        writer.write(rest);
        writer.write(stretched);
        writer.finish();
        return file;
    }
};

TEST(FrameFields, StrainIsTheLargestInSizeWithItsSign) {
    const StretchedStrip strip;
    const std::vector<Spring> along_x{{.i = 0, .j = 1, .rest = 0.01}, {.i = 3, .j = 2, .rest = 0.01}};
    FrameFields stretched(strip.topology, strip.rest, along_x);
    PlayedFrame played;
    stretched.fill(strip.stretched, played);
    for (const double strain : played.strain) EXPECT_NEAR(strain, 0.1, 1e-12);
    FrameFields both(strip.topology, strip.rest, edges_at_rest(strip.topology, strip.rest));
    both.fill(strip.stretched, played);
    for (const double strain : played.strain) EXPECT_NEAR(strain, -0.2, 1e-12);
}

TEST(PlayRecording, ShowsTheFramesOfTheFileWithoutContacts) {
    const StretchedStrip strip;
    const test::TemporaryFolder folder;
    const std::filesystem::path file = strip.record_in(folder);
    std::vector<PlayedFrame> frames;
    EXPECT_EQ(play_recording(file, {}, [&](const PlayedFrame& frame) { frames.push_back(frame); }), 2);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[0].displacement.norm(), 0.0);
    EXPECT_EQ(frames[1].position, strip.stretched.position);
    EXPECT_EQ(frames[1].hash, strip.stretched.hash());
    EXPECT_NEAR(frames[1].strain[0], -0.2, 1e-12);
    EXPECT_TRUE(frames[1].contacts.empty());
    EXPECT_TRUE(frames[1].tools.empty());
}

TEST(PlayRecording, EndsEarlyWhenAskedToAndRefusesWhatIsNotFinite) {
    StretchedStrip strip;
    strip.stretched.position(0, 0) = std::nan("");
    const test::TemporaryFolder folder;
    const std::filesystem::path file = strip.record_in(folder);
    EXPECT_EQ(play_recording(
                  file, {}, [](const PlayedFrame&) {}, [](std::int64_t done) { return done < 1; }),
              1);
    EXPECT_THROW(play_recording(file, {}, [](const PlayedFrame&) {}), InputError);
}

}  // namespace
}  // namespace trocar
