// FCL 0.7 between two frames: discrete collision at the end of the tick, and the library's continuous tests over the
// tick, which are its answer to fast tools. It stands beside our continuous test in the speed sweep.
//
// Settings, and where they depart from the library's defaults:
//  solver=polynomial   the default, and the only one that takes deforming meshes and reports triangles: trees of boxes
//                      around both frames (beginUpdateModel, bottom-up refit) and cubic vertex-face and edge-edge tests
//                      along straight paths. continuousCollide would take translations only, copy all vertices, and
//                      stop at the first pair that it comes across (num_max_contacts 1), whose time is not the
//                      first: so its traversal node is driven directly, with unlimited contacts.
//  solver=advancement  rigid bodies: conservative advancement with the library's traversal of oriented RSS trees,
//                      driven directly. continuousCollide has that traversal and never chooses it, see `conservative`.
//                      Of the volumes only RSS bound how far a pruned part of the body gets: the bound of OBBRSS is 0,
//                      and contacts are stepped over.
//  solver=conservative rigid bodies: what continuousCollide does when asked for conservative advancement. It reports
//                      almost no contact of two meshes, for three reasons in its code: poses are applied to the copy of
//                      the vertices that the step before had moved already; the speed of the second body along the
//                      normal is counted with the first one's sign; and once two triangles meet, the normal is zero and
//                      so is the speed, so that the whole tick is stepped over.
//  solver=naive        rigid bodies, the library's default: tries poses at 10 moments, first and last
//                      included, so a contact between two of them is missed and the time is late by up to one step.
//                      Ray shooting, the fifth solver, has no meshes.
//  motion from frames  (rigid bodies) a body's pose is the rotation and translation that carry the vertices of the
//                      first frame nearest to the current ones (Kabsch 1976, by SVD). Where a vertex ends further off
//                      than 1e-9 of the body's extent the body is not rigid, and the tick is outcome `unsupported`. A
//                      tissue that does not move counts as rigid.
//  motion              (rigid bodies) linear (straight path of the centre, constant axis of rotation); the default
//                      takes the translation alone.
//  toc_err             1e-4 of the tick, the default; conservative ignores it (1e-5).
//  scale               (polynomial) millimetres: the tests compare fourth powers of lengths with 1e-5, so that in
//                      metres no two edges of a millimetre mesh ever meet.
//  bounding volume     AABB for the polynomial solver (fcl_bvh.cpp says why); for rigid bodies OBBRSS at the end of the
//                      tick and RSS for advancement, built once in the body's own frame.
//  request             unlimited contacts, no contact geometry.
// For rigid bodies, what it reports between frames are two bodies and a time, no triangles.
#include <fcl/config.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/continuous_collision.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_continuous_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_conservative_advancement_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/traversal_recurse.h>
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "fcl_detector.hpp"
#include "geometry/rigid_motion.hpp"
#include "method/entry.hpp"

namespace trocar {
namespace {

using baselines::build_model;
using baselines::check;

/// Continuous tests on the vertices themselves, any motion.
class FclPolynomial final : public baselines::FclDetector {
    using Model = fcl::BVHModel<fcl::AABBd>;
    using DiscreteNode = fcl::detail::MeshCollisionTraversalNode<fcl::AABBd>;
    using ContinuousNode = fcl::detail::MeshContinuousCollisionTraversalNode<fcl::AABBd>;

public:
    explicit FclPolynomial(double scale) : scale_(scale) {}

private:
    static bool is_finite(const Matrix3X& positions) { return (positions.array() * 0.0).sum() == 0.0; }

    void forget() override { models_.clear(); }

    void build(const Frame& frame) override {
        last_ = frame.position;
        for (const BodyRange& body : topology().bodies) {
            models_.push_back(build_model<fcl::AABBd>(topology(), frame, body, scale_));
        }
    }

    void follow(const Frame& frame) override {
        has_path_ = frame.previous.cols() == frame.position.cols() && is_finite(frame.previous);
        const Matrix3X& before = has_path_ ? frame.previous : frame.position;
        for (std::size_t body = 0; body < models_.size(); ++body) {
            if (!models_[body]) continue;
            const Range v = topology().bodies[body].vertices;
            // The model keeps its last frame as the one before; after a jump that is another one.
            if (last_.middleCols(v.first, v.count) != before.middleCols(v.first, v.count)) {
                move(*models_[body], before, v);
            }
            move(*models_[body], frame.position, v);
        }
        last_ = frame.position;
    }

    void move(Model& model, const Matrix3X& position, Range vertices) const {
        check(model.beginUpdateModel());
        for (Index v = vertices.first; v < vertices.end(); ++v) check(model.updateVertex(scale_ * position.col(v)));
        check(model.endUpdateModel(true, true));
    }

    /// Intersecting triangles at one of the two frames that the models hold.
    void intersecting(Model& first, Model& second, bool at_start, Index a0, Index b0,
                      std::vector<TrianglePair>& pairs) {
        result_.clear();
        DiscreteNode node;
        fcl::Transform3d here = fcl::Transform3d::Identity();
        fcl::Transform3d there = here;
        const fcl::CollisionRequestd all(std::numeric_limits<std::size_t>::max(), false);
        if (!fcl::detail::initialize(node, first, here, second, there, all, result_)) {
            throw std::runtime_error("the traversal was refused");
        }
        if (at_start) {  // the boxes hold both frames
            node.vertices1 = first.prev_vertices;
            node.vertices2 = second.prev_vertices;
        }
        fcl::detail::collide(&node);
        for (std::size_t k = 0; k < result_.numContacts(); ++k) {
            pairs.push_back(
                {a0 + static_cast<Index>(result_.getContact(k).b1), b0 + static_cast<Index>(result_.getContact(k).b2)});
        }
    }

    void query(const Frame& /*frame*/, ContactSet& contacts) override {
        contacts.work.vertices_read = topology().vertex_count;
        met_.clear();
        for (const auto& [a, b] : topology().body_pairs) {
            Model* const first = models_[static_cast<std::size_t>(a)].get();
            Model* const second = models_[static_cast<std::size_t>(b)].get();
            if (first == nullptr || second == nullptr) continue;
            const Index a0 = body(a).triangles.first;
            const Index b0 = body(b).triangles.first;
            intersecting(*first, *second, false, a0, b0, contacts.pairs);
            if (!has_path_ || first->prev_vertices == nullptr || second->prev_vertices == nullptr) continue;
            ContinuousNode node;
            const fcl::CollisionRequestd all(std::numeric_limits<std::size_t>::max(), false);
            const fcl::Transform3d here = fcl::Transform3d::Identity();
            if (!fcl::detail::initialize(node, *first, here, *second, here, all)) {
                throw std::runtime_error("the continuous traversal was refused");
            }
            fcl::detail::collide(&node);
            if (node.pairs.empty()) continue;
            intersecting(*first, *second, true, a0, b0, met_);
            for (const auto& found : node.pairs) {
                contacts.swept.push_back({.a = a0 + static_cast<Index>(found.id1),
                                          .b = b0 + static_cast<Index>(found.id2),
                                          .body_a = a,
                                          .body_b = b,
                                          .time = found.collision_time});
            }
        }
        contacts.sort();
        // Only what begins within the tick counts.
        const auto less = [](const TrianglePair& x, const TrianglePair& y) {
            return x.a != y.a ? x.a < y.a : x.b < y.b;
        };
        std::sort(met_.begin(), met_.end(), less);
        std::erase_if(contacts.swept, [&](const SweptContact& contact) {
            return std::binary_search(met_.begin(), met_.end(), TrianglePair{contact.a, contact.b}, less);
        });
        std::sort(contacts.swept.begin(), contacts.swept.end(),
                  [](const SweptContact& x, const SweptContact& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
    }

    double scale_;
    Matrix3X last_;                               ///< 3×N, m: the frame that the models hold
    std::vector<std::unique_ptr<Model>> models_;  ///< one per body, null for a body without triangles
    fcl::CollisionResultd result_;
    std::vector<TrianglePair> met_;  ///< intersecting at the frame before
    bool has_path_ = false;          ///< the frame reports the one before
};

enum class Solver { advancement, conservative, naive };

/// Continuous tests on rigid motions.
class FclContinuous final : public baselines::FclDetector {
    using Model = fcl::BVHModel<fcl::OBBRSSd>;
    using AdvancementModel = fcl::BVHModel<fcl::RSSd>;

public:
    explicit FclContinuous(Solver solver)
        : solver_(solver),
          request_(10, 1e-4, fcl::CCDM_LINEAR, fcl::GST_LIBCCD,
                   solver == Solver::naive ? fcl::CCDC_NAIVE : fcl::CCDC_CONSERVATIVE_ADVANCEMENT) {}

private:
    void forget() override {
        models_.clear();
        advancement_models_.clear();
    }

    void build(const Frame& frame) override {
        reference_ = frame.position;
        now_.assign(topology().bodies.size(), fcl::Transform3d::Identity());
        before_ = now_;
        for (const BodyRange& body : topology().bodies) {
            models_.push_back(build_model<fcl::OBBRSSd>(topology(), frame, body));
            if (models_.back()) models_.back()->computeLocalAABB();
            if (solver_ == Solver::naive) continue;
            advancement_models_.push_back(build_model<fcl::RSSd>(topology(), frame, body));
            if (advancement_models_.back()) advancement_models_.back()->computeLocalAABB();
        }
    }

    void follow(const Frame& frame) override {
        not_rigid_ = -1;
        const bool has_path = frame.previous.cols() == frame.position.cols() && frame.previous.allFinite();
        for (std::size_t body = 0; body < models_.size(); ++body) {
            if (!models_[body]) continue;
            const Range v = topology().bodies[body].vertices;
            const auto here = frame.position.middleCols(v.first, v.count);
            bool rigid = fit(body, here, now_[body]);
            before_[body] = now_[body];
            if (has_path && frame.previous.middleCols(v.first, v.count) != here) {
                rigid = fit(body, frame.previous.middleCols(v.first, v.count), before_[body]) && rigid;
            }
            if (!rigid && not_rigid_ < 0) not_rigid_ = static_cast<Index>(body);
        }
    }

    /// Pose that carries the reference to `points` (3×n, m); false when none does.
    bool fit(std::size_t body, const Eigen::Ref<const Matrix3X>& points, fcl::Transform3d& pose) const {
        const Range v = topology().bodies[body].vertices;
        const auto reference = reference_.middleCols(v.first, v.count);
        pose.setIdentity();
        if (reference == points) return true;
        const RigidMotion motion = rigid_motion(reference, points);
        pose.linear() = motion.rotation;
        pose.translation() = motion.translation;
        const double extent = (reference.rowwise().maxCoeff() - reference.rowwise().minCoeff()).maxCoeff();
        const double far = std::max(reference.cwiseAbs().maxCoeff(), points.cwiseAbs().maxCoeff());
        const Matrix3X carried = (pose.linear() * reference).colwise() + pose.translation();
        return (carried - points).cwiseAbs().maxCoeff() <=
               1e-9 * extent + 64.0 * std::numeric_limits<double>::epsilon() * far;
    }

    void query(const Frame& /*frame*/, ContactSet& contacts) override {
        if (not_rigid_ >= 0) {
            contacts.outcome = {
                OutcomeKind::unsupported,
                fmt::format("{} does not move as a rigid body, which is all that continuousCollide takes",
                            body(not_rigid_).name)};
            return;
        }
        const fcl::CollisionRequestd all(std::numeric_limits<std::size_t>::max(), false);
        const fcl::CollisionRequestd any(1, false);
        contacts.work.vertices_read = topology().vertex_count;
        for (const auto& [a, b] : topology().body_pairs) {
            const auto first = static_cast<std::size_t>(a);
            const auto second = static_cast<std::size_t>(b);
            if (!models_[first] || !models_[second]) continue;
            fcl::CollisionResultd found;
            fcl::collide(models_[first].get(), now_[first], models_[second].get(), now_[second], all, found);
            const Index first_triangle = topology().bodies[first].triangles.first;
            const Index second_triangle = topology().bodies[second].triangles.first;
            for (std::size_t k = 0; k < found.numContacts(); ++k) {
                contacts.pairs.push_back({first_triangle + static_cast<Index>(found.getContact(k).b1),
                                          second_triangle + static_cast<Index>(found.getContact(k).b2)});
            }
            const bool moved =
                now_[first].matrix() != before_[first].matrix() || now_[second].matrix() != before_[second].matrix();
            if (!moved) continue;
            // Only what begins within the tick counts.
            fcl::CollisionResultd start;
            fcl::collide(models_[first].get(), before_[first], models_[second].get(), before_[second], any, start);
            if (start.isCollision()) continue;
            const double time = first_contact(first, second);
            if (time >= 0.0) contacts.swept.push_back({.body_a = a, .body_b = b, .time = time});
        }
        contacts.sort();
    }

    /// Part of the tick at which two bodies apart at its start meet; negative: they do not.
    double first_contact(std::size_t first, std::size_t second) {
        if (solver_ == Solver::advancement) return advance(first, second);
        const fcl::CollisionGeometryd* a = models_[first].get();
        const fcl::CollisionGeometryd* b = models_[second].get();
        if (solver_ == Solver::conservative) {
            a = advancement_models_[first].get();
            b = advancement_models_[second].get();
        }
        fcl::ContinuousCollisionResultd path;
        fcl::continuousCollide(a, before_[first], now_[first], b, before_[second], now_[second], request_, path);
        return path.is_collide ? path.time_of_contact : -1.0;
    }

    /// The loop of the library's conservativeAdvancementMeshOriented, with toc_err for its fixed 1e-5.
    double advance(std::size_t first, std::size_t second) {
        const auto motion_a = fcl::getMotionBase<double>(before_[first], now_[first], request_.ccd_motion_type);
        const auto motion_b = fcl::getMotionBase<double>(before_[second], now_[second], request_.ccd_motion_type);
        fcl::detail::MeshConservativeAdvancementTraversalNodeRSS<double> node;
        const AdvancementModel& model_a = *advancement_models_[first];
        const AdvancementModel& model_b = *advancement_models_[second];
        const fcl::Transform3d& start_a = before_[first];
        const fcl::Transform3d& start_b = before_[second];
        if (!fcl::detail::initialize(node, model_a, start_a, model_b, start_b)) {
            throw std::runtime_error("the advancement was refused");
        }
        node.motion1 = motion_a.get();
        node.motion2 = motion_b.get();
        node.t_err = request_.toc_err;
        while (true) {
            fcl::Transform3d pose_a;
            fcl::Transform3d pose_b;
            motion_a->getCurrentTransform(pose_a);
            motion_b->getCurrentTransform(pose_b);
            const fcl::Transform3d relative = pose_a.inverse(Eigen::Isometry) * pose_b;
            node.R = relative.linear();
            node.T = relative.translation();
            node.delta_t = 1.0;
            node.min_distance = std::numeric_limits<double>::max();
            fcl::detail::distanceRecurse<double>(&node, 0, 0, nullptr);
            if (node.delta_t <= node.t_err) return node.toc;
            node.toc += node.delta_t;
            if (node.toc > 1.0) return -1.0;
            motion_a->integrate(node.toc);
            motion_b->integrate(node.toc);
        }
    }

    Solver solver_;
    fcl::ContinuousCollisionRequestd request_;
    Matrix3X reference_;                          ///< 3×N, m: the frame that the models were built from
    std::vector<std::unique_ptr<Model>> models_;  ///< one per body, null for a body without triangles
    std::vector<std::unique_ptr<AdvancementModel>> advancement_models_;  ///< likewise, unless the solver is naive
    std::vector<fcl::Transform3d> now_;                                  ///< per body, from reference to the frame
    std::vector<fcl::Transform3d> before_;  ///< per body, from reference to the frame before
    Index not_rigid_ = -1;                  ///< first body whose motion is not rigid
};

}  // namespace

DetectorEntry fcl_continuous_detector() {
    return {.name = "fcl_continuous",
            .library = "FCL",
            .version = FCL_VERSION,
            .configuration = fmt::format(
                "double precision; FCL_HAVE_SSE {}; discrete at the end of the tick, continuous over it", FCL_HAVE_SSE),
            .parameters = {choice_parameter(
                               "solver", "polynomial", {"polynomial", "advancement", "conservative", "naive"},
                               "cubic tests of vertices and edges; or for rigid bodies only: advancement on RSS "
                               "trees, what continuousCollide does when asked for it, poses at ten moments"),
                           number_parameter("scale", "1", "1000", 1e-6, 1e9,
                                            "polynomial: length units that FCL sees per metre")},
            .make = [](const ParameterValues& values) -> std::unique_ptr<Detector> {
                if (values.is("solver", "polynomial")) return std::make_unique<FclPolynomial>(values.number("scale"));
                Solver solver = Solver::advancement;
                if (values.is("solver", "conservative")) solver = Solver::conservative;
                if (values.is("solver", "naive")) solver = Solver::naive;
                return std::make_unique<FclContinuous>(solver);
            }};
}

}  // namespace trocar
