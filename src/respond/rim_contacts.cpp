#include "respond/rim_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "respond/equations.hpp"
#include "respond/penetration.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Where a segment passes through a triangle, as part of its length; negative where it does not.
double way_to(const equations::Corners& face, const Vector3& from, const Vector3& to) {
    const Vector3 normal = (face[1] - face[0]).cross(face[2] - face[0]);
    const double start = normal.dot(from - face[0]);
    const double end = normal.dot(to - face[0]);
    if ((start > 0.0) == (end > 0.0)) return -1.0;
    const double way = start / (start - end);
    const Vector3 point = from + way * (to - from);
    for (std::size_t i = 0; i < 3; ++i) {
        if (normal.dot((face[(i + 1) % 3] - face[i]).cross(point - face[i])) < 0.0) return -1.0;
    }
    return way;
}

}  // namespace

void RimContacts::prepare(const ThesisState& state) {
    const Topology& topology = *state.topology;
    loose_.assign(topology.bodies.size(), 0);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            for (int i = 0; i < 3; ++i) {
                const bool on_rim = (state.surface.rim_edges(t) & (1U << static_cast<unsigned>(i))) != 0;
                if (!on_rim || state.fixed(topology.triangles(i, t))) continue;
                loose_[at(topology.body_of_triangle[at(t)])] = 1;
            }
        }
    }
    piercings_.clear();
    points_.clear();
    points_now_.clear();
}

void RimContacts::collect(const ThesisState& state, const Frame& frame, const Contact& contact) {
    const Topology& topology = *state.topology;
    const unsigned rim = state.surface.rim_edges(contact.b);
    const Index body = topology.body_of_triangle[at(contact.a)];
    const equations::Corners face = corners_of(topology, frame.position, contact.a);
    for (int i = 0; i < 3; ++i) {
        const bool on_rim = (rim & (1U << static_cast<unsigned>(i))) != 0;
        const auto [u, v] = std::minmax({topology.triangles(i, contact.b), topology.triangles((i + 1) % 3, contact.b)});
        const double way = way_to(face, frame.position.col(u), frame.position.col(v));
        piercings_.push_back({u, v, body, way, contact.a, on_rim});
    }
}

void RimContacts::respond(const ThesisState& state, const Frame& frame, const LedgerResolution* ledger,
                          Effect& effect) {
    std::sort(piercings_.begin(), piercings_.end(), [](const EdgePoint& a, const EdgePoint& b) {
        return std::tie(a.u, a.v, a.body, a.way, a.triangle) < std::tie(b.u, b.v, b.body, b.way, b.triangle);
    });
    // From one piercing to the next, and from the outermost to the ends, an edge is all in or all out.
    double from = 0.0;
    for (std::size_t p = 0; p < piercings_.size(); ++p) {
        EdgePoint point = piercings_[p];
        const auto hold_between = [&](double to) {
            point.way = 0.5 * (from + to);
            hold(state, frame, ledger, point, false, effect);
            from = to;
        };
        // Of two triangles that meet in the edge, both tell.
        if (piercings_[p].way > from) hold_between(piercings_[p].way);
        if (p + 1 < piercings_.size() && piercings_[p + 1].is_of_edge(point)) continue;
        hold_between(1.0);
        from = 0.0;
    }
    piercings_.clear();
    for (const EdgePoint& point : points_) {
        const bool known = std::any_of(points_now_.begin(), points_now_.end(),
                                       [&point](const EdgePoint& now) { return now.is_of_edge(point); });
        if (!known) hold(state, frame, ledger, point, true, effect);
    }
    points_.swap(points_now_);
    points_now_.clear();
}

bool RimContacts::is_loose(const ThesisState& state, const EdgePoint& point) const {
    return loose_[at(state.topology->body_of_vertex(point.u))] != 0;
}

/// A sheet with a free rim may lie across the tool without any bend; of one that is held all round, a level edge is
/// what the tool's samples push back past themselves, in the direction that they know.
bool RimContacts::is_fold(const ThesisState& state, const Frame& frame, const EdgePoint& point,
                          const Vector3& outwards) const {
    const double least = is_loose(state, point) ? -level_sine : level_sine;
    return faces_below(state, frame.position, point.u, point.v, -outwards, least);
}

/// A rim or a fold that is inside has come in from beside. What else lies across the body may have been pierced by it,
/// and gets clear along the body and not out of its side. Of a sheet with a free rim the ledger tells: it holds nothing
/// there, or it pushes a face at the edge the same way.
bool RimContacts::may_leave(const ThesisState& state, const Frame& frame, const LedgerResolution* ledger,
                            const EdgePoint& point, const Vector3& outwards) const {
    const Topology& topology = *state.topology;
    if (point.on_rim || is_fold(state, frame, point, outwards)) return true;
    if (ledger == nullptr || !is_loose(state, point)) return false;
    for (const Index t : state.surface.triangles_at(point.u)) {
        if (!(topology.triangles.col(t).array() == point.v).any()) continue;
        const std::optional<double> side = ledger->side_of(topology, frame, point.triangle, t);
        constexpr double along = 0.5;  // cosine
        const Vector3 front = area_normal(topology, frame.position, t);
        if (!side || -*side * front.dot(outwards) > along * front.norm()) return true;
    }
    return false;
}

void RimContacts::hold(const ThesisState& state, const Frame& frame, const LedgerResolution* ledger, EdgePoint point,
                       bool resting, Effect& effect) {
    const Topology& topology = *state.topology;
    Vector3 x = point.of(frame.position);
    Vector3 weights;
    follow_surface(topology, state.surface, frame, x, point.triangle, weights);
    const auto foot = [&] {
        return equations::point_at(corners_of(topology, frame.position, point.triangle), weights);
    };
    if (resting) {
        // The nearest point slides along the edge while it rests.
        const Vector3 edge = frame.position.col(point.v) - frame.position.col(point.u);
        const double size = edge.squaredNorm();
        if (size > 0.0) {
            point.way = std::clamp(edge.dot(foot() - frame.position.col(point.u)) / size, 0.0, 1.0);
            x = point.of(frame.position);
            follow_surface(topology, state.surface, frame, x, point.triangle, weights);
        }
    }
    const bool inside = state.surface.is_behind(topology, frame.position, point.triangle, weights, x);
    const double distance = (foot() - x).norm();
    if (resting ? inside || distance > state.resting_margin(point.u) : !inside) return;
    const Vector3 normal = state.surface.blended_normal(topology, frame.position, point.triangle, weights);
    // What a loose sheet rested with may have become flat since.
    const bool stays = resting && is_loose(state, point);
    if (!stays && !may_leave(state, frame, ledger, point, normal)) return;
    const double gap = inside ? -distance : normal.dot(x - foot());
    const LoadPoint on_edge{{point.u, point.v, -1}, {1.0 - point.way, point.way, 0.0}};
    HeldContacts::hold_points_apart(state, frame, point.body, LoadPoint::in_triangle(topology, point.triangle, weights),
                                    on_edge, normal, gap, effect);
    points_now_.push_back(point);
}

}  // namespace trocar
