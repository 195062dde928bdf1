// The response of the thesis: equations 3.4-3.17 as METHODS §5-§10 makes them executable. Profile `faithful` keeps the
// printed equations with the damper sign of 3.6 put right, one response per triangle pair in sorted order; `printed`
// keeps that sign too; `corrected` turns on our corrections, each of which is a parameter of its own.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "geometry/crossing.hpp"
#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/crossing_ledger.hpp"
#include "respond/equations.hpp"
#include "respond/grasp.hpp"
#include "respond/surface.hpp"
#include "respond/thesis_settings.hpp"
#include "respond/tip_proxy.hpp"
#include "respond/triangle_grid.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

class Thesis final : public Response {
public:
    explicit Thesis(const ThesisSettings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.k, settings_.mu);
        springs_.prepare(topology, materials);
        surface_.prepare(topology);
        slot_.assign(at(topology.vertex_count), -1);
        edits_.clear();
        moment_.assign(at(topology.body_count()), {});
        first_face_.assign(at(topology.vertex_count), -1);
        first_edge_.assign(at(topology.vertex_count), -1);
        faces_.clear();
        edges_.clear();
        resting_.clear();
        resting_now_.clear();
        held_edges_.clear();
        held_edges_now_.clear();
        has_tissue_ = std::any_of(topology.bodies.begin(), topology.bodies.end(),
                                  [](const BodyRange& body) { return body.kind == BodyKind::tissue; });
        proxies_.prepare(topology, materials, TipProxies::default_radius);
        if (!has_tissue_) return;
        if (settings_.resolution == Resolution::ledger) ledger_.prepare(topology);
        grasp_.prepare(topology, settings_.grasping);
        inside_.assign(at(topology.vertex_count), 0);
    }

    void respond(const Frame& seen, double dt, const ContactSet& contacts, Effect& effect) override {
        const Frame& frame = filtered(seen, dt);
        effect.clear();
        effect.tip = settings_.tip;
        effect.contacts_held = settings_.contacts_held;
        effect.contacts_explicit = settings_.contacts_explicit;
        dt_ = dt;
        for (const Edit& edit : edits_) slot_[at(edit.vertex)] = -1;
        edits_.clear();
        surface_.measure(*topology_, frame.position);
        if (has_tissue_ && settings_.grasp != GraspRule::off) hold_grasped(frame, contacts, effect);
        if (has_tissue_ && settings_.resolution == Resolution::ledger) resolve_by_ledger(frame, contacts, effect);

        if (settings_.tip_proxy) proxies_.respond(*topology_, *materials_, laws_, frame, effect);
        for (const Contact& contact : contacts.contacts) {
            if (!proxies_.takes(*topology_, frame, contact)) respond_to(frame, contact, effect);
        }
        if (settings_.reduce) respond_to_reduced(frame, effect);
        if (has_tissue_ && settings_.constrain) {
            keep_resting(frame, effect);
            keep_held_edges(frame, effect);
        }
        if (has_tissue_ && settings_.resolution == Resolution::back_projection) back_project(frame, effect);

        for (const Edit& edit : edits_)
            effect.placements.push_back({edit.vertex, edit.position, edit.velocity, edit.held});
        add_reactions(frame, effect);
        show_tip_forces(*topology_, *materials_, frame, moment_, effect);
        if (has_tissue_ && settings_.grasp != GraspRule::off) grasp_.remember(frame);
    }

private:
    /// The frame, or a copy of it whose instruments move with low-passed velocity (METHODS §1, option).
    const Frame& filtered(const Frame& seen, double dt) {
        if (settings_.velocity_filter == 0.0) return seen;
        const double gain = 1.0 - std::exp(-2.0 * std::numbers::pi * settings_.velocity_filter * dt);
        smooth_velocity_.swap(filtered_.velocity);  // copying the frame must not lose what the filter remembers
        const bool first = smooth_velocity_.cols() != seen.velocity.cols();
        filtered_ = seen;
        if (first) return filtered_;
        smooth_velocity_.swap(filtered_.velocity);
        for (const BodyRange& body : topology_->bodies) {
            auto now = filtered_.velocity.middleCols(body.vertices.first, body.vertices.count);
            const auto measured = seen.velocity.middleCols(body.vertices.first, body.vertices.count);
            if (body.kind == BodyKind::instrument) {
                now += gain * (measured - now);
            } else {
                now = measured;
            }
        }
        return filtered_;
    }
    /// Working copy of a tissue vertex that a sequential response has changed in this tick.
    struct Edit {
        Index vertex = -1;
        Vector3 position = Vector3::Zero();
        Vector3 velocity = Vector3::Zero();
        Index instrument = -1;                      ///< body that takes the reaction, -1 for none
        Vector3 point = Vector3::Zero();            ///< where the reaction acts
        Vector3 normal = Vector3::Zero();           ///< outer normal of the instrument's face
        Vector3 velocity_change = Vector3::Zero();  ///< m/s, sum of the edits that the instrument answers for
        bool held = false;
    };
    /// A vertex in a face, in either role.
    struct VertexInFace {
        Index vertex = -1;
        Index triangle = -1;  ///< the pierced face
        Index vertex_body = -1;
        Index face_body = -1;
        Vector3 normal = Vector3::Zero();   ///< unit, outer, of the face
        Vector3 weights = Vector3::Zero();  ///< of the face's loaded point
        Index nearest = -1;                 ///< the face's vertex that the printed equations use
        double depth = 0.0;                 ///< m
        double distance = 0.0;              ///< m, to the closest point of the face
        Index next = -1;
    };
    struct Resting {
        Index vertex = -1;
        Index triangle = -1;
        Index face_body = -1;
        Vector3 normal = Vector3::Zero();
    };
    /// Two edges held apart: their vertices, body a's first, sorted within each, and the direction that pushes b from
    /// a.
    struct HeldEdges {
        std::array<Index, 4> vertex{};
        Index body_a = -1;
        Vector3 normal = Vector3::Zero();
    };
    /// Where an instrument vertex came from, straight back along its velocity.
    struct Path {
        Index body = -1;
        Index vertex = -1;
        Vector3 from = Vector3::Zero();
        Box box = {};
    };
    struct EdgePair {
        std::array<Index, 4> key{};  ///< the two edges' vertices, sorted within each
        Contact contact;
        Index next = -1;
    };

    [[nodiscard]] BodyKind kind(Index body) const { return topology_->bodies[at(body)].kind; }
    [[nodiscard]] bool fixed(Index vertex) const {
        return materials_->mass[at(vertex)] <= 0.0 || materials_->pinned[at(vertex)] != 0;
    }
    [[nodiscard]] Vector3 velocity(const Frame& frame, Index vertex) const {
        const Index slot = slot_[at(vertex)];
        return slot < 0 ? Vector3(frame.velocity.col(vertex)) : edits_[at(slot)].velocity;
    }
    Edit& edit(const Frame& frame, Index vertex) {
        Index& slot = slot_[at(vertex)];
        if (slot < 0) {
            slot = static_cast<Index>(edits_.size());
            edits_.push_back(
                {.vertex = vertex, .position = frame.position.col(vertex), .velocity = frame.velocity.col(vertex)});
        }
        return edits_[at(slot)];
    }
    /// Speed of a face's loaded point, or of the vertex that the printed equations take.
    [[nodiscard]] Vector3 face_velocity(const Frame& frame, const VertexInFace& v) const {
        if (!settings_.closest_point) return velocity(frame, v.nearest);
        Vector3 sum = Vector3::Zero();
        for (int i = 0; i < 3; ++i) sum += v.weights[i] * velocity(frame, topology_->triangles(i, v.triangle));
        return sum;
    }
    [[nodiscard]] LoadPoint face_load(const VertexInFace& v) const {
        return settings_.distribute ? LoadPoint::in_triangle(*topology_, v.triangle, v.weights)
                                    : LoadPoint::at_vertex(v.nearest);
    }

    // ------------------------------------------------------------ one contact
    void respond_to(const Frame& frame, const Contact& contact, Effect& effect) {
        const bool acts = contact.kind == ContactCase::a_enters_b || contact.kind == ContactCase::b_enters_a ||
                          contact.kind == ContactCase::edges_cross;
        if (!acts || contact.a < 0 || contact.b < 0 || contact.vertex_a < 0 || contact.vertex_b < 0) {
            ++effect.skipped;
            return;
        }
        const Index body_a = topology_->body_of_triangle[at(contact.a)];
        const Index body_b = topology_->body_of_triangle[at(contact.b)];
        const CollisionClass pair_class = laws_.kind(body_a, body_b);
        const bool edges = contact.kind == ContactCase::edges_cross;
        if (pair_class == CollisionClass::none ||
            (pair_class == CollisionClass::rigid_tissue && !settings_.all_rigid_cases &&
             contact.kind != ContactCase::b_enters_a)) {
            ++effect.skipped;
            return;
        }
        if (pair_class == CollisionClass::tissue_tissue && !settings_.impulse_tissue) {
            exchange(frame, contact);
            return;
        }
        if (edges) {
            if (settings_.reduce) {
                keep_edge_pair(frame, contact);
            } else {
                respond_to_edges(frame, contact, effect);
            }
            return;
        }
        const bool b_enters = contact.kind == ContactCase::b_enters_a;
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
            if (v.vertex != deepest && !settings_.reduce) continue;
            const Vector3 x = frame.position.col(v.vertex);
            v.depth = v.vertex == deepest ? contact.depth : -face_normal.dot(x - corners[0]);
            v.weights = equations::nearest_weights(corners, x);
            const Vector3 foot = v.weights[0] * corners[0] + v.weights[1] * corners[1] + v.weights[2] * corners[2];
            v.distance = (x - foot).norm();
            if (v.vertex != deepest && (v.depth <= 0.0 || v.distance > 1.0001 * v.depth)) continue;
            if (settings_.closest_point) v.depth = std::min(v.depth, v.distance);
            v.nearest = v.vertex == deepest ? (b_enters ? contact.vertex_a : contact.vertex_b)
                                            : topology_->triangles(equations::nearest_corner(corners, x), face);
            v.normal = settings_.blended_normal ? surface_.blended_normal(*topology_, frame.position, face, v.weights)
                                                : face_normal;
            if (settings_.reduce) {
                keep_nearest_face(v);
            } else {
                respond_to_vertex(frame, v, effect);
            }
        }
    }

    // ------------------------------------------------------------ reduction (METHODS §5, corrected)
    void keep_nearest_face(VertexInFace& v) {
        Index& first = first_face_[at(v.vertex)];
        for (Index f = first; f >= 0; f = faces_[at(f)].next) {
            if (faces_[at(f)].face_body != v.face_body) continue;
            if (v.distance < faces_[at(f)].distance) {
                v.next = faces_[at(f)].next;
                faces_[at(f)] = v;
            }
            return;
        }
        v.next = first;
        first = static_cast<Index>(faces_.size());
        faces_.push_back(v);
    }

    void keep_edge_pair(const Frame& frame, const Contact& contact) {
        const Crossing crossing = cross_triangles(corners_of(*topology_, frame.position, contact.a),
                                                  corners_of(*topology_, frame.position, contact.b));
        EdgePair pair;
        pair.contact = contact;
        pair.key.fill(-1);
        for (const CrossingEnd& end : crossing.ends) {
            if (end.triangle < 0 || end.edge < 0) continue;
            const Index triangle = end.triangle == 0 ? contact.a : contact.b;
            const Index p = topology_->triangles(end.edge, triangle);
            const Index q = topology_->triangles((end.edge + 1) % 3, triangle);
            const std::size_t place = end.triangle == 0 ? 0 : 2;
            pair.key[place] = std::min(p, q);
            pair.key[place + 1] = std::max(p, q);
        }
        if (pair.key[0] < 0 || pair.key[2] < 0) {
            pair.key = {contact.vertex_a, contact.a, contact.vertex_b, contact.b};  // no edges known: the pair itself
        }
        Index& first = first_edge_[at(pair.key[0])];
        for (Index e = first; e >= 0; e = edges_[at(e)].next) {
            if (edges_[at(e)].key != pair.key) continue;
            if (contact.depth > edges_[at(e)].contact.depth) edges_[at(e)].contact = contact;
            return;
        }
        pair.next = first;
        first = static_cast<Index>(edges_.size());
        edges_.push_back(pair);
    }

    void respond_to_reduced(const Frame& frame, Effect& effect) {
        for (const VertexInFace& v : faces_) {
            respond_to_vertex(frame, v, effect);
            first_face_[at(v.vertex)] = -1;
        }
        faces_.clear();
        for (const EdgePair& pair : edges_) {
            respond_to_edges(frame, pair.contact, effect, &pair.key);
            first_edge_[at(pair.key[0])] = -1;
        }
        edges_.clear();
    }

    // ------------------------------------------------------------ laws
    [[nodiscard]] double stiffness(Index body_a, Index body_b, double on_tissue, Index vertex) const {
        const double given = laws_.k(body_a, body_b);
        if (!std::isnan(given)) return given;
        const bool tissue = kind(body_a) == BodyKind::tissue || kind(body_b) == BodyKind::tissue;
        if (!tissue) return rigid_stiffness;
        return settings_.area_stiffness ? settings_.kappa * surface_.area(vertex) : on_tissue;
    }

    /// Coulomb friction with a tangential spring (METHODS §6, option): `surface` is the other side's velocity, `key`
    /// the vertex that is in contact.
    void rub(Index key, const Vector3& surface, LinearContact& linear) const {
        if (settings_.friction == 0.0) return;
        linear.friction = settings_.friction;
        linear.tangent_k = settings_.friction_k;
        linear.surface_velocity = surface;
        linear.slip_key = key;
    }

    void finish(LinearContact linear, Effect& effect) const {
        linear.adhesive = !settings_.clamp;
        if (settings_.clamp && linear.k * -linear.gap > settings_.f_max) linear.gap = -settings_.f_max / linear.k;
        effect.contacts.push_back(linear);
    }

    /// Eq. 3.4, 3.6, 3.7-3.8, 3.10-3.11: who is tissue decides which.
    void respond_to_vertex(const Frame& frame, const VertexInFace& v, Effect& effect) {
        const bool vertex_tissue = kind(v.vertex_body) == BodyKind::tissue;
        const bool face_tissue = kind(v.face_body) == BodyKind::tissue;
        if (has_tissue_ && settings_.grasp != GraspRule::off) {
            if (vertex_tissue && grasp_.holds(v.vertex, v.face_body)) return;
            if (face_tissue && grasp_.holds(v.nearest, v.vertex_body)) return;
        }
        if (vertex_tissue && face_tissue) {
            // As in press_tissue_face, where the other tissue is an open sheet.
            if (settings_.resolution == Resolution::ledger && !topology_->bodies[at(v.face_body)].closed) return;
            bounce(frame, v.normal, LoadPoint::at_vertex(v.vertex),
                   LoadPoint::in_triangle(*topology_, v.triangle, v.weights), v.depth,
                   stiffness(v.face_body, v.vertex_body, materials_->mean_stiffness[at(v.vertex)], v.vertex), effect);
        } else if (vertex_tissue) {
            if (fixed(v.vertex)) {
                ++effect.skipped;
            } else if (settings_.constrain) {
                constrain_vertex(frame, v, effect);
            } else {
                project(frame, v, effect);
            }
        } else if (face_tissue) {
            press_tissue_face(frame, v, effect);
        } else {
            press_non_deformable(frame, v, effect);
        }
    }

    /// Eq. 3.4 (§3.4.1, §3.4.2): the vertex is pushed out along the face's normal, the face the other way; a rigid body
    /// is static and takes nothing.
    void press_non_deformable(const Frame& frame, const VertexInFace& v, Effect& effect) const {
        const bool push_vertex = kind(v.vertex_body) == BodyKind::instrument;
        const LoadPoint face = face_load(v);
        LinearContact linear;
        linear.k = stiffness(v.face_body, v.vertex_body, 0.0, v.vertex);
        linear.mu = laws_.mu(v.face_body, v.vertex_body);
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
        finish(linear, effect);
    }

    /// Eq. 3.6 (§3.4.3): the instrument's vertex A1 is below a tissue face, whose force is the opposite of 3.6's. In
    /// `corrected` also a bone's vertex, which takes no reaction.
    void press_tissue_face(const Frame& frame, const VertexInFace& v, Effect& effect) const {
        // The ledger knows exactly on which side the vertex is, also of an open sheet that it touches from behind,
        // where below the face is the right side.
        if (settings_.resolution == Resolution::ledger) return;
        LinearContact linear;
        linear.k = stiffness(v.vertex_body, v.face_body, materials_->mean_stiffness[at(v.nearest)], v.vertex);
        // Literal 3.6: F on A1 = (k d - mu (V2 - V1)·n2) n2, which as a damper on the tissue is -mu.
        linear.mu = (settings_.printed_damper ? -1.0 : 1.0) * laws_.mu(v.vertex_body, v.face_body);
        linear.gap = -v.depth;
        linear.normal = -v.normal;
        const LoadPoint face = face_load(v);
        linear.vertices = face.vertices;
        linear.weights = face.weights;
        linear.face_velocity = frame.velocity.col(v.vertex).dot(linear.normal);
        rub(v.vertex, frame.velocity.col(v.vertex), linear);
        if (kind(v.vertex_body) == BodyKind::instrument) {
            linear.reaction_body = v.vertex_body;
            linear.reaction_point = frame.position.col(v.vertex);
        }
        finish(linear, effect);
    }

    /// Eq. 3.5, 3.9 (§3.4.1-3.4.3): edges that cross.
    void respond_to_edges(const Frame& frame, const Contact& contact, Effect& effect,
                          const std::array<Index, 4>* key = nullptr) {
        const Index body_a = topology_->body_of_triangle[at(contact.a)];
        const Index body_b = topology_->body_of_triangle[at(contact.b)];
        const bool tissue_a = kind(body_a) == BodyKind::tissue;
        const bool tissue_b = kind(body_b) == BodyKind::tissue;
        if (tissue_b && settings_.grasp != GraspRule::off && grasp_.holds(contact.vertex_b, body_a)) return;
        const bool by_history = !tissue_a && tissue_b && settings_.resolution == Resolution::ledger;
        if (by_history && any_inside(contact.a)) return;  // the ledger knows better which way is out
        const Vector3 direction = settings_.edge_normal ? contact.normal : contact.interval_direction;
        const double depth = settings_.edge_normal ? contact.depth : contact.interval_length;
        const LoadPoint a = edge_load(frame, contact.a, contact.vertex_a, contact.point);
        const LoadPoint b = edge_load(frame, contact.b, contact.vertex_b, contact.point);
        const double on_tissue = tissue_b ? materials_->triangle_stiffness[at(contact.b)] : 0.0;
        const double k = stiffness(body_a, body_b, on_tissue, contact.vertex_b);
        if (tissue_a && tissue_b) {
            bounce(frame, direction, b, a, depth, k, effect);
            return;
        }
        const bool push_b = tissue_b || kind(body_b) == BodyKind::instrument;
        if (tissue_b && settings_.constrain) {
            if (key != nullptr && (*key)[3] != contact.b) {
                held_edges_now_.push_back({*key, body_a, direction});
            }
            hold_edges(frame, body_a, a, b, direction, -depth, effect);
            return;
        }
        LinearContact linear;
        linear.k = k;
        linear.mu = settings_.edge_normal ? laws_.mu(body_a, body_b) : 0.0;  // 3.5 and 3.9 have no damper
        linear.gap = -depth;
        linear.normal = push_b ? direction : Vector3(-direction);
        const LoadPoint& pushed = push_b ? b : a;
        const LoadPoint& other = push_b ? a : b;
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        const Vector3 other_velocity = settings_.closest_point
                                           ? other.blend(frame.velocity)
                                           : Vector3(frame.velocity.col(push_b ? contact.vertex_a : contact.vertex_b));
        linear.face_velocity = other_velocity.dot(linear.normal);
        if (tissue_a || tissue_b) rub(push_b ? contact.vertex_b : contact.vertex_a, other_velocity, linear);
        if (push_b && kind(body_a) == BodyKind::instrument) {
            linear.reaction_body = body_a;
            linear.reaction_point = a.blend(frame.position);
        }
        finish(linear, effect);
    }
    /// Corrected 3.9: edges that cross tissue are held like vertices in faces, by a stiff contact along their normal.
    void hold_edges(const Frame& frame, Index body_a, const LoadPoint& a, const LoadPoint& b, const Vector3& direction,
                    double gap, Effect& effect) const {
        LinearContact linear = hard_contact(-gap);
        linear.vertices = b.vertices;
        linear.weights = b.weights;
        linear.normal = direction;
        linear.face_velocity = a.blend(frame.velocity).dot(direction);
        const auto heaviest = std::max_element(b.weights.begin(), b.weights.end());
        rub(b.vertices[static_cast<std::size_t>(heaviest - b.weights.begin())], a.blend(frame.velocity), linear);
        end_on_time(linear);
        if (kind(body_a) == BodyKind::instrument) {
            linear.reaction_body = body_a;
            linear.reaction_point = a.blend(frame.position);
        }
        effect.contacts.push_back(linear);
    }
    /// Edges that were held in the last tick and have come apart a little stay known with their gap, as resting
    /// vertices do.
    void keep_held_edges(const Frame& frame, Effect& effect) {
        for (HeldEdges& held : held_edges_) {
            const auto known = std::any_of(held_edges_now_.begin(), held_edges_now_.end(),
                                           [&held](const HeldEdges& now) { return now.vertex == held.vertex; });
            if (known) continue;
            const Vector3 a0 = frame.position.col(held.vertex[0]);
            const Vector3 b0 = frame.position.col(held.vertex[2]);
            const Vector3 edge_a = frame.position.col(held.vertex[1]) - a0;
            const Vector3 edge_b = frame.position.col(held.vertex[3]) - b0;
            Vector3 across = edge_a.cross(edge_b);
            const double size = across.norm();
            constexpr double parallel_sine = 1e-3;
            if (size <= parallel_sine * edge_a.norm() * edge_b.norm()) continue;
            across /= across.dot(held.normal) < 0.0 ? -size : size;
            // Where the lines come closest: the plane of one edge and the common normal cuts the other.
            const Vector3 between = b0 - a0;
            const double s = between.cross(edge_b).dot(edge_a.cross(edge_b)) / (size * size);
            const double t = between.cross(edge_a).dot(edge_a.cross(edge_b)) / (size * size);
            const double gap = between.dot(across);
            if (s < 0.0 || s > 1.0 || t < 0.0 || t > 1.0 || gap < 0.0 || gap > CrossingLedger::resting_margin) continue;
            held.normal = across;
            held_edges_now_.push_back(held);
            const LoadPoint a{{held.vertex[0], held.vertex[1], -1}, {1.0 - s, s, 0.0}};
            const LoadPoint b{{held.vertex[2], held.vertex[3], -1}, {1.0 - t, t, 0.0}};
            hold_edges(frame, held.body_a, a, b, across, gap, effect);
        }
        held_edges_.swap(held_edges_now_);
        held_edges_now_.clear();
    }
    [[nodiscard]] bool any_inside(Index triangle) const {
        const auto corner = topology_->triangles.col(triangle);
        return inside_[at(corner[0])] != 0 || inside_[at(corner[1])] != 0 || inside_[at(corner[2])] != 0;
    }
    [[nodiscard]] LoadPoint edge_load(const Frame& frame, Index triangle, Index vertex, const Vector3& point) const {
        if (!settings_.distribute) return LoadPoint::at_vertex(vertex);
        const equations::Corners corners = corners_of(*topology_, frame.position, triangle);
        return LoadPoint::in_triangle(*topology_, triangle, equations::nearest_weights(corners, point));
    }

    /// Eq. 3.7-3.8 and 3.10-3.11: tissue vertex A2 in the face of an instrument or a bone. The contact position is
    /// where A2's path of the last tick meets the face; without one the position stays and only the velocity rule acts.
    void project(const Frame& frame, const VertexInFace& v, Effect& effect) {
        Edit& vertex = edit(frame, v.vertex);
        const equations::Corners face = corners_of(*topology_, frame.position, v.triangle);
        Vector3 previous = frame.previous.col(v.vertex);
        if (settings_.relative_path) previous = carried_along(frame, v.triangle, previous);
        equations::PathHit hit = equations::path_hit(face, previous, vertex.position);
        if (!hit.found && settings_.relative_path) {
            hit.found = true;
            hit.point = v.weights[0] * face[0] + v.weights[1] * face[1] + v.weights[2] * face[2];
        }
        if (hit.found) {
            vertex.position = hit.point;
        } else {
            ++effect.no_hit;
        }
        const bool instrument = kind(v.face_body) == BodyKind::instrument;
        const Vector3 before = vertex.velocity;
        vertex.velocity =
            instrument ? equations::projected_velocity(face_velocity(frame, v), before, v.normal, settings_.restitution)
                       : equations::rigid_projected_velocity(before, v.normal, settings_.restitution);
        if (!instrument) return;
        vertex.instrument = v.face_body;
        vertex.point = face_load(v).blend(frame.position);
        if (!settings_.closest_point) vertex.point = frame.position.col(v.nearest);
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

    /// Corrected 3.7-3.8 and 3.10-3.11: the face holds the vertex by a stiff contact in every sub-step, which clears
    /// the depth within the settle time, never pulls, and gives the tool exactly the momentum that the tissue gets.
    void constrain_vertex(const Frame& frame, const VertexInFace& v, Effect& effect) {
        resting_now_.push_back({v.vertex, v.triangle, v.face_body, v.normal});
        LinearContact linear = hard_contact(v.depth);
        linear.vertices = {v.vertex, -1, -1};
        linear.weights = {1.0, 0.0, 0.0};
        linear.normal = v.normal;
        linear.face_velocity = face_velocity(frame, v).dot(v.normal);
        end_on_time(linear);
        rub(v.vertex, face_velocity(frame, v), linear);
        if (kind(v.face_body) == BodyKind::instrument) {
            linear.reaction_body = v.face_body;
            linear.reaction_point = LoadPoint::in_triangle(*topology_, v.triangle, v.weights).blend(frame.position);
        }
        effect.contacts.push_back(linear);
    }
    /// A vertex that was held in the last tick and is now a little in front of the face stays known to the integrator
    /// as a contact with a gap: else a resting contact would be lost and found again every other tick.
    void keep_resting(const Frame& frame, Effect& effect) {
        for (Resting& r : resting_) {
            const auto known = std::any_of(resting_now_.begin(), resting_now_.end(), [&r](const Resting& now) {
                return now.vertex == r.vertex && now.face_body == r.face_body;
            });
            if (known) continue;
            const Vector3 x = frame.position.col(r.vertex);
            VertexInFace v;
            v.vertex = r.vertex;
            v.triangle = r.triangle;
            v.face_body = r.face_body;
            follow_surface(*topology_, surface_, frame, x, v.triangle, v.weights);
            const equations::Corners corners = corners_of(*topology_, frame.position, v.triangle);
            const Vector3 foot = v.weights[0] * corners[0] + v.weights[1] * corners[1] + v.weights[2] * corners[2];
            v.normal = surface_.blended_normal(*topology_, frame.position, v.triangle, v.weights);
            v.depth = v.normal.dot(foot - x);
            v.nearest = topology_->triangles(equations::nearest_corner(corners, x), v.triangle);
            if (v.depth > 0.0 || (foot - x).norm() > CrossingLedger::resting_margin) continue;
            constrain_vertex(frame, v, effect);
        }
        resting_.swap(resting_now_);
        resting_now_.clear();
    }
    [[nodiscard]] LinearContact hard_contact(double depth) const {
        LinearContact linear;
        linear.k = settings_.hard_stiffness;
        linear.mu = settings_.hard_stiffness * settings_.settle_time;
        linear.gap = -depth;
        return linear;
    }

    /// The gap is the frame's, where a tool that follows its script has already moved while the tissue is a tick
    /// behind, and changes with the face's velocity from there. Taken back to where the face came from, it closes at
    /// the end of the tick where the face is, not one tick's motion beyond it.
    void end_on_time(LinearContact& linear) const { linear.gap += linear.face_velocity * dt_; }

    // ------------------------------------------------------------ tissue against tissue
    /// Eq. 3.12-3.17 on the closest vertex pair, once per triangle pair: an even number of pairs cancels (METHODS §13,
    /// 15).
    void exchange(const Frame& frame, const Contact& contact) {
        const equations::CornerPair pair = equations::closest_corners(
            corners_of(*topology_, frame.position, contact.a), corners_of(*topology_, frame.position, contact.b));
        const Index v1 = topology_->triangles(pair.first, contact.a);
        const Index v2 = topology_->triangles(pair.second, contact.b);
        if (fixed(v1) && fixed(v2)) return;
        constexpr double immovable = 1e12;  // kg
        const double m1 = fixed(v1) ? immovable : materials_->mass[at(v1)];
        const double m2 = fixed(v2) ? immovable : materials_->mass[at(v2)];
        const equations::Exchange result = equations::tissue_tissue(m1, m2, velocity(frame, v1), velocity(frame, v2));
        if (!result.direction_defined) return;
        if (!fixed(v1)) edit(frame, v1).velocity = result.velocity1_after;
        if (!fixed(v2)) edit(frame, v2).velocity = result.velocity2_after;
    }

    /// Corrected: impulse along the contact normal when closing, and a penalty on what overlaps (projection=place), or
    /// a stiff contact that works off the overlap (projection=hold). `pushed` moves along `normal`, `other` against it.
    void bounce(const Frame& frame, const Vector3& normal, const LoadPoint& pushed, const LoadPoint& other,
                double depth, double k, Effect& effect) {
        double speed = 0.0;
        double mobility = 0.0;
        const auto visit = [&](const LoadPoint& point, double sign, const auto& act) {
            for (std::size_t i = 0; i < 3; ++i) {
                if (point.vertices[i] >= 0 && point.weights[i] != 0.0) act(point.vertices[i], sign * point.weights[i]);
            }
        };
        const auto measure = [&](Index vertex, double weight) {
            speed += weight * velocity(frame, vertex).dot(normal);
            if (!fixed(vertex)) mobility += weight * weight / materials_->mass[at(vertex)];
        };
        visit(pushed, 1.0, measure);
        visit(other, -1.0, measure);
        if (mobility == 0.0) return;
        if (speed < 0.0) {
            const double impulse = -(1.0 + settings_.tissue_restitution) * speed / mobility;
            const auto push = [&](Index vertex, double weight) {
                if (!fixed(vertex)) {
                    edit(frame, vertex).velocity += weight * impulse / materials_->mass[at(vertex)] * normal;
                }
            };
            visit(pushed, 1.0, push);
            visit(other, -1.0, push);
        }
        LinearContact linear = settings_.constrain ? hard_contact(depth) : LinearContact{};
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        linear.reaction_vertices = other.vertices;
        linear.reaction_weights = other.weights;
        linear.normal = normal;
        if (settings_.constrain) {
            effect.contacts.push_back(linear);
            return;
        }
        linear.gap = -depth;
        linear.k = k;
        finish(linear, effect);
    }

    // ------------------------------------------------------------ reactions of placed vertices
    /// "The reaction force to the instrument is calculated through the equilibrium condition of the vertex A2": once
    /// per held vertex, at its final place, from the last pair that held it; only what presses on the face. Corrected:
    /// the momentum of the velocity edits over the tick. The position edits carry none: counting both would count a
    /// resting contact twice.
    void add_reactions(const Frame& frame, Effect& effect) {
        for (const Edit& vertex : edits_) {
            if (vertex.instrument < 0) continue;
            Vector3 force;
            if (vertex.held) {
                force = internal_force_on(frame, vertex);
            } else if (settings_.impulse_reaction) {
                force = -materials_->mass[at(vertex.vertex)] / dt_ * vertex.velocity_change;
            } else {
                force = equations::pressing_part(internal_force_on(frame, vertex), vertex.normal);
            }
            Wrench& wrench = effect.wrench[at(vertex.instrument)];
            wrench.force += force;
            wrench.moment += vertex.point.cross(force);
        }
    }
    /// Springs, damping, drag and rest bias on a vertex, N, all vertices where this response has put them.
    [[nodiscard]] Vector3 internal_force_on(const Frame& frame, const Edit& vertex) const {
        Vector3 sum = -materials_->drag[at(vertex.vertex)] * vertex.velocity;
        if (materials_->rest_bias.cols() == frame.position.cols()) sum += materials_->rest_bias.col(vertex.vertex);
        for (const Index s : springs_.of(vertex.vertex)) {
            const Spring& spring = materials_->springs[at(s)];
            const Index other = spring.i == vertex.vertex ? spring.j : spring.i;
            const Index slot = slot_[at(other)];
            const equations::NeighbourSpring neighbour{
                .neighbour = slot < 0 ? Vector3(frame.position.col(other)) : edits_[at(slot)].position,
                .neighbour_velocity = velocity(frame, other),
                .rest = spring.rest,
                .k = spring.k,
                .preload = spring.preload,
                .damping = spring.damping};
            sum += equations::equilibrium_force(vertex.position, vertex.velocity, {&neighbour, 1}, Vector3::Zero());
        }
        return sum;
    }

    // ------------------------------------------------------------ interpenetration, §3.4.5
    /// METHODS §9.1: from each instrument vertex back along its velocity; tissue vertices at the surfaces it has passed
    /// attract it and are attracted. Says nothing for a tool at rest, and on withdrawal looks the wrong way.
    void back_project(const Frame& frame, Effect& effect) {
        // Only what lies near the instruments' back paths: a grid over all tissue would cost more than the response.
        paths_.clear();
        Box all;
        for (Index body = 0; body < topology_->body_count(); ++body) {
            if (kind(body) != BodyKind::instrument) continue;
            const Range range = topology_->bodies[at(body)].vertices;
            for (Index a = range.first; a < range.end(); ++a) {
                const Vector3 v = frame.velocity.col(a);
                const double speed = v.norm();
                if (speed == 0.0) continue;
                const Vector3 x = frame.position.col(a);
                const Vector3 back = x - v / speed * std::min(settings_.n_back * dt_ * speed, settings_.l_max);
                Path path{.body = body, .vertex = a, .from = back};
                path.box.add(x);
                path.box.add(back);
                all.add(path.box.min);
                all.add(path.box.max);
                paths_.push_back(path);
            }
        }
        if (paths_.empty()) return;
        near_.clear();
        for (const BodyRange& body : topology_->bodies) {
            if (body.kind != BodyKind::tissue) continue;
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                const auto corner = topology_->triangles.col(t);
                const auto p = frame.position.col(corner[0]);
                const auto q = frame.position.col(corner[1]);
                const auto r = frame.position.col(corner[2]);
                bool apart = false;
                for (int axis = 0; axis < 3 && !apart; ++axis) {
                    apart = std::max({p[axis], q[axis], r[axis]}) < all.min[axis] ||
                            std::min({p[axis], q[axis], r[axis]}) > all.max[axis];
                }
                if (!apart) near_.push_back(t);
            }
        }
        near_grid_.prepare(*topology_, near_);
        near_grid_.fill(*topology_, frame.position);
        for (const Path& path : paths_) {
            attracted_.clear();
            crossed_.clear();
            near_grid_.visit(path.box, [&](Index t) {
                Box box;
                for (int i = 0; i < 3; ++i) box.add(frame.position.col(topology_->triangles(i, t)));
                if (box.overlaps(path.box)) crossed_.push_back(t);
            });
            std::sort(crossed_.begin(), crossed_.end());  // the first triangle of a vertex says how deep it is
            for (const Index t : crossed_) {
                attract(frame, path.body, path.vertex, frame.position.col(path.vertex), path.from, t, effect);
            }
        }
    }
    void attract(const Frame& frame, Index body, Index a, const Vector3& x, const Vector3& back, Index triangle,
                 Effect& effect) {
        const Index tissue = topology_->body_of_triangle[at(triangle)];
        if (topology_->body_pair(body, tissue) < 0) return;
        const equations::Corners corners = corners_of(*topology_, frame.position, triangle);
        const equations::PathHit hit = equations::path_hit(corners, back, x);
        if (!hit.found) return;
        const Index vertex = topology_->triangles(equations::nearest_corner(corners, hit.point), triangle);
        if (std::find(attracted_.begin(), attracted_.end(), vertex) != attracted_.end()) return;
        attracted_.push_back(vertex);
        const Vector3 towards = x - frame.position.col(vertex);
        const double distance = towards.norm();
        if (distance == 0.0) return;
        LinearContact linear;
        linear.vertices = {vertex, -1, -1};
        linear.weights = {1.0, 0.0, 0.0};
        linear.normal = towards / distance;
        linear.gap = -(x - hit.point).norm();
        linear.k = materials_->mean_stiffness[at(vertex)];
        linear.face_velocity = frame.velocity.col(a).dot(linear.normal);
        linear.adhesive = true;
        linear.reaction_body = body;
        linear.reaction_point = x;
        effect.contacts.push_back(linear);
    }

    /// METHODS §9.2: every vertex on the wrong side pushes the surface it has crossed back past itself by a stiff
    /// contact on the anchor, so that what is left goes to zero within the settle time, whether the tool moves or not.
    void resolve_by_ledger(const Frame& frame, const ContactSet& contacts, Effect& effect) {
        for (const Penetration& p : ledger_.penetrations()) inside_[at(p.vertex)] = 0;
        ledger_.update(*topology_, surface_, frame, contacts);
        for (Penetration& p : ledger_.penetrations()) {
            inside_[at(p.vertex)] = 1;
            if (p.ruptured) continue;
            if (grasp_holds_any(p)) continue;
            if (gives_up(frame, p)) {
                p.ruptured = true;
                ++effect.ruptures;
                continue;
            }
            push_anchor(frame, p, effect);
        }
    }
    void push_anchor(const Frame& frame, const Penetration& p, Effect& effect) const {
        LinearContact linear = hard_contact(p.depth);
        const LoadPoint anchor = LoadPoint::in_triangle(*topology_, p.triangle, p.weights);
        linear.vertices = anchor.vertices;
        linear.weights = anchor.weights;
        linear.normal = -p.normal;
        rub(p.vertex, frame.velocity.col(p.vertex), linear);
        // Where the face slopes against the blended normal, a tool that slides sideways needs the surface to follow:
        // n·v_surface = f·v/(f·n). The surface's own sideways speed stays out: it is the last tick's, and fed back
        // through the stiff damper it makes the contact swing from tick to tick.
        const double slope = p.face.dot(p.normal);
        constexpr double least_slope = 0.3;
        const Vector3 velocity_of_sample = frame.velocity.col(p.vertex);
        linear.face_velocity =
            slope > least_slope ? -p.face.dot(velocity_of_sample) / slope : velocity_of_sample.dot(linear.normal);
        end_on_time(linear);
        if (kind(p.body) == BodyKind::instrument) {
            linear.reaction_body = p.body;
            linear.reaction_point = frame.position.col(p.vertex);
        } else if (kind(p.body) == BodyKind::tissue) {
            linear.reaction_vertices = {p.vertex, -1, -1};
            linear.reaction_weights = {1.0, 0.0, 0.0};
        }
        effect.contacts.push_back(linear);
        steady(frame, p, linear, effect);
    }
    /// Where the normal turns along the surface, the pressing force F acts sideways like a spring of stiffness F·turn;
    /// as the normal stays for the tick, that spring lags by half of it and would feed energy in (a sampled spring
    /// needs a damper above K T / 2, METHODS §11). This is that damper with a margin; on flat surface it is nothing.
    void steady(const Frame& frame, const Penetration& p, const LinearContact& push, Effect& effect) const {
        constexpr double near = 1e-4;  // m
        if (settings_.slip_damping == 0.0 || p.depth < -near) return;
        double pressing = 0.0;
        double turn = 0.0;
        double size = 0.0;
        for (int i = 0; i < 3; ++i) {
            const Index corner = topology_->triangles(i, p.triangle);
            const Index next = topology_->triangles((i + 1) % 3, p.triangle);
            Edit here{.vertex = corner, .position = frame.position.col(corner), .velocity = frame.velocity.col(corner)};
            if (!fixed(corner)) pressing += internal_force_on(frame, here).dot(p.normal);
            const Vector3 normal = p.side * surface_.vertex_normal(*topology_, frame.position, corner);
            turn = std::max(turn, (normal - p.normal).norm());
            size = std::max(size, (frame.position.col(next) - frame.position.col(corner)).norm());
        }
        if (pressing <= 0.0 || turn == 0.0 || size == 0.0) return;
        LinearContact slide = push;
        slide.k = 0.0;
        slide.mu = settings_.slip_damping * pressing * turn / size * dt_;
        slide.gap = 0.0;
        slide.bilateral = true;
        const Vector3 first = p.normal.unitOrthogonal();
        for (const Vector3& axis : {first, Vector3(p.normal.cross(first))}) {
            slide.normal = axis;
            slide.face_velocity = frame.velocity.col(p.vertex).dot(axis);
            effect.contacts.push_back(slide);
        }
    }
    [[nodiscard]] bool grasp_holds_any(const Penetration& p) const {
        if (settings_.grasp == GraspRule::off) return false;
        for (int i = 0; i < 3; ++i) {
            if (grasp_.holds(topology_->triangles(i, p.triangle), p.body)) return true;
        }
        return false;
    }
    /// Rupture: too deep, too old, or not getting better although the tissue around the anchor is at its strain limit.
    [[nodiscard]] bool gives_up(const Frame& frame, Penetration& p) const {
        constexpr double clear = 1e-4;       // m
        constexpr double longest_age = 2.0;  // s
        constexpr double stall_time = 0.1;   // s
        if (p.depth > settings_.d_max) return true;
        if (p.depth <= clear) {
            p.age = 0;
            p.stalled = 0;
            p.least_depth = std::numeric_limits<double>::infinity();
            return false;
        }
        if (static_cast<double>(p.age) * dt_ > longest_age) return true;
        // Against the least depth so far, and not the last tick's: tissue at its limit swings a little.
        if (p.depth < p.least_depth * (1.0 - 1e-3)) {
            p.least_depth = p.depth;
            p.stalled = 0;
        } else if (strain_at(frame, p.triangle) > 0.95 * materials_->strain_limit) {
            ++p.stalled;
        }
        return static_cast<double>(p.stalled) * dt_ > stall_time;
    }
    [[nodiscard]] double strain_at(const Frame& frame, Index triangle) const {
        double largest = 0.0;
        for (int i = 0; i < 3; ++i) {
            const Index vertex = topology_->triangles(i, triangle);
            largest = std::max(largest, springs_.largest_strain(*materials_, frame.position, vertex));
        }
        return largest;
    }

    // ------------------------------------------------------------ grasping
    void hold_grasped(const Frame& frame, const ContactSet& contacts, Effect& effect) {
        touches_.clear();
        for (const Resting& r : resting_) {
            touches_.push_back({r.vertex, topology_->triangles(0, r.triangle), r.normal});
        }
        for (const Penetration& p : ledger_.penetrations()) {
            if (kind(p.body) == BodyKind::tissue) continue;
            for (int i = 0; i < 3; ++i) {
                touches_.push_back({topology_->triangles(i, p.triangle), p.vertex, -p.normal});
            }
        }
        grasp_.update(*topology_, *materials_, frame, contacts, touches_);
        if (settings_.grasp == GraspRule::follow) {
            for (const GraspedVertex& held : grasp_.held()) {
                Edit& vertex = edit(frame, held.vertex);
                vertex.position = grasp_.target(frame, held);
                vertex.velocity = grasp_.target_velocity(frame, held, dt_);
                vertex.held = true;
                vertex.instrument = grasp_.body_of(held.group);
                vertex.point = vertex.position;
            }
        } else {
            grasp_.hold_by_springs(*materials_, springs_, frame, dt_, effect);
        }
        effect.grasped = static_cast<std::int64_t>(grasp_.held().size());
    }

    ThesisSettings settings_;
    Frame filtered_;
    Matrix3X smooth_velocity_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    double dt_ = 0.0;
    bool has_tissue_ = false;
    PairLaws laws_;
    TipProxies proxies_;
    VertexSprings springs_;
    SurfaceNeighbours surface_;
    CrossingLedger ledger_;
    Grasp grasp_;
    std::vector<Index> slot_;  ///< N; position in edits_, -1 for none
    std::vector<Edit> edits_;
    std::vector<Index> first_face_;  ///< N; first of a vertex' faces
    std::vector<VertexInFace> faces_;
    std::vector<Index> first_edge_;  ///< N; by the smallest vertex of body a's edge
    std::vector<EdgePair> edges_;
    std::vector<std::uint8_t> inside_;  ///< N; 1 = in the ledger
    std::vector<Path> paths_;
    std::vector<Index> near_;
    TriangleGrid near_grid_;
    std::vector<Index> crossed_;
    std::vector<Index> attracted_;
    std::vector<RestingTouch> touches_;
    std::vector<Resting> resting_;  ///< tissue vertices that a face held in the last tick
    std::vector<Resting> resting_now_;
    std::vector<HeldEdges> held_edges_;  ///< held in the last tick
    std::vector<HeldEdges> held_edges_now_;
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry thesis_response() {
    ResponseEntry entry;
    entry.name = "thesis";
    entry.version = "2005";
    entry.own = true;
    entry.reads_native = false;  // the equations go by the overlap case and its vertex or edge
    entry.parameters = thesis_parameters();
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Thesis>(read_thesis_settings(values));
    };
    return entry;
}

}  // namespace trocar
