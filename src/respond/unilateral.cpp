// Response `unilateral`: every contact of the generator on tissue is one unilateral constraint on a signed gap. Rims,
// folds, edges, resting, approaching and crossed features are one case. The solver of the tissue's stepper finds the
// active constraints. Only the grasp keeps state between ticks. `contact_offset` keeps features a small distance apart,
// so that the contact normal stays defined under load.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/grasp.hpp"
#include "respond/rigid_patches.hpp"
#include "respond/tissue_scale.hpp"

namespace trocar {
namespace {

struct UnilateralSettings {
    LawSettings law = {};
    bool of_scene = false;  ///< k and mu on tissue are those of `penalty`
    bool grasp = true;
    GraspSettings grasping = {};
};

class Unilateral final : public Response {
public:
    explicit Unilateral(const UnilateralSettings& settings) : settings_(settings) {}

    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override {
        return settings_.of_scene ? laws_.values_in_force() : laws_.values_in_force(stiffness_);
    }
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        springs_.prepare(topology, materials);
        laws_.prepare(topology, materials, settings_.law);
        rigid_.prepare(topology, laws_);
        has_tissue_ = std::any_of(topology.bodies.begin(), topology.bodies.end(),
                                  [](const BodyRange& body) { return body.kind == BodyKind::tissue; });
        stiffness_ = std::isnan(settings_.law.k) ? own_stiffness() : settings_.law.k;
        damping_ = laws_.own_mu(stiffness_);
        if (grasps()) grasp_.prepare(topology, materials, settings_.grasping);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        if (grasps()) hold_grasped(frame, dt, contacts, output);
        for (const Contact& contact : contacts.contacts) {
            if (kind(contact.body_b) == BodyKind::tissue) hold_apart(frame, contact, output);
        }
        rigid_.respond(frame, dt, contacts.contacts, output);
        if (grasps()) grasp_.remember(frame);
    }

private:
    [[nodiscard]] BodyKind kind(Index body) const { return topology_->bodies[at(body)].kind; }
    [[nodiscard]] bool grasps() const { return has_tissue_ && settings_.grasp; }

    /// N/m, of all constraints on tissue. Far above the stiffest vertex, since constraint and tissue springs share the
    /// gap in series. On long edges, a force that doubles one penetrates at most 1/100 of most_clear_depth.
    [[nodiscard]] double own_stiffness() const {
        constexpr double above_tissue = 5000.0;
        constexpr double of_clear = 0.01;
        const std::vector<TissueScale> scale = tissue_scales(*topology_, *materials_);
        double stiffness = 0.0;
        for (std::size_t b = 0; b < scale.size(); ++b) {
            const BodyRange& body = topology_->bodies[b];
            if (body.kind != BodyKind::tissue) continue;
            const double above = std::max(above_tissue, scale[b].edge / (of_clear * TissueScale::most_clear_depth));
            for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
                stiffness = std::max(stiffness, above * materials_->mean_stiffness[at(v)]);
            }
        }
        return stiffness;
    }

    /// Body b is tissue and is pushed along the normal; the other side takes the reaction.
    void hold_apart(const Frame& frame, const Contact& contact, ResponseOutput& output) const {
        const Vector3 velocity_a = contact.on_a.blend(frame.velocity);
        ContactForceLaw linear;
        linear.role = ContactRole::constraint;
        linear.source_id = contact.id;
        linear.gap = contact.gap;
        linear.normal = contact.normal;
        linear.face_velocity = velocity_a.dot(contact.normal);
        linear.k = settings_.of_scene ? laws_.k(contact.body_a, contact.body_b) : stiffness_;
        if (std::isnan(linear.k)) linear.k = laws_.mean_of_springs(contact.on_b);
        linear.mu = settings_.of_scene ? laws_.mu(contact.body_a, contact.body_b, linear.k) : damping_;
        linear.vertices = contact.on_b.vertices;
        linear.weights = contact.on_b.weights;
        if (kind(contact.body_a) == BodyKind::tissue) {
            linear.reaction_vertices = contact.on_a.vertices;
            linear.reaction_weights = contact.on_a.weights;
        } else {
            react_on_line(frame, kind(contact.body_a) == BodyKind::instrument ? contact.body_a : -1, linear);
            linear.other_point = contact.point;
            linear.surface_velocity = velocity_a;
            if (contact.kind == ContactCase::edge_edge) {
                linear.other_edge =
                    (frame.position.col(contact.on_a.vertices[1]) - frame.position.col(contact.on_a.vertices[0]))
                        .normalized();
            }
        }
        laws_.finish_on_tissue(contact.body_b, velocity_a, linear);
        output.contacts.push_back(linear);
    }

    /// Springs hold the vertices that touch the jaws when these close.
    void hold_grasped(const Frame& frame, double dt, const ContactSet& contacts, ResponseOutput& output) {
        grasp_.update(*topology_, *materials_, frame, contacts);
        grasp_.hold_by_springs(*materials_, springs_, frame, dt, output);
        output.grasped = static_cast<std::int64_t>(grasp_.held().size());
    }

    UnilateralSettings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    ContactLaws laws_;
    VertexSprings springs_;
    RigidPatches rigid_;
    Grasp grasp_;
    bool has_tissue_ = false;
    double stiffness_ = 0.0;  ///< N/m, of all constraints on tissue
    double damping_ = 0.0;    ///< N s/m, of all constraints on tissue
};

}  // namespace

ResponseEntry unilateral_response() {
    ResponseEntry entry;
    entry.name = "unilateral";
    entry.version = "1";
    entry.own = true;
    entry.contact_generators = {"tracked_proximity", "proximity"};
    entry.parameters = law_parameters_on_tissue(
        "on tissue 5000 times the stiffest vertex' mean spring (k_effective_n_per_m of a run), elsewhere the scene's, "
        "else 1000; scene: as of penalty",
        true);
    entry.parameters.front().words.emplace_back("scene");
    const std::vector<Parameter> grasping{
        choice_parameter("grasp", "on", {"on", "off"},
                         "jaws that close hold the tissue between them on springs that slip"),
        number_parameter("grasp_k", "N/m", "300", 0.0, 1e6, "stiffness that holds a grasped vertex"),
        number_parameter("grasp_slip", "N", "2", 0.0, 1e6, "force on one vertex at which it slips out of a grasp"),
        number_parameter(
            "jaw_length", "m", "0.012", 0.0, 1e3,
            "how far from the tip towards the shaft a grasp may hold tissue, and 2.5/12 of it to the sides"),
        number_parameter("release_time", "s", "0.05", 0.0, 10.0,
                         "time in which the force on a vertex that slips or is let go falls evenly to zero")};
    entry.parameters.insert(entry.parameters.end(), grasping.begin(), grasping.end());
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Unilateral>(
            UnilateralSettings{.law = read_law_settings(values),
                               .of_scene = values.is("k", "scene"),
                               .grasp = values.is("grasp", "on"),
                               .grasping = {.both_jaws = true,
                                            .stiffness = values.number("grasp_k"),
                                            .slip_force = values.number("grasp_slip"),
                                            .jaw_length = values.number("jaw_length"),
                                            .release_time = values.number("release_time")}});
    };
    return entry;
}

}  // namespace trocar
