// A complete response to copy: one file like this one and one line in baselines/CMakeLists.txt, or in a project of your
// own that found trocar with find_package,
//
//     trocar_add_response(my_response)                          or, with a library,
//     trocar_add_response(my_response NEEDS some_library::target)
//
// and `trocar list`, the contract tests, the studies and the report know it. The response found here is the plainest
// one: a spring and a damper for every contact that it is given, closed or open.
//
// Say in this comment which settings of your library you changed from its defaults, and why (README.md, rule 1).
#include <cmath>
#include <memory>

#include "method/entry.hpp"

namespace trocar {
namespace {  // nothing but the entry function at the end is visible to the outside

class ExampleResponse final : public Response {
public:
    ExampleResponse(double k, double relaxation_time) : k_(k), relaxation_time_(relaxation_time) {}

    // Once per run. Topology and materials stay the same and outlive the run; whatever needs memory gets it here.
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
    }

    // Once per tick: says in `output` what shall happen and does nothing itself. What is owed:
    //   - `contacts.contacts` is all there is to know of what touches. Without contacts there is no output, whatever
    //     the frame shows: a response that searches for itself would hide what a detector has missed.
    //   - The same contacts give the same output to the bit, in another order the same but for rounding.
    //   - Never throw, never ask for memory after the first ticks (the lists of `output` keep theirs), leave frame and
    //     contacts alone. What is written must be finite, vertices must exist, weights sum to 1, normals be of
    //     length 1. A response that breaks this ends the run by name, `threw` or `not_finite`.
    // `contact_forces` says what each contact of the last output gave; this law does not ask.
    void respond(const Frame& frame, double /*dt*/, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();  // it holds the last tick's
        for (const Contact& contact : contacts.contacts) {
            // What a generator could not determine is NaN or -1 (touching and coplanar triangles have no direction).
            if (!std::isfinite(contact.gap) || !contact.normal.allFinite()) {
                output.skip(SkipReason::no_direction);
                continue;
            }
            // The gap is that at the start of the tick, negative inside. A contact with a positive gap is open and gets
            // its spring too: the stepper lets it act from the sub-step on in which the gap closes. A response that
            // leaves open contacts out answers each of them a tick late, when it has become an overlap.
            output.contacts.push_back(spring(frame, contact));
        }
    }

private:
    // The stepper evaluates the force anew in every sub-step, so that a stiff spring stays stable; that is why a
    // response reports a law and not a force.
    [[nodiscard]] ContactForceLaw spring(const Frame& frame, const Contact& contact) const {
        const BodyKind kind_a = topology_->bodies[at(contact.body_a)].kind;
        const BodyKind kind_b = topology_->bodies[at(contact.body_b)].kind;
        // Bodies are sorted (instrument, rigid, tissue), so that b is the softer one: it is pushed along the normal,
        // which points from a to b. Bone is never pushed.
        const bool push_b = kind_b != BodyKind::rigid;
        const ContactPoint& pushed = push_b ? contact.on_b : contact.on_a;
        const ContactPoint& other = push_b ? contact.on_a : contact.on_b;
        ContactForceLaw spring;
        spring.source_id = contact.id;
        spring.vertices = pushed.vertices;
        spring.weights = pushed.weights;
        spring.normal = push_b ? contact.normal : Vector3(-contact.normal);
        spring.gap = contact.gap;
        // Somebody takes the reaction, exactly once: the vertices of a tissue, or the tool, in a point on the line of
        // the force, since two forces beside each other would turn what they act on. Bone needs nobody.
        if (push_b && kind_a == BodyKind::tissue) {
            spring.reaction_vertices = other.vertices;
            spring.reaction_weights = other.weights;
        } else if (push_b && kind_a == BodyKind::instrument) {
            spring.reaction_body = contact.body_a;
            spring.reaction_point = pushed.blend(frame.position) - contact.gap * spring.normal;
        }
        spring.face_velocity = other.blend(frame.velocity).dot(spring.normal);
        set_law(contact, pushed, spring);
        return spring;
    }

    // The user's setting first, else the scene's law for the two bodies, else the springs of the tissue that is pushed.
    void set_law(const Contact& contact, const ContactPoint& pushed, ContactForceLaw& spring) const {
        const ContactLaw& law = materials_->contact_laws[at(topology_->body_pair(contact.body_a, contact.body_b))];
        spring.k = std::isnan(k_) ? law.k : k_;
        if (std::isnan(spring.k)) {
            const bool tissue = topology_->bodies[at(contact.body_b)].kind == BodyKind::tissue;
            spring.k = tissue ? 0.0 : 1000.0;
            for (std::size_t i = 0; tissue && i < pushed.vertices.size(); ++i) {
                if (pushed.vertices[i] >= 0)
                    spring.k += pushed.weights[i] * materials_->mean_stiffness[at(pushed.vertices[i])];
            }
        }
        const bool of_scene = std::isnan(k_) && !std::isnan(law.mu);
        spring.mu = of_scene ? law.mu : spring.k * relaxation_time_;
    }

    double k_;                ///< N/m; NaN: auto
    double relaxation_time_;  ///< s, mu / k
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
};

}  // namespace

// The one function that the CMake line searches for: <name>_response. The line names this file, since the detector has
// example.cpp: trocar_add_response(example example_response.cpp).
ResponseEntry example_response() {
    ResponseEntry entry;
    entry.name = "example";
    entry.own = true;
    // The contact generators that it can work from, its default first (docs/CONTACT.md, section 2). This law takes each
    // contact as it comes, so that it wants the generator whose contacts are features along one line, each once,
    // whatever the order of the triangles: on `proximity` and `intersection` a law first has to choose among contacts,
    // as penalty.cpp does.
    entry.contact_generators = {"tracked_proximity"};
    entry.parameters = {
        number_parameter("k", "N/m", "auto", 0.0, 1e9,
                         "contact stiffness; auto: the scene's, else 1000, on tissue the mean of the springs",
                         {"auto"}),
        number_parameter("relaxation_time", "s", "0.003", 0.0, 10.0, "mu / k where k is not the scene's")};
    entry.make = [](const ParameterValues& values) {
        return std::make_unique<ExampleResponse>(values.number("k"), values.number("relaxation_time"));
    };
    return entry;
}

}  // namespace trocar
