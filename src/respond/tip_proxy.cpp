#include "respond/tip_proxy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "geometry/exact.hpp"
#include "respond/equations.hpp"

namespace trocar {
namespace {

/// Penetration that the ball may have while it moves, relative to its radius; removed before the next move. The
/// tolerance keeps a sliding ball from catching on an edge shared by two faces.
constexpr double contact_offset = 2e-4;
constexpr std::size_t most_planes = 16;

Box box_of_triangle(const Topology& topology, const Matrix3X& position, Index triangle) {
    return box_of(corners_of(topology.triangles, position, triangle));
}

}  // namespace

void GodObject::prepare(double radius) {
    radius_ = radius;
    placed_ = false;
}

GodObject::Nearest GodObject::nearest(const Topology& topology, const Matrix3X& position, Index triangle,
                                      const Vector3& point) {
    const Corners corners = corners_of(topology.triangles, position, triangle);
    Nearest result;
    result.point = equations::point_at(corners, closest_point_on_triangle(corners, point));
    result.distance = (point - result.point).norm();
    return result;
}

void GodObject::place(const Topology& topology, const Matrix3X& position, std::span<const Index> triangles,
                      const Vector3& device) {
    proxy_ = device;
    // Inside a closed body the proxy leaves by the shortest path. On a surface that path has no length, and the front
    // normal replaces it.
    const double on_the_surface = 1e-9 * radius_;
    double winding = 0.0;
    Nearest closest{.distance = std::numeric_limits<double>::infinity()};
    for (const Index t : triangles) {
        const Corners c = corners_of(topology.triangles, position, t);
        const Nearest here = nearest(topology, position, t, device);
        const Vector3 front = (c[1] - c[0]).cross(c[2] - c[0]);
        if (here.distance <= on_the_surface && front.norm() > 0.0) {
            proxy_ = device + radius_ * front.normalized();
            placed_ = true;
            return;
        }
        if (!topology.bodies[at(topology.body_of_triangle[at(t)])].closed) continue;
        const Vector3 a = c[0] - device;
        const Vector3 b = c[1] - device;
        const Vector3 d = c[2] - device;
        winding += 2.0 * std::atan2(a.dot(b.cross(d)), a.norm() * b.norm() * d.norm() + a.dot(b) * d.norm() +
                                                           b.dot(d) * a.norm() + d.dot(a) * b.norm());
        if (here.distance < closest.distance) closest = here;
    }
    if (winding > 2.0 * std::numbers::pi && closest.distance > on_the_surface) {
        proxy_ = closest.point + radius_ / closest.distance * (closest.point - device);
    }
    placed_ = true;
}

void GodObject::collect_candidates(const Topology& topology, const Matrix3X& position, std::span<const Index> near,
                                   const Vector3& centre, double extent) {
    Box box;
    box.add(centre - Vector3::Constant(extent));
    box.add(centre + Vector3::Constant(extent));
    candidates_.clear();
    for (const Index t : near) {
        if (box_of_triangle(topology, position, t).overlaps(box)) candidates_.push_back(t);
    }
}

/// Contact planes at the proxy, one per triangle nearer than `within` (m). Omits triangles whose nearest point also
/// belongs to a nearer triangle, since such an edge does not constrain the proxy.
void GodObject::collect_planes(const Topology& topology, const Matrix3X& position, double within) {
    planes_.clear();
    for (const Index t : candidates_) {
        const Nearest here = nearest(topology, position, t, proxy_);
        if (!(here.distance < within) || !(here.distance > 0.0)) continue;
        planes_.push_back({.normal = (proxy_ - here.point) / here.distance,
                           .least = radius_ - here.distance,
                           .foot = here.point,
                           .distance = here.distance,
                           .triangle = t});
    }
    std::sort(planes_.begin(), planes_.end(), [](const Plane& a, const Plane& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.triangle < b.triangle;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < planes_.size() && kept < most_planes; ++i) {
        bool covered = false;
        for (std::size_t j = 0; j < kept && !covered; ++j) {
            covered = nearest(topology, position, planes_[j].triangle, planes_[i].foot).distance < 1e-6 * radius_;
        }
        if (!covered) planes_[kept++] = planes_[i];
    }
    planes_.resize(kept);
}

/// Point nearest to `wanted` that all planes permit. At most three planes are active: sets of one, two and three are
/// tried until one is feasible with pressures >= 0.
Vector3 GodObject::constrained_goal(const Vector3& wanted, int& active) const {
    const Vector3 travel = wanted - proxy_;
    const double tolerance = 1e-9 * radius_;
    const auto allowed = [&](const Vector3& step) {
        return std::all_of(planes_.begin(), planes_.end(),
                           [&](const Plane& p) { return p.normal.dot(step) >= p.least - tolerance; });
    };
    if (allowed(travel)) {
        active = 0;
        return wanted;
    }
    const auto count = static_cast<int>(planes_.size());
    Vector3 best = Vector3::Zero();
    bool found = false;
    const auto attempt = [&](const std::array<int, 3>& chosen, int size) {
        Matrix3 normals = Matrix3::Zero();
        Vector3 missing = Vector3::Zero();
        for (int i = 0; i < size; ++i) {
            const Plane& plane = planes_[at(chosen[at(i)])];
            normals.col(i) = plane.normal;
            missing[i] = plane.least - plane.normal.dot(travel);
        }
        // Unused rows and columns are those of the unit matrix.
        Matrix3 gram = normals.transpose() * normals;
        for (int i = size; i < 3; ++i) gram(i, i) = 1.0;
        if (gram.determinant() < 1e-12) return;
        const Vector3 pressure = gram.inverse() * missing;
        if (pressure.head(size).minCoeff() < 0.0) return;
        const Vector3 step = travel + normals * pressure;
        if (!allowed(step)) return;
        if (found && (step - travel).squaredNorm() >= (best - travel).squaredNorm()) return;
        best = step;
        found = true;
        active = size;
    };
    for (int i = 0; i < count; ++i) attempt({i, -1, -1}, 1);
    for (int i = 0; i < count && !found; ++i) {
        for (int j = 0; j < i; ++j) attempt({i, j, -1}, 2);
    }
    for (int i = 0; i < count && !found; ++i) {
        for (int j = 0; j < i; ++j) {
            for (int k = 0; k < j; ++k) attempt({i, j, k}, 3);
        }
    }
    if (!found) active = std::min(count, 3);
    return proxy_ + best;
}

bool GodObject::move_to(const Topology& topology, const Matrix3X& position, const Vector3& goal) {
    const Vector3 travel = goal - proxy_;
    const double limit = radius_ * (1.0 - contact_offset);
    double share = 1.0;
    for (const Index t : candidates_) {
        // Conservative advancement: the triangle lies behind the plane through its nearest point. The ball moves up to
        // that plane and repeats the query.
        double s = 0.0;
        constexpr int most_searches = 64;
        int search = 0;
        for (; search < most_searches && s < share; ++search) {
            const Vector3 here = proxy_ + s * travel;
            const Nearest foot = nearest(topology, position, t, here);
            if (!(foot.distance > 0.0)) break;
            const double closing = -travel.dot(here - foot.point) / foot.distance;
            if (!(closing > 0.0)) {
                s = 1.0;
                break;
            }
            if (foot.distance <= limit * (1.0 + 1e-9)) break;
            s += (foot.distance - limit) / closing;
        }
        share = std::min(share, s);
    }
    if (!(share > 0.0)) return false;
    const Vector3 end = share < 1.0 ? Vector3(proxy_ + share * travel) : goal;
    const Box path = box_of(proxy_, end);
    for (const Index t : candidates_) {
        const Corners corners = corners_of(topology.triangles, position, t);
        if (box_of(corners).overlaps(path) && triangles_intersect({proxy_, end, end}, corners)) return false;
    }
    const bool moved = (end - proxy_).norm() > 1e-9 * radius_;
    proxy_ = end;
    return moved;
}

const Vector3& GodObject::follow(const Topology& topology, const Matrix3X& position, std::span<const Index> near,
                                 const Vector3& device) {
    if (!placed_) place(topology, position, near, device);
    active_ = 0;
    const double extent = (device - proxy_).norm();
    // The proxy's distance from the device never grows.
    collect_candidates(topology, position, near, device, extent + 3.0 * radius_);
    if (candidates_.empty()) {
        proxy_ = device;
        return proxy_;
    }
    constexpr int most_moves = 24;
    for (int move = 0; move < most_moves; ++move) {
        collect_planes(topology, position, radius_ * (1.0 - 1e-9));
        if (!planes_.empty()) {
            int pushing = 0;
            move_to(topology, position, constrained_goal(proxy_, pushing));
        }
        // Includes planes that the push has just cleared; else the ball would creep along a groove between them.
        collect_planes(topology, position, radius_ * (1.0 + 4.0 * contact_offset));
        const Vector3 goal = constrained_goal(device, active_);
        if ((goal - proxy_).norm() <= 1e-9 * radius_ || !move_to(topology, position, goal)) break;
        if (proxy_ == device) break;
    }
    return proxy_;
}

void TipProxies::prepare(const Topology& topology, const Materials& materials, double radius) {
    tips_.clear();
    radius_ = radius;
    driven_ = false;
    surface_.prepare(topology);
    reached_.assign(at(topology.triangle_count()), 0);
    search_ = 0;
    around_.clear();
    for (Index body = 0; body < topology.body_count(); ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        if (range.kind != BodyKind::instrument || at(body) >= materials.tip.size()) continue;
        const bool part_of_known = std::any_of(tips_.begin(), tips_.end(), [&](const Tip& tip) {
            return !range.instrument.empty() && topology.bodies[at(tip.body)].instrument == range.instrument;
        });
        if (part_of_known) continue;
        Tip tip;
        tip.body = body;
        for (Index other = 0; other < topology.body_count(); ++other) {
            const BodyRange& bone = topology.bodies[at(other)];
            if (bone.kind != BodyKind::rigid || topology.body_pair(body, other) < 0) continue;
            if (tip.rigid < 0) tip.rigid = other;
            for (Index t = bone.triangles.first; t < bone.triangles.end(); ++t) tip.bones.push_back(t);
        }
        if (tip.bones.empty()) continue;
        tip.object.prepare(radius);
        tips_.push_back(std::move(tip));
    }
}

void TipProxies::respond(const Topology& topology, const Materials& materials, const ContactLaws& laws,
                         const Frame& frame, const ContactSet& contacts, ResponseOutput& output) {
    driven_ = frame.pose.size() == topology.bodies.size();
    if (!driven_) return;
    for (Tip& tip : tips_) {
        const Pose& pose = frame.pose[at(tip.body)];
        const Range vertices = topology.bodies[at(tip.body)].vertices;
        tip.place = pose.rotation * materials.tip[at(tip.body)] + pose.translation;
        const auto body = frame.position.middleCols(vertices.first, vertices.count);
        if (tip.vertex < 0) {
            Eigen::Index nearest = 0;
            (body.colwise() - tip.place).colwise().squaredNorm().minCoeff(&nearest);
            tip.vertex = vertices.first + static_cast<Index>(nearest);
        }
        const bool hangs = at(tip.body) < materials.trocar_point.size() && materials.trocar_point[at(tip.body)];
        const Vector3 upwards = (hangs ? *materials.trocar_point[at(tip.body)] : body.rowwise().mean()) - tip.place;
        const double length = upwards.norm();
        const Vector3 device = length > 0.0 ? Vector3(tip.place + radius_ / length * upwards) : tip.place;
        collect_around(topology, frame, contacts, tip, device);
        if (!tip.object.placed()) {
            tip.object.place(topology, frame.position, around_.empty() ? around_ : tip.bones, device);
        }
        const Vector3 back = tip.object.follow(topology, frame.position, around_, device) - device;
        const double depth = back.norm();
        if (depth <= 1e-9 * radius_) continue;
        ContactForceLaw contact;
        contact.vertices = {tip.vertex, -1, -1};
        contact.weights = {1.0, 0.0, 0.0};
        contact.normal = back / depth;
        contact.gap = -depth;
        contact.k = laws.k(tip.body, tip.rigid);
        if (std::isnan(contact.k)) contact.k = rigid_stiffness;
        contact.mu = laws.mu(tip.body, tip.rigid, contact.k);
        output.contacts.push_back(contact);
    }
}

/// Flood fill over the bones' surfaces: from the detector's triangles to all between those and the tip.
void TipProxies::collect_around(const Topology& topology, const Frame& frame, const ContactSet& contacts,
                                const Tip& tip, const Vector3& device) {
    around_.clear();
    ++search_;
    const std::string& instrument = topology.bodies[at(tip.body)].instrument;
    const double extent = (device - tip.object.proxy()).norm() + 3.0 * radius_;
    Box between = box_of(device, device).grown(extent);
    const auto add = [&](Index t) {
        if (reached_[at(t)] == search_) return;
        reached_[at(t)] = search_;
        around_.push_back(t);
    };
    for (const std::vector<TrianglePair>* pairs : {&contacts.pairs, &contacts.near}) {
        for (const TrianglePair& pair : *pairs) {
            const Index body = topology.body_of_triangle[at(pair.a)];
            if (topology.bodies[at(topology.body_of_triangle[at(pair.b)])].kind != BodyKind::rigid) continue;
            const bool same =
                body == tip.body || (!instrument.empty() && topology.bodies[at(body)].instrument == instrument);
            if (!same || reached_[at(pair.b)] == search_) continue;
            add(pair.b);
            between.add(box_of_triangle(topology, frame.position, pair.b));
        }
    }
    // around_ grows during the loop.
    for (std::size_t i = 0; i < around_.size(); ++i) {  // NOLINT(modernize-loop-convert)
        for (int corner = 0; corner < 3; ++corner) {
            for (const Index t : surface_.triangles_at(topology.triangles(corner, around_[i]))) {
                if (reached_[at(t)] != search_ && box_of_triangle(topology, frame.position, t).overlaps(between))
                    add(t);
            }
        }
    }
}

double TipProxies::share_left(Index instrument, const Vector3& place) const {
    double share = 1.0;
    if (!driven_) return share;
    for (const Tip& tip : tips_) {
        if (tip.body != instrument) continue;
        const double outside = std::clamp((place - tip.place).norm() / (2.0 * radius_) - 1.0, 0.0, 1.0);
        share = std::min(share, outside * outside * (3.0 - 2.0 * outside));
    }
    return share;
}

bool TipProxies::takes(const Topology& topology, const Frame& frame, const Contact& contact) const {
    if (!driven_ || contact.body_a < 0 || contact.body_b < 0) return false;
    if (topology.bodies[at(contact.body_b)].kind != BodyKind::rigid) return false;
    Vector3 place = contact.point;
    if (contact.kind == ContactCase::point_face || contact.kind == ContactCase::edge_edge) {
        place = contact.on_a.blend(frame.position);
    } else if (contact.kind == ContactCase::a_enters_b && contact.vertex_a >= 0) {
        place = frame.position.col(contact.vertex_a);
    }
    return share_left(contact.body_a, place) == 0.0;
}

}  // namespace trocar
