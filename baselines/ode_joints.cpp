// ODE 0.16 as contact response: contact joints between the tissue nodes in contact and a kinematic instrument, solved
// by ODE's own steppers.
//
// World    built once, no gravity; bodies are pooled and set anew in every tick, so that no tick knows of the last.
// Nodes    every tissue vertex in a contact is a particle for the tick: its mass, position, velocity, the force of its
//          springs, rest bias and drag as external force, re-evaluated in every step of ODE with its neighbours moving
//          on as they do. Angular motion is off (an inertia of 1e20).
// Tool     per contact a kinematic body with the velocity of the instrument's surface there: what one kinematic body
//          does, right for jaws too, and no contact joins the islands of another.
// Contacts are reduced first, one per vertex and other body, as for every response: N joints would add up to N k.
//          A contact joint has two bodies, so a contact inside a face is three joints (for two tissues up to nine) with
//          k and mu times the barycentric weights, each working on the way of its own node; points=vertex loads the
//          heaviest vertex alone.
// Law      setting=penalty: soft ERP = h k / (h k + mu) and soft CFM = 1 / (h k + mu) make the joint a spring and
// damper
//          at step h (BASELINES, ODE 10), dWorldStep, as many steps per tick as the tissue has sub-steps.
//          setting=library: as ODE comes: ERP 0.2 and CFM 1e-10 of the world, dWorldQuickStep with 20 iterations, one
//          step per tick, vertex contacts. No friction in either, since no other response has any.
// Random   QuickStep shuffles its rows: dRandSetSeed at the start of every tick.
// Result   the mean over ODE's steps of every joint's force is handed over as force held over the tick, its opposite as
//          wrench on the instrument. The same impulse as placed velocities would make a resting node jump by h f / m
//          at the start of each tick and fall back; held, a node at rest stays at rest.
// Without tissue both instruments are particles of `device_mass`, moved by their scripts' velocity; the hand's force is
//          unknown to a response, which makes a pressed contact softer by the factor 1 / (1 + h (h k + mu) / m).
// A joint between two bodies that cannot move (a pinned vertex and a tool) has no solution in ODE and is left out.
#include <fmt/format.h>
#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/input_error.hpp"
#include "method/entry.hpp"
#include "ode_library.hpp"
#include "respond/common.hpp"
#include "respond/point_contacts.hpp"

namespace trocar {
namespace {

struct Settings {
    bool penalty = true;  ///< ERP and CFM from k and mu; false: those of the library
    bool quick = false;   ///< dWorldQuickStep
    bool share = true;    ///< three joints per point of a face; false: its heaviest vertex
    bool reduce = true;   ///< one contact per vertex and other body
    int iterations = 20;  ///< of QuickStep
    int steps = 0;        ///< of ODE per tick; 0: the tissue's sub-steps
    LawSettings law = {};
    double device_mass = 0.1;  ///< kg
    unsigned long seed = 1;
};

/// The library's world and the bodies made so far.
class World {
public:
    World()
        : world_(dWorldCreate()),
          joints_(dJointGroupCreate(0)),
          threading_(dThreadingAllocateSelfThreadedImplementation()) {
        // The library's shared one would stop the process at its end if a step had failed in the middle.
        dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(threading_), threading_);
    }
    ~World() {
        dJointGroupDestroy(joints_);
        dWorldDestroy(world_);
        dThreadingFreeImplementation(threading_);
    }
    World(const World&) = delete;
    World& operator=(const World&) = delete;
    World(World&&) = delete;
    World& operator=(World&&) = delete;

    [[nodiscard]] dWorldID id() const { return world_; }
    [[nodiscard]] dJointGroupID joints() const { return joints_; }
    void clear() {
        dJointGroupEmpty(joints_);
        for (std::size_t i = 0; i < used_; ++i) dBodyDisable(bodies_[i]);
        used_ = 0;
    }
    /// A body of the pool; mass 0 = kinematic.
    dBodyID body(double mass, const Vector3& position, const Vector3& velocity) {
        if (used_ == bodies_.size()) {
            bodies_.push_back(dBodyCreate(world_));
            dBodySetGyroscopicMode(bodies_.back(), 0);
        }
        dBodyID body = bodies_[used_++];
        dBodyEnable(body);
        if (mass > 0.0) {
            constexpr double no_rotation = 1e20;
            dMass inertia;
            dMassSetParameters(&inertia, mass, 0, 0, 0, no_rotation, no_rotation, no_rotation, 0, 0, 0);
            dBodySetDynamic(body);
            dBodySetMass(body, &inertia);
        } else {
            dBodySetKinematic(body);
        }
        dBodySetPosition(body, position.x(), position.y(), position.z());
        dBodySetLinearVel(body, velocity.x(), velocity.y(), velocity.z());
        dBodySetAngularVel(body, 0, 0, 0);
        dBodySetForce(body, 0, 0, 0);
        dBodySetTorque(body, 0, 0, 0);
        return body;
    }

private:
    dWorldID world_;
    dJointGroupID joints_;
    dThreadingImplementationID threading_;
    std::vector<dBodyID> bodies_;
    std::size_t used_ = 0;
};

/// Never destroyed, and still named by somebody: what checks for leaks tells of what nobody can find any more. It looks
/// when all that is static has been destroyed, so the list that names them stays, too.
void abandon(World* world) {
    static auto* const worlds = new std::vector<World*>;  // NOLINT(cppcoreguidelines-owning-memory): never given back
    worlds->push_back(world);
}

Vector3 position_of(dBodyID body) {
    const dReal* const p = dBodyGetPosition(body);
    return {p[0], p[1], p[2]};
}
Vector3 velocity_of(dBodyID body) {
    const dReal* const v = dBodyGetLinearVel(body);
    return {v[0], v[1], v[2]};
}

class OdeJoints final : public Response {
public:
    explicit OdeJoints(const Settings& settings) : settings_(settings) {}

    [[nodiscard]] std::map<std::string, double> values_in_force() const override {
        return settings_.penalty ? laws_.values_in_force() : std::map<std::string, double>{};
    }
    void prepare(const Topology& topology, const Materials& materials) override {
        use_ode();
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.law);
        points_.prepare(topology);
        springs_.prepare(topology, materials);
        node_of_vertex_.assign(at(topology.vertex_count), -1);
        nodes_.clear();
        world_.reset();
        // Parts of one instrument hang together: one device moves them all.
        device_.assign(at(topology.body_count()), {});
        for (Index body = 0; body < topology.body_count(); ++body) {
            device_[at(body)].leader = body;
            const std::string& name = topology.bodies[at(body)].instrument;
            for (Index other = 0; other < body && !name.empty(); ++other) {
                if (topology.bodies[at(other)].instrument != name) continue;
                device_[at(body)].leader = other;
                break;
            }
        }
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts, std::span<const ContactLoad> /*loads*/,
                 Effect& effect) override {
        use_ode();
        effect.clear();
        points_.gather(*topology_, frame, contacts, settings_.reduce, effect);
        if (!world_) world_ = std::make_unique<World>();
        inside_ode_ = false;
        try {
            begin();
            for (const PointContact& contact : points_.list()) add_contact(frame, dt, contact, effect);
            const int steps = settings_.steps > 0 ? settings_.steps : std::max(1, materials_->substeps);
            for (int step = 0; step < steps; ++step) advance(frame, dt / steps, step);
            for (const Joint& joint : joints_) hand_over(joint, joint.impulse / dt, effect);
            world_->clear();
        } catch (...) {
            // A check that failed in the middle of ODE's step leaves a world that cannot even be destroyed.
            if (inside_ode_) abandon(world_.release());
            world_.reset();
            throw;
        }
    }

private:
    struct Node {
        Index vertex = -1;
        dBodyID body = nullptr;
    };
    struct Device {
        Index leader = -1;
        dBodyID body = nullptr;
    };
    /// One side of a joint: an ODE body and who takes its force.
    struct Side {
        dBodyID body = nullptr;
        Vector3 start = Vector3::Zero();  ///< m, of the ODE body
        Index vertex = -1;                ///< tissue vertex that takes the force
        Index instrument = -1;            ///< or the body that does; -1: nobody
        Vector3 point = Vector3::Zero();  ///< m, where it acts on that body
        bool moves = false;
        double weight = 1.0;
    };
    struct Joint {
        Side a, b;
        Vector3 normal = Vector3::Zero();  ///< unit, a to b
        double depth = 0.0;                ///< m, at the start of the tick, negative where it has yet to close
        double k = 0.0;
        double mu = 0.0;
        double surface_rate = 0.0;  ///< m/s, normal speed that the bodies' own velocities lack
        double impulse = 0.0;       ///< N s, on b along the normal, over the tick
        bool solved = false;        ///< is among this step's joints
        dJointFeedback feedback = {};
    };

    void begin() {
        for (const Node& node : nodes_) node_of_vertex_[at(node.vertex)] = -1;
        nodes_.clear();
        joints_.clear();
        world_->clear();
        for (Device& device : device_) device.body = nullptr;
        dRandSetSeed(settings_.seed);
        dWorldSetQuickStepNumIterations(world_->id(), settings_.iterations);
    }

    dBodyID node(const Frame& frame, Index vertex) {
        Index& slot = node_of_vertex_[at(vertex)];
        if (slot < 0) {
            slot = static_cast<Index>(nodes_.size());
            const bool pinned = at(vertex) < materials_->pinned.size() && materials_->pinned[at(vertex)] != 0;
            nodes_.push_back({vertex, world_->body(pinned ? 0.0 : materials_->mass[at(vertex)],
                                                   frame.position.col(vertex), frame.velocity.col(vertex))});
        }
        return nodes_[at(slot)].body;
    }

    dBodyID device(const Frame& frame, Index body) {
        Device& device = device_[at(device_[at(body)].leader)];
        if (device.body == nullptr) {
            const Range range = topology_->bodies[at(device_[at(body)].leader)].vertices;
            const Vector3 velocity = frame.velocity.middleCols(range.first, range.count).rowwise().mean();
            device.body = world_->body(settings_.device_mass, Vector3::Zero(), velocity);
        }
        return device.body;
    }

    /// The ODE bodies that stand for one side of a contact; at most three.
    int sides_of(const Frame& frame, Index body, const ContactPoint& load, bool driven, std::array<Side, 3>& sides) {
        const BodyKind kind = topology_->bodies[at(body)].kind;
        const Vector3 point = load.blend(frame.position);
        if (kind != BodyKind::tissue) {
            Side& side = sides[0];
            side = {.instrument = kind == BodyKind::instrument ? body : -1, .point = point};
            side.moves = driven && kind == BodyKind::instrument;
            side.body = side.moves ? device(frame, body) : world_->body(0.0, point, load.blend(frame.velocity));
            side.start = position_of(side.body);
            return 1;
        }
        int count = 0;
        const auto heaviest = std::max_element(load.weights.begin(), load.weights.end()) - load.weights.begin();
        for (std::size_t i = 0; i < 3; ++i) {
            const bool loaded = settings_.share ? load.weights[i] > 1e-9 : static_cast<std::ptrdiff_t>(i) == heaviest;
            if (load.vertices[i] < 0 || !loaded) continue;
            Side& side = sides[static_cast<std::size_t>(count++)];
            side = {.body = node(frame, load.vertices[i]), .vertex = load.vertices[i]};
            side.start = position_of(side.body);
            side.moves = dBodyIsKinematic(side.body) == 0;
            side.weight = settings_.share ? load.weights[i] : 1.0;
        }
        return count;
    }

    void add_contact(const Frame& frame, double dt, const PointContact& contact, Effect& effect) {
        const LinearContact law = spring_damper(*topology_, laws_, frame, dt, contact);
        if (settings_.penalty && law.k + law.mu <= 0.0) return;
        const bool driven = topology_->bodies[at(contact.body_b)].kind != BodyKind::tissue;
        std::array<Side, 3> a;
        std::array<Side, 3> b;
        const int count_a = sides_of(frame, contact.body_a, contact.a, driven, a);
        const int count_b = sides_of(frame, contact.body_b, contact.b, driven, b);
        // The reaction lies on the line of the force.
        for (Side& side : a) side.point = contact.b.blend(frame.position);
        bool moves = false;
        for (int i = 0; i < count_a; ++i) {
            for (int j = 0; j < count_b; ++j) {
                Joint joint;
                joint.a = a[at(i)];
                joint.b = b[at(j)];
                if (!joint.a.moves && !joint.b.moves) continue;
                moves = true;
                joint.normal = contact.normal;
                joint.depth = -law.gap;
                const double share = joint.a.weight * joint.b.weight;
                joint.k = share * law.k;
                joint.mu = share * law.mu;
                if (driven) {
                    const Vector3 surface = contact.b.blend(frame.velocity) - contact.a.blend(frame.velocity);
                    const Vector3 bodies = velocity_of(joint.b.body) - velocity_of(joint.a.body);
                    joint.surface_rate = (surface - bodies).dot(contact.normal);
                }
                joints_.push_back(joint);
            }
        }
        if (!moves) effect.skip(SkipReason::not_handled);
    }

    /// Springs, rest bias and drag of a node, N, at `time` after the frame.
    [[nodiscard]] Vector3 tissue_force(const Frame& frame, const Node& node, double time) const {
        const auto place = [&](Index v) -> Vector3 {
            const Index slot = node_of_vertex_[at(v)];
            if (slot >= 0) return position_of(nodes_[at(slot)].body);
            return frame.position.col(v) + time * frame.velocity.col(v);
        };
        const auto speed = [&](Index v) -> Vector3 {
            const Index slot = node_of_vertex_[at(v)];
            return slot >= 0 ? velocity_of(nodes_[at(slot)].body) : Vector3(frame.velocity.col(v));
        };
        Vector3 force = Vector3::Zero();
        if (node.vertex < materials_->rest_bias.cols()) force = materials_->rest_bias.col(node.vertex);
        const Vector3 here = place(node.vertex);
        const Vector3 velocity = speed(node.vertex);
        if (at(node.vertex) < materials_->drag.size()) force -= materials_->drag[at(node.vertex)] * velocity;
        for (const Index s : springs_.of(node.vertex)) {
            const Spring& spring = materials_->springs[at(s)];
            const Index other = spring.i == node.vertex ? spring.j : spring.i;
            const Vector3 d = place(other) - here;
            const double length = d.norm();
            if (length == 0.0) continue;
            const Vector3 u = d / length;
            force += (spring.k * (length - spring.rest) + spring.preload +
                      spring.damping * (speed(other) - velocity).dot(u)) *
                     u;
        }
        return force;
    }

    void advance(const Frame& frame, double h, int step) {
        dJointGroupEmpty(world_->joints());
        for (const Node& node : nodes_) {
            const Vector3 force = tissue_force(frame, node, step * h);
            if (!force.allFinite() || !velocity_of(node.body).allFinite()) {
                throw std::runtime_error("the state of a tissue node is not finite");
            }
            dBodyAddForce(node.body, force.x(), force.y(), force.z());
        }
        for (Joint& joint : joints_) {
            const Vector3 moved =
                position_of(joint.b.body) - joint.b.start - (position_of(joint.a.body) - joint.a.start);
            const double depth = joint.depth - moved.dot(joint.normal) - step * h * joint.surface_rate;
            joint.solved = depth >= 0.0;
            if (!joint.solved) continue;  // ODE has contacts only where there is overlap
            dContact contact = {};
            const Vector3 place = position_of(joint.b.body);
            for (int axis = 0; axis < 3; ++axis) {
                contact.geom.pos[axis] = place[axis];
                contact.geom.normal[axis] = joint.normal[axis];
            }
            contact.geom.depth = depth;
            contact.surface.mode = dContactMotionN;
            contact.surface.motionN = -joint.surface_rate;
            if (settings_.penalty) {
                contact.surface.mode |= dContactSoftERP | dContactSoftCFM;
                contact.surface.soft_erp = h * joint.k / (h * joint.k + joint.mu);
                contact.surface.soft_cfm = 1.0 / (h * joint.k + joint.mu);
            }
            const dJointID id = dJointCreateContact(world_->id(), world_->joints(), &contact);
            dJointAttach(id, joint.b.body, joint.a.body);
            dJointSetFeedback(id, &joint.feedback);
        }
        inside_ode_ = true;
        const int done = settings_.quick ? dWorldQuickStep(world_->id(), h) : dWorldStep(world_->id(), h);
        inside_ode_ = false;
        if (done == 0) throw std::runtime_error("ODE's step ran out of memory");
        for (Joint& joint : joints_) {
            if (!joint.solved) continue;
            const dReal* const f = joint.feedback.f1;
            const double force = Vector3(f[0], f[1], f[2]).dot(joint.normal);
            if (!std::isfinite(force)) throw std::runtime_error("ODE's solution is not finite");
            joint.impulse += h * force;
        }
    }

    static void hand_over(const Joint& joint, double force, Effect& effect) {
        const auto load = [&effect](const Side& side, const Vector3& f) {
            if (side.vertex >= 0) {
                effect.held_force.col(side.vertex) += f;
            } else if (side.instrument >= 0) {
                add_reaction(side.instrument, side.point, f, effect);
            }
        };
        load(joint.b, force * joint.normal);
        load(joint.a, -force * joint.normal);
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
    VertexSprings springs_;
    std::unique_ptr<World> world_;
    bool inside_ode_ = false;
    std::vector<Node> nodes_;
    std::vector<Index> node_of_vertex_;
    std::vector<Device> device_;
    std::vector<Joint> joints_;
};

}  // namespace

ResponseEntry ode_joints_response() {
    use_ode();
    ResponseEntry entry;
    entry.name = "ode_joints";
    entry.library = "ODE";
    entry.version = TROCAR_ODE_VERSION;
    entry.configuration = fmt::format("sizeof(dReal) {}; {}", sizeof(dReal), ode_configuration());
    entry.table_row = "D. Baraff et al";
    const auto choice = [](const char* name, const char* first, std::vector<std::string> choices, const char* meaning) {
        return Parameter{.name = name,
                         .type = Parameter::Type::choice,
                         .default_value = first,
                         .choices = std::move(choices),
                         .meaning = meaning};
    };
    const auto whole = [](const char* name, const char* value, double least, const char* meaning) {
        return Parameter{.name = name,
                         .type = Parameter::Type::integer,
                         .unit = "1",
                         .default_value = value,
                         .minimum = least,
                         .maximum = 1000.0,
                         .meaning = meaning};
    };
    Parameter steps =
        whole("steps", "auto", 1.0, "ODE's steps per tick; auto: the tissue's sub-steps (penalty), one (library)");
    steps.words = {"auto"};
    entry.parameters = {
        choice("setting", "penalty", {"penalty", "library"},
               "ERP and CFM that make a joint the spring k and damper mu, or the library's own (ERP 0.2, CFM 1e-10)"),
        choice("stepper", "auto", {"auto", "world", "quick"},
               "dWorldStep or dWorldQuickStep; auto: the first for penalty, the second for library"),
        whole("iterations", "20", 1.0, "iterations of dWorldQuickStep"),
        std::move(steps),
        choice("points", "auto", {"auto", "three", "vertex"},
               "a contact in a face: three joints by barycentric weights (auto for penalty), or one at the nearest "
               "vertex (auto for library)"),
        reduction_parameter(),
        {.name = "device_mass",
         .unit = "kg",
         .default_value = "0.1",
         .minimum = 1e-6,
         .maximum = 1e3,
         .meaning = "mass that stands for an instrument against another instrument or a rigid body"},
        whole("seed", "1", 0.0, "of the random order of rows in dWorldQuickStep, set in every tick")};
    const std::vector<Parameter> law =
        law_parameters("1000 between instruments and rigid bodies, on tissue the mean of the springs there");
    entry.parameters.insert(entry.parameters.begin() + 1, law.begin(), law.end());
    // `near` offers several open features per vertex. dWorldStep's dense solver takes minutes per simulated second for
    // them, and a check of its own fails (dxLDLTRemove).
    entry.why_unreadable = [](const ParameterValues& values, std::string_view source) -> std::string {
        const bool dense =
            values.is("stepper", "auto") ? values.is("setting", "penalty") : values.is("stepper", "world");
        if (source != "near" || !dense) return {};
        return "dWorldStep of ode_joints cannot bear the many open contacts of 'near'; take stepper=quick or another "
               "contact source";
    };
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        if (!ode_precision_matches()) {
            throw InputError("ode_joints: ODE's library and headers differ in the size of a number");
        }
        Settings s;
        s.penalty = values.is("setting", "penalty");
        s.quick = values.is("stepper", "auto") ? !s.penalty : values.is("stepper", "quick");
        s.share = values.is("points", "auto") ? s.penalty : values.is("points", "three");
        s.reduce = values.is("reduction", "vertex");
        s.iterations = static_cast<int>(values.integer("iterations"));
        s.steps = values.is("steps", "auto") ? (s.penalty ? 0 : 1) : static_cast<int>(values.integer("steps"));
        s.law = read_law_settings(values);
        s.device_mass = values.number("device_mass");
        s.seed = static_cast<unsigned long>(values.integer("seed"));
        return std::make_unique<OdeJoints>(s);
    };
    return entry;
}

}  // namespace trocar
