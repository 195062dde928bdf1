// Response of the thesis: equations 3.4-3.17 as specified in METHODS §5-§10. Profile `faithful` keeps the printed
// equations with the damper sign of 3.6 corrected, one response per triangle pair in sorted order. `printed` keeps the
// printed sign as well; `corrected` has all corrections of the equations (METHODS §13).
//
// Functions and files by equation or section of METHODS:
//   - 3.4        press_non_deformable   printed and faithful
//   - 3.4, 3.5   rigid_patches          corrected
//   - 3.5, 3.9   respond_to_edges
//   - 3.6        press_tissue_face
//   - 3.7-3.11   project
//   - 3.12-3.17  tissue_contacts        exchange; corrected: bounce
//   - §3.4.5     back_projection
//   - §5         contact_reduction      corrected
//   - §8         tip_proxy              printed and faithful
//   - §10        grasp
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "method/entry.hpp"
#include "respond/back_projection.hpp"
#include "respond/contact_reduction.hpp"
#include "respond/equations.hpp"
#include "respond/rigid_patches.hpp"
#include "respond/thesis_contacts.hpp"
#include "respond/thesis_settings.hpp"
#include "respond/thesis_state.hpp"
#include "respond/tip_proxy.hpp"
#include "respond/tissue_contacts.hpp"

namespace trocar {
namespace {

constexpr double restitution = 0.0;  ///< e in 3.8 and 3.11: the printed equation

class Thesis final : public Response {
public:
    explicit Thesis(const ThesisSettings& settings) : state_(settings) {}

    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override {
        return state_.laws.values_in_force();
    }
    void prepare(const Topology& topology, const Materials& materials) override {
        state_.prepare(topology, materials);
        topology_ = &topology;
        materials_ = &materials;
        reduction_.prepare(topology);
        patches_.prepare(topology, state_.laws);
        proxies_.prepare(topology, materials, TipProxies::default_radius);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        output.contact_timing = settings().contact_timing;
        state_.begin(frame, dt);
        if (state_.has_tissue) hold_grasped(frame, contacts, output);
        if (!corrected()) respond_to_tips(frame, contacts, output);
        for (const Contact& contact : contacts.contacts) respond_to(frame, contact, output);
        if (corrected()) respond_to_reduced(frame, output);
        if (state_.has_tissue && settings().n_back > 0.0) back_projection_.respond(state_, frame, contacts, output);
        for (const TissueEdit& edit : state_.edits()) {
            output.position_corrections.push_back({edit.vertex, edit.position, edit.velocity, edit.held});
        }
        add_reactions(frame, output);
        if (state_.has_tissue) state_.grasp.remember(frame);
    }

private:
    [[nodiscard]] const ThesisSettings& settings() const { return state_.settings; }
    [[nodiscard]] bool corrected() const { return settings().corrected(); }
    [[nodiscard]] BodyKind kind(Index body) const { return state_.kind(body); }

    /// m/s, of a face's loaded point, or of the vertex that the printed equations take.
    [[nodiscard]] Vector3 face_velocity(const Frame& frame, const VertexInFace& v) const {
        if (!corrected()) return state_.velocity(frame, v.nearest);
        Vector3 sum = Vector3::Zero();
        for (std::size_t i = 0; i < 3; ++i) {
            if (v.face.vertices[i] >= 0) sum += v.face.weights[i] * state_.velocity(frame, v.face.vertices[i]);
        }
        return sum;
    }
    [[nodiscard]] ContactPoint face_load(const VertexInFace& v) const {
        return settings().distribute ? v.face : ContactPoint::at_vertex(v.nearest);
    }

    // ------------------------------------------------------------ one contact
    void respond_to(const Frame& frame, const Contact& contact, ResponseOutput& output) {
        const bool features = is_of_features(contact);
        const bool enters = contact.kind == ContactCase::a_enters_b || contact.kind == ContactCase::b_enters_a;
        const bool pair = enters || contact.kind == ContactCase::edges_cross;
        if (!features && (!pair || contact.a < 0 || contact.b < 0 || contact.vertex_a < 0 || contact.vertex_b < 0)) {
            output.skip(SkipReason::no_direction);
            return;
        }
        const CollisionClass pair_class = state_.laws.kind(contact.body_a, contact.body_b);
        if (pair_class == CollisionClass::none ||
            (pair_class == CollisionClass::rigid_tissue && !corrected() && !enters_with_b(contact))) {
            output.skip(SkipReason::not_handled);
            return;
        }
        const bool patch = corrected() && kind(contact.body_b) != BodyKind::tissue;
        const bool open = features && !(contact.gap + contact.approach < 0.0);
        if (open && !patch && !takes_open(contact)) {
            output.skip(SkipReason::not_handled);
            return;
        }
        if (pair_class == CollisionClass::tissue_tissue && !corrected() && !features) {
            exchange(state_, frame, contact);
            return;
        }
        if (patch) {
            rigid_.push_back(contact);
            return;
        }
        if (contact.kind == ContactCase::edges_cross) {
            const CrossedEdges edges = read_crossing(state_, frame, contact);
            if (corrected()) {
                if (!reduction_.keep(name_edges(*topology_, frame, contact), edges)) output.skip(SkipReason::reduced);
            } else {
                respond_to_edges(frame, edges, output);
            }
        } else if (enters) {
            read_vertices(state_, frame, contact, entered_);
            for (const VertexInFace& v : entered_) {
                if (corrected()) {
                    if (!reduction_.keep(v) && v.vertex == entered_.front().vertex) output.skip(SkipReason::reduced);
                } else {
                    respond_to_vertex(frame, v, output);
                }
            }
        } else if (contact.kind == ContactCase::edge_edge) {
            respond_to_edges(frame, read_edge_edge(state_, contact), output);
        } else {
            respond_to_vertex(frame, read_point_face(contact), output);
        }
    }

    /// Springs accept open contacts, since they act from the sub-step in which the gap closes. Projections (3.7 to
    /// 3.11) and adhesive laws do not.
    [[nodiscard]] bool takes_open(const Contact& contact) const {
        const bool places = enters_with_b(contact) && kind(contact.body_a) != BodyKind::tissue &&
                            kind(contact.body_b) == BodyKind::tissue;
        return corrected() && !places;
    }

    void respond_to_reduced(const Frame& frame, ResponseOutput& output) {
        for (const VertexInFace& v : reduction_.faces()) respond_to_vertex(frame, v, output);
        for (std::size_t i = 0; i < reduction_.edge_count(); ++i) {
            respond_to_edges(frame, reduction_.edges(i), output);
        }
        reduction_.clear();
        patches_.respond(frame, state_.dt, rigid_, output);
        rigid_.clear();
    }

    // ------------------------------------------------------------ laws
    /// Eq. 3.4, 3.6, 3.7-3.8 or 3.10-3.11, by which side is tissue.
    void respond_to_vertex(const Frame& frame, const VertexInFace& v, ResponseOutput& output) {
        const bool vertex_tissue = kind(v.vertex_body) == BodyKind::tissue;
        const bool face_tissue = kind(v.face_body) == BodyKind::tissue;
        if (vertex_tissue && state_.follows(v.vertex, v.face_body)) return;
        if (face_tissue && state_.follows(v.nearest, v.vertex_body)) return;
        if (vertex_tissue && face_tissue) {
            bounce(state_, frame, v.normal, ContactPoint::at_vertex(v.vertex), v.face, v.depth,
                   state_.stiffness(v.face_body, v.vertex_body, materials_->mean_stiffness[at(v.vertex)], v.vertex),
                   output);
        } else if (vertex_tissue) {
            if (state_.fixed(v.vertex)) {
                output.skip(SkipReason::not_handled);
            } else {
                project(frame, v, output);
            }
        } else if (face_tissue) {
            press_tissue_face(frame, v, output);
        } else {
            press_non_deformable(frame, v, output);
        }
    }

    /// Eq. 3.4 (§3.4.1, §3.4.2), printed and faithful: pushes the vertex along the face's normal, the face in the
    /// opposite direction. A rigid body is static and takes no force.
    void press_non_deformable(const Frame& frame, const VertexInFace& v, ResponseOutput& output) const {
        const bool push_vertex = kind(v.vertex_body) == BodyKind::instrument;
        const ContactPoint face = face_load(v);
        ContactForceLaw linear;
        linear.k = state_.stiffness(v.face_body, v.vertex_body, 0.0, v.vertex);
        linear.mu = state_.laws.mu(v.face_body, v.vertex_body, linear.k);
        linear.gap = -v.depth;
        linear.normal = push_vertex ? v.normal : Vector3(-v.normal);
        push(push_vertex ? ContactPoint::at_vertex(v.vertex) : face, linear);
        const Vector3 other = push_vertex ? face_velocity(frame, v) : Vector3(frame.velocity.col(v.vertex));
        linear.face_velocity = other.dot(linear.normal);
        if (push_vertex) react(frame, v.face_body, face.blend(frame.position), linear);
        const bool vertex_first = kind(v.vertex_body) <= kind(v.face_body);
        const Vector3 place = vertex_first ? Vector3(frame.position.col(v.vertex)) : face.blend(frame.position);
        const bool bone = kind(v.vertex_body) == BodyKind::rigid || kind(v.face_body) == BodyKind::rigid;
        finish_rigid(frame, bone ? std::min(v.vertex_body, v.face_body) : -1, place, linear, output);
    }
    static void push(const ContactPoint& point, ContactForceLaw& linear) {
        linear.vertices = point.vertices;
        linear.weights = point.weights;
    }
    /// Reaction at the vertex or face of the equation; in `corrected` on the line of action.
    void react(const Frame& frame, Index body, const Vector3& point, ContactForceLaw& linear) const {
        if (kind(body) != BodyKind::instrument) return;
        react_on_line(frame, body, linear);
        if (!corrected()) linear.reaction_point = point;
    }
    /// Printed and faithful. A contact of `instrument` with bone (-1: other contacts) is weighted by its distance from
    /// the tip, where the proxy acts.
    void finish_rigid(const Frame& frame, Index instrument, const Vector3& place, ContactForceLaw linear,
                      ResponseOutput& output) const {
        const double share = instrument >= 0 ? proxies_.share_left(instrument, place) : 1.0;
        if (share == 0.0) return;
        linear.k *= share;
        linear.mu *= share;
        state_.finish(frame, linear, output);
    }
    /// Instrument tips against bone (§3.4.2, where the thesis uses GHOST).
    void respond_to_tips(const Frame& frame, const ContactSet& contacts, ResponseOutput& output) {
        const std::size_t before = output.contacts.size();
        proxies_.respond(*topology_, *materials_, state_.laws, frame, contacts, output);
        for (std::size_t c = before; c < output.contacts.size(); ++c) {
            report_at_start(*topology_, frame, state_.dt, output.contacts[c]);
        }
    }

    /// Eq. 3.6 (§3.4.3): the instrument's vertex A1 is below a tissue face, which gets the opposite of 3.6's force. In
    /// `corrected` also for a bone's vertex, without reaction.
    void press_tissue_face(const Frame& frame, const VertexInFace& v, ResponseOutput& output) const {
        ContactForceLaw linear;
        linear.k = state_.stiffness(v.vertex_body, v.face_body, materials_->mean_stiffness[at(v.nearest)], v.vertex);
        // Literal 3.6: F on A1 = (k d - mu (V2 - V1)·n2) n2, a damper of -mu on the tissue.
        linear.mu = (settings().profile == Profile::printed ? -1.0 : 1.0) *
                    state_.laws.mu(v.vertex_body, v.face_body, linear.k);
        linear.gap = -v.depth;
        linear.normal = -v.normal;
        push(face_load(v), linear);
        linear.face_velocity = frame.velocity.col(v.vertex).dot(linear.normal);
        react(frame, v.vertex_body, frame.position.col(v.vertex), linear);
        state_.finish(frame, linear, output);
    }

    /// Eq. 3.5, 3.9 (§3.4.1-3.4.3): crossing edges.
    void respond_to_edges(const Frame& frame, const CrossedEdges& edges, ResponseOutput& output) {
        const bool tissue_a = kind(edges.body_a) == BodyKind::tissue;
        const bool tissue_b = kind(edges.body_b) == BodyKind::tissue;
        if (tissue_b && state_.follows(edges.vertex_b, edges.body_a)) return;
        const double k = state_.stiffness(edges.body_a, edges.body_b, edges.stiffness, edges.vertex_b);
        if (tissue_a && tissue_b) {
            bounce(state_, frame, edges.direction, edges.b, edges.a, edges.depth, k, output);
            return;
        }
        const bool push_b = tissue_b || kind(edges.body_b) == BodyKind::instrument;
        ContactForceLaw linear;
        linear.k = k;
        linear.mu = corrected() ? state_.laws.mu(edges.body_a, edges.body_b, k) : 0.0;  // printed: no damper
        linear.gap = -edges.depth;
        linear.normal = push_b ? edges.direction : Vector3(-edges.direction);
        push(push_b ? edges.b : edges.a, linear);
        const ContactPoint& other = push_b ? edges.a : edges.b;
        const Vector3 other_velocity = corrected()
                                           ? other.blend(frame.velocity)
                                           : Vector3(frame.velocity.col(push_b ? edges.vertex_a : edges.vertex_b));
        linear.face_velocity = other_velocity.dot(linear.normal);
        if (push_b) react(frame, edges.body_a, edges.a.blend(frame.position), linear);
        if (tissue_b) {
            state_.finish(frame, linear, output);
        } else {
            finish_rigid(frame, kind(edges.body_b) == BodyKind::rigid ? edges.body_a : -1, edges.place, linear, output);
        }
    }

    /// Eq. 3.7-3.8 and 3.10-3.11: tissue vertex A2 in the face of an instrument or bone. The contact position is the
    /// intersection of A2's path of the last tick with the face. Without one, `corrected` takes the nearest point of
    /// the face; otherwise only the velocity changes.
    void project(const Frame& frame, const VertexInFace& v, ResponseOutput& output) {
        TissueEdit& vertex = state_.edit(frame, v.vertex);
        equations::PathHit hit;
        if (v.triangle >= 0) {
            Vector3 previous = frame.previous.col(v.vertex);
            if (corrected()) previous = carried_along(frame, v.triangle, previous);
            hit = equations::path_hit(corners_of(topology_->triangles, frame.position, v.triangle), previous,
                                      vertex.position);
        }
        if (!hit.found && corrected()) hit = {.found = true, .point = v.face.blend(frame.position)};
        if (hit.found) {
            vertex.position = hit.point;
        } else {
            ++output.no_hit;
        }
        const bool instrument = kind(v.face_body) == BodyKind::instrument;
        const Vector3 before = vertex.velocity;
        vertex.velocity = instrument
                              ? equations::projected_velocity(face_velocity(frame, v), before, v.normal, restitution)
                              : equations::rigid_projected_velocity(before, v.normal, restitution);
        if (!instrument) return;
        vertex.instrument = v.face_body;
        vertex.point = corrected() ? face_load(v).blend(frame.position) : Vector3(frame.position.col(v.nearest));
        vertex.normal = v.normal;
        vertex.velocity_change += vertex.velocity - before;
    }
    /// Position of a point of the last tick after rigid motion with the triangle.
    [[nodiscard]] Vector3 carried_along(const Frame& frame, Index triangle, const Vector3& point) const {
        const auto axes = [](const Corners& c) {
            Matrix3 m;
            m.col(0) = (c[1] - c[0]).normalized();
            m.col(2) = m.col(0).cross(c[2] - c[0]).normalized();
            m.col(1) = m.col(2).cross(m.col(0));
            return m;
        };
        const Corners then = corners_of(topology_->triangles, frame.previous, triangle);
        const Corners now = corners_of(topology_->triangles, frame.position, triangle);
        return now[0] + axes(now) * (axes(then).transpose() * (point - then[0]));
    }

    /// "The reaction force to the instrument is calculated through the equilibrium condition of the vertex A2". It is
    /// evaluated once per edited vertex, at its final position, from its last pair; only the pressing part counts.
    /// Corrected: the momentum of the velocity edits over the tick. Position edits carry none, since a resting contact
    /// would count twice.
    void add_reactions(const Frame& frame, ResponseOutput& output) {
        for (const TissueEdit& vertex : state_.edits()) {
            if (vertex.instrument < 0) continue;
            Vector3 force;
            if (vertex.held) {
                force = state_.internal_force_on(frame, vertex);
            } else if (corrected()) {
                force = -materials_->mass[at(vertex.vertex)] / state_.dt * vertex.velocity_change;
            } else {
                force = equations::pressing_part(state_.internal_force_on(frame, vertex), vertex.normal);
            }
            Wrench& wrench = output.wrench[at(vertex.instrument)];
            wrench.force += force;
            wrench.moment += vertex.point.cross(force);
        }
    }

    // ------------------------------------------------------------ grasping
    void hold_grasped(const Frame& frame, const ContactSet& contacts, ResponseOutput& output) {
        state_.grasp.update(*topology_, *materials_, frame, contacts);
        if (!corrected()) {
            for (const GraspedVertex& held : state_.grasp.held()) {
                TissueEdit& vertex = state_.edit(frame, held.vertex);
                vertex.position = state_.grasp.target(frame, held);
                vertex.velocity = state_.grasp.target_velocity(frame, held, state_.dt);
                vertex.held = true;
                vertex.instrument = state_.grasp.body_of(held.group);
                vertex.point = vertex.position;
            }
        } else {
            state_.grasp.hold_by_springs(*materials_, state_.springs, frame, state_.dt, output);
        }
        output.grasped = static_cast<std::int64_t>(state_.grasp.held().size());
    }

    ThesisState state_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    TipProxies proxies_;
    ContactReduction reduction_;
    RigidPatches patches_;
    BackProjection back_projection_;
    std::vector<VertexInFace> entered_;
    std::vector<Contact> rigid_;  ///< between bodies without tissue
};

}  // namespace

ResponseEntry thesis_response() {
    ResponseEntry entry;
    entry.name = "thesis";
    entry.version = "2005";
    entry.own = true;
    entry.contact_generators = {"tracked_proximity", "proximity", "intersection"};
    // The printed equations need the overlap case of two triangles, its vertex or edge and its interval.
    entry.why_unreadable = [](const ParameterValues& values, std::string_view generator) -> std::string {
        if (generator == "intersection") return {};
        if (values.is("profile", "corrected")) return {};
        return fmt::format(
            "the printed equations of thesis need pairs of triangles, contacts 'intersection'; from '{}' works "
            "profile=corrected",
            generator);
    };
    entry.parameters = thesis_parameters();
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Thesis>(read_thesis_settings(values));
    };
    return entry;
}

}  // namespace trocar
