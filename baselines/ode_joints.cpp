// ODE 0.16 as contact response: contact joints between tissue nodes and what touches them, solved by ODE's own steppers
// in every sub-step of the tissue, from the velocities that the tissue's stepper predicts without them.
//
// World    no gravity; bodies are pooled and set anew each time, so that nothing is known of the last.
// Nodes    every tissue vertex with a joint is a particle with its mass and predicted velocity. Springs have acted on
//          that; ODE adds the joints' impulses. Angular motion is off (an inertia of 1e20).
// Tool     a joint with the static world whose wanted speed is that of the instrument's surface there.
// Contacts are reduced first, one per vertex and other body, as for every response: N joints would add up to N k.
//          A contact joint has two bodies, so a contact inside a face is three joints (for two tissues up to nine) with
//          k and mu times the barycentric weights, each working on the path of its own node. Stiff ones hold a face's
//          corners and not the point in it, and show more force: with k=1e7 2.25 N on i2t_stab, where one spring per
//          contact shows 1.79.
// Law      setting=penalty: soft ERP = h k / (h k + mu) and soft CFM = 1 / (h k + mu) make the joint a spring and
//          damper at step h (BASELINES, ODE 10), dWorldStep. A joint whose gap would close within the step gets a
//          wanted speed that closes it and no depth, which is the law of StepLaw.
//          setting=library: as ODE comes: ERP 0.2 and CFM 1e-10 of the world, dWorldQuickStep with 20 iterations, one
//          step per tick whose forces are held, vertex contacts, joints only where there is overlap. No friction in
//          either, since no other response has any.
// Random   QuickStep shuffles its rows: dRandSetSeed each time the world is set anew.
// Without tissue both instruments are particles of `device_mass`, moved by their scripts' velocity; the operator's
//          force is unknown to a response, so a pressed contact is softer by 1 / (1 + h (h k + mu) / m).
//          Between an instrument and a rigid body or instrument the wrench is held over the tick.
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
#include <utility>
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
    bool reduce = true;   ///< one contact per vertex and other body
    LawSettings law = {};
    double device_mass = 0.1;  ///< kg
};

/// A contact joint. Body 1 (`b`) is pushed along the normal, body 2 (`a`) against it; null: the static world.
struct Joint {
    dBodyID b = nullptr;
    dBodyID a = nullptr;
    Vector3 normal = Vector3::Zero();  ///< unit, a to b
    double depth = 0.0;                ///< m, negative where it has yet to close
    double speed = 0.0;                ///< m/s, of b against a along the normal with which the gap stays as it is
    double k = 0.0;                    ///< N/m
    double mu = 0.0;                   ///< N s/m
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
    /// A particle of the pool, kg and m/s.
    dBodyID body(double mass, const Vector3& velocity) {
        if (used_ == bodies_.size()) {
            bodies_.push_back(dBodyCreate(world_));
            dBodySetGyroscopicMode(bodies_.back(), 0);
        }
        dBodyID body = bodies_[used_++];
        dBodyEnable(body);
        constexpr double no_rotation = 1e20;
        dMass inertia;
        dMassSetParameters(&inertia, mass, 0, 0, 0, no_rotation, no_rotation, no_rotation, 0, 0, 0);
        dBodySetMass(body, &inertia);
        dBodySetPosition(body, 0, 0, 0);
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

/// Keeps a world that is never destroyed. Leak checkers report unreachable memory after static objects are destroyed,
/// so the list is never destroyed either.
void abandon(World* world) {
    static auto* const worlds = new std::vector<World*>;  // NOLINT(cppcoreguidelines-owning-memory): never given back
    worlds->push_back(world);
}

Vector3 velocity_of(dBodyID body) {
    if (body == nullptr) return Vector3::Zero();
    const dReal* const v = dBodyGetLinearVel(body);
    return {v[0], v[1], v[2]};
}

class OdeJoints final : public Response, public SubstepSolver {
public:
    explicit OdeJoints(const Settings& settings) : settings_(settings) {}

    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override {
        return settings_.penalty ? laws_.values_in_force() : std::nullopt;
    }
    void prepare(const Topology& topology, const Materials& materials) override {
        use_ode();
        topology_ = &topology;
        materials_ = &materials;
        laws_.prepare(topology, materials, settings_.law);
        points_.prepare(topology);
        world_.reset();
        bodies_.reserve(usual_contacts);
        joints_.reserve(usual_contacts);
        numbers_.reserve(usual_contacts);
        feedback_.reserve(usual_contacts);
        force_.reserve(usual_contacts);
        laws_of_.reserve(usual_contacts);
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

    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        output.solver = this;
        output.solver_timing = settings_.penalty ? SolverTiming::substep : SolverTiming::held;
        laws_of_.clear();
        driven_.clear();
        points_.gather(*topology_, frame, contacts, settings_.reduce, output);
        for (const PointContact& contact : points_.list()) {
            const ContactForceLaw law = spring_damper(*topology_, laws_, frame, dt, contact);
            if (settings_.penalty && law.k + law.mu <= 0.0) continue;
            if (topology_->bodies[at(contact.body_b)].kind == BodyKind::tissue) {
                add_on_tissue(frame, contact, law, output);
            } else {
                driven_.push_back({.contact = &contact, .law = law});
            }
        }
        if (!driven_.empty()) press_driven(frame, dt, output);
    }

    void solve(PredictedStep& step) override {
        bodies_.assign(step.columns(), nullptr);
        joints_.clear();
        numbers_.clear();
        in_world([&] {
            for (std::size_t c = 0; c < step.contacts().size(); ++c) {
                const SolvedContact& contact = step.contacts()[c];
                const bool closes = settings_.penalty && step.depth_after(contact) > 0.0;
                if (contact.depth < 0.0 && !closes) continue;
                Joint joint{.normal = contact.normal,
                            .depth = contact.depth,
                            .speed = contact.surface.dot(contact.normal),
                            .k = laws_of_[contact.source].k,
                            .mu = laws_of_[contact.source].mu};
                for (std::size_t i = 0; i < at(contact.count); ++i) {
                    (contact.weight[i] > 0.0 ? joint.b : joint.a) = body_of(step, contact.column[i]);
                }
                joints_.push_back(joint);
                numbers_.push_back(c);
            }
            if (!joints_.empty()) advance(step.time());
        });
        for (std::size_t j = 0; j < joints_.size(); ++j) {
            const SolvedContact& contact = step.contacts()[numbers_[j]];
            step.push(contact, step.time() * force_[j] * contact.normal);
        }
    }

private:
    struct Law {
        double k = 0.0;   ///< N/m
        double mu = 0.0;  ///< N s/m
    };
    struct Device {
        Index leader = -1;
        dBodyID body = nullptr;
    };
    /// A contact without tissue.
    struct Driven {
        const PointContact* contact = nullptr;
        ContactForceLaw law;
        double impulse = 0.0;  ///< N s, on body b
    };

    /// A world whose step failed inside ODE cannot even be destroyed.
    template <typename Work>
    void in_world(const Work& work) {
        use_ode();
        if (!world_) world_ = std::make_unique<World>();
        inside_ode_ = false;
        try {
            world_->clear();
            dRandSetSeed(1);
            work();
        } catch (...) {
            if (inside_ode_) abandon(world_.release());
            world_.reset();
            throw;
        }
    }

    dBodyID body_of(const PredictedStep& step, Index column) {
        dBodyID& body = bodies_[at(column)];
        if (body == nullptr) body = world_->body(1.0 / step.inverse_mass(column), step.velocity(column));
        return body;
    }

    [[nodiscard]] bool moves(Index vertex) const {
        return vertex >= 0 && (at(vertex) >= materials_->pinned.size() || materials_->pinned[at(vertex)] == 0);
    }

    /// Vertices of a tissue's point, with their shares; at most three.
    std::size_t nodes_of(const ContactPoint& load, std::array<std::pair<Index, double>, 3>& nodes) const {
        if (!settings_.penalty) {
            nodes[0] = {load.heaviest(), 1.0};
            return 1;
        }
        std::size_t count = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            if (load.vertices[i] >= 0 && load.weights[i] > 0.0) nodes[count++] = {load.vertices[i], load.weights[i]};
        }
        return count;
    }

    /// A joint that bears less of a contact makes ODE's matrix too badly scaled for its solver (dxLDLTRemove).
    static constexpr double least_share = 1e-4;

    void add_on_tissue(const Frame& frame, const PointContact& contact, const ContactForceLaw& law,
                       ResponseOutput& output) {
        std::array<std::pair<Index, double>, 3> a{std::pair<Index, double>{-1, 1.0}};
        std::array<std::pair<Index, double>, 3> b;
        const bool both = topology_->bodies[at(contact.body_a)].kind == BodyKind::tissue;
        const std::size_t count_a = both ? nodes_of(contact.a, a) : 1;
        const std::size_t count_b = nodes_of(contact.b, b);
        ContactForceLaw joint = solved_contact(frame, contact, law);
        bool any = false;
        for (std::size_t i = 0; i < count_a; ++i) {
            for (std::size_t j = 0; j < count_b; ++j) {
                if (!moves(a[i].first) && !moves(b[j].first)) continue;
                const double share = a[i].second * b[j].second;
                if (share < least_share) continue;
                any = true;
                joint.vertices = {b[j].first, -1, -1};
                joint.weights = {1.0, 0.0, 0.0};
                joint.reaction_point =
                    law.reaction_point + frame.position.col(b[j].first) - contact.b.blend(frame.position);
                if (both) {
                    joint.reaction_vertices = {a[i].first, -1, -1};
                    joint.reaction_weights = {1.0, 0.0, 0.0};
                }
                output.contacts.push_back(joint);
                laws_of_.push_back({share * law.k, share * law.mu});
            }
        }
        if (!any) output.skip(SkipReason::not_handled);
    }

    dBodyID device(const Frame& frame, Index body) {
        if (topology_->bodies[at(body)].kind != BodyKind::instrument) return nullptr;
        Device& device = device_[at(device_[at(body)].leader)];
        if (device.body == nullptr) {
            const Range range = topology_->bodies[at(device_[at(body)].leader)].vertices;
            const Vector3 velocity = frame.velocity.middleCols(range.first, range.count).rowwise().mean();
            device.body = world_->body(settings_.device_mass, velocity);
        }
        return device.body;
    }

    /// Contacts without tissue, in as many steps as the tissue has; what they give is held over the tick.
    void press_driven(const Frame& frame, double dt, ResponseOutput& output) {
        const int steps = settings_.penalty ? std::max(1, materials_->substeps) : 1;
        const double h = dt / steps;
        for (Device& device : device_) device.body = nullptr;
        joints_.clear();
        in_world([&] {
            for (const Driven& driven : driven_) {
                const PointContact& contact = *driven.contact;
                Joint joint{.b = device(frame, contact.body_b),
                            .a = device(frame, contact.body_a),
                            .normal = contact.normal,
                            .depth = -driven.law.gap,
                            .k = driven.law.k,
                            .mu = driven.law.mu};
                // What the bodies' own velocities lack.
                const Vector3 surface = contact.b.blend(frame.velocity) - contact.a.blend(frame.velocity);
                joint.speed = -(surface - velocity_of(joint.b) + velocity_of(joint.a)).dot(joint.normal);
                joints_.push_back(joint);
            }
            for (int step = 0; step < steps; ++step) {
                dJointGroupEmpty(world_->joints());
                advance(h);
                for (std::size_t j = 0; j < joints_.size(); ++j) {
                    Joint& joint = joints_[j];
                    driven_[j].impulse += h * force_[j];
                    joint.depth -= h * ((velocity_of(joint.b) - velocity_of(joint.a)).dot(joint.normal) - joint.speed);
                }
            }
        });
        for (const Driven& driven : driven_) {
            const PointContact& contact = *driven.contact;
            const Vector3 force = driven.impulse / dt * contact.normal;
            // The reaction lies on the line of the force.
            const Vector3 point = contact.b.blend(frame.position);
            add_wrench(contact.body_b, point, force, output);
            add_wrench(contact.body_a, point, -force, output);
        }
    }

    void add_wrench(Index body, const Vector3& point, const Vector3& force, ResponseOutput& output) const {
        if (topology_->bodies[at(body)].kind != BodyKind::instrument) return;
        Wrench& wrench = output.wrench[at(body)];
        wrench.force += force;
        wrench.moment += point.cross(force);
    }

    /// One step of ODE over h (s) with the joints as they are: `force_`, N, of each on its body 1 along the normal.
    void advance(double h) {
        feedback_.resize(joints_.size());
        force_.assign(joints_.size(), 0.0);
        for (std::size_t j = 0; j < joints_.size(); ++j) {
            const Joint& joint = joints_[j];
            if (!velocity_of(joint.b).allFinite() || !velocity_of(joint.a).allFinite()) {
                throw std::runtime_error("the state of a node is not finite");
            }
            // ODE attaches a joint with the static world by its first body.
            const bool turned = joint.b == nullptr;
            dContact contact = {};
            for (int axis = 0; axis < 3; ++axis) contact.geom.normal[axis] = (turned ? -1.0 : 1.0) * joint.normal[axis];
            contact.geom.depth = std::max(joint.depth, 0.0);
            contact.surface.mode = dContactMotionN;
            contact.surface.motionN = joint.speed + std::min(joint.depth, 0.0) / h;
            if (settings_.penalty) {
                contact.surface.mode |= dContactSoftERP | dContactSoftCFM;
                contact.surface.soft_erp = h * joint.k / (h * joint.k + joint.mu);
                contact.surface.soft_cfm = 1.0 / (h * joint.k + joint.mu);
            }
            const dJointID id = dJointCreateContact(world_->id(), world_->joints(), &contact);
            dJointAttach(id, turned ? joint.a : joint.b, turned ? nullptr : joint.a);
            dJointSetFeedback(id, &feedback_[j]);
        }
        inside_ode_ = true;
        const int done = settings_.quick ? dWorldQuickStep(world_->id(), h) : dWorldStep(world_->id(), h);
        inside_ode_ = false;
        if (done == 0) throw std::runtime_error("ODE's step ran out of memory");
        for (std::size_t j = 0; j < joints_.size(); ++j) {
            const dReal* const f = feedback_[j].f1;
            force_[j] = Vector3(f[0], f[1], f[2]).dot(joints_[j].normal) * (joints_[j].b == nullptr ? -1.0 : 1.0);
            if (!std::isfinite(force_[j])) throw std::runtime_error("ODE's solution is not finite");
        }
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
    std::unique_ptr<World> world_;
    bool inside_ode_ = false;
    std::vector<Device> device_;
    std::vector<Law> laws_of_;  ///< per contact of the output
    std::vector<Driven> driven_;
    std::vector<dBodyID> bodies_;  ///< per column of the step
    std::vector<Joint> joints_;
    std::vector<std::size_t> numbers_;  ///< per joint, of its contact in the step
    std::vector<dJointFeedback> feedback_;
    std::vector<double> force_;  ///< N, per joint
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
    entry.parameters = {
        choice_parameter(
            "setting", "penalty", {"penalty", "library"},
            "ERP and CFM that make a joint the spring k and damper mu, or the library's own (ERP 0.2, CFM 1e-10)"),
        choice_parameter("stepper", "auto", {"auto", "world", "quick"},
                         "dWorldStep or dWorldQuickStep; auto: the first for penalty, the second for library"),
        reduction_parameter(),
        number_parameter("device_mass", "kg", "0.1", 1e-6, 1e3,
                         "mass that stands for an instrument against another instrument or a rigid body")};
    const std::vector<Parameter> law = law_parameters(auto_stiffness);
    entry.parameters.insert(entry.parameters.begin() + 1, law.begin(), law.end());
    // `proximity` offers several open features per vertex. dWorldStep's dense solver takes minutes per simulated second
    // for them, and a check of its own fails (dxLDLTRemove).
    entry.why_unreadable = [](const ParameterValues& values, std::string_view generator) -> std::string {
        const bool dense =
            values.is("stepper", "auto") ? values.is("setting", "penalty") : values.is("stepper", "world");
        if (generator != "proximity" || !dense) return {};
        return "dWorldStep of ode_joints cannot bear the many open contacts of 'proximity'; take stepper=quick or "
               "another "
               "contact generator";
    };
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        if (!ode_precision_matches()) {
            throw InputError("ode_joints: ODE's library and headers differ in the size of a number");
        }
        Settings s;
        s.penalty = values.is("setting", "penalty");
        s.quick = values.is("stepper", "auto") ? !s.penalty : values.is("stepper", "quick");
        s.reduce = values.is("reduction", "vertex");
        s.law = read_law_settings(values);
        s.device_mass = values.number("device_mass");
        return std::make_unique<OdeJoints>(s);
    };
    return entry;
}

}  // namespace trocar
