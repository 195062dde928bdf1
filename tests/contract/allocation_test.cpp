// After warm-up no stage of ours asks for memory in a tick: every detector, `derive` and every response of ours, in a
// whole closed loop on a shipped scene. Libraries may: their count is a column of the reports.
#include <gtest/gtest.h>

#include "contact/derive.hpp"
#include "measure/allocations.hpp"
#include "method/registry.hpp"
#include "simulate/frame_source.hpp"
#include "simulate/simulation.hpp"

namespace trocar {
namespace {

constexpr std::int64_t warm_up = 1000;    ///< the first drag, in which buffers grow
constexpr std::int64_t last_tick = 1700;  ///< the second, until the tool is lifted

/// The shipped drag, twice.
const Scene& drag() {
    static const Scene scene = [] {
        Scene made = read_scene(std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_drag.json", std::nullopt);
        for (SceneBody& body : made.bodies) {
            if (!body.motion) continue;
            const std::vector<MotionKey> once = body.motion->keys;
            for (MotionKey key : once) {
                key.time += made.dt * static_cast<double>(warm_up);
                body.motion->keys.push_back(key);
            }
        }
        return made;
    }();
    return scene;
}

std::vector<std::string> own_detectors() {
    std::vector<std::string> methods;
    for (const DetectorEntry& entry : registry().detectors()) {
        if (entry.own) methods.push_back(entry.name);
    }
    return methods;
}

/// Our responses; one that has profiles, with each of them.
std::vector<std::string> own_responses() {
    std::vector<std::string> methods;
    for (const ResponseEntry& entry : registry().responses()) {
        if (!entry.own) continue;
        const std::size_t before = methods.size();
        for (const Parameter& parameter : entry.parameters) {
            if (parameter.name != "profile") continue;
            for (const std::string& profile : parameter.choices) methods.push_back(entry.name + ":profile=" + profile);
        }
        if (methods.size() == before) methods.push_back(entry.name);
    }
    return methods;
}

struct Counted {
    std::int64_t warm_up = 0;
    std::int64_t after = 0;
    std::int64_t worst_tick = -1;  ///< the last tick with one
    std::int64_t contacts = 0;     ///< after warm-up
};

/// A whole tick: detector, derive, a penalty and the tissue.
Counted count_detector(const std::string& detector) {
    Simulation simulation(drag(), make_detector(detector), make_response("penalty"), ContactSource::canonical);
    Counted counted;
    for (std::int64_t tick = 0; tick < last_tick; ++tick) {
        const StepRow row = simulation.step();
        EXPECT_EQ(row.outcome, OutcomeKind::ok) << simulation.outcome().message;
        (tick < warm_up ? counted.warm_up : counted.after) += row.allocations;
        if (tick >= warm_up && row.allocations > 0) counted.worst_tick = tick;
        if (tick >= warm_up) counted.contacts += row.contacts;
    }
    return counted;
}

/// derive and the response on frames from outside, so that a response that cannot hold the tool back is counted too.
Counted count_response(const std::string& method) {
    const Scene& scene = drag();
    const MethodSpec spec = parse_method(method);
    const auto response = make_response(spec.name, spec.parameters);
    const auto detector = neutral_pairs();
    const auto frames = scene_frames(scene, last_tick);
    response->prepare(scene.topology, scene.materials);
    detector->prepare(scene.topology, scene.first);
    Frame frame;
    ContactSet contacts;
    Effect effect;
    effect.resize(scene.topology.vertex_count, scene.topology.body_count());
    effect.contacts.reserve(4096);  // as the stepper does
    effect.placements.reserve(4096);
    contacts.contacts.reserve(4096);
    Counted counted;
    for (std::int64_t tick = 0; frames->next(frame); ++tick) {
        detector->update(frame);
        detector->detect(frame, contacts);
        const std::int64_t before = allocation_count();
        derive(scene.topology, frame, contacts);
        response->respond(frame, scene.dt, contacts, effect);
        const std::int64_t allocations = allocation_count() - before;
        (tick < warm_up ? counted.warm_up : counted.after) += allocations;
        if (tick >= warm_up && allocations > 0) counted.worst_tick = tick;
        if (tick >= warm_up) counted.contacts += static_cast<std::int64_t>(contacts.contacts.size());
    }
    return counted;
}

class NoAllocation : public ::testing::Test {
protected:
    void SetUp() override {
        if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    }
};

TEST_F(NoAllocation, TheCounterCounts) {
    const std::int64_t before = allocation_count();
    const Matrix3X by_eigen = Matrix3X::Zero(3, 1000);
    const std::vector<double> by_operator_new(1000, by_eigen.sum());
    EXPECT_GE(allocation_count() - before, 2) << by_operator_new.size();
}

TEST_F(NoAllocation, InATickOfOurDetectorsAndDerive) {
    ASSERT_FALSE(own_detectors().empty());
    for (const std::string& detector : own_detectors()) {
        const Counted counted = count_detector(detector);
        EXPECT_GT(counted.warm_up, 0) << detector;
        EXPECT_GT(counted.contacts, 200) << detector;
        EXPECT_EQ(counted.after, 0) << detector << ", last in tick " << counted.worst_tick;
    }
}

TEST_F(NoAllocation, InATickOfOurResponsesInAllProfiles) {
    ASSERT_FALSE(own_responses().empty());
    for (const std::string& response : own_responses()) {
        const Counted counted = count_response(response);
        EXPECT_GT(counted.contacts, 200) << response;
        EXPECT_EQ(counted.after, 0) << response << ", last in tick " << counted.worst_tick;
    }
}

}  // namespace
}  // namespace trocar
