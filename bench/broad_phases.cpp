// Settings: FCL DynamicAABBTreeCollisionManager with one fcl::Box per body, resized and moved every tick, then
// update(). ODE dHashSpace with one box geom per body in millimetres, cell sizes from 2^0 to 2^7 mm (the library's
// default, 2^-3 to 2^10, is as wide as no body needs).
#include "broad_phases.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <utility>

#include "baselines/candidates.hpp"
#include "geometry/box_pairs.hpp"
#include "method/frame_check.hpp"

#ifdef TROCAR_BENCH_FCL
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/config.h>
#include <fcl/geometry/shape/box.h>
#endif
#ifdef TROCAR_BENCH_ODE
#include "baselines/ode_library.hpp"
#endif

namespace trocar::bench {
namespace {

/// Finds pairs of bodies whose boxes overlap.
class BroadPhase {
public:
    BroadPhase() = default;
    BroadPhase(const BroadPhase&) = delete;
    BroadPhase& operator=(const BroadPhase&) = delete;
    BroadPhase(BroadPhase&&) = delete;
    BroadPhase& operator=(BroadPhase&&) = delete;
    virtual ~BroadPhase() = default;
    virtual void prepare(const std::vector<Box>& boxes) = 0;
    virtual void update(const std::vector<Box>& boxes) = 0;
    /// Appends (a, b) in any order, each pair once; returns how many pairs it examined as far as that can be reported.
    virtual std::int64_t find(const std::vector<Box>& boxes, std::vector<std::array<Index, 2>>& pairs) = 0;
};

/// The common rest: body boxes in, triangles out.
class BodiesFirst final : public Detector {
public:
    explicit BodiesFirst(std::unique_ptr<BroadPhase> broad) : broad_(std::move(broad)) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        find_boxes(frame);
        broad_->prepare(boxes_);
    }
    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        find_boxes(frame);
        broad_->update(boxes_);
    }
    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        if (!check_no_query_distance(query_distance_, contacts)) return;
        body_pairs_.clear();
        contacts.work.vertices_read = topology_->vertex_count;
        contacts.work.box_tests = broad_->find(boxes_, body_pairs_);
        for (auto [a, b] : body_pairs_) {
            if (a > b) std::swap(a, b);
            if (topology_->body_pair(a, b) >= 0) test_bodies(a, b, frame, contacts);
        }
        contacts.sort_pairs();
    }

private:
    void find_boxes(const Frame& frame) {
        boxes_.assign(topology_->bodies.size(), Box{});
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            const Range vertices = topology_->bodies[i].vertices;
            for (Index v = vertices.first; v < vertices.end(); ++v) boxes_[i].add(frame.position.col(v));
        }
    }
    void gather(Index body, const Box& common, const Frame& frame, std::int64_t& box_tests) {
        const Range triangles = topology_->bodies[static_cast<std::size_t>(body)].triangles;
        box_tests += triangles.count;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            const Box box = baselines::box_of(*topology_, frame, t);
            if (!box.overlaps(common)) continue;
            near_boxes_.push_back(box);
            near_.push_back(t);
        }
    }
    void test_bodies(Index a, Index b, const Frame& frame, ContactSet& contacts) {
        const Box& box_a = boxes_[static_cast<std::size_t>(a)];
        const Box& box_b = boxes_[static_cast<std::size_t>(b)];
        Box common;
        common.min = box_a.min.cwiseMax(box_b.min);
        common.max = box_a.max.cwiseMin(box_b.max);
        near_.clear();
        near_boxes_.clear();
        gather(a, common, frame, contacts.work.box_tests);
        const auto first = static_cast<Index>(near_.size());
        gather(b, common, frame, contacts.work.box_tests);
        overlapping_boxes(near_boxes_, {0, first}, {first, static_cast<Index>(near_.size()) - first}, candidates_);
        for (const IndexPair& pair : candidates_) {
            baselines::test_candidate(*topology_, frame, near_[static_cast<std::size_t>(pair.first)],
                                      near_[static_cast<std::size_t>(pair.second)], contacts);
        }
    }

    std::unique_ptr<BroadPhase> broad_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    std::vector<Box> boxes_;
    std::vector<std::array<Index, 2>> body_pairs_;
    std::vector<Index> near_;  ///< triangles of a, then of b, in the box that the two have in common
    std::vector<Box> near_boxes_;
    std::vector<IndexPair> candidates_;
};

class EveryTwo final : public BroadPhase {
public:
    void prepare(const std::vector<Box>& /*boxes*/) override {}
    void update(const std::vector<Box>& /*boxes*/) override {}
    std::int64_t find(const std::vector<Box>& boxes, std::vector<std::array<Index, 2>>& pairs) override {
        const auto count = static_cast<Index>(boxes.size());
        for (Index a = 0; a < count; ++a) {
            for (Index b = a + 1; b < count; ++b) {
                if (boxes[static_cast<std::size_t>(a)].overlaps(boxes[static_cast<std::size_t>(b)])) {
                    pairs.push_back({a, b});
                }
            }
        }
        return static_cast<std::int64_t>(count) * (count - 1) / 2;
    }
};

#ifdef TROCAR_BENCH_FCL
class FclManager final : public BroadPhase {
public:
    void prepare(const std::vector<Box>& boxes) override {
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            shapes_.push_back(std::make_shared<fcl::Boxd>(1.0, 1.0, 1.0));
            objects_.push_back(std::make_unique<fcl::CollisionObjectd>(shapes_.back()));
            objects_.back()->setUserData(&numbers_.emplace_back(static_cast<Index>(i)));
        }
        place(boxes);
        for (const auto& object : objects_) manager_.registerObject(object.get());
        manager_.setup();
    }
    void update(const std::vector<Box>& boxes) override {
        place(boxes);
        manager_.update();
    }
    std::int64_t find(const std::vector<Box>& /*boxes*/, std::vector<std::array<Index, 2>>& pairs) override {
        const std::size_t before = pairs.size();
        manager_.collide(&pairs, [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* out) {
            static_cast<std::vector<std::array<Index, 2>>*>(out)->push_back(
                {*static_cast<Index*>(a->getUserData()), *static_cast<Index*>(b->getUserData())});
            return false;
        });
        return static_cast<std::int64_t>(pairs.size() - before);
    }

private:
    void place(const std::vector<Box>& boxes) {
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            // One part in 1e12 larger: centre and side are rounded, and nothing may be missed.
            shapes_[i]->side = (boxes[i].max - boxes[i].min) * (1.0 + 1e-12);
            shapes_[i]->computeLocalAABB();
            objects_[i]->setTranslation(0.5 * (boxes[i].max + boxes[i].min));
            objects_[i]->computeAABB();
        }
    }
    std::vector<std::shared_ptr<fcl::Boxd>> shapes_;
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
    std::deque<Index> numbers_;
    fcl::DynamicAABBTreeCollisionManagerd manager_;
};
#endif

#ifdef TROCAR_BENCH_ODE
class OdeHashSpace final : public BroadPhase {
public:
    OdeHashSpace() {
        use_ode();
        space_ = dHashSpaceCreate(nullptr);
        dHashSpaceSetLevels(space_, 0, 7);
    }
    ~OdeHashSpace() override { dSpaceDestroy(space_); }  // and the geoms in it
    OdeHashSpace(const OdeHashSpace&) = delete;
    OdeHashSpace& operator=(const OdeHashSpace&) = delete;
    OdeHashSpace(OdeHashSpace&&) = delete;
    OdeHashSpace& operator=(OdeHashSpace&&) = delete;

    void prepare(const std::vector<Box>& boxes) override {
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            geoms_.push_back(dCreateBox(space_, 1.0, 1.0, 1.0));
            dGeomSetData(geoms_.back(), &numbers_.emplace_back(static_cast<Index>(i)));
        }
        update(boxes);
    }
    void update(const std::vector<Box>& boxes) override {
        constexpr double millimetres = 1000.0;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const Vector3 side = millimetres * (1.0 + 1e-12) * (boxes[i].max - boxes[i].min);
            const Vector3 centre = 0.5 * millimetres * (boxes[i].max + boxes[i].min);
            dGeomBoxSetLengths(geoms_[i], side.x(), side.y(), side.z());
            dGeomSetPosition(geoms_[i], centre.x(), centre.y(), centre.z());
        }
    }
    std::int64_t find(const std::vector<Box>& /*boxes*/, std::vector<std::array<Index, 2>>& pairs) override {
        const std::size_t before = pairs.size();
        dSpaceCollide(space_, &pairs, [](void* out, dGeomID a, dGeomID b) {
            static_cast<std::vector<std::array<Index, 2>>*>(out)->push_back(
                {*static_cast<Index*>(dGeomGetData(a)), *static_cast<Index*>(dGeomGetData(b))});
        });
        return static_cast<std::int64_t>(pairs.size() - before);
    }

private:
    dSpaceID space_ = nullptr;
    std::vector<dGeomID> geoms_;
    std::deque<Index> numbers_;
};
#endif

template <typename Broad>
Method broad_phase(const char* label, const char* library, const char* family) {
    Method method;
    method.label = label;
    method.library = library;
    method.family = family;
    method.narrow = "trocar's exact test";
    method.make = [] { return std::make_unique<BodiesFirst>(std::make_unique<Broad>()); };
    return method;
}

}  // namespace

std::vector<Method> broad_phases([[maybe_unused]] std::vector<Missing>& missing) {
    std::vector<Method> list;
    list.push_back(broad_phase<EveryTwo>("bodies: every two boxes", "none", "none"));
#ifdef TROCAR_BENCH_FCL
    list.push_back(broad_phase<FclManager>("bodies: FCL dynamic tree", "FCL " FCL_VERSION, "tree"));
#else
    missing.push_back({"bodies: FCL dynamic tree", "library not found: fcl"});
#endif
#ifdef TROCAR_BENCH_ODE
    list.push_back(broad_phase<OdeHashSpace>("bodies: ODE hash space", "ODE " TROCAR_BENCH_ODE, "cells"));
#else
    missing.push_back({"bodies: ODE hash space", "library not found: ode"});
#endif
    return list;
}

}  // namespace trocar::bench
