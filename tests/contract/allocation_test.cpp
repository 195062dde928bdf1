// After warm-up no detector or contact generator of ours asks for memory in a tick, on a shipped scene. Of responses
// and steppers their contracts ask it. Libraries may: their count is a column of the reports.
#include <gtest/gtest.h>

#include <array>

#include "measure/allocations.hpp"
#include "method/registry.hpp"
#include "simulate/frame_source.hpp"
#include "simulate/query_distance.hpp"
#include "simulate/simulation.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

constexpr std::int64_t warm_up = 1000;    ///< the first drag, in which buffers grow
constexpr std::int64_t last_tick = 1700;  ///< the second, until the tool is lifted

/// The shipped drag, twice.
const Scene& drag() {
    static const Scene scene = [] {
        Scene made = test::shipped_scene("i2t_drag");
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

struct Counted {
    std::int64_t warm_up = 0;
    std::int64_t after = 0;
    std::int64_t worst_tick = -1;  ///< the last tick with one
    std::int64_t contacts = 0;     ///< after warm-up
};

/// A whole tick: detector, intersection contacts, a penalty and the tissue.
Counted count_detector(const std::string& detector) {
    Simulation simulation(drag(), make_detector(detector), make_response("penalty"),
                          registry().contact_generator("intersection"));
    Counted counted;
    for (std::int64_t tick = 0; tick < last_tick; ++tick) {
        const StepRow row = simulation.step();
        EXPECT_EQ(row.outcome, OutcomeKind::ok) << simulation.outcome().message;
        (tick < warm_up ? counted.warm_up : counted.after) += row.allocations;
        if (tick >= warm_up && row.allocations > 0) counted.worst_tick = tick;
        if (tick >= warm_up) counted.contacts += row.contacts_offered;
    }
    return counted;
}

/// The frames of the first drag twice over: the second time nothing is larger than it was in the first, so that a list
/// that grows then grows for nothing. Calls act(frame, warms_up).
template <typename Act>
void drag_twice(const Act& act) {
    for (const bool warms_up : {true, false}) {
        const auto frames = scene_frames(drag(), warm_up);
        Frame frame;
        for (std::int64_t tick = 0; frames->next(frame); ++tick) {
            frame.tick = tick + (warms_up ? 0 : warm_up);
            if (tick == 0) frame.moved.reset();  // the tool is back where it was
            act(frame, warms_up);
        }
    }
}

/// A contact generator on frames from outside, in which no response holds the tool back.
Counted count_generator(const ContactGeneratorEntry& entry) {
    const Scene& scene = drag();
    const auto detector = make_detector("ohc");
    const auto generator = make_contact_generator(entry.name);
    QueryDistance query_distance(scene);
    std::vector<Range> driven;
    std::vector<Range> tissue;
    for (const BodyRange& body : scene.topology.bodies) {
        (body.kind == BodyKind::tissue ? tissue : driven).push_back(body.vertices);
    }
    detector->prepare(scene.topology, scene.first);
    generator->prepare(scene.topology, scene.first);
    ContactSet contacts;
    contacts.contacts.reserve(4096);  // as the stepper does
    Counted counted;
    drag_twice([&](const Frame& frame, bool warms_up) {
        detector->update(frame, entry.wants_query_distance
                                    ? query_distance.of(furthest_move(frame, driven), furthest_move(frame, tissue), 0.0)
                                    : 0.0);
        detector->detect(frame, contacts);
        const std::int64_t before = allocation_count();
        generator->gather(frame, contacts);
        const std::int64_t allocations = allocation_count() - before;
        (warms_up ? counted.warm_up : counted.after) += allocations;
        if (!warms_up && allocations > 0) counted.worst_tick = frame.tick;
        if (!warms_up) counted.contacts += static_cast<std::int64_t>(contacts.contacts.size());
    });
    return counted;
}

/// A detector on frames from outside, within a query distance that grows and shrinks by factors of two.
Counted count_within_query_distance(const std::string& method) {
    const Scene& scene = drag();
    const auto detector = make_detector(method);
    detector->prepare(scene.topology, scene.first);
    ContactSet contacts;
    Counted counted;
    drag_twice([&](const Frame& frame, bool warms_up) {
        // The same in both drags.
        constexpr std::array<double, 4> query_distances{0.0002, 0.0004, 0.0008, 0.0004};  // m
        const double query_distance = query_distances[static_cast<std::size_t>(frame.tick / 50 % 4)];
        const std::int64_t before = allocation_count();
        detector->update(frame, query_distance);
        detector->detect(frame, contacts);
        const std::int64_t allocations = allocation_count() - before;
        EXPECT_TRUE(contacts.outcome.ok()) << contacts.outcome.message;
        (warms_up ? counted.warm_up : counted.after) += allocations;
        if (!warms_up && allocations > 0) counted.worst_tick = frame.tick;
        if (!warms_up) counted.contacts += static_cast<std::int64_t>(contacts.near.size());
    });
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
    const Matrix3X by_eigen = Matrix3X::Random(3, 1000);
    // A call of its own: what a `new` asks for and nobody sees a compiler may leave out.
    void* const by_operator_new = ::operator new(8);
    ::operator delete(by_operator_new);
    EXPECT_GE(allocation_count() - before, 2) << by_eigen.sum();
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

TEST_F(NoAllocation, InATickOfOurDetectorsWithinAQueryDistance) {
    for (const DetectorEntry& entry : registry().detectors()) {
        if (!entry.own || !entry.query_distance) continue;
        const Counted counted = count_within_query_distance(entry.name);
        EXPECT_GT(counted.contacts, 2000) << entry.name;
        EXPECT_EQ(counted.after, 0) << entry.name << ", last in tick " << counted.worst_tick;
    }
}

TEST_F(NoAllocation, InATickOfOurContactGenerators) {
    for (const ContactGeneratorEntry& entry : registry().contact_generators()) {
        if (entry.wants_native) continue;
        const Counted counted = count_generator(entry);
        EXPECT_GT(counted.contacts, 200) << entry.name;
        EXPECT_EQ(counted.after, 0) << entry.name << ", last in tick " << counted.worst_tick;
    }
}

}  // namespace
}  // namespace trocar
