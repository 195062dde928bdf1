#include "respond/ledger_resolution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// How fast a tear opens, of the tissue's wave speed: slower, tissue beside it stays stretched until it tears too;
/// faster, it flies.
constexpr double tear_speed = 1.0 / 6.0;

/// Cosine between a face and the normal it is pushed along below which the face's slope tells nothing.
constexpr double least_slope = 0.3;

/// Where the normal turns along the surface, the pressing force F acts sideways like a spring of stiffness F·turn; as
/// the normal stays for the tick, that spring lags by half of it and would feed energy in (a sampled spring needs a
/// damper above K T / 2, METHODS §11), which light vertices show first: on a sheet of 2.5 mm edges the triangle under a
/// dragged point swings from tick to tick. This is that damper with a margin; on flat surface it is nothing. A sample
/// that is fast enough to pass a good part of a triangle in a tick does not stay to swing: there the damper would only
/// drag the sheet along (a stab at 2 m/s was left 0.4 mm deep), so it fades.
///
/// `tilt` is the least turn of a normal that is a face's own: it tilts with the corners, which yield as the sample
/// slides between them, on flat surface too. That swing takes tens of ticks to grow, so the damper against it is for
/// samples that stand; one that goes on is on the next triangle before.
void steady(const ThesisState& state, const Frame& frame, const Penetration& p, const LinearContact& push, double tilt,
            Effect& effect) {
    constexpr double near = 0.05;  // of the margin
    if (state.settings.slip_damping == 0.0 || p.depth < -near * state.scale_of(p.tissue).margin) return;
    const Topology& topology = *state.topology;
    double pressing = 0.0;
    double turn = 0.0;
    double size = 0.0;
    for (int i = 0; i < 3; ++i) {
        const Index corner = topology.triangles(i, p.triangle);
        const Index next = topology.triangles((i + 1) % 3, p.triangle);
        const TissueEdit here{
            .vertex = corner, .position = frame.position.col(corner), .velocity = frame.velocity.col(corner)};
        if (!state.fixed(corner)) pressing += state.internal_force_on(frame, here).dot(p.normal);
        const Vector3 normal = p.side * state.surface.vertex_normal(topology, frame.position, corner);
        turn = std::max(turn, (normal - p.normal).norm());
        size = std::max(size, (frame.position.col(next) - frame.position.col(corner)).norm());
    }
    if (pressing <= 0.0 || size == 0.0) return;
    const double way = p.sample.of(frame.velocity).norm() * state.dt / size;  // in triangles a tick
    const auto share = [way](double slow, double fast) { return std::clamp((fast - way) / (fast - slow), 0.0, 1.0); };
    const double turned = std::max(share(0.15, 0.3) * turn, share(0.0002, 0.001) * tilt);
    if (turned == 0.0) return;
    LinearContact slide = push;
    slide.k = 0.0;
    slide.mu = state.settings.slip_damping * pressing * turned / size * state.dt;
    slide.gap = 0.0;
    slide.role = ContactRole::damper;
    const Vector3 first = p.normal.unitOrthogonal();
    for (const Vector3& axis : {first, Vector3(p.normal.cross(first))}) {
        slide.normal = axis;
        slide.face_velocity = p.sample.of(frame.velocity).dot(axis);
        effect.contacts.push_back(slide);
    }
}

/// A stiff contact that pushes the surface at `weights` of `triangle` back past the sample along -`normal`.
LinearContact against_sample(const ThesisState& state, const Frame& frame, const Penetration& p, Index triangle,
                             const Vector3& weights, const Vector3& normal, double depth) {
    LinearContact linear = state.hard_contact(depth);
    const LoadPoint point = LoadPoint::in_triangle(*state.topology, triangle, weights);
    linear.vertices = point.vertices;
    linear.weights = point.weights;
    linear.normal = -normal;
    state.rub(p.sample.key, p.sample.of(frame.velocity), linear);
    if (state.kind(p.sample.body) == BodyKind::instrument) {
        linear.reaction_body = p.sample.body;
        linear.reaction_point = p.sample.of(frame.position);
    } else if (state.kind(p.sample.body) == BodyKind::tissue) {
        linear.reaction_vertices = {p.sample.vertex, -1, -1};
        linear.reaction_weights = {1.0, 0.0, 0.0};
    }
    return linear;
}

/// anchor=blend: one contact, along the blended normal.
void push_anchor(const ThesisState& state, const Frame& frame, const Penetration& p, Effect& effect) {
    LinearContact linear = against_sample(state, frame, p, p.triangle, p.weights, p.normal, p.depth);
    // Where the face slopes against the blended normal, a tool that slides sideways needs the surface to follow:
    // n·v_surface = f·v/(f·n). The surface's own sideways speed stays out: it is the last tick's, and fed back through
    // the stiff damper it makes the contact swing from tick to tick.
    const double slope = p.face.dot(p.normal);
    const auto rate = [&](const Vector3& u) {
        return slope > least_slope ? -p.face.dot(u) / slope : u.dot(linear.normal);
    };
    state.end_on_time(p.sample.body, p.sample.of(frame.velocity), rate, linear);
    effect.contacts.push_back(linear);
    steady(state, frame, p, linear, 0.0, effect);
}

/// How much the normal of a face beside the nearest one counts where the surface bends away from the sample: all of it
/// where both are as near, nothing from a band of `widest` (m) on, so that the force turns while the sample slides
/// round an edge instead of jumping. `further` is how much further it is than the nearest (m); `across` leads from the
/// face's nearest point to that of the nearest face.
double share_round_edge(const equations::Corners& face, const Vector3& face_normal, const Vector3& nearest_normal,
                        const Vector3& across, double further, double widest) {
    constexpr double of_its_size = 0.25;  // or it would reach past the faces that share a corner
    constexpr double full_turn = 0.05;    // sine of the turn from which on it counts in full
    constexpr double crease = 0.5;        // cosine of 60 degrees: round a fold as sharp it is another side
    const double size = std::sqrt((face[1] - face[0]).cross(face[2] - face[0]).norm());
    const double band = std::min(widest, of_its_size * size);
    if (further >= band || size == 0.0) return 0.0;
    const auto smooth = [](double s) {
        s = std::clamp(s, 0.0, 1.0);
        return s * s * (3.0 - 2.0 * s);
    };
    constexpr double of_widest = 2e-6;
    const double rounding = of_widest * widest;
    const double length = across.norm();
    // Feet on a common edge or corner lie as far apart as rounding has it: that tells no direction.
    const double turn = length > rounding ? -face_normal.dot(across) / length : 0.0;
    const double level = (face_normal.dot(nearest_normal) - crease) / (1.0 - crease);
    return smooth(1.0 - further / band) * smooth(length / rounding - 1.0) * smooth(turn / full_turn) *
           smooth(4.0 * level);
}

/// Where a sample and the surface are nearest.
struct Foot {
    Vector3 from = Vector3::Zero();  ///< the sample's place
    Index triangle = -1;
    Vector3 weights = Vector3::Zero();
    Vector3 point = Vector3::Zero();
    double distance = 0.0;  ///< m
    bool at_start = false;  ///< of the tick, where a script's body comes from, and not at its end
};

/// At the tick's end a sample that leaves a pocket is nearest to its walls, and until the tissue has followed it is in
/// the bottom of the pocket: it is there that it has to be held.
Foot foot_of(const ThesisState& state, const Frame& frame, const Penetration& p) {
    const Vector3 here = p.sample.of(frame.position);
    const auto foot_from = [&](const Vector3& x, Index triangle, Vector3 weights) {
        follow_surface(*state.topology, state.surface, frame, x, triangle, weights);
        const Vector3 point = equations::point_at(corners_of(*state.topology, frame.position, triangle), weights);
        return Foot{x, triangle, weights, point, (point - x).norm()};
    };
    Foot end = foot_from(here, p.triangle, p.weights);
    const Vector3 way = (p.sample.of(frame.velocity) - state.hand_velocity(p.sample.body)) * state.dt;
    if (p.crossed != 0 || way.isZero()) return end;
    Foot start = foot_from(here - way, end.triangle, end.weights);
    constexpr double mostly = 0.5;  // of the way leads away from the surface: else the sample slides along it
    start.at_start = end.distance - start.distance > mostly * way.norm();
    return start.at_start ? start : end;
}

/// anchor=faces: what hard contact does between a point and a mesh. The face nearest to the sample is pushed along its
/// own normal, and so is every face around it that rises towards the sample and comes within its reach in this tick: in
/// the pocket that a point makes, the sample touches several at once, and the walls take it along when it goes
/// sideways. Where the surface bends away from the sample, the normal turns over a narrow band along the edge.
void push_faces(const ThesisState& state, const Frame& frame, const Penetration& p, Effect& effect) {
    const Topology& topology = *state.topology;
    const Vector3 velocity = p.sample.of(frame.velocity);
    const Foot foot = foot_of(state, frame, p);
    const Vector3& x = foot.from;
    const Index home = foot.triangle;
    const auto at_its_time = [&](const auto& rate, LinearContact& linear) {
        if (foot.at_start) {
            linear.face_velocity = rate(velocity);
            state.clear_slowly(linear);
        } else {
            state.end_on_time(p.sample.body, velocity, rate, linear);
        }
        effect.contacts.push_back(linear);
    };
    const auto centre = [](const equations::Corners& c) { return Vector3((c[0] + c[1] + c[2]) / 3.0); };
    const double near = 0.25 * state.scale_of(p.tissue).margin;
    const equations::Corners corners = corners_of(topology, frame.position, home);
    const Vector3 face = p.side * equations::unit_normal(corners);
    Vector3 normal = face;
    const auto has = [&](Index triangle, Index vertex) {
        return (topology.triangles.col(triangle).array() == vertex).any();
    };
    for (int i = 0; i < 3; ++i) {
        for (const Index t : state.surface.triangles_at(topology.triangles(i, home))) {
            // Each once: not those that an earlier corner has seen.
            if (t == home || (i > 0 && has(t, topology.triangles(0, home))) ||
                (i > 1 && has(t, topology.triangles(1, home))))
                continue;
            const equations::Corners other = corners_of(topology, frame.position, t);
            const Vector3 other_normal = p.side * equations::unit_normal(other);
            const Vector3 w = closest_point_on_triangle(other, x);
            const Vector3 other_foot = equations::point_at(other, w);
            const double distance = (other_foot - x).norm();
            normal +=
                share_round_edge(other, other_normal, face, foot.point - other_foot, distance - foot.distance, near) *
                other_normal;
            const Vector3& shared = corners[at(i)];
            // Faces in one plane, to rounding, are one wall.
            const auto rises = [&shared](const Vector3& from, const Vector3& to) {
                constexpr double flat = 1e-6;  // sine
                return from.dot(to - shared) > flat * (to - shared).norm();
            };
            if (!rises(other_normal, centre(corners)) || !rises(face, centre(other))) continue;
            Vector3 approach = velocity;
            for (int k = 0; k < 3; ++k) approach -= w[k] * frame.velocity.col(topology.triangles(k, t));
            const double reach = near + 2.0 * approach.norm() * state.dt;
            double depth = other_normal.dot(other[0] - x);
            // From `reach` on it counts less and less: it must not come in with a jump.
            const double beyond = (distance - reach - std::max(0.0, p.depth)) / (0.5 * near);
            if (beyond >= 1.0 || depth < -near - reach) continue;
            depth -= std::max(0.0, beyond) * std::max(0.0, depth);
            LinearContact wall = against_sample(state, frame, p, t, w, other_normal, depth);
            at_its_time([&](const Vector3& u) { return u.dot(wall.normal); }, wall);
        }
    }
    normal.normalize();
    const double slope = std::max(face.dot(normal), least_slope);
    LinearContact linear =
        against_sample(state, frame, p, home, foot.weights, normal, face.dot(foot.point - x) / slope);
    at_its_time([&](const Vector3& u) { return -face.dot(u) / slope; }, linear);
    constexpr double tilt = 0.5;  // 1, with a margin of 3 on F/height, the height of a triangle of edges `size`
    steady(state, frame, p, linear, tilt, effect);
}

/// A sample off the surface, beside an edge of it: the surface stands in its way across the shortest line between them,
/// and nowhere else. Over a face that is the face's own plane: false, nothing is pushed.
bool push_beside(const ThesisState& state, const Frame& frame, const Penetration& p, Effect& effect) {
    constexpr double rounding = 1e-9;  // m
    constexpr double over = 0.999;     // cosine
    const Vector3 x = p.sample.of(frame.position);
    Index triangle = p.triangle;
    Vector3 weights = p.weights;
    follow_surface(*state.topology, state.surface, frame, x, triangle, weights);
    const equations::Corners corners = corners_of(*state.topology, frame.position, triangle);
    const Vector3 way = x - equations::point_at(corners, weights);
    const double gap = way.norm();
    if (gap <= rounding || p.side * equations::unit_normal(corners).dot(way) >= over * gap) return false;
    LinearContact linear = against_sample(state, frame, p, triangle, weights, way / gap, -gap);
    const auto rate = [&](const Vector3& u) { return u.dot(linear.normal); };
    state.end_on_time(p.sample.body, p.sample.of(frame.velocity), rate, linear);
    effect.contacts.push_back(linear);
    return true;
}

bool follows_any(const ThesisState& state, const Penetration& p) {
    for (int i = 0; i < 3; ++i) {
        if (state.follows(state.topology->triangles(i, p.triangle), p.sample.body)) return true;
    }
    return false;
}

double strain_at(const ThesisState& state, const Frame& frame, Index triangle) {
    double largest = 0.0;
    for (int i = 0; i < 3; ++i) {
        const Index vertex = state.topology->triangles(i, triangle);
        largest = std::max(largest, state.springs.largest_strain(*state.materials, frame.position, vertex));
    }
    return largest;
}

bool cannot_move(const ThesisState& state, Index triangle) {
    const auto corner = state.topology->triangles.col(triangle);
    return state.fixed(corner[0]) && state.fixed(corner[1]) && state.fixed(corner[2]);
}

/// The deepest of the layers that face the same way as this normal of the surface, else of all: the walls of a fold
/// face each other. Null where there is none.
const Penetration* deepest_of(std::span<const Penetration> layers, const Vector3& outwards) {
    const Penetration* deepest = nullptr;
    bool agrees = false;
    for (const Penetration& layer : layers) {
        const bool faces_it = layer.side * layer.face.dot(outwards) > 0.0;
        if (deepest != nullptr && (faces_it != agrees ? agrees : layer.depth <= deepest->depth)) continue;
        deepest = &layer;
        agrees = faces_it;
    }
    return deepest;
}

}  // namespace

void LedgerResolution::prepare(const ThesisState& state) {
    const Topology& topology = *state.topology;
    ledger_.prepare(topology, state.scale, state.settings.edge_samples);
    approaching_tissue_.prepare(state);
    approaching_.clear();
    faces_.assign(topology.bodies.size(), 1);
    for (const auto& [a, b] : topology.body_pairs) {
        if (topology.bodies[at(a)].kind != BodyKind::tissue || topology.bodies[at(b)].kind != BodyKind::tissue)
            continue;
        faces_[at(a)] = faces_[at(b)] = 0;
    }
}

void LedgerResolution::respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts,
                               const SqueezedTissue& squeezed, const TornTissue& torn, Effect& effect) {
    const std::int64_t repairs = ledger_.repairs();
    ledger_.update(*state.topology, state.surface, frame, contacts);
    effect.repairs = ledger_.repairs() - repairs;
    for (Penetration& p : ledger_.penetrations()) {
        if (follows_any(state, p)) continue;
        if (p.ruptured) {
            p.opening += tear_speed * state.scale_of(p.tissue).wave_speed * state.dt;
        } else if (gives_up(state, frame, squeezed, torn, p)) {
            p.ruptured = true;
            p.opening = std::max(p.depth, 0.0);
            ++effect.ruptures;
        }
        if (p.opening > state.deepest(p.tissue)) continue;
        const std::size_t before = effect.contacts.size();
        push(state, frame, p, effect);
        for (std::size_t c = before; c < effect.contacts.size(); ++c) effect.contacts[c].gap += p.opening;
    }
}

void LedgerResolution::push(const ThesisState& state, const Frame& frame, const Penetration& p, Effect& effect) const {
    if (faces_[at(p.tissue)] != 0 && state.settings.anchor_faces) {
        push_faces(state, frame, p, effect);
    } else {
        push_anchor(state, frame, p, effect);
    }
}

/// Walls beyond whose planes a point of a tool lies before it has crossed anything stand elsewhere: they would throw
/// folded tissue about.
void LedgerResolution::keep_apart(const ThesisState& state, const Frame& frame, VelocityChanges& changes,
                                  Effect& effect) {
    approaching_tissue_.find(state, frame, effect, changes, ledger_, approaching_);
    for (const Penetration& p : approaching_) {
        if (follows_any(state, p)) continue;
        const bool by_tissue = state.kind(p.sample.body) == BodyKind::tissue;
        if (!by_tissue && push_beside(state, frame, p, effect)) continue;
        const auto before = static_cast<std::ptrdiff_t>(effect.contacts.size());
        push(state, frame, p, effect);
        if (by_tissue) continue;
        const auto elsewhere = std::remove_if(effect.contacts.begin() + before, effect.contacts.end(),
                                              [](const LinearContact& contact) { return contact.gap < 0.0; });
        effect.contacts.erase(elsewhere, effect.contacts.end());
    }
}

std::optional<double> LedgerResolution::side_of(const Topology& topology, const Frame& frame, Index triangle,
                                                Index tissue_face) const {
    const Index tissue = topology.body_of_triangle[at(tissue_face)];
    const Vector3 outwards = area_normal(topology, frame.position, tissue_face);
    std::optional<double> side;
    const auto corner = topology.triangles.col(triangle);
    for (int i = 0; i < 3; ++i) {
        for (const auto& layers :
             {ledger_.layers(corner[i], tissue), ledger_.layers_on_edge(corner[i], corner[(i + 1) % 3], tissue)}) {
            const Penetration* p = deepest_of(layers, outwards);
            if (p == nullptr) continue;
            if (p->ruptured) return 0.0;
            side = p->side;
        }
    }
    return side;
}

/// Rupture: too deep, too old, in torn tissue, pressed for tear_time by tissue around the anchor that is stretched as
/// far as it can be (its strain limiter holds what the way out would stretch further), or not getting better with
/// tissue that is squeezed, close to its strain limit or held wherever it is.
bool LedgerResolution::gives_up(const ThesisState& state, const Frame& frame, const SqueezedTissue& squeezed,
                                const TornTissue& torn, Penetration& p) {
    const double clear = state.clear_depth(p.tissue);
    constexpr double longest_age = 2.0;  // s
    constexpr double stalled = 20.0;     // times the tissue's patience
    if (p.depth > state.deepest(p.tissue)) return true;
    const double stretched = strain_at(state, frame, p.triangle) / state.materials->strain_limit;
    constexpr double touching = -0.1;  // of what counts as clear
    constexpr double at_limit = 0.999;
    p.stretched = p.depth > touching * clear && stretched > at_limit ? p.stretched + 1 : 0;
    if (static_cast<double>(p.stretched) * state.dt > state.tear_time(p.tissue)) return true;
    if (p.depth <= clear) {
        p.age = 0;
        p.stalled = 0;
        p.least_depth = std::numeric_limits<double>::infinity();
        return false;
    }
    if (static_cast<double>(p.age) * state.dt > longest_age || torn.holds(*state.topology, p.triangle)) return true;
    // Against the least depth so far, and not the last tick's: tissue at its limit swings a little.
    if (p.depth < p.least_depth * (1.0 - 1e-3)) {
        p.least_depth = p.depth;
        p.stalled = 0;
    } else if (squeezed.holds(*state.topology, p.triangle) || stretched > 0.95 || cannot_move(state, p.triangle)) {
        ++p.stalled;
    }
    return static_cast<double>(p.stalled) * state.dt > stalled * state.patience(p.tissue);
}

}  // namespace trocar
