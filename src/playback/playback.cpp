#include "playback/playback.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "geometry/input_error.hpp"
#include "playback/frame_fields.hpp"
#include "scene/recording.hpp"
#include "simulate/overrides.hpp"
#include "simulate/simulation.hpp"

namespace trocar {
namespace {

/// Passes on the wanted frames. Keeps those that only the end of the run shows to be wanted.
class Chooser {
public:
    Chooser(const PlaybackChoice& choice, const PlayedFrameVisitor& visit) : choice_(choice), visit_(&visit) {}
    void show(const PlayedFrame& frame) {
        const bool wanted = (choice_.every > 0 && frame.tick % choice_.every == 0) ||
                            std::find(choice_.ticks.begin(), choice_.ticks.end(), frame.tick) != choice_.ticks.end();
        if (wanted) (*visit_)(frame);
        const double depth =
            std::isfinite(frame.row.residual_penetration) ? frame.row.residual_penetration : frame.deepest_vertex();
        if (choice_.deepest && (!deepest_ || depth > deepest_->depth)) {
            deepest_ = Held{.frame = wanted ? PlayedFrame{} : frame, .depth = depth, .shown = wanted};
            deepest_->frame.tick = frame.tick;
        }
        if (choice_.last) {
            last_ = Held{.frame = wanted ? PlayedFrame{} : frame, .shown = wanted};
            last_->frame.tick = frame.tick;
        }
    }
    void end() {
        if (deepest_ && !deepest_->shown) (*visit_)(deepest_->frame);
        const bool twice = deepest_ && last_ && deepest_->frame.tick == last_->frame.tick;
        if (last_ && !last_->shown && !twice) (*visit_)(last_->frame);
    }

private:
    struct Held {
        PlayedFrame frame;
        double depth = 0.0;  ///< m
        bool shown = false;  ///< already handed out
    };
    PlaybackChoice choice_;
    const PlayedFrameVisitor* visit_;
    std::optional<Held> deepest_;
    std::optional<Held> last_;
};

void add_found(const std::vector<Contact>& contacts, const Matrix3X& position, std::vector<PlayedContact>& played) {
    for (const Contact& contact : contacts) {
        PlayedContact one{.kind = ActingKind::found,
                          .body = contact.body_a,
                          .other = contact.body_b,
                          .point = contact.point,
                          .normal = contact.normal};
        if (any_vertex(contact.on_a.vertices) >= 0) one.point = contact.on_a.blend(position);
        one.depth = std::isfinite(contact.depth) ? contact.depth : std::fmax(0.0, -contact.gap);
        if (one.point.allFinite() && one.normal.allFinite()) played.push_back(one);
    }
}

void add_acting(const Topology& topology, const Simulation& simulation, const Matrix3X& position,
                std::vector<PlayedContact>& played) {
    const ResponseOutput& output = simulation.output();
    const std::vector<ContactForce>& contact_forces = simulation.contact_forces();
    for (std::size_t c = 0; c < output.contacts.size() && c < contact_forces.size(); ++c) {
        const ContactForceLaw& contact = output.contacts[c];
        // Within the query distance, apart and without a force: nothing acts.
        if (contact.gap >= 0.0 && contact_forces[c].force.squaredNorm() == 0.0) continue;
        const ContactPoint pushed{contact.vertices, contact.weights};
        PlayedContact one{.kind = ActingKind::pushed, .body = topology.body_of_vertex(any_vertex(contact.vertices))};
        one.other = contact.reaction_body >= 0 ? contact.reaction_body
                                               : topology.body_of_vertex(any_vertex(contact.reaction_vertices));
        one.point = pushed.blend(position);
        one.normal = contact.normal;
        one.depth = std::max(0.0, -contact.gap);
        one.force = contact_forces[c].force;
        played.push_back(one);
    }
    for (Index vertex = 0; vertex < static_cast<Index>(output.held_force.cols()); ++vertex) {
        const Vector3 force = output.held_force.col(vertex);
        if (force.squaredNorm() == 0.0) continue;
        played.push_back({.kind = ActingKind::held_force,
                          .body = topology.body_of_vertex(vertex),
                          .point = position.col(vertex),
                          .normal = force.normalized(),
                          .force = force});
    }
    for (const PositionCorrection& position_correction : output.position_corrections) {
        PlayedContact one{.kind = ActingKind::placed, .body = topology.body_of_vertex(position_correction.vertex)};
        one.point = position.col(position_correction.vertex);
        const Vector3 path = position_correction.position - simulation.seen().position.col(position_correction.vertex);
        if (path.squaredNorm() > 0.0) one.normal = path.normalized();
        played.push_back(one);
    }
}

void add_tools(const Scene& scene, const Simulation& simulation, std::vector<PlayedTool>& tools) {
    const std::vector<Pose>& poses = simulation.seen().pose;
    for (std::size_t body = 0; body < scene.topology.bodies.size(); ++body) {
        if (scene.topology.bodies[body].kind != BodyKind::instrument || body >= poses.size()) continue;
        PlayedTool tool{.body = static_cast<Index>(body)};
        const Vector3 tip = body < scene.materials.tip.size() ? scene.materials.tip[body] : Vector3::Zero();
        tool.tip = poses[body].rotation * tip + poses[body].translation;
        const Wrench at_tip = moved_to(simulation.body_loads()[body], tool.tip);
        tool.force = at_tip.force;
        tool.moment = at_tip.moment;
        tools.push_back(tool);
    }
}

/// The mode that moves the world as the specification's own does.
RunSpec motion_of(const RunSpec& spec, RunLimits& limits) {
    RunSpec motion = spec;
    motion.overrides.clear();
    if (spec.mode == "paced" || spec.mode == "cost_by_size") {
        motion.mode = "closed_loop";
        motion.truth_stride = 0;
        limits.watched = false;
    } else if (spec.mode == "metamorphic") {
        throw InputError("run", "/mode", "a kind of run with one motion", fmt::format("'{}'", spec.mode));
    }
    return motion;
}

}  // namespace

const char* name_of(ActingKind kind) {
    static constexpr std::array names{"found", "pushed", "held_force", "placed"};
    return names.at(static_cast<std::size_t>(kind));
}

double PlayedFrame::deepest_vertex() const {
    double deepest = 0.0;
    for (const double one : depth) deepest = std::fmax(deepest, one);
    return deepest;
}

Record play(const Scene& scene, const RunSpec& spec, const RunLimits& limits, const PlaybackChoice& choice,
            const PlayedFrameVisitor& visit) {
    Scene turned = scene;
    if (!spec.overrides.empty()) apply_overrides(spec.overrides, turned);
    RunLimits watched = limits;
    const RunSpec motion = motion_of(spec, watched);
    const bool moves = !motion.response.empty() && motion.mode != "replay";
    FrameFields fields(turned.topology, turned.first, turned.materials.springs);
    Chooser chooser(choice, visit);
    PlayedFrame played;
    watched.observe = [&](const Simulation& simulation, const StepRow& row) {
        if (limits.observe) limits.observe(simulation, row);
        if (!simulation.outcome().ok()) return;
        const Frame& frame = moves ? simulation.frame() : simulation.seen();
        fields.fill(frame, played);
        played.time = row.time;
        played.row = row;
        played.contacts.clear();
        played.tools.clear();
        add_found(simulation.contacts().contacts, frame.position, played.contacts);
        if (moves) {
            add_acting(turned.topology, simulation, frame.position, played.contacts);
            add_tools(turned, simulation, played.tools);
        }
        chooser.show(played);
    };
    Record record = make_run(turned, motion, watched);
    record.spec = spec;
    chooser.end();
    return record;
}

std::int64_t play_recording(const std::filesystem::path& file, const PlaybackChoice& choice,
                            const PlayedFrameVisitor& visit, const std::function<bool(std::int64_t)>& progress) {
    RecordingReader reader(file);
    Frame frame;
    std::optional<FrameFields> fields;
    Chooser chooser(choice, visit);
    PlayedFrame played;
    std::int64_t tick = 0;
    for (; tick < reader.frame_count() && (!progress || progress(tick)); ++tick) {
        reader.read(tick, frame);
        if (!frame.all_finite()) {
            throw InputError(file.string(), fmt::format("frame {}", tick), "finite positions", "one that is not");
        }
        if (!fields) fields.emplace(reader.topology(), frame, edges_at_rest(reader.topology(), frame));
        fields->fill(frame, played);
        played.row = {};
        played.row.tick = played.tick;
        played.row.time = played.time;
        chooser.show(played);
    }
    chooser.end();
    return tick;
}

}  // namespace trocar
