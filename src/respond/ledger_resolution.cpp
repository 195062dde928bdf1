#include "respond/ledger_resolution.hpp"

#include <algorithm>
#include <limits>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Where the normal turns along the surface, the pressing force F acts sideways like a spring of stiffness F·turn; as
/// the normal stays for the tick, that spring lags by half of it and would feed energy in (a sampled spring needs a
/// damper above K T / 2, METHODS §11). This is that damper with a margin; on flat surface it is nothing.
void steady(const ThesisState& state, const Frame& frame, const Penetration& p, const LinearContact& push,
            Effect& effect) {
    constexpr double near = 1e-4;  // m
    if (state.settings.slip_damping == 0.0 || p.depth < -near) return;
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
    if (pressing <= 0.0 || turn == 0.0 || size == 0.0) return;
    LinearContact slide = push;
    slide.k = 0.0;
    slide.mu = state.settings.slip_damping * pressing * turn / size * state.dt;
    slide.gap = 0.0;
    slide.bilateral = true;
    const Vector3 first = p.normal.unitOrthogonal();
    for (const Vector3& axis : {first, Vector3(p.normal.cross(first))}) {
        slide.normal = axis;
        slide.face_velocity = frame.velocity.col(p.vertex).dot(axis);
        effect.contacts.push_back(slide);
    }
}

void push_anchor(const ThesisState& state, const Frame& frame, const Penetration& p, Effect& effect) {
    LinearContact linear = state.hard_contact(p.depth);
    const LoadPoint anchor = LoadPoint::in_triangle(*state.topology, p.triangle, p.weights);
    linear.vertices = anchor.vertices;
    linear.weights = anchor.weights;
    linear.normal = -p.normal;
    const Vector3 velocity = frame.velocity.col(p.vertex);
    state.rub(p.vertex, velocity, linear);
    // Where the face slopes against the blended normal, a tool that slides sideways needs the surface to follow:
    // n·v_surface = f·v/(f·n). The surface's own sideways speed stays out: it is the last tick's, and fed back through
    // the stiff damper it makes the contact swing from tick to tick.
    const double slope = p.face.dot(p.normal);
    constexpr double least_slope = 0.3;
    const auto rate = [&](const Vector3& u) {
        return slope > least_slope ? -p.face.dot(u) / slope : u.dot(linear.normal);
    };
    state.end_on_time(p.body, velocity, rate, linear);
    if (state.kind(p.body) == BodyKind::instrument) {
        linear.reaction_body = p.body;
        linear.reaction_point = frame.position.col(p.vertex);
    } else if (state.kind(p.body) == BodyKind::tissue) {
        linear.reaction_vertices = {p.vertex, -1, -1};
        linear.reaction_weights = {1.0, 0.0, 0.0};
    }
    effect.contacts.push_back(linear);
    steady(state, frame, p, linear, effect);
}

bool follows_any(const ThesisState& state, const Penetration& p) {
    for (int i = 0; i < 3; ++i) {
        if (state.follows(state.topology->triangles(i, p.triangle), p.body)) return true;
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

}  // namespace

void LedgerResolution::prepare(const Topology& topology) {
    ledger_.prepare(topology);
    inside_.assign(at(topology.vertex_count), 0);
}

void LedgerResolution::respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts,
                               const SqueezedTissue& squeezed, Effect& effect) {
    for (const Penetration& p : ledger_.penetrations()) inside_[at(p.vertex)] = 0;
    ledger_.update(*state.topology, state.surface, frame, contacts);
    for (Penetration& p : ledger_.penetrations()) {
        inside_[at(p.vertex)] = 1;
        if (p.ruptured || follows_any(state, p)) continue;
        if (gives_up(state, frame, squeezed, p)) {
            p.ruptured = true;
            ++effect.ruptures;
            continue;
        }
        push_anchor(state, frame, p, effect);
    }
}

bool LedgerResolution::knows_corner(const Topology& topology, Index triangle) const {
    const auto corner = topology.triangles.col(triangle);
    return inside_[at(corner[0])] != 0 || inside_[at(corner[1])] != 0 || inside_[at(corner[2])] != 0;
}

/// Rupture: too deep, too old, or not getting better although the tissue around the anchor is at its strain limit
/// or squeezed.
bool LedgerResolution::gives_up(const ThesisState& state, const Frame& frame, const SqueezedTissue& squeezed,
                                Penetration& p) {
    constexpr double clear = 1e-4;       // m
    constexpr double longest_age = 2.0;  // s
    constexpr double stall_time = 0.1;   // s
    if (p.depth > state.settings.d_max) return true;
    if (p.depth <= clear) {
        p.age = 0;
        p.stalled = 0;
        p.least_depth = std::numeric_limits<double>::infinity();
        return false;
    }
    if (static_cast<double>(p.age) * state.dt > longest_age) return true;
    // Against the least depth so far, and not the last tick's: tissue at its limit swings a little.
    if (p.depth < p.least_depth * (1.0 - 1e-3)) {
        p.least_depth = p.depth;
        p.stalled = 0;
    } else if (squeezed.holds(*state.topology, p.triangle) ||
               strain_at(state, frame, p.triangle) > 0.95 * state.materials->strain_limit) {
        ++p.stalled;
    }
    return static_cast<double>(p.stalled) * state.dt > stall_time;
}

}  // namespace trocar
