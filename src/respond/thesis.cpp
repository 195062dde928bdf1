// The response of the thesis: equations 3.4-3.11 per triangle pair, in sorted pair order, as METHODS §5-§6 makes them
// executable. Profile `faithful` keeps the printed equations with the damper sign of 3.6 put right, `printed` keeps
// that sign too.
#include <cmath>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Settings {
    bool printed_damper = false;  ///< sign of the damper in 3.6 as printed
    bool distribute = true;       ///< §4.3.1: force shared out over the face; false: on the vertex, §3.4
    bool fulcrum = false;         ///< tip force
    double restitution = 0.0;     ///< e in 3.8 and 3.11
    double k = 0.0;               ///< NaN: auto
    double mu = 0.0;              ///< NaN: auto
    bool contacts_held = false;
    bool contacts_explicit = false;
};

class Thesis final : public Response {
public:
    explicit Thesis(const Settings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.k, settings_.mu);
        springs_.prepare(topology, materials);
        const auto n = at(topology.vertex_count);
        slot_.assign(n, -1);
        edits_.clear();
        moment_.assign(at(topology.body_count()), {});
    }

    void respond(const Frame& frame, double /*dt*/, const ContactSet& contacts, Effect& effect) override {
        effect.clear();
        effect.contacts_held = settings_.contacts_held;
        effect.contacts_explicit = settings_.contacts_explicit;
        for (const Edit& edit : edits_) slot_[at(edit.vertex)] = -1;
        edits_.clear();
        for (const Contact& contact : contacts.contacts) respond_to(frame, contact, effect);
        for (const Edit& edit : edits_) {
            effect.placements.push_back({edit.vertex, edit.position, edit.velocity});
        }
        add_equilibrium_reactions(frame, effect);
        show_tip_forces(*topology_, *materials_, frame, settings_.fulcrum, moment_, effect);
    }

private:
    /// Working copy of a tissue vertex that a sequential response has changed in this tick.
    struct Edit {
        Index vertex = -1;
        Vector3 position = Vector3::Zero();
        Vector3 velocity = Vector3::Zero();
        Index instrument = -1;             ///< body that holds the vertex, -1 for none
        Vector3 point = Vector3::Zero();   ///< A1, where the reaction acts
        Vector3 normal = Vector3::Zero();  ///< outer normal of the instrument's face
    };

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

    void respond_to(const Frame& frame, const Contact& contact, Effect& effect) {
        const bool acts = contact.kind == ContactCase::a_enters_b || contact.kind == ContactCase::b_enters_a ||
                          contact.kind == ContactCase::edges_cross;
        if (!acts || contact.a < 0 || contact.b < 0 || contact.vertex_a < 0 || contact.vertex_b < 0) {
            ++effect.skipped;
            return;
        }
        const Index body_a = topology_->body_of_triangle[at(contact.a)];
        const Index body_b = topology_->body_of_triangle[at(contact.b)];
        switch (laws_.kind(body_a, body_b)) {
            case CollisionClass::instrument_instrument:
            case CollisionClass::instrument_rigid:
                non_deformable(frame, contact, body_a, body_b, effect);
                break;
            case CollisionClass::instrument_tissue:
                instrument_tissue(frame, contact, body_a, body_b, effect);
                break;
            default:
                ++effect.skipped;
                break;
        }
    }

    /// The point of a face on which a force acts: the nearest vertex (§3.4), or shared out over the face at the
    /// projection of `target` (§4.3.1).
    [[nodiscard]] LoadPoint load_point(const Frame& frame, Index triangle, Index vertex, const Vector3& target) const {
        if (!settings_.distribute) return LoadPoint::at_vertex(vertex);
        const equations::Corners corners = corners_of(*topology_, frame.position, triangle);
        return LoadPoint::in_triangle(*topology_, triangle, equations::nearest_weights(corners, target));
    }

    /// The two load points of a contact: an entering vertex stands alone, a face (or an edge) takes its share.
    struct LoadPoints {
        LoadPoint a, b;
    };
    [[nodiscard]] LoadPoints load_points(const Frame& frame, const Contact& contact) const {
        const Vector3 target_a =
            contact.kind == ContactCase::edges_cross ? contact.point : Vector3(frame.position.col(contact.vertex_b));
        const Vector3 target_b =
            contact.kind == ContactCase::edges_cross ? contact.point : Vector3(frame.position.col(contact.vertex_a));
        LoadPoints points;
        points.a = contact.kind == ContactCase::a_enters_b ? LoadPoint::at_vertex(contact.vertex_a)
                                                           : load_point(frame, contact.a, contact.vertex_a, target_a);
        points.b = contact.kind == ContactCase::b_enters_a ? LoadPoint::at_vertex(contact.vertex_b)
                                                           : load_point(frame, contact.b, contact.vertex_b, target_b);
        return points;
    }

    /// Eq. 3.4 and 3.5 (§3.4.1, §3.4.2). Instruments get no force from a rigid body's own reaction: it is static.
    void non_deformable(const Frame& frame, const Contact& contact, Index body_a, Index body_b, Effect& effect) {
        const bool edges = contact.kind == ContactCase::edges_cross;
        const LoadPoints points = load_points(frame, contact);
        const double given = laws_.k(body_a, body_b);
        const Vector3 direction = edges ? contact.interval_direction : contact.normal;  // pushes b, parts the two
        LinearContact linear;
        linear.k = std::isnan(given) ? rigid_stiffness : given;
        linear.mu = edges ? 0.0 : laws_.mu(body_a, body_b);
        linear.gap = edges ? -contact.interval_length : -contact.depth;
        linear.adhesive = true;
        const bool push_b = topology_->bodies[at(body_b)].kind == BodyKind::instrument;
        const LoadPoint& pushed = push_b ? points.b : points.a;
        const LoadPoint& other = push_b ? points.a : points.b;
        linear.vertices = pushed.vertices;
        linear.weights = pushed.weights;
        linear.normal = push_b ? direction : Vector3(-direction);
        linear.face_velocity = frame.velocity.col(push_b ? contact.vertex_a : contact.vertex_b).dot(linear.normal);
        if (push_b) {
            linear.reaction_body = body_a;
            linear.reaction_point = other.blend(frame.position);
        }
        effect.contacts.push_back(linear);
    }

    /// Eq. 3.6, 3.7-3.8 and 3.9 (§3.4.3).
    void instrument_tissue(const Frame& frame, const Contact& contact, Index body_a, Index body_b, Effect& effect) {
        if (contact.kind == ContactCase::b_enters_a) {
            project(frame, contact, body_a, effect);
            return;
        }
        const bool edges = contact.kind == ContactCase::edges_cross;
        const LoadPoints points = load_points(frame, contact);
        const double given = laws_.k(body_a, body_b);
        LinearContact linear;
        if (!std::isnan(given)) {
            linear.k = given;
        } else {
            linear.k = edges ? materials_->triangle_stiffness[at(contact.b)]
                             : materials_->mean_stiffness[at(contact.vertex_b)];
        }
        // Literal 3.6: F on A1 = (k d - mu (V2 - V1)·n2) n2, which as a damper on the tissue is -mu.
        const double mu = laws_.mu(body_a, body_b);
        linear.mu = edges ? 0.0 : settings_.printed_damper ? -mu : mu;
        linear.gap = edges ? -contact.interval_length : -contact.depth;
        linear.normal = edges ? contact.interval_direction : contact.normal;
        linear.vertices = points.b.vertices;
        linear.weights = points.b.weights;
        linear.face_velocity = frame.velocity.col(contact.vertex_a).dot(linear.normal);
        linear.adhesive = true;
        linear.reaction_body = body_a;
        linear.reaction_point = points.a.blend(frame.position);
        effect.contacts.push_back(linear);
    }

    /// Eq. 3.7-3.8: tissue vertex A2 in an instrument's face. The contact position is where A2's own path of the last
    /// tick meets the face; without one the position stays and only the velocity rule acts.
    void project(const Frame& frame, const Contact& contact, Index body_a, Effect& effect) {
        const Index a2 = contact.vertex_b;
        if (fixed(a2)) {
            ++effect.skipped;
            return;
        }
        Edit& vertex = edit(frame, a2);
        const equations::PathHit hit = equations::path_hit(corners_of(*topology_, frame.position, contact.a),
                                                           frame.previous.col(a2), vertex.position);
        if (hit.found) {
            vertex.position = hit.point;
        } else {
            ++effect.no_hit;
        }
        vertex.velocity = equations::projected_velocity(frame.velocity.col(contact.vertex_a), vertex.velocity,
                                                        contact.normal, settings_.restitution);
        vertex.instrument = body_a;
        vertex.point = frame.position.col(contact.vertex_a);
        vertex.normal = contact.normal;
    }

    /// "The reaction force to the instrument is calculated through the equilibrium condition of the vertex A2": once
    /// per held vertex, at its final place, from the last pair that held it; only what presses on the face.
    void add_equilibrium_reactions(const Frame& frame, Effect& effect) {
        for (const Edit& vertex : edits_) {
            if (vertex.instrument < 0) continue;
            const Vector3 internal = internal_force_on(frame, vertex);
            const Vector3 force = equations::pressing_part(internal, vertex.normal);
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

    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    PairLaws laws_;
    VertexSprings springs_;
    std::vector<Index> slot_;  ///< N; position in edits_, -1 for none
    std::vector<Edit> edits_;
    std::vector<Wrench> moment_;
};

}  // namespace

ResponseEntry thesis_response() {
    ResponseEntry entry;
    entry.name = "thesis";
    entry.version = "2005";
    entry.own = true;
    entry.parameters = {
        {.name = "profile",
         .type = Parameter::Type::choice,
         .default_value = "faithful",
         .choices = {"faithful", "printed"},
         .meaning = "faithful: the equations with the damper sign of 3.6 put right; printed: that sign as printed"},
        stiffness_parameter("1000 between instruments and rigid bodies, on tissue the mean of the springs at A2 (3.6) "
                            "or of the triangle (3.9)"),
        damping_parameter(),
        {.name = "distribute",
         .type = Parameter::Type::choice,
         .default_value = "force_alpha",
         .choices = {"force_alpha", "force_at_vertex"},
         .meaning = "force on a face: shared out by barycentric weights (§4.3.1), or on the nearest vertex (§3.4)"},
        {.name = "e",
         .unit = "1",
         .default_value = "0",
         .minimum = 0.0,
         .maximum = 1.0,
         .meaning = "restitution in 3.8: 0 the printed equation, 1 the printed words"},
        tip_parameter("sum"),
        {.name = "contacts",
         .type = Parameter::Type::choice,
         .default_value = "implicit",
         .choices = {"implicit", "explicit", "hold"},
         .meaning = "contact forces in the tissue's sub-steps: implicit, explicit, or held over the tick"}};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Thesis>(Settings{.printed_damper = values.is("profile", "printed"),
                                                 .distribute = values.is("distribute", "force_alpha"),
                                                 .fulcrum = values.is("tip", "fulcrum"),
                                                 .restitution = values.number("e"),
                                                 .k = values.number("k"),
                                                 .mu = values.number("mu"),
                                                 .contacts_held = values.is("contacts", "hold"),
                                                 .contacts_explicit = values.is("contacts", "explicit")});
    };
    return entry;
}

}  // namespace trocar
