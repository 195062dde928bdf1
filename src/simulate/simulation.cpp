#include "simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>

#include "contact/derive.hpp"
#include "geometry/input_error.hpp"
#include "measure/allocations.hpp"
#include "simulate/leading.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {

namespace {

Outcome not_finite() { return {OutcomeKind::not_finite, "a vertex position is not finite"}; }

}  // namespace

struct Simulation::State {
    State(const Scene& the_scene, std::unique_ptr<Detector> the_detector, std::unique_ptr<Response> the_response,
          ContactSource the_source)
        : scene(the_scene),
          detector(std::move(the_detector)),
          response(std::move(the_response)),
          source(the_source),
          leading(the_scene),
          frame(the_scene.first),
          seen(the_scene.first),
          next(the_scene.first) {}

    const Scene& scene;
    std::unique_ptr<Detector> detector;
    std::unique_ptr<Response> response;
    ContactSource source;
    Leading leading;
    std::optional<MassSpring> tissue;

    Frame frame;  ///< after the last step
    Frame seen;   ///< moved, as detection sees it
    Frame next;   ///< being advanced; becomes `frame` when all went well
    ContactSet contacts;
    Effect effect;
    std::vector<Wrench> reaction;  ///< per body, of tissue
    std::vector<Wrench> load;      ///< per body, mean over the tick
    TipDisplay display;
    Outcome prepared;  ///< how prepare ended
    Outcome outcome;   ///< of the last tick
    std::int64_t tick = 0;

    /// Runs one stage between two readings of the clock. A method that throws has failed, nothing more.
    template <typename Work>
    void timed(Stage stage, StepRow& row, Work&& work) {
        if (!outcome.ok()) return;
        const std::int64_t allocations = allocation_count();
        const auto start = std::chrono::steady_clock::now();
        try {
            work();
        } catch (const std::exception& error) {
            outcome = {OutcomeKind::threw,
                       fmt::format("{}: {}", stage_names.at(static_cast<std::size_t>(stage)), error.what())};
        }
        const auto end = std::chrono::steady_clock::now();
        row.stage_ns.at(static_cast<std::size_t>(stage)) =
            std::chrono::duration_cast<std::chrono::nanoseconds>(end - start).count();
        if (allocations >= 0)
            row.allocations = std::max<std::int64_t>(0, row.allocations) + allocation_count() - allocations;
    }

    void derive_contacts() {
        if (source == ContactSource::canonical) {
            derive(scene.topology, seen, contacts);
        } else {
            contacts.contacts.assign(contacts.native.begin(), contacts.native.end());
        }
    }

    void advance() {
        std::fill(reaction.begin(), reaction.end(), Wrench{});
        if (tissue) {
            outcome = tissue->advance(effect, scene.dt, seen, next, reaction);
            if (!outcome.ok()) return;
        }
        leading.advance(next.time, effect, reaction, next, load);
    }

    void check_finite(const Frame& of) {
        if (!outcome.ok()) return;
        const auto finite = [&of](const Range& range) {
            return of.position.middleCols(range.first, range.count).allFinite();
        };
        for (const std::vector<Range>* ranges : {&leading.led_vertices(), &leading.free_tissue()}) {
            if (!std::all_of(ranges->begin(), ranges->end(), finite)) outcome = not_finite();
        }
    }

    /// All three frames agree in what cannot change.
    static void copy_vertices(const std::vector<Range>& ranges, const Frame& from, Frame& to) {
        for (const Range& range : ranges) {
            for (const auto matrix : {&Frame::position, &Frame::previous, &Frame::velocity}) {
                (to.*matrix).middleCols(range.first, range.count) = (from.*matrix).middleCols(range.first, range.count);
            }
        }
    }
    void copy_led(const Frame& from, Frame& to) const {
        copy_vertices(leading.led_vertices(), from, to);
        to.tick = from.tick;
        to.time = from.time;
        to.moved = from.moved;
        to.pose = from.pose;
    }

    void take_over_detection(StepRow& row) {
        if (outcome.ok()) outcome = contacts.outcome;
        row.pairs = static_cast<std::int64_t>(contacts.pairs.size());
        row.swept = static_cast<std::int64_t>(contacts.swept.size());
        row.native_contacts = static_cast<std::int64_t>(contacts.native.size());
        row.work = contacts.work;
        row.truncated = contacts.truncated;
    }

    /// Load on the shown instrument as the tool's wrench, the force at its tip and what the device makes of it.
    void show_load(StepRow& row) {
        const Wrench sum = leading.shown_load(load);
        row.tool_force = sum.force;
        row.tip_force = sum.force;
        const Index shown = leading.shown_body();
        const auto body = static_cast<std::size_t>(shown);
        if (shown >= 0 && body < seen.pose.size() && body < scene.materials.tip.size()) {
            const Pose& pose = seen.pose[body];
            const Vector3 tip = pose.rotation * scene.materials.tip[body] + pose.translation;
            row.tool_moment = moved_to(sum, tip).moment;
            if (scene.materials.trocar_point[body]) {
                const Vector3& pivot = *scene.materials.trocar_point[body];
                row.roll_torque = roll_torque(moved_to(sum, pivot), pivot, tip);
                if (effect.tip.fulcrum) row.tip_force = fulcrum_tip_force(moved_to(sum, pivot), pivot, tip);
            }
        }
        row.device_force = display.show(row.tip_force, effect.tip, scene.dt);
        row.saturated = display.saturated();
    }

    void observe(StepRow& row) {
        row.contacts = static_cast<std::int64_t>(contacts.contacts.size());
        row.outcome = outcome.kind;
        if (!response || !outcome.ok()) return;
        show_load(row);
        row.ruptures = effect.ruptures;
        row.repairs = effect.repairs;
        row.detached = effect.detached;
        row.grasped = effect.grasped;
        row.skipped = effect.skipped;
        row.no_hit = effect.no_hit;
        if (tissue) {
            row.max_strain = tissue->max_strain();
            row.limited_edges = tissue->limited_edges();
        }
    }
};

/// One tick of DESIGN §5: each stage reads what the one before has made, and the clock is read between them only.
StepRow Simulation::step() {
    State& s = *state_;
    StepRow row;
    row.tick = s.tick;
    row.time = static_cast<double>(s.tick) * s.scene.dt;
    s.contacts.clear();

    // What is copied between the three frames is the harness' own and stands outside the clock.
    // Tissue is written once a tick, by its integrator. `seen` takes it by exchange; `frame` gets it back on failure.
    std::swap(s.frame, s.seen);
    s.copy_led(s.seen, s.frame);
    s.seen.tick = row.tick;
    s.seen.time = row.time;
    s.timed(Stage::move, row, [&] { s.leading.move(row.time, s.seen); });
    if (row.tick == 0) s.seen.moved.reset();  // nobody has seen a frame to compare with
    s.check_finite(s.seen);
    s.timed(Stage::update, row, [&] { s.detector->update(s.seen); });
    s.timed(Stage::detect, row, [&] { s.detector->detect(s.seen, s.contacts); });
    s.take_over_detection(row);
    s.timed(Stage::derive, row, [&] { s.derive_contacts(); });

    s.copy_led(s.seen, s.next);
    if (s.response) {
        s.timed(Stage::respond, row, [&] { s.response->respond(s.seen, s.scene.dt, s.contacts, s.effect); });
        // Scripts alone have no such stage: their forces are only looked at.
        if (s.tissue || s.leading.has_operator()) {
            s.timed(Stage::advance, row, [&] { s.advance(); });
        } else if (s.outcome.ok()) {
            s.advance();
        }
    }
    s.check_finite(s.next);
    if (s.outcome.ok()) {
        std::swap(s.frame, s.next);
        ++s.tick;
    } else {
        State::copy_vertices(s.leading.free_tissue(), s.seen, s.frame);
    }
    s.observe(row);
    return row;
}

StepRow Simulation::replay(const Frame& frame) {
    State& s = *state_;
    StepRow row;
    row.tick = frame.tick;
    row.time = frame.time;
    s.contacts.clear();
    s.outcome = s.prepared;  // a frame that cannot be answered says nothing about the next one
    s.seen = frame;
    if (s.outcome.ok() && !s.seen.all_finite()) s.outcome = not_finite();
    s.timed(Stage::update, row, [&] { s.detector->update(s.seen); });
    s.timed(Stage::detect, row, [&] { s.detector->detect(s.seen, s.contacts); });
    s.take_over_detection(row);
    s.timed(Stage::derive, row, [&] { s.derive_contacts(); });
    row.contacts = static_cast<std::int64_t>(s.contacts.contacts.size());
    row.outcome = s.outcome.kind;
    return row;
}

Simulation::Simulation(const Scene& scene, std::unique_ptr<Detector> detector, std::unique_ptr<Response> response,
                       ContactSource source)
    : state_(std::make_unique<State>(scene, std::move(detector), std::move(response), source)) {
    State& s = *state_;
    if (scene.has_tissue() && s.response) s.tissue.emplace(scene.topology, scene.materials);
    s.effect.resize(scene.topology.vertex_count, scene.topology.body_count());
    // Room for a crowded tick, so that the first one does not ask for memory; more than this grows as it comes.
    const auto room = static_cast<std::size_t>(std::min<Index>(4096, scene.topology.triangle_count()));
    s.contacts.pairs.reserve(room);
    s.contacts.contacts.reserve(room);
    s.effect.contacts.reserve(4 * room);
    s.effect.placements.reserve(room);
    s.reaction.resize(scene.topology.bodies.size());
    s.load.resize(scene.topology.bodies.size());
    s.contacts.native_wanted = source == ContactSource::native;
    try {
        s.detector->prepare(scene.topology, scene.first);
        if (s.response) s.response->prepare(scene.topology, scene.materials);
    } catch (const std::exception& error) {
        s.prepared = {OutcomeKind::threw, fmt::format("prepare: {}", error.what())};
    }
    s.outcome = s.prepared;
}

Simulation::~Simulation() = default;

const Frame& Simulation::seen() const { return state_->seen; }
const Frame& Simulation::frame() const { return state_->frame; }
const ContactSet& Simulation::contacts() const { return state_->contacts; }
const Effect& Simulation::effect() const { return state_->effect; }
const std::vector<Wrench>& Simulation::body_loads() const { return state_->load; }
const Outcome& Simulation::outcome() const { return state_->outcome; }
std::vector<std::uint8_t> Simulation::yielding_pairs() const { return state_->leading.yielding_pairs(); }

ContactSource contact_source_from(std::string_view name) {
    if (name == "canonical") return ContactSource::canonical;
    if (name == "native") return ContactSource::native;
    throw InputError("contact source", "", "canonical or native", fmt::format("'{}'", name));
}

}  // namespace trocar
