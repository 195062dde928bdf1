#include "simulate/frame_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <optional>
#include <vector>

#include "geometry/input_error.hpp"
#include "geometry/mesh_report.hpp"
#include "measure/pair_truth.hpp"
#include "measure/passage.hpp"
#include "simulate/judge.hpp"

namespace trocar {
namespace {

/// Largest change of shape of a rigid body, as a part of its size: files may have six digits.
constexpr double rigid_tolerance = 1e-5;

Pose identity() { return {}; }

/// The motion of the points from `local` to `now` (3×n, m) that fits best (Umeyama 1991).
Pose best_motion(const Matrix3X& local, const Matrix3X& now) {
    if (local == now || local.cols() == 0) return identity();
    const Eigen::Matrix4d motion = Eigen::umeyama(local, now, false);
    Pose pose;
    pose.rotation = Quaternion(Matrix3(motion.topLeftCorner<3, 3>())).normalized();
    pose.translation = motion.topRightCorner<3, 1>();
    return pose;
}

bool is_same_shape(const Matrix3X& local, const Matrix3X& now, const Pose& pose) {
    if (local.cols() == 0) return true;
    const Matrix3X moved = (pose.rotation.toRotationMatrix() * local).colwise() + pose.translation;
    const double size = (local.rowwise().maxCoeff() - local.rowwise().minCoeff()).norm();
    return (moved - now).colwise().norm().maxCoeff() <= rigid_tolerance * size;
}

/// Bodies that move by poses, which PassageTruth reads.
Scene as_scene(const Topology& topology, const Frame& first) {
    Scene scene;
    scene.topology = topology;
    scene.first = first;
    scene.first.pose.assign(topology.bodies.size(), identity());
    scene.bodies.resize(topology.bodies.size());
    for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
        scene.topology.bodies[b].kind = BodyKind::rigid;
        const Range& vertices = topology.bodies[b].vertices;
        scene.bodies[b].local = first.position.middleCols(vertices.first, vertices.count);
    }
    return scene;
}

}  // namespace

struct FrameJudge::State {
    const Topology* topology;
    bool self;
    bool any_closed = false;   ///< a pair has a closed body
    bool sides_known = false;  ///< of all pairs
    DepthTruth depth;
    Scene scene;
    PassageTruth passages;
    std::vector<std::uint8_t> reshaped;  ///< per body, from the frame before to this one

    State(const Topology& bodies, const Frame& first, FrameStart start, bool look_for_self)
        : topology(&bodies),
          self(look_for_self),
          sides_known(true),
          depth(bodies, first, {}, DepthTruth::default_area_samples, start == FrameStart::clean),
          scene(as_scene(bodies, first)),
          passages(scene, scene.first),
          reshaped(bodies.bodies.size(), 0) {
        for (const auto& [a, b] : bodies.body_pairs) {
            const bool closed_a = bodies.bodies[at(a)].closed;
            const bool closed_b = bodies.bodies[at(b)].closed;
            any_closed = any_closed || closed_a || closed_b;
            if (start == FrameStart::unknown && !(closed_a && closed_b)) sides_known = false;
        }
    }

    /// Poses of the bodies; the shape of one that has changed it is the new one from here on.
    [[nodiscard]] std::vector<Pose> poses(const Frame& frame) {
        std::vector<Pose> all;
        for (std::size_t b = 0; b < reshaped.size(); ++b) {
            const Range& vertices = topology->bodies[b].vertices;
            const Matrix3X now = frame.position.middleCols(vertices.first, vertices.count);
            Matrix3X& local = scene.bodies[b].local;
            const Pose pose = best_motion(local, now);
            reshaped[b] = is_same_shape(local, now, pose) ? 0 : 1;
            if (reshaped[b] != 0) {
                local = pose.rotation.toRotationMatrix().transpose() * (now.colwise() - pose.translation);
            }
            all.push_back(pose);
        }
        return all;
    }

    /// Pairs, passages and self-intersections, none of which needs the depths.
    void judge_surfaces(const Frame& frame, FrameFigures& figures) {
        if (!topology->body_pairs.empty()) {
            const TickTruth truth = truth_of(*topology, frame);
            figures.row.true_pairs = static_cast<std::int64_t>(truth.pairs.size());
            figures.row.true_touch = static_cast<std::int64_t>(truth.touch.size());
            Frame posed;
            posed.position = frame.position;
            posed.pose = poses(frame);
            figures.row.passed_through = passages.follow(posed, reshaped);
        }
        if (!self) return;
        figures.self_intersections = 0;
        for (const BodyRange& body : topology->bodies) {
            figures.self_intersections += trocar::self_intersections(
                frame.position.middleCols(body.vertices.first, body.vertices.count),
                topology->triangles.middleCols(body.triangles.first, body.triangles.count).array() -
                    body.vertices.first);
        }
    }
};

FrameJudge::FrameJudge(const Topology& topology, const Frame& first, FrameStart start, bool self,
                       const std::string& place) {
    if (start == FrameStart::clean) {
        const auto [pairs, touch] = truth_of(topology, first);
        std::size_t crossing = 0;
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const auto is_open = [&](Index triangle) {
                return !topology.bodies[at(topology.body_of_triangle[at(triangle)])].closed;
            };
            const bool touches = std::binary_search(touch.begin(), touch.end(), static_cast<Index>(i));
            crossing += !touches && (is_open(pairs[i].a) || is_open(pairs[i].b)) ? 1 : 0;
        }
        if (crossing > 0) {
            throw InputError(place, fmt::format("frame {}", first.tick),
                             "no surface that crosses an open sheet, as a clean start says (else --start unknown)",
                             fmt::format("{} pairs of triangles", crossing));
        }
    }
    state_ = std::make_unique<State>(topology, first, start, self);
}

FrameJudge::~FrameJudge() = default;

const DepthTruth& FrameJudge::depth_truth() const { return state_->depth; }

FrameFigures FrameJudge::judge(const Frame& frame) {
    State& state = *state_;
    FrameFigures figures;
    figures.row.tick = frame.tick;
    figures.row.time = frame.time;
    if (!frame.all_finite()) return figures;
    FrameFigures surfaces;
    std::future<void> beside = std::async(std::launch::async, [&] { state.judge_surfaces(frame, surfaces); });
    const DepthTruth::Result left = state.depth.measure(frame);
    beside.get();
    figures.self_intersections = surfaces.self_intersections;
    figures.row.true_pairs = surfaces.row.true_pairs;
    figures.row.true_touch = surfaces.row.true_touch;
    figures.row.passed_through = surfaces.row.passed_through;
    if (state.topology->body_pairs.empty()) return figures;
    add_depth(left, figures.row);
    if (state.sides_known) return figures;
    figures.row.wrong_side = -1;
    figures.row.wrong_side_area = not_known;
    figures.row.wrong_side_vertices = -1;
    if (!state.any_closed) figures.row.residual_penetration = figures.row.residual_penetration_mean = not_known;
    return figures;
}

}  // namespace trocar
