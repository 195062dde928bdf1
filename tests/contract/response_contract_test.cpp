// What every registered response owes its caller, ours or foreign, with each of its profiles on every contact generator
// that it takes. What one is known to get wrong is listed in known_gaps.json with the reason; it must go on failing, or
// the list is out of date.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <stdexcept>

#include "contact/usable.hpp"
#include "contract/contract_support.hpp"
#include "contract/response_methods.hpp"
#include "contract/stepper_methods.hpp"
#include "measure/allocations.hpp"
#include "simulate/simulation.hpp"
#include "support/materials.hpp"
#include "support/scene_samples.hpp"
#include "support/shown_force.hpp"

namespace trocar::test {
namespace {

// ------------------------------------------------------------------ what responses are asked about

/// Frames and contacts of a run, to be asked about again.
struct Take {
    Scene scene;
    std::vector<Frame> frames = {};
    std::vector<ContactSet> contacts = {};
    bool has_contacts = false;
};

struct Shot {
    const char* scene;
    double faster;
    int ticks;
};
constexpr Shot shots[] = {{"i2t_drag", 8.0, 90},    {"i2t_stab", 4.0, 30},      {"i2t_grasp", 12.0, 80},
                          {"t2t_press", 8.0, 80},   {"i2t_deep_start", 1.0, 5}, {"i2i_cross", 8.0, 80},
                          {"i2r_scrape", 8.0, 100}, {"r2t_bone", 8.0, 80}};

/// A run that `penalty` holds, which takes every contact generator. Once per generator.
const std::vector<Take>& takes(const std::string& source) {
    static std::map<std::string, std::vector<Take>> all;
    std::vector<Take>& list = all[source];
    if (!list.empty()) return list;
    const ContactGeneratorEntry& entry = registry().contact_generator(source);
    for (const Shot& shot : shots) {
        Take take{.scene = quick_scene(shot.scene, shot.faster)};
        Simulation simulation(take.scene, make_detector(detector_for(entry)), make_response("penalty"), entry);
        for (int tick = 0; tick < shot.ticks && simulation.outcome().ok(); ++tick) {
            simulation.step();
            take.frames.push_back(simulation.seen());
            take.contacts.push_back(simulation.contacts());
            take.has_contacts = take.has_contacts || !simulation.contacts().contacts.empty();
        }
        list.push_back(std::move(take));
    }
    return list;
}

struct Instance {
    std::unique_ptr<Response> response;
    ResponseOutput output;
    std::vector<ContactForce> contact_forces;

    Instance(const std::string& method, const Topology& topology, const Materials& materials)
        : response(make_response(method)) {
        response->prepare(topology, materials);
        output.resize(topology.vertex_count, topology.body_count());
    }
    /// No stepper runs: there are no contact forces.
    void respond(const Take& take, std::size_t tick) { respond(take, tick, take.contacts[tick]); }
    void respond(const Take& take, std::size_t tick, const ContactSet& contacts) {
        response->respond(take.frames[tick], take.scene.dt, contacts, contact_forces, output);
        contact_forces.assign(output.contacts.size(), {});
    }
};

std::string over_takes(const ResponseMethod& who, const std::function<std::string(const Take&)>& check) {
    std::string failures;
    for (const Take& take : takes(who.source)) {
        if (!take.has_contacts && who.source != "native") failures += take.scene.name + ": no contacts for a test\n";
        const std::string failure = check(take);
        if (!failure.empty()) failures += fmt::format("{}: {}\n", take.scene.name, failure);
    }
    return failures;
}

// ------------------------------------------------------------------ equality to the bit

using Bits = std::vector<std::uint64_t>;

void append(Bits& bits, double number) { bits.push_back(std::bit_cast<std::uint64_t>(number)); }
void append(Bits& bits, Index number) { bits.push_back(static_cast<std::uint64_t>(number)); }
void append(Bits& bits, const Vector3& v) {
    for (int i = 0; i < 3; ++i) append(bits, v[i]);
}
void append(Bits& bits, const Matrix3X& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) append(bits, Vector3(m.col(c)));
}
template <typename T, std::size_t N>
void append(Bits& bits, const std::array<T, N>& all) {
    for (const T& one : all) append(bits, one);
}

Bits bits_of(const Frame& frame) {
    Bits bits;
    append(bits, frame.position);
    append(bits, frame.previous);
    append(bits, frame.velocity);
    for (const Vector3& motion : frame.operator_motion) append(bits, motion);
    for (const Pose& pose : frame.pose) {
        append(bits, pose.translation);
        append(bits, pose.jaw);
    }
    append(bits, frame.time);
    return bits;
}

Bits bits_of(const ContactSet& set) {
    Bits bits;
    for (const auto list : {&ContactSet::pairs, &ContactSet::near}) {
        for (const TrianglePair& pair : set.*list) {
            append(bits, pair.a);
            append(bits, pair.b);
        }
    }
    for (const auto list : {&ContactSet::contacts, &ContactSet::native}) {
        for (const Contact& one : set.*list) {
            for (const Index number : {one.a, one.b, one.vertex_a, one.vertex_b, one.body_a, one.body_b})
                append(bits, number);
            for (const Vector3& v : {one.point, one.normal, one.interval_direction}) append(bits, v);
            for (const double number : {one.depth, one.interval_length, one.gap, one.approach}) append(bits, number);
            for (const ContactPoint& point : {one.on_a, one.on_b}) {
                append(bits, point.vertices);
                append(bits, point.weights);
            }
            bits.push_back(one.id);
        }
    }
    append(bits, set.query_distance);
    return bits;
}

Bits bits_of(const ResponseOutput& output) {
    Bits bits;
    for (const ContactForceLaw& one : output.contacts) {
        bits.push_back(static_cast<std::uint64_t>(one.role));
        bits.push_back(one.source_id);
        append(bits, one.vertices);
        append(bits, one.weights);
        append(bits, one.reaction_vertices);
        append(bits, one.reaction_weights);
        for (const Vector3& v : {one.normal, one.reaction_point, one.surface_velocity}) append(bits, v);
        for (const double number : {one.gap, one.k, one.mu, one.face_velocity, one.limit, one.friction, one.tangent_k})
            append(bits, number);
        append(bits, one.reaction_body);
        append(bits, one.slip_key);
    }
    for (const PositionCorrection& one : output.position_corrections) {
        append(bits, one.vertex);
        append(bits, one.position);
        append(bits, one.velocity);
    }
    append(bits, output.held_force);
    for (const Wrench& wrench : output.wrench) {
        append(bits, wrench.force);
        append(bits, wrench.moment);
    }
    return bits;
}

// ------------------------------------------------------------------ checks: empty text = kept

/// The two sides of every contact force law are on one line along its normal; where all that can be touched is tissue
/// or instruments, somebody takes the reaction, and vertices only where they are tissue's; wrenches between instruments
/// sum to none.
std::string action_is_reaction(const ResponseMethod& who) {
    constexpr double most_arm = 1e-6;  // m, against mesh edges of 3 to 5 mm
    return over_takes(who, [&who](const Take& take) {
        const Topology& topology = take.scene.topology;
        const auto kind = [&topology](Index body) { return topology.bodies[at(body)].kind; };
        const bool has_bone = std::any_of(topology.bodies.begin(), topology.bodies.end(),
                                          [](const BodyRange& body) { return body.kind == BodyKind::rigid; });
        const bool has_tissue = std::any_of(topology.bodies.begin(), topology.bodies.end(),
                                            [](const BodyRange& body) { return body.kind == BodyKind::tissue; });
        Instance one(who.method, topology, take.scene.materials);
        double arm = 0.0;
        std::string place;  // of the longest arm
        double off_sum = 0.0;
        std::size_t untaken = 0;
        std::size_t off_tissue = 0;
        std::size_t count = 0;
        double wrench_off = 0.0;
        double wrench_all = 1e-3;
        for (std::size_t tick = 0; tick < take.frames.size(); ++tick) {
            one.respond(take, tick);
            const Matrix3X& x = take.frames[tick].position;
            for (const ContactForceLaw& linear : one.output.contacts) {
                ++count;
                // A grasp pulls by three springs along the axes, whose moments cancel together.
                if (linear.role == ContactRole::grasp) continue;
                const double before = arm;
                off_sum = std::max(off_sum, std::abs(linear.weights[0] + linear.weights[1] + linear.weights[2] - 1.0));
                const bool on_tissue = any_vertex(linear.reaction_vertices) >= 0;
                Vector3 reaction = linear.reaction_point;
                if (on_tissue) {
                    // A body's vertices take nothing: its reaction would be lost.
                    for (const Index vertex : linear.reaction_vertices) {
                        if (vertex >= 0 && kind(topology.body_of_vertex(vertex)) != BodyKind::tissue) ++off_tissue;
                    }
                    reaction = blend(linear.reaction_vertices, linear.reaction_weights, x);
                    off_sum = std::max(off_sum, std::abs(linear.reaction_weights[0] + linear.reaction_weights[1] +
                                                         linear.reaction_weights[2] - 1.0));
                } else if (linear.reaction_body < 0 || kind(linear.reaction_body) == BodyKind::rigid) {
                    if (!has_bone) ++untaken;
                    continue;
                }
                const Vector3 between = blend(linear.vertices, linear.weights, x) - reaction;
                arm = std::max(arm, between.cross(linear.normal).norm());
                if (arm > before)
                    place = fmt::format("tick {}, contact {}, vertices {}, feature id {}", tick, count,
                                        fmt::join(linear.vertices, " "), linear.source_id);
            }
            if (has_bone || has_tissue) continue;
            Vector3 force = Vector3::Zero();
            Vector3 moment = Vector3::Zero();
            for (const Wrench& wrench : one.output.wrench) {
                force += wrench.force;
                moment += wrench.moment;
                wrench_all = std::max({wrench_all, wrench.force.norm(), wrench.moment.norm()});
            }
            wrench_off = std::max({wrench_off, force.norm(), moment.norm()});
        }
        std::string failure;
        if (off_sum > 1e-9) failure += fmt::format("weights sum to 1 ± {:g}; ", off_sum);
        if (untaken > 0) failure += fmt::format("nobody takes the reaction of {} of {} contacts; ", untaken, count);
        if (off_tissue > 0) failure += fmt::format("reactions on {} vertices that are no tissue's; ", off_tissue);
        if (arm > most_arm)
            failure += fmt::format(
                "action and reaction {:g} m beside each other ({}; remedy: react at the pushed point - gap * normal, "
                "or on tissue at the weights of its projection on the face's plane); ",
                arm, place);
        if (wrench_off > 1e-9 * wrench_all)
            failure += fmt::format("wrenches sum to {:g} of {:g}; ", wrench_off, wrench_all);
        return failure;
    });
}

std::string inputs_are_untouched(const ResponseMethod& who) {
    return over_takes(who, [&who](const Take& take) -> std::string {
        Instance one(who.method, take.scene.topology, take.scene.materials);
        for (std::size_t tick = 0; tick < take.frames.size(); ++tick) {
            const Bits frame = bits_of(take.frames[tick]);
            const Bits contacts = bits_of(take.contacts[tick]);
            one.respond(take, tick);
            if (bits_of(take.frames[tick]) != frame) return fmt::format("tick {}: the frame has changed", tick);
            if (bits_of(take.contacts[tick]) != contacts)
                return fmt::format("tick {}: the contacts have changed", tick);
        }
        return {};
    });
}

std::string no_contact_no_force(const ResponseMethod& who) {
    return over_takes(who, [&who](const Take& take) -> std::string {
        Instance one(who.method, take.scene.topology, take.scene.materials);
        for (std::size_t tick = 0; tick < take.frames.size(); ++tick) {
            ContactSet nothing;
            nothing.query_distance = take.contacts[tick].query_distance;
            one.respond(take, tick, nothing);
            const ResponseOutput& output = one.output;
            if (!output.contacts.empty()) return fmt::format("tick {}: {} contacts", tick, output.contacts.size());
            if (!output.position_corrections.empty())
                return fmt::format("tick {}: {} position corrections", tick, output.position_corrections.size());
            if (!output.held_force.isZero(0.0)) return fmt::format("tick {}: a held force", tick);
            for (const Wrench& wrench : output.wrench) {
                if (!wrench.force.isZero(0.0) || !wrench.moment.isZero(0.0))
                    return fmt::format("tick {}: a wrench", tick);
            }
        }
        return {};
    });
}

/// N, per vertex and mean over a tick of the default stepper, of all that acts on tissue: what a solver of the
/// response's own gives is known no sooner.
Matrix3X pushed_in_a_tick(const Take& take, std::size_t tick, const ResponseOutput& output, Stepper& tissue) {
    const Frame& before = take.frames[tick];
    Frame after = before;
    std::vector<Wrench> reaction(output.wrench.size());
    const Outcome outcome = tissue.advance(output, take.scene.dt, before, after, reaction);
    if (!outcome.ok()) throw std::runtime_error(outcome.message);
    Matrix3X push = (after.velocity - before.velocity) / take.scene.dt;
    for (std::size_t v = 0; v < take.scene.materials.mass.size(); ++v) {
        push.col(static_cast<Eigen::Index>(v)) *= take.scene.materials.mass[v];
    }
    return push;
}

std::unique_ptr<Stepper> stepper_for(const Take& take) {
    std::unique_ptr<Stepper> stepper = make_stepper(registry().default_stepper().name);
    stepper->prepare(take.scene.topology, take.scene.materials);
    return stepper;
}

std::string same_bits_twice(const ResponseMethod& who) {
    return over_takes(who, [&who](const Take& take) -> std::string {
        Instance one(who.method, take.scene.topology, take.scene.materials);
        Instance two(who.method, take.scene.topology, take.scene.materials);
        const std::unique_ptr<Stepper> tissue = stepper_for(take);
        for (std::size_t tick = 0; tick < take.frames.size(); ++tick) {
            one.respond(take, tick);
            two.respond(take, tick);
            if (bits_of(one.output) != bits_of(two.output)) return fmt::format("tick {}: other effects", tick);
            if (one.output.solver == nullptr) continue;
            const Matrix3X push = pushed_in_a_tick(take, tick, one.output, *tissue);
            if (push != pushed_in_a_tick(take, tick, two.output, *tissue))
                return fmt::format("tick {}: other impulses", tick);
        }
        return {};
    });
}

/// What a response output does to every vertex, in whatever order it is reported: the force of its contacts with
/// nothing moving, held forces, and where vertices are put.
Matrix3X done_to_vertices(const ResponseOutput& output, const Matrix3X& position) {
    constexpr double per_metre = 1000.0;  // N/m, so that places stand beside forces
    Matrix3X sum = output.held_force;
    for (const ContactForceLaw& one : output.contacts) {
        const double force = one.k * -one.gap + one.mu * one.face_velocity;
        for (std::size_t i = 0; i < 3; ++i) {
            if (one.vertices[i] >= 0) sum.col(one.vertices[i]) += one.weights[i] * force * one.normal;
            if (one.reaction_vertices[i] >= 0)
                sum.col(one.reaction_vertices[i]) -= one.reaction_weights[i] * force * one.normal;
        }
    }
    for (const PositionCorrection& one : output.position_corrections) {
        sum.col(one.vertex) += per_metre * (one.position - position.col(one.vertex)) + one.velocity;
    }
    return sum;
}

std::string order_of_contacts(const ResponseMethod& who) {
    return over_takes(who, [&who](const Take& take) -> std::string {
        Instance one(who.method, take.scene.topology, take.scene.materials);
        Instance two(who.method, take.scene.topology, take.scene.materials);
        const std::unique_ptr<Stepper> tissue = stepper_for(take);
        std::mt19937 random(5);
        double worst = 0.0;
        double largest = 1e-6;
        for (std::size_t tick = 0; tick < take.frames.size(); ++tick) {
            ContactSet other = take.contacts[tick];
            std::shuffle(other.contacts.begin(), other.contacts.end(), random);
            one.respond(take, tick);
            two.respond(take, tick, other);
            const Matrix3X& x = take.frames[tick].position;
            const Matrix3X here = done_to_vertices(one.output, x);
            largest = std::max(largest, here.cwiseAbs().maxCoeff());
            worst = std::max(worst, (here - done_to_vertices(two.output, x)).cwiseAbs().maxCoeff());
            if (one.output.solver != nullptr) {
                const Matrix3X push = pushed_in_a_tick(take, tick, one.output, *tissue);
                largest = std::max(largest, push.cwiseAbs().maxCoeff());
                const Matrix3X off = push - pushed_in_a_tick(take, tick, two.output, *tissue);
                worst = std::max(worst, off.cwiseAbs().maxCoeff());
            }
            for (std::size_t body = 0; body < one.output.wrench.size(); ++body) {
                const Vector3 off = one.output.wrench[body].force - two.output.wrench[body].force;
                largest = std::max(largest, one.output.wrench[body].force.norm());
                worst = std::max(worst, off.norm());
            }
        }
        return worst > 1e-9 * largest ? fmt::format("{:g} of {:g} N", worst, largest) : std::string();
    });
}

/// The same run on the same scene with its triangles reported in another order.
std::string order_of_triangles(const ResponseMethod& who) {
    std::string failures;
    const ContactGeneratorEntry& source = registry().contact_generator(who.source);
    for (const auto& [name, faster, ticks] : {Shot{"i2t_drag", 12.0, 30}, Shot{"t2t_press", 12.0, 30}}) {
        const Scene scene = quick_scene(name, faster);
        const Scene other = permuted(scene, shuffled(scene.topology, 3, Shuffle::triangles));
        Simulation one(scene, make_detector(detector_for(source)), make_response(who.method), source);
        Simulation two(other, make_detector(detector_for(source)), make_response(who.method), source);
        double worst = 0.0;
        for (int tick = 0; tick < ticks; ++tick) {
            one.step();
            two.step();
            worst = std::max(worst, (one.frame().position - two.frame().position).cwiseAbs().maxCoeff());
        }
        // Rounding of another order of sums, grown by the run.
        constexpr double rounding = 1e-9;  // m, of motions of some millimetres
        if (!(worst <= rounding) || one.outcome().kind != two.outcome().kind)
            failures += fmt::format("{}: {:g} m\n", name, worst);
    }
    return failures;
}

Materials plain_materials(const Topology& topology) {
    Materials materials = empty_materials(topology);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            materials.mass[at(v)] = 2.5e-5;
            materials.area[at(v)] = 8e-6;
            materials.mean_stiffness[at(v)] = 100.0;
        }
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) materials.triangle_stiffness[at(t)] = 100.0;
    }
    return materials;
}

/// Triangles on a lattice, coplanar, of no area, equal points, needles, huge beside tiny: as they stand.
std::string finite_on_hard_frames(const ResponseMethod& who) {
    std::string failures;
    const ContactGeneratorEntry& source = registry().contact_generator(who.source);
    std::vector<World> worlds = touching_scenes();
    for (const auto& more : {zero_area_scenes(), long_triangle_scenes()}) {
        worlds.insert(worlds.end(), more.begin(), more.end());
    }
    for (World& world : worlds) {
        world.frame.pose.assign(world.topology.bodies.size(), {});
        const double query_distance = source.wants_query_distance ? 1e-3 : 0.0;
        // The exact one whatever the generator: libraries may give up on such frames.
        if (source.wants_native) continue;
        const auto detector = make(registry().detector("brute_force"));
        detector->prepare(world.topology, world.frame);
        ContactSet contacts = answer(*detector, world, false, query_distance);
        const auto gatherer = source.make(ParameterValues(source.name, source.parameters, {}));
        gatherer->prepare(world.topology, world.frame);
        gatherer->gather(world.frame, contacts);
        const Outcome reported = check_contacts(world.topology, contacts);
        if (!reported.ok()) failures += fmt::format("{}: {}\n", world.name, reported.message);
        if (!reported.ok()) continue;
        Instance one(who.method, world.topology, plain_materials(world.topology));
        const Materials materials = plain_materials(world.topology);
        one.response->prepare(world.topology, materials);
        for (int twice = 0; twice < 2; ++twice) {
            one.response->respond(world.frame, 1e-3, contacts, one.contact_forces, one.output);
            one.contact_forces.assign(one.output.contacts.size(), {});
            const Outcome done = check_output(world.topology, one.output);
            if (!done.ok()) failures += fmt::format("{}: {}\n", world.name, done.message);
        }
    }
    return failures;
}

/// The frames once so that buffers grow, then again.
std::string nothing_allocated(const ResponseMethod& who) {
    if (allocation_count() < 0) return {};
    return over_takes(who, [&who](const Take& take) -> std::string {
        Instance one(who.method, take.scene.topology, take.scene.materials);
        one.contact_forces.reserve(1 << 14);
        one.output.contacts.reserve(1 << 14);
        one.output.position_corrections.reserve(1 << 14);
        const std::unique_ptr<Stepper> tissue = stepper_for(take);
        Frame after = take.frames.front();
        std::vector<Wrench> reaction(one.output.wrench.size());
        const auto answer = [&](std::size_t tick) {
            one.respond(take, tick);
            if (one.output.solver == nullptr) return;
            tissue->advance(one.output, take.scene.dt, take.frames[tick], after, reaction);
        };
        for (int pass = 0; pass < 2; ++pass) {
            for (std::size_t tick = 0; tick < take.frames.size(); ++tick) answer(tick);
        }
        std::int64_t count = 0;
        for (std::size_t tick = 0; tick < take.frames.size(); ++tick) {
            const std::int64_t before = allocation_count();
            answer(tick);
            count += allocation_count() - before;
        }
        return count > 0 ? fmt::format("{} allocations", count) : std::string();
    });
}

// ------------------------------------------------------------------ contacts that cannot be

enum class Fault { none, gap, vertex, normal };

/// A contact generator whose contacts have a fault from some tick on.
class Faulty final : public ContactGenerator {
public:
    Faulty(std::unique_ptr<ContactGenerator> source, Fault fault) : source_(std::move(source)), fault_(fault) {}
    void prepare(const Topology& topology, const Frame& first) override {
        vertex_count_ = topology.vertex_count;
        source_->prepare(topology, first);
    }
    void gather(const Frame& frame, ContactSet& contacts) override {
        source_->gather(frame, contacts);
        for (Contact& one : contacts.contacts) {
            if (!std::isfinite(one.gap) || !one.normal.allFinite()) continue;
            ++changed;
            if (fault_ == Fault::gap) one.gap = std::nan("");
            if (fault_ == Fault::vertex) one.on_a.vertices[0] = vertex_count_ + 7;
            if (fault_ == Fault::normal) one.normal = -one.normal;
        }
    }
    static inline std::int64_t changed = 0;

private:
    std::unique_ptr<ContactGenerator> source_;
    Fault fault_;
    Index vertex_count_ = 0;
};

Outcome outcome_with(const ResponseMethod& who, Fault fault, std::string& failures) {
    ContactGeneratorEntry source = registry().contact_generator(who.source);
    const auto make_sound = source.make;
    source.make = [&](const ParameterValues& values) { return std::make_unique<Faulty>(make_sound(values), fault); };
    Faulty::changed = 0;
    const Scene scene = quick_scene("i2t_drag", 8.0);
    Simulation simulation(scene, make_detector(detector_for(source)), make_response(who.method), source);
    for (int tick = 0; tick < 60 && simulation.outcome().ok(); ++tick) {
        simulation.step();
        if (!simulation.frame().all_finite()) failures += "a frame that is not finite\n";
    }
    if (Faulty::changed == 0) failures += "no contact to change\n";
    return simulation.outcome();
}

std::string faulty_contacts_have_a_name(const ResponseMethod& who) {
    std::string failures;
    const auto expect = [&](Fault fault, OutcomeKind kind, const char* what) {
        const Outcome outcome = outcome_with(who, fault, failures);
        if (outcome.kind != kind || outcome.message.find(what) == std::string::npos)
            failures += fmt::format("expected {} ({}), found {} ({})\n", name_of(kind), what, name_of(outcome.kind),
                                    outcome.message);
    };
    // Native contacts leave unset what their library does not report.
    if (who.source != "native") expect(Fault::gap, OutcomeKind::not_finite, "contacts: a gap");
    expect(Fault::vertex, OutcomeKind::threw, "contacts: a vertex");
    // A contact whose normal points the other way is like others: it may pull, or blow the tissue up, by name.
    const Outcome turned = outcome_with(who, Fault::normal, failures);
    if (!turned.ok() && turned.kind != OutcomeKind::unstable && turned.kind != OutcomeKind::not_finite)
        failures += fmt::format("a normal turned round: {} ({})\n", name_of(turned.kind), turned.message);
    return failures;
}

// ------------------------------------------------------------------ open contacts

constexpr double approach_speed = 0.05;  // m/s
constexpr int substeps = 4;

/// A box above the middle vertex of a sheet that has next to no springs. From tick 1 on the box moves along z; at the
/// start of tick 3 its lower face is `gap` metres above the sheet.
Scene box_over_sheet(double gap, double speed) {
    constexpr double dt = 1e-3;
    const double first = 0.005 + gap - 2.0 * speed * dt;
    Scene scene = scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"box_over_sheet","unit":"m","dt":{},"ticks":10,"seed":1,"bodies":[
      {{"name":"sheet","kind":"tissue","closed":false,"parts":[{{"shape":"sheet","size":[0.02,0.02],"edge":0.01}}]}},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{{"shape":"box","size":[0.01,0.01,0.01],"edge":0.01}}],
       "motion":{{"drive":"prescribed","keys":[{{"time":0,"pose":[0,0,{},0,0,0]}},
                                            {{"time":1,"pose":[0,0,{},0,0,0]}}]}}}}]}})",
        dt, first, first + speed));
    for (double& mass : scene.materials.mass) mass = 1e-4;
    for (double& drag : scene.materials.drag) drag = 0.0;
    for (Spring& spring : scene.materials.springs) {
        spring.k = 1e-3;
        spring.preload = 0.0;
        spring.damping = 0.0;
    }
    scene.materials.rest_bias.setZero();
    scene.materials.substeps = substeps;
    return scene;
}

/// Offers one contact in every tick: the free vertex of the sheet against the box's lower face.
class FaceOverVertex final : public ContactGenerator {
public:
    explicit FaceOverVertex(Index vertex) : vertex_(vertex) {}
    void prepare(const Topology& topology, const Frame& first) override {
        const Range box = topology.bodies[0].vertices;
        const double low = first.position.row(2).segment(box.first, box.count).minCoeff();
        for (Index t = topology.bodies[0].triangles.first; t < topology.bodies[0].triangles.end(); ++t) {
            const auto corner = topology.triangles.col(t);
            const bool lowest =
                std::all_of(corner.begin(), corner.end(), [&](Index v) { return first.position(2, v) < low + 1e-6; });
            if (lowest) face_ = {{corner[0], corner[1], corner[2]}, {0.5, 0.25, 0.25}};
        }
    }
    void gather(const Frame& frame, ContactSet& contacts) override {
        Contact one;
        one.kind = ContactCase::point_face;
        one.body_a = 0;
        one.body_b = 1;
        one.on_a = face_;
        one.on_b = ContactPoint::at_vertex(vertex_);
        one.normal = -Vector3::UnitZ();
        one.point = face_.blend(frame.previous);
        one.gap = one.point.z() - frame.position(2, vertex_);
        one.approach = face_.blend(frame.position).z() - one.point.z();
        one.depth = std::max(0.0, -one.gap);
        one.side = one.gap < 0.0 ? -1 : 1;
        one.id = 1;
        contacts.contacts = {one};
    }

private:
    Index vertex_;
    ContactPoint face_;
};

/// The method with a stiff spring that settles at once and nothing that softens it, as far as it has such parameters.
std::string stiffest(const std::string& method) {
    MethodSpec spec = parse_method(method);
    for (const Parameter& parameter : registry().response(spec.name).parameters) {
        for (const auto& [name, value] : {std::pair{"k", "1e6"},
                                          {"relaxation_time", "1e-5"},
                                          {"contact_offset", "0"},
                                          {"clear_speed", "none"},
                                          {"pressure", "none"}}) {
            if (parameter.name == name) spec.parameters[name] = value;
        }
    }
    return spec.text();
}

/// m, that the vertex has moved down in tick 3, and what the last contact of the two next ticks gave (N). NaN: the
/// stepper does not take the output.
struct Answered {
    double moved = std::nan("");
    double force = 0.0;
    double force_after = 0.0;
};
Answered answer_to(const std::string& method, const std::string& stepper, double gap, double speed) {
    const Scene scene = box_over_sheet(gap, speed);
    const Range sheet = scene.topology.bodies[1].vertices;
    Index middle = -1;
    for (Index v = sheet.first; v < sheet.end(); ++v) {
        if (scene.materials.pinned[at(v)] == 0) middle = v;
    }
    ContactGeneratorEntry source = registry().contact_generator("tracked_proximity");
    source.make = [middle](const ParameterValues&) { return std::make_unique<FaceOverVertex>(middle); };
    Simulation simulation(scene, make_detector("brute_force"), make_response(stiffest(method)), source,
                          {.stepper = parse_method(stepper), .watched = false});
    Answered answered;
    const auto force = [&simulation] {
        double sum = 0.0;
        for (const ContactForce& load : simulation.contact_forces()) sum += std::abs(load.normal);
        return sum + simulation.output().held_force.norm();
    };
    double before = 0.0;
    for (int tick = 0; tick <= 5; ++tick) {
        if (tick == 3) before = simulation.frame().position(2, middle);
        simulation.step();
        if (simulation.outcome().kind == OutcomeKind::unsupported) return {};
        if (tick == 3) answered.moved = before - simulation.frame().position(2, middle);
        if (tick == 3) answered.force = force();
        if (tick == 5) answered.force_after = force();
    }
    return answered;
}

/// A face that closes a gap within the j-th sub-step moves the vertex from there on, and not at all where it closes
/// after the tick; a face that leaves an overlap never draws the vertex after it.
std::string open_contact_joins(const ResponseMethod& who) {
    if (who.source != "tracked_proximity") return {};
    std::string failures;
    constexpr double h = 1e-3 / substeps;
    for (const std::string& stepper : stepper_methods()) {
        // One that takes a single step a tick sees no sub-step.
        for (int j = 0; j <= substeps; ++j) {
            const double gap = (j + 0.5) * approach_speed * h;
            const Answered closing = answer_to(who.method, stepper, gap, -approach_speed);
            if (std::isnan(closing.moved)) continue;
            const double expected = approach_speed * 1e-3 - gap;
            if (j < substeps && !(std::abs(closing.moved - expected) <= 0.05 * approach_speed * 1e-3)) {
                failures += fmt::format("{}, gap closes in sub-step {}: vertex moved by {:g} m instead of {:g}\n",
                                        stepper, j, closing.moved, expected);
            }
            if (j == substeps && (closing.moved != 0.0 || closing.force != 0.0)) {
                failures += fmt::format("{}, gap stays open: vertex moved by {:g} m with {:g} N\n", stepper,
                                        closing.moved, closing.force);
            }
            const Answered leaving = answer_to(who.method, stepper, -gap, approach_speed);
            constexpr double by_springs = 1e-11;  // m, of a vertex that lies still where it has been put
            if (!(leaving.moved >= -by_springs) || leaving.force_after != 0.0) {
                failures += fmt::format("{}, face leaves an overlap of {:g} m: vertex moved by {:g} m, {:g} N left\n",
                                        stepper, gap, leaving.moved, leaving.force_after);
            }
        }
    }
    return failures;
}

struct Check {
    const char* name;
    std::string (*run)(const ResponseMethod&);
};
constexpr Check checks[] = {
    {"ActionIsReaction", action_is_reaction},
    {"InputsAreUntouched", inputs_are_untouched},
    {"NoContactNoForce", no_contact_no_force},
    {"SameBitsTwice", same_bits_twice},
    {"OrderOfContactsMakesNoDifference", order_of_contacts},
    {"OrderOfTrianglesMakesNoDifference", order_of_triangles},
    {"FiniteOnHardFrames", finite_on_hard_frames},
    {"NothingAllocatedAfterWarmUp", nothing_allocated},
    {"FaultyContactsHaveANamedOutcome", faulty_contacts_have_a_name},
    {"AnOpenContactJoinsInItsSubStep", open_contact_joins},
};

void PrintTo(const Check& check, std::ostream* stream) { *stream << check.name; }

class ResponseContract : public testing::TestWithParam<std::tuple<ResponseMethod, Check>> {};

TEST_P(ResponseContract, Holds) {
    const auto& [who, check] = GetParam();
    std::string failures;
    try {
        failures = check.run(who);
    } catch (const std::exception& error) {
        failures = fmt::format("threw: {}", error.what());
    }
    expect_kept(who, check.name, failures);
}

INSTANTIATE_TEST_SUITE_P(Every, ResponseContract,
                         testing::Combine(testing::ValuesIn(response_methods()), testing::ValuesIn(checks)),
                         [](const auto& tested) {
                             return std::get<0>(tested.param).name() + "_" + std::get<1>(tested.param).name;
                         });

TEST(KnownResponseGaps, NameOnlyResponsesAndChecksThatExist) {
    const auto methods = response_methods();
    for (const auto& [key, reason] : known_gaps("response_contract")) {
        const auto& [method, name] = key;
        const bool absent = std::none_of(methods.begin(), methods.end(), [&m = method](const auto& who) {
            return who.name() == m || "*_" + who.source == m;
        });
        // Foreign methods may be absent from this build.
        EXPECT_FALSE(absent && method.rfind("ode_joints", 0) != 0 && method.find("native") == std::string::npos)
            << method;
        EXPECT_TRUE(
            name.rfind("NothingReportedIsNothingDone", 0) == 0 ||
            std::any_of(std::begin(checks), std::end(checks), [&n = name](const Check& c) { return n == c.name; }))
            << name;
        EXPECT_FALSE(reason.empty()) << method;
    }
}

}  // namespace
}  // namespace trocar::test
