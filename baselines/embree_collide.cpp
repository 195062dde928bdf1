// Embree 3 rtcCollide on user geometry, one scene per body, followed by our exact triangle test.
//
// Settings, and where they depart from the library's default:
// * device "threads=1": every method runs on one thread (default: all cores).
// * geometry build quality REFIT and scene flag DYNAMIC: the tree is refitted to the moved vertices each tick
//   instead of being rebuilt (default: MEDIUM, static). The scene's own quality is LOW, which makes one tree per
//   geometry, the only kind that Embree refits; the geometry's tree is built once by the surface area heuristic.
// * update=rebuild builds a tree of `quality` each tick: low (Morton codes) or medium (surface area heuristic).
// * boxes are rounded outward to float: Embree stores float boxes, and nothing may be missed.
// * within a query distance every box has half of it added on all sides, in both scenes; bodies at rest are followed
//   when the query distance changes.
// * leaf=cluster puts runs of `cluster_size` consecutive triangles into one primitive, the hybrid a sceptic asks for.
// * Embree takes subnormal numbers for zero while it runs; in its callback they count again, or our test would err.
// * coordinates beyond 1.8e18 make the tick `unsupported`: Embree leaves such boxes out without a word.
// * errors of the device end the tick as outcome `threw`; a library of another version than its header is refused.
#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <xmmintrin.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "candidates.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

using baselines::box_of_body;
using baselines::FloatBox;

constexpr Index largest_cluster = 64;
constexpr double largest_coordinate = 1.8e18;  // just below the library's own 1.844e18

/// One body as Embree sees it. Address is stable: bounds callbacks hold it.
struct EmbreeBody {
    const Topology* topology = nullptr;
    const Frame* frame = nullptr;
    const baselines::FloatVertices* vertices = nullptr;  ///< the frame's, narrowed
    double around = 0.0;                                 ///< m, half of the query distance
    Range triangles;
    Index triangles_per_primitive = 1;
    RTCGeometry geometry = nullptr;
    RTCScene scene = nullptr;
    Box box;  ///< with that around it

    [[nodiscard]] FloatBox box_of(Index triangle) const { return vertices->box_of(*topology, triangle, around); }
    [[nodiscard]] Index primitive_count() const {
        return (triangles.count + triangles_per_primitive - 1) / triangles_per_primitive;
    }
    [[nodiscard]] Range primitive(Index number) const {
        const Index first = triangles.first + number * triangles_per_primitive;
        return {first, std::min(triangles_per_primitive, triangles.end() - first)};
    }
};

void primitive_bounds(const RTCBoundsFunctionArguments* arguments) {
    const auto& body = *static_cast<const EmbreeBody*>(arguments->geometryUserPtr);
    const Range run = body.primitive(static_cast<Index>(arguments->primID));
    FloatBox box = body.box_of(run.first);
    for (Index t = run.first + 1; t < run.end(); ++t) box.add(body.box_of(t));
    RTCBounds& bounds = *arguments->bounds_o;
    bounds.lower_x = box.low[0];
    bounds.lower_y = box.low[1];
    bounds.lower_z = box.low[2];
    bounds.upper_x = box.high[0];
    bounds.upper_y = box.high[1];
    bounds.upper_z = box.high[2];
}

/// The processor's numbers as IEEE 754 has them, for as long as it lives.
class SubnormalsCount {
public:
    SubnormalsCount() : outside_(_mm_getcsr()) { _mm_setcsr(outside_ & ~flush_and_zero); }
    ~SubnormalsCount() { _mm_setcsr(outside_); }
    SubnormalsCount(const SubnormalsCount&) = delete;
    SubnormalsCount& operator=(const SubnormalsCount&) = delete;
    SubnormalsCount(SubnormalsCount&&) = delete;
    SubnormalsCount& operator=(SubnormalsCount&&) = delete;

private:
    static constexpr unsigned int flush_and_zero = 0x8040;  // results flushed to zero, operands taken as zero
    unsigned int outside_;
};

struct Query {
    const EmbreeBody* a = nullptr;
    const EmbreeBody* b = nullptr;
    ContactSet* contacts = nullptr;
};

/// The triangles of a run that overlap `common`, with their boxes.
struct RunBoxes {
    std::array<Index, largest_cluster> triangle;
    std::array<FloatBox, largest_cluster> box;
    std::size_t count = 0;
    FloatBox hull;

    RunBoxes(const EmbreeBody& body, Range run, const FloatBox* common, std::int64_t& box_tests) {
        if (common != nullptr) box_tests += run.count;
        for (Index t = run.first; t < run.end(); ++t) {
            const FloatBox own = body.box_of(t);
            if (common != nullptr && !own.overlaps(*common)) continue;
            if (count == 0) hull = own;
            hull.add(own);
            triangle[count] = t;
            box[count++] = own;
        }
    }
};

void on_collisions(void* user, RTCCollision* collisions, unsigned int count) {
    const SubnormalsCount subnormals;
    const Query& query = *static_cast<const Query*>(user);
    const Topology& topology = *query.a->topology;
    const Frame& frame = *query.a->frame;
    std::int64_t& box_tests = query.contacts->work.box_tests;
    for (unsigned int i = 0; i < count; ++i) {
        const Range run_a = query.a->primitive(static_cast<Index>(collisions[i].primID0));
        const Range run_b = query.b->primitive(static_cast<Index>(collisions[i].primID1));
        if (run_a.count == 1 && run_b.count == 1) {
            baselines::test_candidate(topology, frame, run_a.first, run_b.first, *query.contacts);
            continue;
        }
        const RunBoxes all_a(*query.a, run_a, nullptr, box_tests);
        const RunBoxes b(*query.b, run_b, &all_a.hull, box_tests);
        if (b.count == 0) continue;
        const RunBoxes a(*query.a, run_a, &b.hull, box_tests);
        for (std::size_t k = 0; k < a.count; ++k) {
            for (std::size_t m = 0; m < b.count; ++m) {
                ++box_tests;
                if (!a.box[k].overlaps(b.box[m])) continue;
                baselines::test_candidate(topology, frame, a.triangle[k], b.triangle[m], *query.contacts);
            }
        }
    }
}

class EmbreeCollide final : public Detector {
public:
    explicit EmbreeCollide(const ParameterValues& parameters)
        : triangles_per_primitive_(
              parameters.is("leaf", "cluster") ? static_cast<Index>(parameters.integer("cluster_size")) : 1),
          quality_(parameters.is("update", "refit")     ? RTC_BUILD_QUALITY_REFIT
                   : parameters.is("quality", "medium") ? RTC_BUILD_QUALITY_MEDIUM
                                                        : RTC_BUILD_QUALITY_LOW) {}
    ~EmbreeCollide() override { release(); }
    EmbreeCollide(const EmbreeCollide&) = delete;
    EmbreeCollide& operator=(const EmbreeCollide&) = delete;
    EmbreeCollide(EmbreeCollide&&) = delete;
    EmbreeCollide& operator=(EmbreeCollide&&) = delete;

    void prepare(const Topology& topology, const Frame& frame) override {
        release();
        topology_ = &topology;
        device_ = rtcNewDevice("threads=1");
        if (device_ != nullptr && rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_VERSION) != RTC_VERSION) release();
        if (device_ == nullptr || !is_answerable(topology, frame)) return;
        vertices_.narrow(frame);
        for (const BodyRange& range : topology.bodies) {
            auto body = std::make_unique<EmbreeBody>();
            body->topology = &topology;
            body->frame = &frame;
            body->vertices = &vertices_;
            body->triangles = range.triangles;
            body->triangles_per_primitive = triangles_per_primitive_;
            body->box = box_of_body(frame, range);
            body->scene = rtcNewScene(device_);
            rtcSetSceneFlags(body->scene, RTC_SCENE_FLAG_DYNAMIC);
            rtcSetSceneBuildQuality(body->scene, RTC_BUILD_QUALITY_LOW);
            body->geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
            rtcSetGeometryUserPrimitiveCount(body->geometry, static_cast<unsigned int>(body->primitive_count()));
            rtcSetGeometryUserData(body->geometry, body.get());
            rtcSetGeometryBoundsFunction(body->geometry, primitive_bounds, nullptr);
            rtcSetGeometryBuildQuality(body->geometry, quality_);
            rtcCommitGeometry(body->geometry);
            rtcAttachGeometry(body->scene, body->geometry);
            rtcCommitScene(body->scene);
            bodies_.push_back(std::move(body));
        }
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        if (bodies_.empty() && !topology_->bodies.empty()) prepare(*topology_, frame);
        vertices_.narrow(frame);
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            EmbreeBody& body = *bodies_[i];
            body.frame = &frame;
            const bool other_query_distance = body.around != query_distance_ / 2.0;
            if (!other_query_distance && !baselines::may_have_moved(frame, topology_->bodies[i])) continue;
            body.around = query_distance_ / 2.0;
            body.box = box_of_body(frame, topology_->bodies[i]).grown(body.around);
            rtcUpdateGeometryBuffer(body.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
            rtcCommitGeometry(body.geometry);
            rtcCommitScene(body.scene);
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        contacts.query_distance = query_distance_;
        if (device_ == nullptr) {
            contacts.outcome = {OutcomeKind::unsupported,
                                "Embree could not make a device, or is another version than its header"};
            return;
        }
        for (const auto& body : bodies_) {
            if (body->box.min.minCoeff() >= -largest_coordinate && body->box.max.maxCoeff() <= largest_coordinate)
                continue;
            contacts.outcome = {OutcomeKind::unsupported, "Embree leaves out what lies beyond 1.8e18"};
            return;
        }
        for (auto [a, b] : topology_->body_pairs) {
            EmbreeBody& body_a = *bodies_[static_cast<std::size_t>(a)];
            EmbreeBody& body_b = *bodies_[static_cast<std::size_t>(b)];
            body_a.frame = &frame;
            body_b.frame = &frame;
            ++contacts.work.box_tests;
            if (!body_a.box.overlaps(body_b.box)) continue;
            Query query{&body_a, &body_b, &contacts};
            rtcCollide(body_a.scene, body_b.scene, on_collisions, &query);
        }
        contacts.sort();
        if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE) {
            contacts.clear();
            contacts.outcome = {OutcomeKind::threw, fmt::format("Embree reported error {}", static_cast<int>(error))};
        }
    }

private:
    void release() {
        for (const auto& body : bodies_) {
            rtcReleaseGeometry(body->geometry);
            rtcReleaseScene(body->scene);
        }
        bodies_.clear();
        if (device_ != nullptr) rtcReleaseDevice(device_);
        device_ = nullptr;
    }

    Index triangles_per_primitive_;
    RTCBuildQuality quality_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    RTCDevice device_ = nullptr;
    baselines::FloatVertices vertices_;
    std::vector<std::unique_ptr<EmbreeBody>> bodies_;
};

}  // namespace

DetectorEntry embree_collide_detector();
DetectorEntry embree_collide_detector() {
    return {
        .name = "embree_collide",
        .library = "Embree",
        .version = RTC_VERSION_STRING,
        .configuration =
            "rtcCollide, float boxes rounded outward, threads=1; candidates decided by trocar's exact test",
        .query_distance = true,
        .parameters = {choice_parameter("update", "refit", {"refit", "rebuild"}, "how the tree follows moved vertices"),
                       choice_parameter("leaf", "triangle", {"triangle", "cluster"},
                                        "what a primitive is: one triangle, or several consecutive ones"),
                       integer_parameter("cluster_size", "32", 1, largest_cluster,
                                         "leaf=cluster: triangles in a primitive"),
                       choice_parameter("quality", "low", {"low", "medium"},
                                        "update=rebuild: tree by Morton codes, or by the surface area heuristic")},
        .make = [](const ParameterValues& parameters) { return std::make_unique<EmbreeCollide>(parameters); }};
}

}  // namespace trocar
