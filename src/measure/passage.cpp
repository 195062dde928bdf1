#include "measure/passage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "geometry/exact.hpp"
#include "geometry/signed_crossing.hpp"

namespace trocar {
namespace {

constexpr double most_samples = 2e5;
/// Cosine between the outward normals of entry and exit, at most, that makes a passage.
constexpr double opposite = -0.5;
/// Depth that makes one, at least: as part of how deep the body is, or of the distance from entry to exit.
constexpr double deep_for_the_body = 0.8;
constexpr double deep_for_the_path = 0.4;
/// Samples are thought moved by this part of the other body's box, in a direction that no mesh is built along, so that
/// they do not run through edges and vertices of a mesh whose lines they share.
constexpr double aside = 1e-9;
const Vector3 aside_direction(0.5497, 0.6180, 0.7549);

Box both(Box box, const Box& other) {
    box.add(other);
    return box;
}

bool finite(const Box& box) { return box.min.allFinite() && box.max.allFinite(); }

/// Exact side of the line p→q on which the line u→v passes it, never 0, and opposite for v→u.
int passing_side(const Vector3& p, const Vector3& q, const Matrix3X& shape, Index u, Index v) {
    const bool ordered = u < v;
    const int sign = orientation_sign(p, q, shape.col(ordered ? u : v), shape.col(ordered ? v : u));
    return (sign < 0 ? -1 : 1) * (ordered ? 1 : -1);
}

}  // namespace

PassageTruth::PassageTruth(const Scene& scene, const Frame& frame)
    : scene_(&scene), shape_(frame.position), shape_before_(frame.position) {
    const Topology& topology = scene.topology;
    if (frame.pose.size() != topology.bodies.size() || scene.bodies.size() != topology.bodies.size()) return;
    before_ = frame.position;
    pose_before_ = frame.pose;
    targets_.resize(topology.bodies.size());
    box_.resize(topology.bodies.size());
    for (const BodyRange& body : topology.bodies) box_before_.push_back(box_of(frame.position, body.vertices));
    const auto has_shape = [&](Index body) {
        return scene.bodies[at(body)].local.cols() == range(body).vertices.count && range(body).triangles.count > 0;
    };
    for (const auto& [a, b] : topology.body_pairs) {
        const bool tissue = range(a).kind == BodyKind::tissue || range(b).kind == BodyKind::tissue;
        if (tissue || !has_shape(a) || !has_shape(b)) continue;
        pairs_.push_back({.a = a, .b = b, .directions = {}});
        if (box_before_[at(a)].overlaps(box_before_[at(b)])) begin(false, pairs_.back());
    }
}

void PassageTruth::begin(bool apart, Pair& pair) {
    pair.met = true;
    for (const auto& [from, into] : {std::pair{pair.a, pair.b}, std::pair{pair.b, pair.a}}) {
        const Pose& pose = pose_before_[at(into)];
        if (targets_[at(into)].normal.cols() == 0) place_target(into, pose.jaw);
        Direction direction;
        direction.from = from;
        direction.into = into;
        add_samples(direction);
        sample_places(direction, before_, pose, direction.at);
        direction.up_to_date = true;
        direction.depth.assign(direction.samples.size(), 0);
        direction.entered.assign(direction.samples.size(), -1);
        direction.entry = direction.at;
        direction.deepest.assign(direction.samples.size(), 0.0);
        if (range(into).closed && !apart) {
            for (std::size_t s = 0; s < direction.samples.size(); ++s) {
                direction.depth[s] = targets_[at(into)].rays.crossings(scene_->topology.triangles, shape_,
                                                                       direction.at.col(static_cast<Eigen::Index>(s)));
                direction.any_inside = direction.any_inside || direction.depth[s] != 0;
            }
        }
        pair.directions.push_back(std::move(direction));
    }
}

void PassageTruth::reshape_target(Index body, double jaw) {
    const BodyRange& own = range(body);
    const Triangles& triangles = scene_->topology.triangles;
    Target& target = targets_[at(body)];
    shape_before_.middleCols(own.vertices.first, own.vertices.count) =
        shape_.middleCols(own.vertices.first, own.vertices.count);
    place_target(body, jaw);
    target.reshaped = true;
    if (target.swept.empty()) target.swept.prepare(triangles, own.triangles, shape_);
    target.swept.refit(triangles, shape_, &shape_before_);
}

void PassageTruth::place_target(Index body, double jaw) {
    const Topology& topology = scene_->topology;
    const BodyRange& own = range(body);
    Target& target = targets_[at(body)];
    Pose pose;
    pose.jaw = jaw;
    place_body(scene_->bodies[at(body)], own.vertices, pose, shape_);
    const bool placed = target.normal.cols() > 0;
    const bool is_first_or_jaw_moved = !placed || target.jaw != jaw;
    target.jaw = jaw;
    target.box = box_of(shape_, own.vertices);
    // Another shape leaves the order of the trees as it is.
    if (placed) {
        target.rays.refit(topology.triangles, shape_);
        target.distance.refit(topology.triangles, shape_);
    } else {
        target.rays.prepare(topology.triangles, own.triangles, shape_);
        target.distance.prepare(topology.triangles, own.triangles, shape_);
    }
    target.normal.resize(3, own.triangles.count);
    double twice_area = 0.0;
    double six_volumes = 0.0;
    double edges = 0.0;
    const Vector3 origin = target.box.min;
    for (Index t = 0; t < own.triangles.count; ++t) {
        const Corners corners = corners_of(topology.triangles, shape_, own.triangles.first + t);
        const auto& [a, b, c] = corners;
        const Vector3 area = area_normal(corners);
        target.normal.col(t) = area.norm() > 0.0 ? Vector3(area / area.norm()) : Vector3(Vector3::Zero());
        twice_area += area.norm();
        six_volumes += (a - origin).dot(area);
        edges += (b - a).norm() + (c - b).norm() + (a - c).norm();
    }
    target.thickness = own.closed && six_volumes > 0.0 ? six_volumes / (3.0 * twice_area)
                                                       : edges / (3.0 * static_cast<double>(own.triangles.count));
    // A deforming body keeps that of its first shape, which takes as long to find as a frame of `trocar judge`.
    if (is_first_or_jaw_moved) target.half_width = own.closed ? half_width_of(body) : 0.0;
}

/// From the middle of a triangle straight inwards, half-way to the other side, is about where a body is deepest.
double PassageTruth::half_width_of(Index body) const {
    const Topology& topology = scene_->topology;
    const BodyRange& own = range(body);
    const Target& target = targets_[at(body)];
    const double across = (target.box.max - target.box.min).norm();
    constexpr Index most_rays = 1000;
    const Index stride = 1 + own.triangles.count / most_rays;
    double deepest = 0.0;
    for (Index t = 0; t < own.triangles.count; t += stride) {
        const Corners corners = corners_of(topology.triangles, shape_, own.triangles.first + t);
        const Vector3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        const Vector3 inwards = -target.normal.col(t);
        double nearest = across;
        target.rays.visit_along(middle, middle + across * inwards, [&](Index other) {
            const auto normal = target.normal.col(other - own.triangles.first);
            const auto face = topology.triangles.col(other);
            const double slope = normal.dot(inwards);
            if (slope <= 0.0) return;
            const double path = normal.dot(shape_.col(face[0]) - middle) / slope;
            const Vector3 hit = middle + path * inwards;
            if (path <= 0.0 || path >= nearest) return;
            constexpr double on_the_face = 1e-9;  // of the body's size
            const double squared =
                squared_distance_to_triangle(shape_.col(face[0]), shape_.col(face[1]), shape_.col(face[2]), hit);
            if (std::sqrt(squared) <= on_the_face * across) nearest = path;
        });
        const Vector3 point = middle + 0.5 * nearest * inwards;
        if (nearest < across) {
            deepest = std::max(deepest, target.distance.distance(topology.triangles, shape_, point));
        }
    }
    return deepest;
}

void PassageTruth::add_samples(Direction& direction) const {
    const BodyRange& own = range(direction.from);
    const Triangles& triangles = scene_->topology.triangles;
    const Matrix3X& position = scene_->first.position;
    std::set<std::array<Index, 2>> edges;
    double length = 0.0;
    for (Index t = own.triangles.first; t < own.triangles.end(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            const auto [u, v] = std::minmax(triangles(corner, t), triangles((corner + 1) % 3, t));
            if (edges.insert({u, v}).second) length += (position.col(v) - position.col(u)).norm();
        }
    }
    for (Index v = own.vertices.first; v < own.vertices.end(); ++v) direction.samples.push_back({v, v, 0.0});
    const double spacing = std::max(targets_[at(direction.into)].thickness, length / most_samples);
    for (const auto& [u, v] : edges) {
        const auto parts = std::llround(std::ceil((position.col(v) - position.col(u)).norm() / spacing));
        for (std::int64_t i = 1; i < parts; ++i) {
            direction.samples.push_back({u, v, static_cast<double>(i) / static_cast<double>(parts)});
        }
    }
}

void PassageTruth::sample_places(const Direction& direction, const Matrix3X& position, const Pose& into,
                                 Matrix3X& places) const {
    const Box& box = targets_[at(direction.into)].box;
    const Matrix3 back = into.rotation.toRotationMatrix().transpose();
    const Vector3 offset = aside * (box.max - box.min).norm() * aside_direction - back * into.translation;
    places.resize(3, static_cast<Eigen::Index>(direction.samples.size()));
    for (std::size_t s = 0; s < direction.samples.size(); ++s) {
        const Sample& sample = direction.samples[s];
        const Vector3 world = (1.0 - sample.share) * position.col(sample.u) + sample.share * position.col(sample.v);
        places.col(static_cast<Eigen::Index>(s)) = back * world + offset;
    }
}

std::int64_t PassageTruth::follow(const Frame& frame, std::span<const std::uint8_t> reshaped) {
    if (pairs_.empty()) return -1;
    for (std::size_t b = 0; b < targets_.size(); ++b) {
        targets_[b].reshaped = false;
        const bool placed = targets_[b].normal.cols() > 0;
        if (placed && b < reshaped.size() && reshaped[b] != 0) reshape_target(static_cast<Index>(b), targets_[b].jaw);
    }
    for (std::size_t b = 0; b < box_.size(); ++b) box_[b] = box_of(frame.position, scene_->topology.bodies[b].vertices);
    std::int64_t completed = 0;
    for (Pair& pair : pairs_) {
        const Box swept_a = both(box_[at(pair.a)], box_before_[at(pair.a)]);
        const Box swept_b = both(box_[at(pair.b)], box_before_[at(pair.b)]);
        const bool inside = std::any_of(pair.directions.begin(), pair.directions.end(),
                                        [](const Direction& direction) { return direction.any_inside; });
        if (!finite(swept_a) || !finite(swept_b) || (!inside && !swept_a.overlaps(swept_b))) {
            for (Direction& direction : pair.directions) direction.up_to_date = false;
            pair.counted = false;
            continue;
        }
        if (!pair.met) begin(true, pair);
        bool through = false;
        bool going_on = false;
        for (Direction& direction : pair.directions) {
            through = follow(frame, direction) || through;
            going_on = going_on || direction.any_inside || moved_through_;
        }
        if (through && !pair.counted) ++completed;
        pair.counted = (pair.counted || through) && going_on;
    }
    before_ = frame.position;
    pose_before_ = frame.pose;
    box_before_.swap(box_);
    return completed;
}

bool PassageTruth::follow(const Frame& frame, Direction& direction) {
    const auto into = at(direction.into);
    const Pose& before = pose_before_[into];
    const double jaw = frame.pose[into].jaw;
    const bool has_jaws = !scene_->bodies[into].jaws.empty();
    if (!direction.up_to_date) {
        if (has_jaws && targets_[into].jaw != before.jaw) place_target(direction.into, before.jaw);
        sample_places(direction, before_, before, direction.at);
    }
    if (has_jaws && targets_[into].jaw != jaw) reshape_target(direction.into, jaw);
    sample_places(direction, frame.position, frame.pose[into], next_);
    direction.any_inside = false;
    moved_through_ = false;
    bool through = false;
    for (std::size_t s = 0; s < direction.samples.size(); ++s) {
        through = follow_sample(s, next_.col(static_cast<Eigen::Index>(s)), direction) || through;
        direction.any_inside = direction.any_inside || direction.depth[s] != 0;
    }
    direction.at.swap(next_);
    direction.up_to_date = true;
    if (range(direction.into).closed) return through;
    if (!direction.any_inside || !surfaces_apart(frame, direction)) return false;
    // The side that the samples are on now is the one that the next passage is counted from.
    std::fill(direction.depth.begin(), direction.depth.end(), 0);
    direction.any_inside = false;
    return true;
}

void PassageTruth::cross_surface(const Vector3& from, const Vector3& to, Index into) {
    const Triangles& triangles = scene_->topology.triangles;
    const Target& target = targets_[at(into)];
    target.rays.visit_along(from, to, [&](Index t) {
        const auto [a, b, c] = corners_of(triangles, shape_, t);
        const bool below = orientation_sign(a, b, c, from) > 0;
        if (below == (orientation_sign(a, b, c, to) > 0)) return;
        const int side = passing_side(from, to, shape_, triangles(0, t), triangles(1, t));
        if (side != passing_side(from, to, shape_, triangles(1, t), triangles(2, t)) ||
            side != passing_side(from, to, shape_, triangles(2, t), triangles(0, t))) {
            return;
        }
        const auto normal = target.normal.col(t - range(into).triangles.first);
        const double part = normal.dot(a - from) / normal.dot(to - from);
        hits_.push_back({std::isfinite(part) ? part : 0.5, t, below ? -1 : 1});
    });
}

/// The sample stays at the origin, and the triangles move by their own motion less that of the sample.
void PassageTruth::cross_swept_surface(const Vector3& from, const Vector3& to, Index into) {
    const Triangles& triangles = scene_->topology.triangles;
    const Box path = box_of(from, to);
    targets_[at(into)].swept.visit_overlapping(path, [&](Index t) {
        Corners before = corners_of(triangles, shape_before_, t);
        Corners now = corners_of(triangles, shape_, t);
        for (std::size_t corner = 0; corner < before.size(); ++corner) {
            before.at(corner) -= from;
            now.at(corner) -= to;
        }
        const int step =
            sweep_crossing(Vector3::Zero(), {triangles(0, t), triangles(1, t), triangles(2, t)}, before, now);
        if (step == 0) return;
        const double height_before = area_normal(before).normalized().dot(before[0]);
        const double height_now = area_normal(now).normalized().dot(now[0]);
        const double part = height_before / (height_before - height_now);
        hits_.push_back({part >= 0.0 && part <= 1.0 ? part : 0.5, t, step});
    });
}

bool PassageTruth::follow_sample(std::size_t sample, const Vector3& to, Direction& direction) {
    const Vector3 from = direction.at.col(static_cast<Eigen::Index>(sample));
    hits_.clear();
    if (targets_[at(direction.into)].reshaped) {
        cross_swept_surface(from, to, direction.into);
    } else if (from != to) {
        cross_surface(from, to, direction.into);
    }
    if (hits_.empty()) {
        if (direction.entered[sample] >= 0) deepen(sample, from, to, direction);
        return false;
    }
    // In an order of their own where several are met at once.
    std::sort(hits_.begin(), hits_.end(), [](const Hit& x, const Hit& y) { return x.triangle < y.triangle; });
    std::stable_sort(hits_.begin(), hits_.end(), [](const Hit& x, const Hit& y) { return x.part < y.part; });
    moved_through_ = true;
    bool through = false;
    Vector3 last = from;
    for (const Hit& hit : hits_) {
        const Vector3 here = from + hit.part * (to - from);
        through = cross(sample, hit.triangle, hit.step, last, here, direction) || through;
        last = here;
    }
    if (direction.entered[sample] >= 0) deepen(sample, last, to, direction);
    return through;
}

bool PassageTruth::cross(std::size_t sample, Index triangle, int step, const Vector3& last, const Vector3& here,
                         Direction& direction) const {
    const Target& target = targets_[at(direction.into)];
    const Index first = range(direction.into).triangles.first;
    const auto column = static_cast<Eigen::Index>(sample);
    int& depth = direction.depth[sample];
    Index& entered = direction.entered[sample];
    if (depth == 0) {
        entered = triangle;
        direction.entry.col(column) = here;
        direction.deepest[sample] = 0.0;
    } else if (entered >= 0) {
        deepen(sample, last, here, direction);
    }
    depth += step;
    if (depth != 0) return false;
    const Index in = std::exchange(entered, -1);
    if (in < 0) return false;
    const double deep_enough = std::min(deep_for_the_body * target.half_width,
                                        deep_for_the_path * (here - direction.entry.col(column)).norm());
    return target.normal.col(in - first).dot(target.normal.col(triangle - first)) <= opposite &&
           direction.deepest[sample] >= deep_enough;
}

void PassageTruth::deepen(std::size_t sample, const Vector3& from, const Vector3& to, Direction& direction) const {
    const Target& target = targets_[at(direction.into)];
    double& deepest = direction.deepest[sample];
    if (!range(direction.into).closed || deepest >= deep_for_the_body * target.half_width) return;
    // Odd, so that the middle is among them; one for a step that is short against the body.
    constexpr double most_points = 9.0;
    const auto points =
        1 +
        2 * std::llround(std::floor(std::min(2.0 * (to - from).norm() / target.thickness, 0.5 * (most_points - 1.0))));
    for (std::int64_t i = 0; i < points; ++i) {
        const Vector3 point = from + (static_cast<double>(i) + 0.5) / static_cast<double>(points) * (to - from);
        deepest = std::max(deepest, target.distance.distance(scene_->topology.triangles, shape_, point));
    }
}

bool PassageTruth::surfaces_apart(const Frame& frame, const Direction& direction) {
    const Topology& topology = scene_->topology;
    std::vector<Box> boxes;
    std::vector<IndexPair> candidates;
    triangle_boxes(frame.position, topology.triangles, boxes);
    overlapping_boxes(boxes, range(direction.from).triangles, range(direction.into).triangles, candidates);
    const auto corners = [&](Index t) { return corners_of(topology.triangles, frame.position, t); };
    return std::none_of(candidates.begin(), candidates.end(), [&](const IndexPair& pair) {
        return oracle_intersect(corners(pair.first), corners(pair.second));
    });
}

}  // namespace trocar
