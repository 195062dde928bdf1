// The response of the thesis: equations 3.4-3.17 as METHODS §5-§10 makes them executable. Profile `faithful` keeps the
// printed equations with the damper sign of 3.6 put right, one response per triangle pair in sorted order; `printed`
// keeps that sign too; `corrected` turns on our corrections, each of which is a parameter of its own.
//
// Where to look, by equation or section of METHODS, with the parameters that act there:
//   3.4        press_non_deformable   closest_point, normal, distribute, clamp, tip_proxy
//   3.4, 3.5   rigid_contacts         rigid=patch, rigid=hold
//   3.5, 3.9   respond_to_edges       edges, distribute, clamp; projection=hold -> held_contacts
//   3.6        press_tissue_face      profile=printed, stiffness, kappa, closest_point, normal, clamp
//   3.7-3.11   project                path, e, reaction; projection=hold -> held_contacts
//   3.12-3.17  tissue_contacts        tissue_tissue, e_tissue
//   §3.4.5     back_projection        resolution=back_projection, n_back, l_max
//   §5         contact_reduction      reduction
//   §9.2       ledger_resolution      resolution=ledger, samples, anchor, settle_time, clear_speed, slip_damping
//              rupture, torn_tissue   tear_time, d_max
//   §9.2       approaching_tissue     resolution=ledger: tissue about to meet tissue; approach: or a tool's point
//   §9.2       approaching_faces      approach: tissue about to meet a face of a tool or bone
//   §9.2       squeezed_tissue        squeeze
//   §9.2       rim_contacts           projection=hold with reduction=vertex: rims and folds of tissue
//   §10        grasp                  grasp, grasp_k, grasp_slip, jaw_length, release_time
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/approaching_faces.hpp"
#include "respond/back_projection.hpp"
#include "respond/contact_reduction.hpp"
#include "respond/equations.hpp"
#include "respond/held_contacts.hpp"
#include "respond/ledger_resolution.hpp"
#include "respond/rigid_contacts.hpp"
#include "respond/rim_contacts.hpp"
#include "respond/squeezed_tissue.hpp"
#include "respond/thesis_settings.hpp"
#include "respond/thesis_state.hpp"
#include "respond/tip_proxy.hpp"
#include "respond/tissue_contacts.hpp"
#include "respond/torn_tissue.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

class Thesis final : public Response {
public:
    explicit Thesis(const ThesisSettings& settings) : state_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        state_.prepare(topology, materials);
        topology_ = &topology;
        materials_ = &materials;
        reduction_.prepare(topology);
        held_.prepare();
        rims_.prepare(state_);
        faces_ahead_.prepare(state_);
        changes_.prepare(state_);
        squeezed_.prepare(topology);
        torn_.prepare(topology);
        rigid_.prepare(topology);
        proxies_.prepare(topology, materials, TipProxies::default_radius);
        if (state_.has_tissue && settings().resolution == Resolution::ledger) ledger_.prepare(state_);
        back_projection_.prepare(topology);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, std::span<const ContactLoad> /*loads*/,
                 Effect& effect) override {
        effect.clear();
        effect.contacts_held = settings().contacts_held;
        effect.contacts_explicit = settings().contacts_explicit;
        state_.begin(frame, dt);
        if (state_.grasps()) hold_grasped(frame, contacts, effect);
        if (by_ledger()) ledger_.respond(state_, frame, contacts, squeezed_, torn_, effect);
        if (settings().tip_proxy) respond_to_tips(frame, effect);
        for (const Contact& contact : contacts.contacts) respond_to(frame, contact, effect);
        if (settings().reduce) respond_to_reduced(frame, effect);
        const auto beside_tip = [&](Index body_a, Index body_b, const Vector3& place) {
            return settings().tip_proxy && kind(body_b) == BodyKind::rigid ? proxies_.share_left(body_a, place) : 1.0;
        };
        rigid_.respond(state_, frame, beside_tip, effect);
        if (state_.has_tissue && settings().constrain) {
            rims_.respond(state_, frame, by_ledger() ? &ledger_ : nullptr, effect);
            held_.keep_resting(state_, frame, effect);
        }
        if (by_ledger()) {
            changes_.begin_tick(state_, frame);
            faces_ahead_.respond(state_, frame, changes_, held_, effect);
            ledger_.keep_apart(state_, frame, changes_, effect);
        }
        if (state_.has_tissue && settings().share_squeeze) squeezed_.share(state_, contacts, effect);
        if (state_.has_tissue && settings().constrain) torn_.judge(state_, frame, effect);
        if (state_.has_tissue && settings().resolution == Resolution::back_projection) {
            back_projection_.respond(state_, frame, effect);
        }
        for (const TissueEdit& edit : state_.edits()) {
            effect.placements.push_back({edit.vertex, edit.position, edit.velocity, edit.held});
        }
        add_reactions(frame, effect);
        if (state_.grasps()) state_.grasp.remember(frame);
    }

private:
    [[nodiscard]] const ThesisSettings& settings() const { return state_.settings; }
    [[nodiscard]] bool by_ledger() const { return state_.has_tissue && settings().resolution == Resolution::ledger; }
    [[nodiscard]] BodyKind kind(Index body) const { return state_.kind(body); }
    [[nodiscard]] Vector3 velocity(const Frame& frame, Index vertex) const { return state_.velocity(frame, vertex); }

    /// Speed of a face's loaded point, or of the vertex that the printed equations take.
    [[nodiscard]] Vector3 face_velocity(const Frame& frame, const VertexInFace& v) const {
        if (!settings().closest_point) return velocity(frame, v.nearest);
        Vector3 sum = Vector3::Zero();
        for (int i = 0; i < 3; ++i) sum += v.weights[i] * velocity(frame, topology_->triangles(i, v.triangle));
        return sum;
    }
    [[nodiscard]] LoadPoint face_load(const VertexInFace& v) const {
        return settings().distribute ? LoadPoint::in_triangle(*topology_, v.triangle, v.weights)
                                     : LoadPoint::at_vertex(v.nearest);
    }

    // ------------------------------------------------------------ one contact
    /// True where tissue, the second body, is held outside a closed tool or bone.
    [[nodiscard]] bool is_held_outside(const Contact& contact) const {
        const Index body_a = topology_->body_of_triangle[at(contact.a)];
        const Index body_b = topology_->body_of_triangle[at(contact.b)];
        return settings().reduce && settings().constrain && topology_->bodies[at(body_a)].closed &&
               kind(body_a) != BodyKind::tissue && kind(body_b) == BodyKind::tissue;
    }
    void respond_to(const Frame& frame, const Contact& contact, Effect& effect) {
        const bool acts = contact.kind == ContactCase::a_enters_b || contact.kind == ContactCase::b_enters_a ||
                          contact.kind == ContactCase::edges_cross;
        // An edge that lies inside a tool stays there while the triangle beside it collapses.
        if (contact.kind == ContactCase::degenerate && contact.a >= 0 && contact.b >= 0 && is_held_outside(contact) &&
            state_.surface.rim_edges(contact.a) == 0) {
            rims_.collect(state_, frame, contact);
        }
        if (!acts || contact.a < 0 || contact.b < 0 || contact.vertex_a < 0 || contact.vertex_b < 0) {
            ++effect.skipped;
            return;
        }
        const Index body_a = topology_->body_of_triangle[at(contact.a)];
        const Index body_b = topology_->body_of_triangle[at(contact.b)];
        const CollisionClass pair_class = state_.laws.kind(body_a, body_b);
        const bool edges = contact.kind == ContactCase::edges_cross;
        if (pair_class == CollisionClass::none ||
            (pair_class == CollisionClass::rigid_tissue && !settings().all_rigid_cases &&
             contact.kind != ContactCase::b_enters_a)) {
            ++effect.skipped;
            return;
        }
        if (pair_class == CollisionClass::tissue_tissue && !settings().impulse_tissue) {
            exchange(state_, frame, contact);
            return;
        }
        if (rigid_.takes(state_, body_a, body_b)) {
            rigid_.add(state_, frame, contact);
            return;
        }
        const bool held_outside = is_held_outside(contact);
        if (held_outside && state_.surface.rim_edges(contact.a) == 0) {
            reduction_.keep_corners(*topology_, state_.surface, frame, contact);
            rims_.collect(state_, frame, contact);
        }
        if (edges) {
            if (settings().reduce) {
                reduction_.keep_edges(*topology_, frame, contact);
            } else {
                respond_to_edges(frame, contact, effect);
            }
            return;
        }
        const bool b_enters = contact.kind == ContactCase::b_enters_a;
        if (b_enters && held_outside) reduction_.keep_pierced(*topology_, frame, contact);
        const Index entering = b_enters ? contact.b : contact.a;
        const Index face = b_enters ? contact.a : contact.b;
        const Index deepest = b_enters ? contact.vertex_b : contact.vertex_a;
        VertexInFace v;
        v.vertex_body = b_enters ? body_b : body_a;
        v.face_body = b_enters ? body_a : body_b;
        v.triangle = face;
        const Vector3 face_normal = b_enters ? contact.normal : Vector3(-contact.normal);
        const equations::Corners corners = corners_of(*topology_, frame.position, face);
        for (int i = 0; i < 3; ++i) {
            v.vertex = topology_->triangles(i, entering);
            // The printed equations take the deepest vertex; the corrected ones every vertex that lies below the face.
            if (v.vertex != deepest && !settings().reduce) continue;
            const Vector3 x = frame.position.col(v.vertex);
            v.depth = v.vertex == deepest ? contact.depth : -face_normal.dot(x - corners[0]);
            v.weights = closest_point_on_triangle(corners, x);
            const Vector3 foot = equations::point_at(corners, v.weights);
            v.distance = (x - foot).norm();
            if (v.vertex != deepest && (v.depth <= 0.0 || v.distance > 1.0001 * v.depth)) continue;
            if (settings().closest_point) v.depth = std::min(v.depth, v.distance);
            v.nearest = v.vertex == deepest ? (b_enters ? contact.vertex_a : contact.vertex_b)
                                            : topology_->triangles(equations::nearest_corner(corners, x), face);
            v.normal = settings().blended_normal
                           ? state_.surface.blended_normal(*topology_, frame.position, face, v.weights)
                           : face_normal;
            if (settings().reduce) {
                reduction_.keep(v);
            } else {
                respond_to_vertex(frame, v, effect);
            }
        }
    }

    void respond_to_reduced(const Frame& frame, Effect& effect) {
        for (const VertexInFace& v : reduction_.faces()) respond_to_vertex(frame, v, effect);
        for (const EdgePair& pair : reduction_.edges()) {
            respond_to_edges(frame, pair.contact, effect, ContactReduction::names_edges(pair) ? &pair : nullptr);
        }
        reduction_.clear();
    }

    // ------------------------------------------------------------ laws
    /// Eq. 3.4, 3.6, 3.7-3.8, 3.10-3.11: who is tissue decides which.
    void respond_to_vertex(const Frame& frame, const VertexInFace& v, Effect& effect) {
        const bool vertex_tissue = kind(v.vertex_body) == BodyKind::tissue;
        const bool face_tissue = kind(v.face_body) == BodyKind::tissue;
        if (vertex_tissue && state_.follows(v.vertex, v.face_body)) return;
        if (face_tissue && state_.follows(v.nearest, v.vertex_body)) return;
        if (vertex_tissue && face_tissue) {
            // As in press_tissue_face, where the other tissue is an open sheet.
            if (settings().resolution == Resolution::ledger && !topology_->bodies[at(v.face_body)].closed) return;
            bounce(state_, frame, v.normal, LoadPoint::at_vertex(v.vertex),
                   LoadPoint::in_triangle(*topology_, v.triangle, v.weights), v.depth,
                   state_.stiffness(v.face_body, v.vertex_body, materials_->mean_stiffness[at(v.vertex)], v.vertex),
                   effect);
        } else if (vertex_tissue) {
            if (by_ledger() && is_beside_an_open_face(frame, v)) return;
            const bool fixed = state_.fixed(v.vertex);
            if (fixed) ++effect.skipped;
            if (settings().constrain) {
                held_.hold_nearest(state_, frame, v, effect);
            } else if (!fixed) {
                project(frame, v, effect);
            }
        } else if (face_tissue) {
            press_tissue_face(frame, v, effect);
        } else {
            press_non_deformable(frame, v, effect);
        }
    }

    /// Half of all points are below a face of an open body, which has no inside. The face presses on those only that it
    /// pushes to where they belong, away from the face's own side of the tissue; past what stands across the tissue's
    /// surface the vertex lies beside it.
    [[nodiscard]] bool is_beside_an_open_face(const Frame& frame, const VertexInFace& v) const {
        if (topology_->bodies[at(v.face_body)].closed) return false;
        Vector3 front = Vector3::Zero();
        const std::span<const Index> faces = state_.surface.triangles_at(v.vertex);
        for (const Index t : faces) front += area_normal(*topology_, frame.position, t);
        const auto side = faces.empty() ? std::nullopt : ledger_.side_of(*topology_, frame, v.triangle, faces.front());
        constexpr double towards = 0.5;  // cosine
        const double along = front.dot(v.normal);
        return (side ? -*side * along : std::abs(along)) < towards * front.norm();
    }

    /// Eq. 3.4 (§3.4.1, §3.4.2): the vertex is pushed out along the face's normal, the face the other way; a rigid body
    /// is static and takes nothing.
    void press_non_deformable(const Frame& frame, const VertexInFace& v, Effect& effect) const {
        const bool push_vertex = kind(v.vertex_body) == BodyKind::instrument;
        const LoadPoint face = face_load(v);
        LinearContact linear;
        linear.k = state_.stiffness(v.face_body, v.vertex_body, 0.0, v.vertex);
        linear.mu = state_.laws.mu(v.face_body, v.vertex_body);
        linear.gap = -v.depth;
        linear.normal = push_vertex ? v.normal : Vector3(-v.normal);
        const LoadPoint pushed = push_vertex ? LoadPoint::at_vertex(v.vertex) : face;
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        const Vector3 other = push_vertex ? face_velocity(frame, v) : Vector3(frame.velocity.col(v.vertex));
        linear.face_velocity = other.dot(linear.normal);
        if (push_vertex && kind(v.face_body) == BodyKind::instrument) {
            linear.reaction_body = v.face_body;
            linear.reaction_point = face.blend(frame.position);
        }
        const bool vertex_first = kind(v.vertex_body) <= kind(v.face_body);
        const Vector3 place = vertex_first ? Vector3(frame.position.col(v.vertex)) : face.blend(frame.position);
        const bool bone = kind(v.vertex_body) == BodyKind::rigid || kind(v.face_body) == BodyKind::rigid;
        finish_rigid(frame, bone ? std::min(v.vertex_body, v.face_body) : -1, place, linear, effect);
    }
    /// Of an instrument's contact with bone (-1: other contacts), what is at its tip is the proxy's.
    void finish_rigid(const Frame& frame, Index instrument, const Vector3& place, LinearContact linear,
                      Effect& effect) const {
        const double share = settings().tip_proxy && instrument >= 0 ? proxies_.share_left(instrument, place) : 1.0;
        if (share == 0.0) return;
        linear.k *= share;
        linear.mu *= share;
        state_.finish(frame, linear, effect);
    }
    /// GHOST's part (§3.4.2): the tips against bone.
    void respond_to_tips(const Frame& frame, Effect& effect) {
        const std::size_t before = effect.contacts.size();
        proxies_.respond(*topology_, *materials_, state_.laws, frame, effect);
        for (std::size_t c = before; c < effect.contacts.size(); ++c) {
            const Index body = topology_->body_of_vertex(effect.contacts[c].vertices[0]);
            const Index bone = proxies_.rigid_of(body);
            if (rigid_.takes(state_, body, bone)) {
                rigid_.give_law(state_, frame, body, bone, 1.0, effect.contacts[c]);
            } else {
                tell_at_start(*topology_, frame, state_.dt, effect.contacts[c]);
            }
        }
    }

    /// Eq. 3.6 (§3.4.3): the instrument's vertex A1 is below a tissue face, whose force is the opposite of 3.6's. In
    /// `corrected` also a bone's vertex, which takes no reaction.
    void press_tissue_face(const Frame& frame, const VertexInFace& v, Effect& effect) const {
        // The ledger knows exactly on which side the vertex is, also of an open sheet that it touches from behind,
        // where below the face is the right side.
        if (settings().resolution == Resolution::ledger) return;
        LinearContact linear;
        linear.k = state_.stiffness(v.vertex_body, v.face_body, materials_->mean_stiffness[at(v.nearest)], v.vertex);
        // Literal 3.6: F on A1 = (k d - mu (V2 - V1)·n2) n2, which as a damper on the tissue is -mu.
        linear.mu = (settings().printed_damper ? -1.0 : 1.0) * state_.laws.mu(v.vertex_body, v.face_body);
        linear.gap = -v.depth;
        linear.normal = -v.normal;
        const LoadPoint face = face_load(v);
        linear.vertices = face.vertices;
        linear.weights = face.weights;
        linear.face_velocity = frame.velocity.col(v.vertex).dot(linear.normal);
        state_.rub(v.vertex, frame.velocity.col(v.vertex), linear);
        if (kind(v.vertex_body) == BodyKind::instrument) {
            linear.reaction_body = v.vertex_body;
            linear.reaction_point = frame.position.col(v.vertex);
        }
        state_.finish(frame, linear, effect);
    }

    /// Eq. 3.5, 3.9 (§3.4.1-3.4.3): edges that cross.
    void respond_to_edges(const Frame& frame, const Contact& contact, Effect& effect, const EdgePair* pair = nullptr) {
        const Index body_a = topology_->body_of_triangle[at(contact.a)];
        const Index body_b = topology_->body_of_triangle[at(contact.b)];
        const bool tissue_a = kind(body_a) == BodyKind::tissue;
        const bool tissue_b = kind(body_b) == BodyKind::tissue;
        if (tissue_b && state_.follows(contact.vertex_b, body_a)) return;
        const bool by_history = !tissue_a && tissue_b && settings().resolution == Resolution::ledger;
        const auto side = by_history ? ledger_.side_of(*topology_, frame, contact.a, contact.b) : std::nullopt;
        if (side && (*side == 0.0 || pair == nullptr || !settings().constrain)) return;
        const Vector3 direction = settings().edge_normal ? contact.normal : contact.interval_direction;
        const double depth = settings().edge_normal ? contact.depth : contact.interval_length;
        const LoadPoint a = edge_load(frame, contact.a, contact.vertex_a, contact.point);
        const LoadPoint b = edge_load(frame, contact.b, contact.vertex_b, contact.point);
        const double on_tissue = tissue_b ? materials_->triangle_stiffness[at(contact.b)] : 0.0;
        const double k = state_.stiffness(body_a, body_b, on_tissue, contact.vertex_b);
        if (tissue_a && tissue_b) {
            if (by_ledger() && hold_tissue_edges(frame, contact, pair, effect)) return;
            bounce(state_, frame, direction, b, a, depth, k, effect);
            return;
        }
        const bool push_b = tissue_b || kind(body_b) == BodyKind::instrument;
        if (tissue_b && settings().constrain) {
            const bool apart = pair != nullptr && held_.hold_edges_apart(state_, frame, body_a, side, *pair, effect);
            if (apart || side || (pair != nullptr && !pair->crosses)) return;
            // A corner that is held outside takes the triangle along.
            if (held_.holds_corner(*topology_, contact.b, body_a)) return;
            held_.hold_crossing(state_, frame, contact, a, b, pair != nullptr ? &pair->key : nullptr, effect);
            return;
        }
        LinearContact linear;
        linear.k = k;
        linear.mu = settings().edge_normal ? state_.laws.mu(body_a, body_b) : 0.0;  // 3.5 and 3.9 have no damper
        linear.gap = -depth;
        linear.normal = push_b ? direction : Vector3(-direction);
        const LoadPoint& pushed = push_b ? b : a;
        const LoadPoint& other = push_b ? a : b;
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        const Vector3 other_velocity = settings().closest_point
                                           ? other.blend(frame.velocity)
                                           : Vector3(frame.velocity.col(push_b ? contact.vertex_a : contact.vertex_b));
        linear.face_velocity = other_velocity.dot(linear.normal);
        if (tissue_a || tissue_b) state_.rub(push_b ? contact.vertex_b : contact.vertex_a, other_velocity, linear);
        if (push_b && kind(body_a) == BodyKind::instrument) {
            linear.reaction_body = body_a;
            linear.reaction_point = a.blend(frame.position);
        }
        if (tissue_b) {
            state_.finish(frame, linear, effect);
        } else {
            finish_rigid(frame, kind(body_b) == BodyKind::rigid ? body_a : -1, contact.point, linear, effect);
        }
    }
    /// Of two tissues, either may have a corner of which the ledger knows on which side of the other it belongs. False
    /// where it does not.
    bool hold_tissue_edges(const Frame& frame, const Contact& contact, const EdgePair* pair, Effect& effect) {
        const auto hold = [&](Index a, Index b, const EdgeKey& key) {
            const auto side = ledger_.side_of(*topology_, frame, a, b);
            if (side && *side != 0.0 && pair != nullptr && settings().constrain) {
                const EdgePair edges{.key = key, .contact = contact};
                held_.hold_edges_apart(state_, frame, topology_->body_of_triangle[at(a)], side, edges, effect);
            }
            return side.has_value();
        };
        const EdgeKey key = pair == nullptr ? EdgeKey{} : pair->key;
        return hold(contact.a, contact.b, key) || hold(contact.b, contact.a, {key[2], key[3], key[0], key[1]});
    }
    [[nodiscard]] LoadPoint edge_load(const Frame& frame, Index triangle, Index vertex, const Vector3& point) const {
        if (!settings().distribute) return LoadPoint::at_vertex(vertex);
        const equations::Corners corners = corners_of(*topology_, frame.position, triangle);
        return LoadPoint::in_triangle(*topology_, triangle, closest_point_on_triangle(corners, point));
    }

    /// Eq. 3.7-3.8 and 3.10-3.11: tissue vertex A2 in the face of an instrument or a bone. The contact position is
    /// where A2's path of the last tick meets the face; without one the position stays and only the velocity rule acts.
    void project(const Frame& frame, const VertexInFace& v, Effect& effect) {
        TissueEdit& vertex = state_.edit(frame, v.vertex);
        const equations::Corners face = corners_of(*topology_, frame.position, v.triangle);
        Vector3 previous = frame.previous.col(v.vertex);
        if (settings().relative_path) previous = carried_along(frame, v.triangle, previous);
        equations::PathHit hit = equations::path_hit(face, previous, vertex.position);
        if (!hit.found && settings().relative_path) {
            hit.found = true;
            hit.point = equations::point_at(face, v.weights);
        }
        if (hit.found) {
            vertex.position = hit.point;
        } else {
            ++effect.no_hit;
        }
        const bool instrument = kind(v.face_body) == BodyKind::instrument;
        const Vector3 before = vertex.velocity;
        vertex.velocity = instrument ? equations::projected_velocity(face_velocity(frame, v), before, v.normal,
                                                                     settings().restitution)
                                     : equations::rigid_projected_velocity(before, v.normal, settings().restitution);
        if (!instrument) return;
        vertex.instrument = v.face_body;
        vertex.point = face_load(v).blend(frame.position);
        if (!settings().closest_point) vertex.point = frame.position.col(v.nearest);
        vertex.normal = v.normal;
        vertex.velocity_change += vertex.velocity - before;
    }
    /// Where a point of the last tick would be had it moved with the triangle's body.
    [[nodiscard]] Vector3 carried_along(const Frame& frame, Index triangle, const Vector3& point) const {
        const auto axes = [](const equations::Corners& c) {
            Matrix3 m;
            m.col(0) = (c[1] - c[0]).normalized();
            m.col(2) = m.col(0).cross(c[2] - c[0]).normalized();
            m.col(1) = m.col(2).cross(m.col(0));
            return m;
        };
        const equations::Corners then = corners_of(*topology_, frame.previous, triangle);
        const equations::Corners now = corners_of(*topology_, frame.position, triangle);
        return now[0] + axes(now) * (axes(then).transpose() * (point - then[0]));
    }

    // ------------------------------------------------------------ reactions of placed vertices
    /// "The reaction force to the instrument is calculated through the equilibrium condition of the vertex A2": once
    /// per held vertex, at its final place, from the last pair that held it; only what presses on the face. Corrected:
    /// the momentum of the velocity edits over the tick. The position edits carry none: counting both would count a
    /// resting contact twice.
    void add_reactions(const Frame& frame, Effect& effect) {
        for (const TissueEdit& vertex : state_.edits()) {
            if (vertex.instrument < 0) continue;
            Vector3 force;
            if (vertex.held) {
                force = state_.internal_force_on(frame, vertex);
            } else if (settings().impulse_reaction) {
                force = -materials_->mass[at(vertex.vertex)] / state_.dt * vertex.velocity_change;
            } else {
                force = equations::pressing_part(state_.internal_force_on(frame, vertex), vertex.normal);
            }
            Wrench& wrench = effect.wrench[at(vertex.instrument)];
            wrench.force += force;
            wrench.moment += vertex.point.cross(force);
        }
    }

    // ------------------------------------------------------------ grasping
    void hold_grasped(const Frame& frame, const ContactSet& contacts, Effect& effect) {
        touches_.clear();
        for (const RestingVertex& r : held_.resting()) {
            touches_.push_back({r.vertex, topology_->triangles(0, r.triangle), r.normal});
        }
        for (const Penetration& p : ledger_.penetrations()) {
            if (kind(p.sample.body) == BodyKind::tissue) continue;
            for (int i = 0; i < 3; ++i) {
                touches_.push_back({topology_->triangles(i, p.triangle), p.sample.vertex, -p.normal});
            }
        }
        state_.grasp.update(*topology_, *materials_, frame, contacts, touches_);
        if (settings().grasp == GraspRule::follow) {
            for (const GraspedVertex& held : state_.grasp.held()) {
                TissueEdit& vertex = state_.edit(frame, held.vertex);
                vertex.position = state_.grasp.target(frame, held);
                vertex.velocity = state_.grasp.target_velocity(frame, held, state_.dt);
                vertex.held = true;
                vertex.instrument = state_.grasp.body_of(held.group);
                vertex.point = vertex.position;
            }
        } else {
            state_.grasp.hold_by_springs(*materials_, state_.springs, frame, state_.dt, effect);
        }
        effect.grasped = static_cast<std::int64_t>(state_.grasp.held().size());
    }

    ThesisState state_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    TipProxies proxies_;
    ContactReduction reduction_;
    RigidContacts rigid_;
    HeldContacts held_;
    RimContacts rims_;
    ApproachingFaces faces_ahead_;
    VelocityChanges changes_;
    SqueezedTissue squeezed_;
    TornTissue torn_;
    LedgerResolution ledger_;
    BackProjection back_projection_;
    std::vector<RestingTouch> touches_;
};

}  // namespace

ResponseEntry thesis_response() {
    ResponseEntry entry;
    entry.name = "thesis";
    entry.version = "2005";
    entry.own = true;
    entry.sources = {"canonical"};  // the equations go by the overlap case and its vertex or edge
    entry.parameters = thesis_parameters();
    for (const char* setting :
         {"projection", "squeeze", "settle_time", "anchor", "samples", "approach", "slip_damping", "tear_time", "d_max",
          "clear_speed", "rigid", "rigid_settle", "friction", "friction_k", "resolution=ledger"}) {
        entry.left.push_back({setting, "take the response hold"});
    }
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Thesis>(read_thesis_settings(values));
    };
    return entry;
}

}  // namespace trocar
