// FCL 0.7 for rigid bodies: discrete collision at the end of the tick, and continuousCollide over the tick, which is
// the library's answer to fast tools. It stands beside our continuous test in the speed sweep.
//
// Settings, and where they depart from the library's defaults:
//  motion from frames  a body's pose is the rotation and translation that carry the vertices of the first frame nearest
//                      to the current ones (Kabsch 1976, by SVD). Where a vertex ends further off than 1e-9 of the
//                      body's extent the body is not rigid, and the tick is outcome `unsupported`: the library has no
//                      continuous test for deforming meshes. A tissue that does not move counts as rigid.
//  solver              naive, the default: tries poses at `iterations` + 1 moments, so a contact between two of them is
//                      missed and the time is late by up to one step. Conservative advancement is offered and told no
//                      contact of two meshes here, nor in plain calls on two boxes, with OBBRSS and RSS trees and every
//                      motion; the cause is not known. The polynomial solver moves the models that it is given and
//                      knows translations only; ray shooting has no meshes.
//  motion              linear (straight way of the centre, constant axis of rotation), where the default takes the
//                      translation alone. `screw` is offered.
//  toc_err             1e-4 of the tick, the default. iterations: 10, the default.
//  bounding volume     OBBRSS: conservative advancement knows RSS and OBBRSS only; built once in the body's own frame.
//  request             unlimited contacts, no contact geometry.
// What it tells between frames are two bodies and a time, no triangles.
#include <fcl/config.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/continuous_collision.h>
#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <exception>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSSd>;

class FclContinuous final : public Detector {
public:
    explicit FclContinuous(const fcl::ContinuousCollisionRequestd& request) : request_(request) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        models_.clear();
        build(frame);
    }

    void update(const Frame& frame) override {
        not_rigid_ = -1;
        if (!is_answerable(*topology_, frame)) return;
        if (models_.empty()) build(frame);  // the first frame could not be built from
        const bool has_way = frame.previous.cols() == frame.position.cols() && frame.previous.allFinite();
        for (std::size_t body = 0; body < models_.size() && failure_.empty(); ++body) {
            if (!models_[body]) continue;
            const Range v = topology_->bodies[body].vertices;
            const auto here = frame.position.middleCols(v.first, v.count);
            bool rigid = fit(body, here, now_[body]);
            before_[body] = now_[body];
            if (has_way && frame.previous.middleCols(v.first, v.count) != here) {
                rigid = fit(body, frame.previous.middleCols(v.first, v.count), before_[body]) && rigid;
            }
            if (!rigid && not_rigid_ < 0) not_rigid_ = static_cast<Index>(body);
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        if (not_rigid_ >= 0) {
            contacts.outcome = {
                OutcomeKind::unsupported,
                fmt::format("{} does not move as a rigid body, which is all that continuousCollide takes",
                            topology_->bodies[static_cast<std::size_t>(not_rigid_)].name)};
            return;
        }
        try {
            if (failure_.empty()) query(contacts);
        } catch (const std::exception& error) {
            failure_ = fmt::format("FCL threw during the query: {}", error.what());
        }
        if (!failure_.empty()) {
            contacts.clear();
            contacts.outcome = {OutcomeKind::threw, failure_};
            failure_.clear();
            models_.clear();  // built afresh at the next tick
        }
    }

private:
    static void check(int code) {
        if (code != fcl::BVH_OK) throw std::runtime_error(fmt::format("BVH error code {}", code));
    }

    void build(const Frame& frame) {
        if (!is_answerable(*topology_, frame)) return;
        failure_.clear();
        reference_ = frame.position;
        const std::size_t bodies = topology_->bodies.size();
        now_.assign(bodies, fcl::Transform3d::Identity());
        before_ = now_;
        try {
            for (const BodyRange& body : topology_->bodies) {
                models_.push_back(nullptr);
                if (body.triangles.count == 0) continue;
                std::vector<fcl::Vector3d> points;
                std::vector<fcl::Triangle> triangles;
                for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
                    points.emplace_back(frame.position.col(v));
                }
                for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                    const auto corner = [&](int k) {
                        return static_cast<std::size_t>(topology_->triangles(k, t) - body.vertices.first);
                    };
                    triangles.emplace_back(corner(0), corner(1), corner(2));
                }
                auto model = std::make_unique<Model>();
                check(model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(points.size())));
                check(model->addSubModel(points, triangles));
                check(model->endModel());
                model->computeLocalAABB();
                models_.back() = std::move(model);
            }
        } catch (const std::exception& error) {
            failure_ = fmt::format("FCL threw while building: {}", error.what());
        }
    }

    /// Pose that carries the reference to `points` (3×n, m); false when none does.
    template <typename Points>
    bool fit(std::size_t body, const Points& points, fcl::Transform3d& pose) const {
        const Range v = topology_->bodies[body].vertices;
        const auto reference = reference_.middleCols(v.first, v.count);
        pose.setIdentity();
        if (reference == points) return true;
        const Vector3 from = reference.rowwise().mean();
        const Vector3 to = points.rowwise().mean();
        const Matrix3 covariance = (points.colwise() - to) * (reference.colwise() - from).transpose();
        const Eigen::JacobiSVD<Matrix3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
        Matrix3 sign = Matrix3::Identity();
        if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) sign(2, 2) = -1.0;
        pose.linear() = svd.matrixU() * sign * svd.matrixV().transpose();
        pose.translation() = to - pose.linear() * from;
        const double extent = (reference.rowwise().maxCoeff() - reference.rowwise().minCoeff()).maxCoeff();
        const double far = std::max(reference.cwiseAbs().maxCoeff(), points.cwiseAbs().maxCoeff());
        const Matrix3X carried = (pose.linear() * reference).colwise() + pose.translation();
        return (carried - points).cwiseAbs().maxCoeff() <=
               1e-9 * extent + 64.0 * std::numeric_limits<double>::epsilon() * far;
    }

    void query(ContactSet& contacts) {
        const fcl::CollisionRequestd all(std::numeric_limits<std::size_t>::max(), false);
        const fcl::CollisionRequestd any(1, false);
        contacts.work.vertices_read = topology_->vertex_count;
        for (const auto& [a, b] : topology_->body_pairs) {
            const auto first = static_cast<std::size_t>(a);
            const auto second = static_cast<std::size_t>(b);
            if (!models_[first] || !models_[second]) continue;
            fcl::CollisionResultd found;
            fcl::collide(models_[first].get(), now_[first], models_[second].get(), now_[second], all, found);
            const Index first_triangle = topology_->bodies[first].triangles.first;
            const Index second_triangle = topology_->bodies[second].triangles.first;
            for (std::size_t k = 0; k < found.numContacts(); ++k) {
                contacts.pairs.push_back({first_triangle + static_cast<Index>(found.getContact(k).b1),
                                          second_triangle + static_cast<Index>(found.getContact(k).b2)});
            }
            const bool moved =
                now_[first].matrix() != before_[first].matrix() || now_[second].matrix() != before_[second].matrix();
            if (!moved) continue;
            // Only what begins on the way counts.
            fcl::CollisionResultd start;
            fcl::collide(models_[first].get(), before_[first], models_[second].get(), before_[second], any, start);
            if (start.isCollision()) continue;
            fcl::ContinuousCollisionResultd way;
            fcl::continuousCollide(models_[first].get(), before_[first], now_[first], models_[second].get(),
                                   before_[second], now_[second], request_, way);
            if (!way.is_collide) continue;
            contacts.swept.push_back({.body_a = a, .body_b = b, .time = way.time_of_contact});
        }
        contacts.sort_pairs();
    }

    fcl::ContinuousCollisionRequestd request_;
    const Topology* topology_ = nullptr;
    Matrix3X reference_;                          ///< 3×N, m: the frame that the models were built from
    std::vector<std::unique_ptr<Model>> models_;  ///< one per body, null for a body without triangles
    std::vector<fcl::Transform3d> now_;           ///< per body, from reference to the frame
    std::vector<fcl::Transform3d> before_;        ///< per body, from reference to the frame before
    Index not_rigid_ = -1;                        ///< first body whose motion is not rigid
    std::string failure_;
};

}  // namespace

DetectorEntry fcl_continuous_detector() {
    using Type = Parameter::Type;
    return {
        .name = "fcl_continuous",
        .library = "FCL",
        .version = FCL_VERSION,
        .configuration = fmt::format(
            "double precision; FCL_HAVE_SSE {}; rigid bodies only; continuousCollide on OBBRSS trees, poses "
            "fitted to the frames",
            FCL_HAVE_SSE),
        .information = InformationLevel::pairs,
        .parameters = {{.name = "solver",
                        .type = Type::choice,
                        .default_value = "naive",
                        .choices = {"naive", "conservative"},
                        .meaning =
                            "poses at `iterations` + 1 moments (the library's default), or conservative advancement"},
                       {.name = "motion",
                        .type = Type::choice,
                        .default_value = "linear",
                        .choices = {"linear", "translation", "screw"},
                        .meaning = "how a body moves from pose to pose"},
                       {.name = "toc_err",
                        .unit = "1",
                        .default_value = "0.0001",
                        .minimum = 1e-12,
                        .maximum = 1.0,
                        .meaning = "tolerated error of the time of contact, part of the tick"},
                       {.name = "iterations",
                        .type = Type::integer,
                        .unit = "1",
                        .default_value = "10",
                        .minimum = 1,
                        .maximum = 1e6,
                        .meaning = "largest number of iterations of the solver"}},
        .make = [](const ParameterValues& values) -> std::unique_ptr<Detector> {
            fcl::CCDMotionType motion = fcl::CCDM_LINEAR;
            if (values.is("motion", "translation")) motion = fcl::CCDM_TRANS;
            if (values.is("motion", "screw")) motion = fcl::CCDM_SCREW;
            return std::make_unique<FclContinuous>(fcl::ContinuousCollisionRequestd(
                static_cast<std::size_t>(values.integer("iterations")), values.number("toc_err"), motion,
                fcl::GST_LIBCCD, values.is("solver", "naive") ? fcl::CCDC_NAIVE : fcl::CCDC_CONSERVATIVE_ADVANCEMENT));
        }};
}

}  // namespace trocar
