#include "simulate/runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "measure/force_without_touch.hpp"
#include "measure/metrics.hpp"
#include "measure/passage.hpp"
#include "measure/space_time.hpp"
#include "measure/tip_stiffness.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"
#include "reference/reference.hpp"
#include "simulate/against.hpp"
#include "simulate/frame_source.hpp"
#include "simulate/judge.hpp"
#include "simulate/metamorphic.hpp"
#include "simulate/overrides.hpp"
#include "simulate/paced.hpp"
#include "simulate/resolution.hpp"
#include "simulate/simulation.hpp"
#include "simulate/step_check.hpp"

namespace trocar {
namespace {

std::int64_t ticks_of(const Scene& scene, const RunSpec& spec) { return spec.ticks > 0 ? spec.ticks : scene.ticks; }

Record start_record(const RunSpec& spec, std::int64_t ticks) {
    Record record = started_record(spec);
    constexpr std::int64_t most_reserved = 200000;
    record.rows.reserve(static_cast<std::size_t>(std::min(ticks, most_reserved)));
    return record;
}

bool is_judged(const RunSpec& spec, std::int64_t tick, std::int64_t ticks) {
    return spec.truth_stride > 0 && (tick % spec.truth_stride == 0 || tick + 1 == ticks);
}

bool is_judged_in_detail(const RunSpec& spec, std::int64_t tick, std::int64_t ticks) {
    return is_judged(spec, tick, ticks) && (tick / spec.truth_stride % spec.detail_stride == 0 || tick + 1 == ticks);
}

/// Neither judging nor the audit may take time from a run for its times alone.
bool is_timed_only(const RunSpec& spec) { return spec.mode == "paced" || spec.mode == "cost_by_size"; }

/// A truncated tick is always judged, whatever the stride: pairs beyond a limit count as false negatives.
bool is_cut(const RunSpec& spec, const StepRow& row) { return spec.truth_stride > 0 && row.truncated; }

/// False when the caller ends the run.
bool go_on(const RunLimits& limits, std::int64_t done) { return !limits.progress || limits.progress(done); }

/// Records steps that are certainly unstable, and ends the run unless they are allowed.
void note_unstable_step(const Scene& scene, const RunSpec& spec, const RunLimits& limits, Record& record) {
    const StepCheck check = check_step(scene, spec.stepper);
    record.summary[Metric::substeps] = scene.has_tissue() ? check.tissue.substeps : check.substeps;
    const std::string why = why_unstable(scene, check);
    if (why.empty()) return;
    const bool taken = limits.allow_unstable_step || spec.mode == "hard_case";
    record.environment["run.unstable_step"] = why;
    if (!taken && record.outcome.ok()) record.outcome = {OutcomeKind::unstable, "not started: " + why};
}

Index tissue_triangles(const Topology& topology) {
    Index triangles = 0;
    for (const BodyRange& body : topology.bodies) {
        if (body.kind == BodyKind::tissue) triangles += body.triangles.count;
    }
    return triangles;
}

/// Native contacts of a replay come from a second detector outside the timed spans, so that the timed one does not
/// compute them.
class NativeContacts {
public:
    NativeContacts(const Scene& scene, const RunSpec& spec) {
        if (!registry().detector(parse_method(spec.detector).name).native_contacts) return;
        detector_ = make_detector(spec.detector);
        try {
            detector_->prepare(scene.topology, scene.first);
        } catch (const std::exception&) {
            detector_.reset();  // the timed detector reports the same failure
        }
    }
    void judge(const Frame& frame, const Judge& judge, StepRow& row) {
        if (!detector_) return;
        frame_ = frame;
        frame_.moved.reset();  // ticks in between were skipped
        try {
            detector_->update(frame_, 0.0);
            detector_->detect(frame_, contacts_);
        } catch (const std::exception&) {
            return;
        }
        row.native_contacts = static_cast<std::int64_t>(contacts_.native.size());
        row.native_depth_error = judge.worst_error(contacts_.native);
    }

private:
    std::unique_ptr<Detector> detector_;
    Frame frame_;
    ContactSet contacts_;
};

/// Truth between frames and the resulting contact events, for runs with spec.between_ticks.
class BetweenTicks {
public:
    BetweenTicks(const Scene& scene, const RunSpec& spec)
        : scene_(&scene), truth_(scene.topology), events_(scene.topology) {
        wanted_ = spec.between_ticks;
    }
    void judge(const Frame& seen, const ContactSet& contacts, StepRow& row) {
        if (!wanted_ || !truth_.measure(seen)) return;
        judge_swept(scene_->topology, truth_, contacts, row);
        events_.follow(seen, scene_->dt, truth_, contacts);
    }
    /// Call after the record's own summary is set.
    void add_to(Record& record) const {
        if (!wanted_) return;
        record.events = events_.events();
        record.summary.merge(summarize(record.events));
    }

private:
    const Scene* scene_;
    bool wanted_ = false;
    SpaceTimeTruth truth_;
    ContactEvents events_;
};

/// Path of scripted motion since the start, m: sum over ticks of the largest displacement of a box corner of a scripted
/// body. Deviations of an operator from its script are not included.
class ScriptedPath {
public:
    explicit ScriptedPath(const Scene& scene) {
        for (const SceneBody& body : scene.bodies) {
            if (!body.motion || body.local.cols() == 0) continue;
            Driven driven{&*body.motion, Matrix3X(3, 8), Matrix3X(3, 8)};
            const Vector3 low = body.local.rowwise().minCoeff();
            const Vector3 high = body.local.rowwise().maxCoeff();
            for (int i = 0; i < 8; ++i) {
                driven.corners.col(i) = Vector3((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                                                (i & 4) != 0 ? high.z() : low.z());
            }
            driven.at = placed(driven, 0.0);
            driven_.push_back(std::move(driven));
            motion_end_ = std::fmax(motion_end_, body.motion->last_key_time());
        }
    }
    /// Times must ascend.
    double up_to(double time) {
        double farthest = 0.0;
        for (Driven& driven : driven_) {
            const Matrix3X now = placed(driven, time);
            farthest = std::max(farthest, (now - driven.at).colwise().norm().maxCoeff());
            driven.at = now;
        }
        return path_ += farthest;
    }
    /// s, last key of any motion; NaN without one.
    [[nodiscard]] double motion_end() const { return motion_end_; }

private:
    struct Driven {
        const Motion* motion;
        Matrix3X corners;  ///< m, body frame
        Matrix3X at;       ///< m, world
    };
    static Matrix3X placed(const Driven& driven, double time) {
        const Pose pose = driven.motion->pose_at(time);
        return (pose.rotation.toRotationMatrix() * driven.corners).colwise() + pose.translation;
    }
    std::vector<Driven> driven_;
    double path_ = 0.0;
    double motion_end_ = std::nan("");
};

std::string stream_text() {
    return fmt::format(
        "the scene driven without any method: pairs from overlapping boxes and the exact test, one spring of {} "
        "N/m per pair",
        scene_frames_stiffness);
}

/// N/m, of the scene's stiffest law of a pair with tissue, else of any pair; NaN without one.
double stiffness_of(const Scene& scene) {
    double stiffest = std::nan("");
    bool on_tissue = false;
    for (std::size_t i = 0; i < scene.topology.body_pairs.size(); ++i) {
        const double k = scene.materials.contact_laws[i].k;
        const auto [a, b] = scene.topology.body_pairs[i];
        const bool tissue = scene.topology.bodies[at(a)].kind == BodyKind::tissue ||
                            scene.topology.bodies[at(b)].kind == BodyKind::tissue;
        if (std::isnan(k) || tissue < on_tissue) continue;
        stiffest = tissue > on_tissue ? k : std::fmax(stiffest, k);
        on_tissue = tissue;
    }
    return stiffest;
}

void add_errors(const ReferenceErrors& errors, Summary& summary) {
    for (const auto& [law, ending] : {std::pair{&errors.equal_k, "_equal_k"}, std::pair{&errors.hard, "_hard"}}) {
        const auto put = [&, end = ending](const char* name, double value) {
            summary[metric_of(std::string(name) + end)] = value;
        };
        put("force_error_rms", law->force_rms);
        put("force_error_worst", law->force_worst);
        put("impulse_error_worst", law->impulse_worst);
        put("position_error_rms", law->position_rms);
        put("position_error_worst", law->position_worst);
        put("force_bound", law->force_bound);
        put("position_bound", law->position_bound);
        put("reference_force_max", law->reference_max);
    }
    summary[Metric::reference_force_step_hard] = errors.hard.reference_step;
    summary[Metric::reference_clears_hard] = errors.hard_clears;
}

std::unique_ptr<Against> against_of(const Scene& scene, const RunSpec& spec) {
    if (spec.against.empty()) return nullptr;
    SimulationSettings settings = simulation_settings(spec);
    settings.stepper = parse_method(spec.against);
    settings.watched = false;  // it is no result
    return std::make_unique<Against>(
        scene, std::make_unique<Simulation>(scene, make_detector(spec.detector), make_response(spec.response),
                                            registry().contact_generator(spec.contacts), settings));
}

/// What a closed loop is measured by, outside the timed spans: truth on the frame after each tick, the reference, and
/// the second stepper.
class ClosedLoopTruth {
public:
    /// Scene and simulation outlive it. Records the reference's state, the scene's notes and, where the window of
    /// resolution begins with the first tick, the depth that the scripts have left.
    ClosedLoopTruth(const Scene& scene, const RunSpec& spec, const std::optional<RunLimits::Judged>& judged,
                    const Simulation& simulation, Record& record)
        : spec_(&spec),
          judged_(judged),
          scene_(&scene),
          judge_(scene.topology, scripted_frame(scene, -scene.prelude_ticks()), simulation.yielding_pairs(),
                 &scene.materials),
          script_(scene),
          passages_(scene, scripted_frame(scene, -scene.prelude_ticks())),
          reference_(find_reference(scene)),
          comparison_(reference_, scene.dt),
          against_(against_of(scene, spec)) {
        for (std::int64_t tick = 1 - scene.prelude_ticks(); tick < 0; ++tick) {
            const Frame frame = scripted_frame(scene, tick);
            judge_.follow(frame);
            passages_.follow(frame);
        }
        // No row comes before the first tick.
        if (spec.mode == "resolution" && has_resolution_window(scene) && resolution_window(scene).begin == 0) {
            record.summary[Metric::resolution_depth_before_m] = judge_.depth(scene.first);
        }
        // Needs the start and the end of every tick.
        if (spec.truth_stride == 1 && !judged_)
            untouched_.emplace(scene.topology, scene.first, simulation.yielding_pairs());
        record.environment["reference.hard"] = text_of(reference_.reference.hard);
        record.environment["reference.equal_k"] = text_of(reference_.reference.equal_k);
        if (!scene.notes.empty()) record.environment["scene.notes"] = fmt::format("{}", fmt::join(scene.notes, "; "));
    }

    /// Judges the tick that `simulation` has done. Returns how the second stepper ended.
    Outcome observe(const Simulation& simulation, std::int64_t tick, std::int64_t ticks, StepRow& row) {
        row.passed_through = passages_.follow(simulation.frame());
        if (judged_ && (tick < judged_->begin || tick >= judged_->end)) {
            judge_.follow(simulation.seen());
            judge_.follow(simulation.frame());
        } else if (const bool judged = is_judged(*spec_, tick, ticks); judged || is_cut(*spec_, row)) {
            const bool in_detail = is_judged_in_detail(*spec_, tick, ticks);
            if (scene_->has_contact_at(tick)) {
                judge_.judge_detection(simulation.seen(), simulation.contacts(), row, in_detail);
            } else {
                judge_.follow(simulation.seen());
            }
            if (judged) judge_.judge_outcome(simulation.frame(), row, script_.up_to(row.time), in_detail);
        }
        if (untouched_) {
            untouched_->observe(simulation.frame(), simulation.output(), simulation.contact_forces(),
                                [this](Index a, Index b) { return judge_.clearance(a, b); });
        }
        if (against_) {
            against_->follow(simulation, row);
            const Outcome& other = against_->outcome();
            if (!other.ok()) return {other.kind, spec_->against + ": " + other.message};
        }
        comparison_.observe(row.time, row.tool_force, simulation.frame().position);
        return {};
    }

    /// s, last key of any motion; NaN without one.
    [[nodiscard]] double motion_end() const { return script_.motion_end(); }

    void add_to(const Simulation& simulation, Summary& summary) const {
        summary.merge(simulation.audit_figures());
        if (const auto values = simulation.values_in_force()) {
            summary[Metric::k_effective_n_per_m] = values->k;
            summary[Metric::mu_effective_ns_per_m] = values->mu;
            summary[Metric::relaxation_time_effective_s] = values->relaxation_time;
            summary[Metric::damping_ratio] = values->damping_ratio;
        }
        summary[Metric::k_scene_n_per_m] = stiffness_of(*scene_);
        summary[Metric::force_without_touch_m] = untouched_ ? untouched_->largest() : std::nan("");
        add_errors(comparison_.errors(), summary);
        if (against_) summary.merge(against_->figures());
    }

private:
    const RunSpec* spec_;
    std::optional<RunLimits::Judged> judged_;
    const Scene* scene_;
    Judge judge_;
    std::optional<ForceWithoutTouch> untouched_;
    ScriptedPath script_;
    PassageTruth passages_;
    FoundReference reference_;
    ReferenceComparison comparison_;
    std::unique_ptr<Against> against_;
};

/// `loop`: "paced", or "empty" for the loop that takes turns with it.
void add_loop(const std::string& loop, const PacedFigures& figures, Summary& summary) {
    const auto put = [&](const char* name, double value) { summary[metric_of(loop + name)] = value; };
    put("_ticks", figures.ticks);
    put("_overruns", figures.overruns);
    put("_skipped", figures.skipped);
    put("_latency_median_ns", figures.latency_median_ns);
    put("_latency_p99_ns", figures.latency_p99_ns);
    put("_latency_p999_ns", figures.latency_p999_ns);
    put("_latency_max_ns", figures.latency_max_ns);
    put("_cpu_median_ns", figures.cpu_median_ns);
    put("_cpu_p999_ns", figures.cpu_p999_ns);
    put("_switches", figures.switches);
    put("_age_p99_ns", figures.age_p99_ns);
}

/// Runs the ticks by the clock, at most one in each of as many periods.
void run_by_the_clock(const Scene& scene, std::int64_t ticks, const std::function<bool()>& do_tick, Record& record) {
    const auto period_ns = static_cast<std::int64_t>(std::llround(scene.dt * 1e9));
    const PacedRun run = run_in_turns(ticks, period_ns, machine_clock(), do_tick);
    add_loop("paced", figures_of(run.work, period_ns), record.summary);
    add_loop("empty", figures_of(run.empty, period_ns), record.summary);
    record.summary[Metric::paced_steal] = run.steal;
    const TipStiffness tip = tip_stiffness(scene, record.rows);
    record.summary[Metric::paced_force_step_p999_n] = tip.force_step_p999_n;
    record.summary[Metric::paced_stiffness_p999_n_per_m] = tip.stiffness_p999_n_per_m;
    record.summary[Metric::paced_damping_ns_per_m] = passivity_damping(tip.stiffness_p999_n_per_m, scene.dt);
}

}  // namespace

Record make_run(const Scene& scene, const RunSpec& spec, const RunLimits& limits) {
    if (!spec.overrides.empty()) {
        Scene turned = scene;
        apply_overrides(spec.overrides, turned);
        RunSpec plain = spec;
        plain.overrides.clear();
        Record record = make_run(turned, plain, limits);
        record.spec.overrides = spec.overrides;
        return record;
    }
    if (spec.mode == "metamorphic") return run_metamorphic_test(scene, spec);
    if (spec.mode == "resolution") return run_resolution(scene, spec, limits);
    if (spec.mode == "work_precision") {
        Record record = spec.response.empty() ? run_replay(scene, spec, limits) : run_closed_loop(scene, spec, limits);
        record.environment["run.dt_s"] = fmt::format("{}", scene.dt);
        return record;
    }
    if (spec.mode == "replay" || spec.mode == "repeated_motion") return run_replay(scene, spec, limits);
    for (const std::string_view mode : {"closed_loop", "paced", "cost_by_size", "hard_case", "against"}) {
        if (spec.mode == mode) return run_closed_loop(scene, spec, limits);
    }
    throw InputError("run", "/mode",
                     "replay, repeated_motion, closed_loop, work_precision, paced, cost_by_size, against, resolution, "
                     "metamorphic or "
                     "hard_case",
                     fmt::format("'{}'", spec.mode));
}

SimulationSettings simulation_settings(const RunSpec& spec) {
    return {.stepper = spec.stepper.empty() ? MethodSpec{} : parse_method(spec.stepper),
            .device = read_device(spec.device)};
}

std::string why_not_combined(const RunSpec& spec) {
    const ContactGeneratorEntry& generator = registry().contact_generator(spec.contacts);
    const std::string reason = why_unreported(registry().detector(parse_method(spec.detector).name), generator);
    return reason.empty() ? why_unreadable(generator, parse_method(spec.response)) : reason;
}

Record run_replay(const Scene& scene, const RunSpec& spec, const RunLimits& limits) {
    const std::int64_t ticks = ticks_of(scene, spec);
    Record record = start_record(spec, ticks);
    record.environment["frames"] = stream_text();
    Simulation simulation(scene, make_detector(spec.detector), nullptr, registry().contact_generator("intersection"));
    Judge judge(scene.topology, scene.first, {});
    const std::unique_ptr<FrameSource> source = scene_frames(scene, ticks);
    NativeContacts native(scene, spec);
    BetweenTicks between(scene, spec);
    FnvHash hash;  // of the hashes of all frames
    Frame frame;
    for (std::int64_t tick = 0; source->next(frame) && go_on(limits, tick); ++tick) {
        hash.add_word(frame.hash());
        StepRow row = simulation.replay(frame);
        if (simulation.outcome().ok()) between.judge(simulation.seen(), simulation.contacts(), row);
        if (simulation.outcome().ok() && (is_judged(spec, tick, ticks) || is_cut(spec, row))) {
            const bool in_detail = is_judged_in_detail(spec, tick, ticks);
            judge.judge_detection(simulation.seen(), simulation.contacts(), row, in_detail);
            if (in_detail) native.judge(frame, judge, row);
        }
        if (record.outcome.ok()) record.outcome = simulation.outcome();
        if (limits.observe) limits.observe(simulation, row);
        record.rows.push_back(row);
    }
    if (record.outcome.ok()) record.outcome = source->outcome();
    record.frames_hash = hash.text();
    record.summary = summarize(record.rows, {.mode = "replay"});
    between.add_to(record);
    return record;
}

Record run_closed_loop(const Scene& scene, const RunSpec& spec, const RunLimits& limits) {
    const std::int64_t ticks = ticks_of(scene, spec);
    const ContactGeneratorEntry& generator = registry().contact_generator(spec.contacts);
    Record record = start_record(spec, ticks);
    if (spec.mode == "cost_by_size") {
        record.environment["run.tissue_triangles"] = fmt::format("{}", tissue_triangles(scene.topology));
    }
    if (const std::string reason = why_not_combined(spec); !reason.empty()) {
        record.outcome = {OutcomeKind::unsupported, reason};
    }
    note_unstable_step(scene, spec, limits, record);
    SimulationSettings settings = simulation_settings(spec);
    settings.watched = limits.watched && !is_timed_only(spec);
    Simulation simulation(scene, make_detector(spec.detector), make_response(spec.response), generator, settings);
    std::optional<ClosedLoopTruth> truth;
    if (!is_timed_only(spec)) truth.emplace(scene, spec, limits.judged, simulation, record);
    std::int64_t tick = 0;
    const auto do_tick = [&] {
        if (!record.outcome.ok() || tick >= ticks || !go_on(limits, tick)) return false;
        StepRow row = simulation.step();
        record.outcome = simulation.outcome();
        if (truth && record.outcome.ok()) record.outcome = truth->observe(simulation, tick, ticks, row);
        if (limits.observe) limits.observe(simulation, row);
        record.rows.push_back(row);
        ++tick;
        return record.outcome.ok();
    };
    if (spec.mode == "paced" && record.outcome.ok()) {
        run_by_the_clock(scene, ticks, do_tick, record);
    } else {
        while (do_tick()) {
        }
    }
    if (!record.outcome.ok() && !record.rows.empty()) {
        record.outcome.message = fmt::format("tick {}: {}", record.rows.back().tick, record.outcome.message);
    }
    record.state_hash = fmt::format("{:016x}", simulation.frame().hash());
    record.summary.merge(summarize(record.rows, {.motion_end = truth ? truth->motion_end() : std::nan("")}));
    if (truth) truth->add_to(simulation, record.summary);
    return record;
}

Record run_resolution(const Scene& scene, const RunSpec& spec, const RunLimits& limits) {
    const Scene twin = twin_of(scene);
    RunSpec alone = spec;
    alone.against.clear();
    RunSpec twin_spec = alone;
    twin_spec.ticks = 0;
    ResolutionObserver of_twin(scene, scene.prelude_ticks());
    // The tick before the window says how deep the interval has left the scene.
    const ResolutionWindow window = resolution_window(scene);
    RunLimits twin_limits = limits;
    twin_limits.judged = {window.begin - 1 + scene.prelude_ticks(), window.end + scene.prelude_ticks()};
    twin_limits.observe = [&](const Simulation& simulation, const StepRow& row) { of_twin.observe(simulation, row); };
    const Record twin_record = run_closed_loop(twin, twin_spec, twin_limits);
    ResolutionObserver own(scene, 0);
    RunLimits own_limits = limits;
    own_limits.judged = {window.begin - 1, window.end};
    own_limits.observe = [&](const Simulation& simulation, const StepRow& row) {
        own.observe(simulation, row);
        if (limits.observe) limits.observe(simulation, row);
    };
    Record record = run_closed_loop(scene, alone, own_limits);
    record.spec = spec;
    ResolutionTrail trail = own.trail();
    const auto scripted = record.summary.find(Metric::resolution_depth_before_m);
    if (scripted != record.summary.end()) trail.depth_before = scripted->second;
    Resolution resolution = compare_resolution(scene, record.outcome, trail, of_twin.trail());
    record.summary.merge(resolution.figures);
    record.environment["resolution.cause"] = text_of(resolution.cause);
    record.environment["resolution.twin"] = fmt::format("{}", name_of(twin_record.outcome.kind));
    return record;
}

}  // namespace trocar
