#include "simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <optional>

#include "contact/usable.hpp"
#include "measure/allocations.hpp"
#include "simulate/blow_up.hpp"
#include "simulate/energy_momentum_audit.hpp"
#include "simulate/kinematic_driver.hpp"
#include "simulate/query_distance.hpp"
#include "simulate/rupture.hpp"
#include "simulate/step_check.hpp"

namespace trocar {

namespace {

Outcome not_finite() { return {OutcomeKind::not_finite, "a vertex position is not finite"}; }

}  // namespace

struct Simulation::State {
    State(const Scene& the_scene, std::unique_ptr<Detector> the_detector, std::unique_ptr<Response> the_response,
          const ContactGeneratorEntry& the_generator, const StepperEntry& the_stepper,
          const SimulationSettings& settings)
        : scene(the_scene),
          detector(std::move(the_detector)),
          response(std::move(the_response)),
          wants_query_distance(the_generator.wants_query_distance),
          stepper_entry(the_stepper),
          query_distance(the_scene),
          driver(the_scene),
          device(settings.device),
          frame(the_scene.first),
          seen(the_scene.first),
          next(the_scene.first) {}

    const Scene& scene;
    std::unique_ptr<Detector> detector;
    std::unique_ptr<Response> response;
    std::unique_ptr<ContactGenerator> generator;
    bool wants_query_distance = false;
    const StepperEntry& stepper_entry;
    std::unique_ptr<Stepper> stepper;  ///< null where no tissue moves
    QueryDistance query_distance;
    KinematicDriver driver;
    const TipSettings device;

    Frame frame;       ///< after the last step
    Frame seen;        ///< moved, input of detection
    Frame next;        ///< being advanced; becomes `frame` when all went well
    Frame whole_seen;  ///< `seen` and `next` with deferred vertices completed, for the audit; else empty
    Frame whole_next;
    ContactSet contacts;
    ResponseOutput output;
    Rupture rupture;
    std::optional<EnergyMomentumAudit> audit;
    std::optional<BlowUp> blow_up;
    std::vector<ContactForce> contact_forces;  ///< per contact of `output`, of the last step
    std::vector<Wrench> reaction;              ///< per body, of tissue
    std::vector<Wrench> load;                  ///< per body, mean over the tick
    TipDisplay display;
    double deepest_edges = 0.0;          ///< m, edge-edge depth in the last tick
    bool query_distance_is_cut = false;  ///< in this tick
    Outcome prepared;                    ///< how prepare ended
    Outcome outcome;                     ///< of the last tick
    std::int64_t tick = 0;
    bool frames_kept = false;  ///< nothing else has written the frames since the last advance

    /// Ranges of tissue that moved since the last tick; null: unknown.
    [[nodiscard]] const std::vector<Range>* tissue_moved() const {
        return stepper && frames_kept ? stepper->moved() : nullptr;
    }

    /// Runs one stage between two readings of the clock. An exception becomes the outcome `threw`.
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

    /// m, query distance of this tick; `tissue_move` as in `Reach::of`.
    double ask_query_distance(double tissue_move) {
        if (!wants_query_distance) return 0.0;
        const double driven_move = furthest_move(seen, driver.driven_vertices());
        query_distance_is_cut = query_distance.is_cut(driven_move, tissue_move, deepest_edges);
        return query_distance.of(driven_move, tissue_move, deepest_edges);
    }
    /// Crossed edges leave no trace but their pairs. The next query distance therefore includes their depth after the
    /// tick's scripts have moved.
    void note_deep_edges() {
        deepest_edges = 0.0;
        for (const Contact& contact : contacts.contacts) {
            if (contact.kind == ContactCase::edge_edge)
                deepest_edges = std::max(deepest_edges, -(contact.gap + contact.approach));
        }
    }

    void advance() {
        std::fill(reaction.begin(), reaction.end(), Wrench{});
        contact_forces.assign(output.contacts.size(), {});
        if (stepper) {
            const std::string not_taken = why_not_taken(stepper_entry, scene.topology, output);
            if (!not_taken.empty()) outcome = {OutcomeKind::unsupported, not_taken};
            stepper->trust_frames(frames_kept);
            if (outcome.ok()) outcome = stepper->advance(output, scene.dt, seen, next, reaction);
            if (outcome.kind == OutcomeKind::unstable) explain_unstable();
            if (!outcome.ok()) return;
            std::copy(stepper->contact_forces().begin(), stepper->contact_forces().end(), contact_forces.begin());
        }
        driver.advance(next.time, output, reaction, next, load, contact_forces);
    }

    /// Adds place and remedy to the stepper's outcome `unstable`, from the stable step at the start of the tick.
    void explain_unstable() {
        const StepEstimate estimate =
            stepper->estimate(scene.topology, scene.materials, seen.position, scene.dt, false);
        const std::string place = deciding_place(scene, estimate, seen.position);
        if (place.empty()) return;
        if (scene.dt / estimate.substeps > estimate.stable_step) {
            outcome.message += fmt::format("; {} bears {:.3g} ms: {}", place, 1e3 * estimate.stable_step,
                                           step_remedy(scene, estimate));
        } else {
            outcome.message += fmt::format(
                "; the springs bear the sub-steps ({} decides): it is contacts, held forces or position corrections "
                "that feed it",
                place);
        }
    }

    /// `tissue`: ranges that moved since the last check; null: all free tissue.
    void check_finite(const Frame& of, const std::vector<Range>* tissue) {
        if (!outcome.ok()) return;
        const auto finite = [&of](const Range& range) {
            return of.position.middleCols(range.first, range.count).allFinite();
        };
        for (const std::vector<Range>* ranges :
             {&driver.driven_vertices(), tissue != nullptr ? tissue : &driver.free_tissue()}) {
            if (!std::all_of(ranges->begin(), ranges->end(), finite)) outcome = not_finite();
        }
    }

    [[nodiscard]] bool has_whole() const { return whole_next.position.cols() > 0; }

    /// Outside the clock, before `next` replaces `frame`.
    void watch() {
        if (!audit || !outcome.ok()) return;
        if (stepper && stepper->leaves_behind()) {
            // Deferred vertices have spurious strain at the border to current ones.
            if (!has_whole()) whole_next = seen;
            std::swap(whole_seen, whole_next);
            copy_driven(seen, whole_seen);
            whole_next = next;
            stepper->complete(whole_next);
        }
        audit->observe(has_whole() ? whole_seen : seen, has_whole() ? whole_next : next, output, contact_forces, load,
                       driver.operators(), stepper && stepper->limited_edges() > 0);
        outcome = blow_up->judge(seen, next, contacts, output, contact_forces, reaction, *audit);
    }

    /// All three frames agree outside the vertices that can change.
    static void copy_vertices(const std::vector<Range>& ranges, const Frame& from, Frame& to) {
        for (const Range& range : ranges) {
            for (const auto matrix : {&Frame::position, &Frame::previous, &Frame::velocity}) {
                (to.*matrix).middleCols(range.first, range.count) = (from.*matrix).middleCols(range.first, range.count);
            }
        }
    }
    void copy_driven(const Frame& from, Frame& to) const {
        copy_vertices(driver.driven_vertices(), from, to);
        to.tick = from.tick;
        to.time = from.time;
        to.moved = from.moved;
        to.pose = from.pose;
        to.operator_motion = from.operator_motion;
    }

    void take_over_detection(StepRow& row) {
        if (outcome.ok()) outcome = contacts.outcome;
        row.pairs = static_cast<std::int64_t>(contacts.pairs.size());
        row.swept = static_cast<std::int64_t>(contacts.swept.size());
        row.native_contacts = static_cast<std::int64_t>(contacts.native.size());
        row.work = contacts.work;
        contacts.truncated = contacts.truncated || query_distance_is_cut;
        row.truncated = contacts.truncated;
    }

    /// Load on the shown instrument: its wrench, the force at its tip and the displayed force.
    void show_load(StepRow& row) {
        const Wrench sum = driver.shown_load(load);
        row.tool_force = sum.force;
        row.tip_force = sum.force;
        const Index shown = driver.shown_body();
        const auto body = static_cast<std::size_t>(shown);
        if (shown >= 0 && body < seen.pose.size() && body < scene.materials.tip.size()) {
            const Pose& pose = seen.pose[body];
            const Vector3 tip = pose.rotation * scene.materials.tip[body] + pose.translation;
            row.tool_moment = moved_to(sum, tip).moment;
            if (scene.materials.trocar_point[body]) {
                const Vector3& pivot = *scene.materials.trocar_point[body];
                row.roll_torque = roll_torque(moved_to(sum, pivot), pivot, tip);
                if (device.fulcrum) row.tip_force = fulcrum_tip_force(moved_to(sum, pivot), pivot, tip);
            }
        }
        row.device_force = display.show(row.tip_force, device, scene.dt);
        row.saturated = display.saturated();
    }

    void observe(StepRow& row) {
        row.contacts_offered = static_cast<std::int64_t>(contacts.contacts.size());
        row.outcome = outcome.kind;
        if (!response || !outcome.ok()) return;
        show_load(row);
        row.ruptures = rupture.judge(frame, output, contact_forces, scene.dt);
        row.detached = output.detached;
        row.grasped = output.grasped;
        row.skipped = output.skipped;
        row.contacts_used = row.contacts_offered - output.all_skipped();
        row.no_hit = output.no_hit;
        if (stepper) {
            row.max_strain = stepper->max_strain();
            row.limited_edges = stepper->limited_edges();
        }
    }
};

/// One tick of DESIGN §5. Each stage reads the results of the one before; the clock is read only between stages.
StepRow Simulation::step() {
    State& s = *state_;
    StepRow row;
    row.tick = s.tick;
    row.time = static_cast<double>(s.tick) * s.scene.dt;
    s.contacts.clear();

    // Copies between the three frames belong to the harness and are not timed. Only the stepper writes tissue, once a
    // tick. `seen` takes it by swap; `frame` gets it back on failure.
    std::swap(s.frame, s.seen);
    s.copy_driven(s.seen, s.frame);
    s.seen.tick = row.tick;
    s.seen.time = row.time;
    s.timed(Stage::move, row, [&] { s.driver.move(row.time, s.tissue_moved(), s.seen); });
    if (row.tick == 0) s.seen.moved.reset();  // there is no earlier frame
    s.check_finite(s.seen, s.tissue_moved());
    row.query_distance = s.ask_query_distance(s.stepper ? s.stepper->largest_move() : 0.0);
    s.timed(Stage::update, row, [&] { s.detector->update(s.seen, row.query_distance); });
    s.timed(Stage::detect, row, [&] { s.detector->detect(s.seen, s.contacts); });
    const bool has_contact = s.scene.has_contact_at(row.tick);
    if (!has_contact) s.contacts.answer_nothing();
    s.take_over_detection(row);
    s.timed(Stage::contacts, row, [&] { s.generator->gather(s.seen, s.contacts); });
    if (!has_contact) s.contacts.contacts.clear();
    if (s.outcome.ok()) s.outcome = check_contacts(s.scene.topology, s.contacts);

    if (s.wants_query_distance) s.note_deep_edges();
    s.copy_driven(s.seen, s.next);
    if (s.response) {
        s.timed(Stage::respond, row,
                [&] { s.response->respond(s.seen, s.scene.dt, s.contacts, s.contact_forces, s.output); });
        if (s.outcome.ok()) s.outcome = check_output(s.scene.topology, s.output);
        // With scripts alone nothing is integrated, so the stage is not timed.
        if (s.stepper || s.driver.has_operator()) {
            s.timed(Stage::advance, row, [&] { s.advance(); });
        } else if (s.outcome.ok()) {
            s.advance();
        }
    }
    s.check_finite(s.next, s.stepper ? s.stepper->moved() : nullptr);
    s.watch();
    s.frames_kept = s.outcome.ok();
    if (s.outcome.ok()) {
        std::swap(s.frame, s.next);
        ++s.tick;
    } else {
        State::copy_vertices(s.driver.free_tissue(), s.seen, s.frame);
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
    s.outcome = s.prepared;  // a failed frame does not affect the next one
    s.seen = frame;
    if (s.outcome.ok() && !s.seen.all_finite()) s.outcome = not_finite();
    row.query_distance = s.ask_query_distance(furthest_move(s.seen, s.driver.free_tissue()));
    s.timed(Stage::update, row, [&] { s.detector->update(s.seen, row.query_distance); });
    s.timed(Stage::detect, row, [&] { s.detector->detect(s.seen, s.contacts); });
    s.take_over_detection(row);
    s.timed(Stage::contacts, row, [&] { s.generator->gather(s.seen, s.contacts); });
    row.contacts_offered = static_cast<std::int64_t>(s.contacts.contacts.size());
    row.outcome = s.outcome.kind;
    return row;
}

Simulation::Simulation(const Scene& scene, std::unique_ptr<Detector> detector, std::unique_ptr<Response> response,
                       const ContactGeneratorEntry& generator, const SimulationSettings& settings)
    : state_(std::make_unique<State>(
          scene, std::move(detector), std::move(response), generator,
          settings.stepper.name.empty() ? registry().default_stepper() : registry().stepper(settings.stepper.name),
          settings)) {
    State& s = *state_;
    s.output.resize(0, scene.topology.body_count());
    // Capacity for a tick with many contacts, so that the first one does not allocate.
    const auto room = static_cast<std::size_t>(std::min<Index>(4096, scene.topology.triangle_count()));
    s.contacts.pairs.reserve(room);
    s.contacts.contacts.reserve(room);
    s.output.contacts.reserve(4 * room);
    s.output.position_corrections.reserve(room);
    s.contact_forces.reserve(4 * room);
    s.rupture.prepare(scene.topology, scene.materials);
    if (settings.watched && s.response) {
        s.audit.emplace(scene);
        s.blow_up.emplace(scene);
    }
    s.reaction.resize(scene.topology.bodies.size());
    s.load.resize(scene.topology.bodies.size());
    s.contacts.native_wanted = generator.wants_native;
    try {
        s.detector->prepare(scene.topology, scene.first);
        s.generator = generator.make(ParameterValues(generator.name, generator.parameters, {}));
        s.generator->prepare(scene.topology, scene.first);
        s.deepest_edges = s.query_distance.edge();  // no earlier tick
        if (s.response) s.response->prepare(scene.topology, scene.materials);
        if (s.response && scene.has_tissue()) {
            s.stepper = s.stepper_entry.make(checked_values(s.stepper_entry, settings.stepper.parameters));
            s.stepper->prepare(scene.topology, scene.materials);
            s.stepper->start(scene.first);
        }
    } catch (const std::exception& error) {
        s.prepared = {OutcomeKind::threw, fmt::format("prepare: {}", error.what())};
    }
    s.outcome = s.prepared;
}

Simulation::~Simulation() = default;

const Frame& Simulation::seen() const { return state_->seen; }
const Frame& Simulation::frame() const { return state_->frame; }
const Frame& Simulation::whole_frame() const { return state_->has_whole() ? state_->whole_next : state_->frame; }
const ContactSet& Simulation::contacts() const { return state_->contacts; }
const ResponseOutput& Simulation::output() const { return state_->output; }
const std::vector<ContactForce>& Simulation::contact_forces() const { return state_->contact_forces; }
const std::vector<Wrench>& Simulation::body_loads() const { return state_->load; }
const Outcome& Simulation::outcome() const { return state_->outcome; }
Summary Simulation::audit_figures() const { return state_->audit ? state_->audit->figures() : Summary{}; }
double Simulation::tissue_energy_gain() const { return state_->audit ? state_->audit->tissue_gain() : std::nan(""); }
std::optional<ForceLawValues> Simulation::values_in_force() const {
    if (!state_->response || !state_->prepared.ok()) return std::nullopt;
    return state_->response->values_in_force();
}

std::vector<std::uint8_t> Simulation::yielding_pairs() const { return state_->driver.yielding_pairs(); }

}  // namespace trocar
