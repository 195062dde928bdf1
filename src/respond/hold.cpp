// `hold`, our response: one set of unilateral constraints, which are the contacts of the source as they come. A
// constraint keeps two features apart while they are near and on the right side, and brings them back where they are
// not: rims, folds, edges, resting, approaching and crossed are one case, a signed gap. The solver of the tissue's
// integrator finds which of them press. No state is kept over ticks but the grasp's.
//
// Features are held a hair apart, the skin: what presses then stays on its side, where the way between two features
// has a direction, however hard it presses.
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

struct HoldSettings {
    double settle_time = 0.003;  ///< s
    double clear_speed = 0.0;    ///< m/s; NaN: a twelfth of the tissue's wave speed
    double skin = 0.001;         ///< of the tissue's mean edge
    double friction = 0.0;
    double friction_k = 1000.0;  ///< N/m
    double k = 0.0;              ///< N/m, between bodies without tissue; NaN: the scene's
    double mu = 0.0;             ///< N s/m, the same
    double pressure = 0.0;       ///< Pa; NaN: own_pressure
    bool grasp = true;
    GraspSettings grasping = {};
};

class Hold final : public Response {
public:
    explicit Hold(const HoldSettings& settings) : settings_(settings) {}

    [[nodiscard]] bool holds_forces() const override { return false; }
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        scale_ = tissue_scales(topology, materials);
        springs_.prepare(topology, materials);
        rigid_.prepare(topology, materials, settings_.k, settings_.mu);
        // Far above the stiffest tissue, else the two would share the gap like springs in a row; and where edges are
        // long, a force that doubles one goes no deeper than a twentieth of what counts as clear.
        constexpr double above_tissue = 5000.0;
        constexpr double of_clear = 0.01;
        stiffness_ = 0.0;
        has_tissue_ = false;
        pressure_.assign(topology.bodies.size(), 0.0);
        for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
            const BodyRange& body = topology.bodies[b];
            if (body.kind != BodyKind::tissue) continue;
            has_tissue_ = true;
            pressure_[b] = std::isnan(settings_.pressure) ? own_pressure(body.vertices, scale_[b]) : settings_.pressure;
            const double above = std::max(above_tissue, scale_[b].edge / (of_clear * TissueScale::most_clear_depth));
            for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
                stiffness_ = std::max(stiffness_, above * materials.mean_stiffness[at(v)]);
            }
        }
        if (grasps()) grasp_.prepare(topology, materials, settings_.grasping);
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, std::span<const ContactLoad> /*loads*/,
                 Effect& effect) override {
        effect.clear();
        if (grasps()) hold_grasped(frame, dt, contacts, effect);
        for (const Contact& contact : contacts.contacts) {
            if (kind(contact.body_b) == BodyKind::tissue) hold_apart(frame, dt, contact, effect);
        }
        rigid_.respond(frame, contacts.contacts, effect);
        if (grasps()) grasp_.remember(frame);
    }

private:
    [[nodiscard]] BodyKind kind(Index body) const { return topology_->bodies[at(body)].kind; }
    [[nodiscard]] bool grasps() const { return has_tissue_ && settings_.grasp; }

    /// Pa: four times what the membrane's stiffness E h (N/m) makes over a thirtieth of its side, a thickness that no
    /// mesh tells; three newtons on a vertex of the default material's mesh of 5 mm.
    [[nodiscard]] double own_pressure(Range vertices, const TissueScale& scale) const {
        double mass = 0.0;
        for (Index v = vertices.first; v < vertices.end(); ++v) mass += materials_->mass[at(v)];
        const double membrane = scale.wave_speed * scale.wave_speed * mass / (scale.side * scale.side);
        constexpr double times = 4.0;
        constexpr double of_side = 1.0 / 30.0;
        const double pressure = times * membrane / (of_side * scale.side);
        return std::isfinite(pressure) ? pressure : std::numeric_limits<double>::infinity();
    }

    /// m², of the tissue around the point.
    [[nodiscard]] double area_of(const ContactPoint& point) const {
        double sum = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            if (point.vertices[i] >= 0) sum += point.weights[i] * materials_->area[at(point.vertices[i])];
        }
        return sum;
    }

    /// Body b is tissue: it is pushed along the normal, the other side takes the reaction.
    void hold_apart(const Frame& frame, double dt, const Contact& contact, Effect& effect) const {
        const TissueScale& scale = scale_[at(contact.body_b)];
        const Vector3 velocity_a = contact.on_a.blend(frame.velocity);
        LinearContact linear;
        linear.role = ContactRole::constraint;
        linear.source_id = contact.id;
        linear.gap = contact.gap - settings_.skin * scale.edge;
        linear.normal = contact.normal;
        linear.face_velocity = velocity_a.dot(contact.normal);
        // What cannot meet within the tick is left out. Springs may turn a vertex round: twice its own speed.
        constexpr double look_out = 0.1;  // of an edge
        const double closing = linear.face_velocity - contact.on_b.blend(frame.velocity).dot(contact.normal);
        if (linear.gap > look_out * scale.edge + 2.0 * std::max(0.0, closing) * dt) return;
        // With what tissue weighs, k d of a deep gap would throw it.
        constexpr double of_waves = 1.0 / 12.0;
        const double speed = std::isnan(settings_.clear_speed) ? of_waves * scale.wave_speed : settings_.clear_speed;
        linear.gap = std::max(linear.gap, -speed * settings_.settle_time);
        linear.k = stiffness_;
        linear.mu = stiffness_ * settings_.settle_time;
        linear.vertices = contact.on_b.vertices;
        linear.weights = contact.on_b.weights;
        if (kind(contact.body_a) == BodyKind::tissue) {
            linear.reaction_vertices = contact.on_a.vertices;
            linear.reaction_weights = contact.on_a.weights;
        } else {
            if (kind(contact.body_a) == BodyKind::instrument) linear.reaction_body = contact.body_a;
            linear.reaction_point = contact.point;
            linear.surface_velocity = velocity_a;
            if (contact.kind == ContactCase::edge_edge) {
                linear.other_edge =
                    (frame.position.col(contact.on_a.vertices[1]) - frame.position.col(contact.on_a.vertices[0]))
                        .normalized();
            }
        }
        linear.limit = pressure_[at(contact.body_b)] * area_of(contact.on_b);
        if (settings_.friction > 0.0) {
            linear.friction = settings_.friction;
            linear.tangent_k = settings_.friction_k;
            linear.surface_velocity = velocity_a;
            const auto heaviest = std::max_element(linear.weights.begin(), linear.weights.end());
            linear.slip_key = linear.vertices[static_cast<std::size_t>(heaviest - linear.weights.begin())];
        }
        effect.contacts.push_back(linear);
    }

    /// What touches the jaws when they close is held by springs.
    void hold_grasped(const Frame& frame, double dt, const ContactSet& contacts, Effect& effect) {
        grasp_.update(*topology_, *materials_, frame, contacts);
        grasp_.hold_by_springs(*materials_, springs_, frame, dt, effect);
        effect.grasped = static_cast<std::int64_t>(grasp_.held().size());
    }

    HoldSettings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    std::vector<TissueScale> scale_;
    VertexSprings springs_;
    RigidPatches rigid_;
    Grasp grasp_;
    std::vector<double> pressure_;  ///< Pa, per body
    bool has_tissue_ = false;
    double stiffness_ = 0.0;  ///< N/m, of all constraints
};

Parameter number(const std::string& name, const std::string& unit, const std::string& value, double low, double high,
                 const std::string& meaning) {
    return {.name = name, .unit = unit, .default_value = value, .minimum = low, .maximum = high, .meaning = meaning};
}

}  // namespace

ResponseEntry hold_response() {
    ResponseEntry entry;
    entry.name = "hold";
    entry.version = "1";
    entry.own = true;
    entry.sources = {"tracked", "near"};
    Parameter clear_speed = number("clear_speed", "m/s", "auto", 1e-6, 1e6,
                                   "fastest at which features that have crossed are brought back; auto: a twelfth of "
                                   "the tissue's sqrt(E/rho), 0.5 for the default material");
    clear_speed.words = {"auto"};
    Parameter pressure =
        number("pressure", "Pa", "auto", 1.0, 1e12,
               "largest pressure of a constraint, on the area of the feature that it holds: what presses "
               "harder passes; auto: 138 kPa for a sheet of 100 mm of the default material");
    pressure.words = {"auto"};
    entry.parameters = {
        stiffness_parameter("1000, between instruments and rigid bodies alone"),
        damping_parameter(),
        number("settle_time", "s", "0.003", 1e-6, 10.0, "time constant in which what is too near is brought apart"),
        clear_speed,
        number("skin", "1", "0.001", 0.0, 1.0, "how far apart features are held, in mean edges of the tissue"),
        pressure,
        number("friction", "1", "0", 0.0, 10.0, "Coulomb friction on tissue (0.1 is usual); 0: none"),
        number("friction_k", "N/m", "1000", 0.0, 1e6, "tangential spring of a sticking contact with friction > 0"),
        {.name = "grasp",
         .type = Parameter::Type::choice,
         .default_value = "on",
         .choices = {"on", "off"},
         .meaning = "jaws that close hold the tissue between them on springs that slip"},
        number("grasp_k", "N/m", "300", 0.0, 1e6, "stiffness that holds a grasped vertex"),
        number("grasp_slip", "N", "2", 0.0, 1e6, "force on one vertex at which it slips out of a grasp"),
        number("jaw_length", "m", "0.012", 0.0, 1e3,
               "how far from the tip towards the shaft a grasp may hold tissue, and 2.5/12 of it to the sides"),
        number("release_time", "s", "0.05", 0.0, 10.0,
               "time in which the force on a vertex that slips or is let go falls evenly to zero")};
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<Hold>(HoldSettings{.settle_time = values.number("settle_time"),
                                                   .clear_speed = values.number("clear_speed"),
                                                   .skin = values.number("skin"),
                                                   .friction = values.number("friction"),
                                                   .friction_k = values.number("friction_k"),
                                                   .k = values.number("k"),
                                                   .mu = values.number("mu"),
                                                   .pressure = values.number("pressure"),
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
