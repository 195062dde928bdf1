#include "reference/build_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"
#include "scene/vertex_springs.hpp"

namespace trocar {
namespace {

constexpr double position_interval = 0.008;  ///< s, a multiple of every coarsest step
constexpr std::size_t most_points = 6;
/// Differences of force below these count as agreement: N, RMS; and part of the largest force of the run.
constexpr double force_floor = 1e-4;
constexpr double relative_floor = 0.005;
constexpr double position_floor = 1e-6;  ///< m
/// Below it differences shrink so slowly that all is solved once more with steps a quarter as long.
constexpr double trusted_order = 0.5;
constexpr double shorter_steps = 0.25;

/// Time of the first jaw that closes, else the end of the scene: what is gripped depends on a rule of attachment.
double time_of_grasp(const Scene& scene) {
    double time = scene.dt * static_cast<double>(scene.ticks);
    for (const SceneBody& body : scene.bodies) {
        if (!body.motion || body.jaws.empty()) continue;
        const auto& keys = body.motion->keys;
        for (std::size_t i = 1; i < keys.size(); ++i) {
            if (keys[i].jaw < keys[i - 1].jaw) time = std::min(time, keys[i - 1].time);
        }
    }
    return time;
}

/// Longest path of a scripted vertex in one tick, m.
double fastest_tick(const Scene& scene) {
    double longest = 0.0;
    Matrix3X before = scene.first.position;
    Matrix3X now = before;
    for (std::int64_t tick = 1; tick <= scene.ticks; ++tick) {
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            if (!scene.bodies[b].motion) continue;
            place_body(scene.bodies[b], scene.topology.bodies[b].vertices,
                       scene.bodies[b].motion->pose_at(scene.dt * static_cast<double>(tick)), now);
        }
        longest = std::max(longest, (now - before).colwise().norm().maxCoeff());
        before = now;
    }
    return longest;
}

double step_of(const Scene& scene, const ReferencePlan& plan) {
    if (plan.time_step) return *plan.time_step;
    constexpr double most_motion = 0.25e-3;
    const double speed = fastest_tick(scene) / scene.dt;
    return speed * 0.002 <= most_motion ? 0.002 : 0.001;
}

struct Run {
    double step = 0.0;
    double until = 0.0;
    std::string message;          ///< why it ended early
    std::vector<Vector3> force;   ///< at 0, step, 2 step …
    std::vector<Matrix3X> place;  ///< all positions at 0, position_interval …
    double residual = 0.0;
    double worst_gap = std::numeric_limits<double>::infinity();
    double strain = 0.0;       ///< largest edge strain so far
    double strain_time = 0.0;  ///< s, when that was
    double final_strain = 0.0;
};

bool starts_crossed(const Scene& scene) {
    const Topology& topology = scene.topology;
    const auto corners = [&](Index t) { return corners_of(topology.triangles, scene.first.position, t); };
    std::vector<Box> boxes;
    std::vector<IndexPair> pairs;
    triangle_boxes(scene.first.position, topology.triangles, boxes);
    for (const auto& [a, b] : topology.body_pairs) {
        overlapping_boxes(boxes, topology.bodies[at(a)].triangles, topology.bodies[at(b)].triangles, pairs);
        for (const IndexPair& pair : pairs) {
            if (triangles_intersect(corners(pair.first), corners(pair.second))) return true;
        }
    }
    return false;
}

/// The scene with its tissue where hard contact has it at the start, for scenes that begin with bodies inside each
/// other: every scripted body is driven in from the end of its script, in equilibrium on the whole path. Nothing when
/// that fails; `message` then says why.
std::optional<Scene> driven_in(const Scene& scene, double rest_gap, std::string& message) {
    Scene approach = scene;
    constexpr double duration = 1.0;  // s; without meaning in equilibrium
    for (std::size_t b = 0; b < approach.bodies.size(); ++b) {
        std::optional<Motion>& motion = approach.bodies[b].motion;
        if (!motion || motion->keys.empty()) continue;
        MotionKey from = motion->keys.back();
        MotionKey to = motion->keys.front();
        from.time = 0.0;
        to.time = duration;
        motion->keys = {from, to};
        place_body(approach.bodies[b], approach.topology.bodies[b].vertices, motion->pose_at(0.0),
                   approach.first.position);
    }
    if (starts_crossed(approach)) {
        message = "bodies begin inside each other, and the end of the script does not part them";
        return std::nullopt;
    }
    ImplicitSolver solver(approach, {.time_step = duration / 100.0, .rest_gap = rest_gap, .quasi_static = true});
    for (int i = 0; i < 100; ++i) {
        if (!solver.step()) {
            message = "while bodies that begin inside each other are moved in: " + solver.message();
            return std::nullopt;
        }
    }
    Scene ready = scene;
    ready.first.position = solver.position();
    return ready;
}

Run run_solver(const Scene& scene, const SolverSettings& settings, Index shown, double end) {
    Run run;
    run.step = settings.time_step;
    ImplicitSolver solver(scene, settings);
    run.force.push_back(Vector3::Zero());
    run.place.push_back(solver.position());
    const auto steps = static_cast<std::int64_t>(std::floor(end / settings.time_step + 1e-9));
    const auto stride = static_cast<std::int64_t>(std::lround(position_interval / settings.time_step));
    for (std::int64_t i = 1; i <= steps; ++i) {
        if (!solver.step()) {
            run.message = solver.message();
            break;
        }
        run.until = solver.time();
        run.force.push_back(shown < 0 ? Vector3::Zero().eval() : solver.force_on(shown));
        if (i % std::max<std::int64_t>(1, stride) == 0) run.place.push_back(solver.position());
        constexpr double smallest_scale = 0.01;  // N
        run.residual = std::max(run.residual, solver.residual() / std::max(smallest_scale, solver.largest_contact()));
        run.worst_gap = std::min(run.worst_gap, solver.smallest_gap());
        run.final_strain = solver.max_strain();
        if (run.final_strain > run.strain) {
            run.strain = run.final_strain;
            run.strain_time = solver.time();
        }
    }
    return run;
}

/// Force at 0, dt, 2 dt … up to `until`, N.
std::vector<Vector3> sampled(const Run& run, double dt, double until) {
    std::vector<Vector3> samples;
    const auto count = static_cast<std::size_t>(std::floor((until + 1e-9) / dt)) + 1;
    samples.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double time = static_cast<double>(i) * dt;
        const double x = std::min(time / run.step, static_cast<double>(run.force.size() - 1));
        const auto left = static_cast<std::size_t>(x);
        const std::size_t right = std::min(left + 1, run.force.size() - 1);
        const double w = x - static_cast<double>(left);
        samples.emplace_back((1.0 - w) * run.force[left] + w * run.force[right]);
    }
    return samples;
}

std::vector<Vector3> force_between(const Run& a, const Run& b, double dt, double until) {
    std::vector<Vector3> difference = sampled(a, dt, until);
    const std::vector<Vector3> second = sampled(b, dt, until);
    for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= second[i];
    return difference;
}

double force_difference(const Run& a, const Run& b, double dt, double until) {
    return force_in_band(force_between(a, b, dt, until), dt).rms;
}

double impulse_difference(const Run& a, const Run& b, double dt, double until) {
    return largest_impulse(force_between(a, b, dt, until), dt);
}

double position_difference(const Run& a, const Run& b, const std::vector<Index>& points, double until) {
    double worst = 0.0;
    const auto count =
        std::min({a.place.size(), b.place.size(), static_cast<std::size_t>(until / position_interval + 1e-9) + 1});
    for (std::size_t i = 0; i < count; ++i) {
        for (const Index p : points) worst = std::max(worst, (a.place[i].col(p) - b.place[i].col(p)).norm());
    }
    return worst;
}

/// The free tissue vertices that move most, at least three edges apart from each other as far as there are such; of a
/// scene without tissue the first vertex of every operator's body.
std::vector<Index> choose_points(const Scene& scene, const Run& run) {
    std::vector<Index> points;
    if (!scene.has_tissue()) {
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            const auto& motion = scene.bodies[b].motion;
            if (motion && motion->drive == Drive::simulated_operator) {
                points.push_back(scene.topology.bodies[b].vertices.first);
            }
        }
        return points;
    }
    std::vector<std::pair<double, Index>> moved;
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            double furthest = 0.0;
            for (const Matrix3X& place : run.place) {
                furthest = std::max(furthest, (place.col(v) - run.place.front().col(v)).norm());
            }
            moved.emplace_back(-furthest, v);
        }
    }
    std::sort(moved.begin(), moved.end());
    const double edge = mean_spring_length(scene.materials);
    for (const auto& entry : moved) {
        if (points.size() == most_points) break;
        const auto place = scene.first.position.col(entry.second);
        const bool apart = std::none_of(points.begin(), points.end(), [&](Index p) {
            return (scene.first.position.col(p) - place).norm() < 1.5 * edge;
        });
        if (apart) points.push_back(entry.second);
    }
    std::sort(points.begin(), points.end());
    return points;
}

ReferenceSolution unavailable(std::string reason) {
    ReferenceSolution solution;
    solution.reason = std::move(reason);
    return solution;
}

/// Whether contact can move anything: free tissue or an operator.
bool anything_is_free(const Scene& scene) {
    for (Index v = 0; at(v) < scene.materials.mass.size(); ++v) {
        if (scene.materials.is_free(v)) return true;
    }
    return std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const SceneBody& body) {
        return body.motion && body.motion->drive == Drive::simulated_operator;
    });
}

/// All runs of one law. A run is named by how often step and stiffness are halved from the plan's; negative = doubled.
class LawRuns {
public:
    using Triple = std::array<const Run*, 3>;  ///< coarse, middle, fine

    LawRuns(const Scene& scene, ReferenceLaw law, const ReferencePlan& plan, double step, double end,
            const ReferenceProgress& progress)
        : scene_(scene),
          plan_(plan),
          law_(law),
          step_(step),
          end_(end),
          progress_(progress),
          shown_(shown_body(scene)),
          crossed_(starts_crossed(scene)) {}

    [[nodiscard]] double step(int halvings) const { return std::ldexp(step_, -halvings); }
    [[nodiscard]] double rest_gap(int halvings) const { return std::ldexp(plan_.rest_gap, -halvings); }
    [[nodiscard]] int points(int halvings) const {
        return std::max(1, static_cast<int>(std::lround(std::ldexp(plan_.foundation_points, halvings))));
    }

    const Run& get(int step_halvings, int stiffness_halvings) {
        const auto [found, added] = runs_.try_emplace({step_halvings, stiffness_halvings});
        if (added) found->second = make(step_halvings, stiffness_halvings);
        return found->second;
    }
    Triple by_step(int finest, int stiffness) {
        return {&get(finest - 2, stiffness), &get(finest - 1, stiffness), &get(finest, stiffness)};
    }
    Triple by_stiffness(int step, int finest) {
        return {&get(step, finest - 2), &get(step, finest - 1), &get(step, finest)};
    }

private:
    Run make(int step_halvings, int stiffness_halvings) const {
        SolverSettings settings;
        settings.law = law_;
        settings.time_step = step(step_halvings);
        settings.rest_gap = rest_gap(stiffness_halvings);
        settings.foundation_points = points(stiffness_halvings);
        const bool hard = law_ == ReferenceLaw::hard;
        if (progress_) {
            const int n = settings.foundation_points;
            progress_(fmt::format("{} contact, step {:g} ms, {}", hard ? "hard" : "equal k", settings.time_step * 1e3,
                                  hard ? fmt::format("rest gap {:g} um", settings.rest_gap * 1e6)
                                       : fmt::format("{} points on a triangle", n * n)));
        }
        if (!hard || !crossed_) return run_solver(scene_, settings, shown_, end_);
        Run failed;
        const std::optional<Scene> ready = driven_in(scene_, settings.rest_gap, failed.message);
        return ready ? run_solver(*ready, settings, shown_, end_) : failed;
    }

    const Scene& scene_;
    const ReferencePlan& plan_;
    ReferenceLaw law_;
    double step_;
    double end_;
    const ReferenceProgress& progress_;
    Index shown_;
    bool crossed_;
    std::map<std::pair<int, int>, Run> runs_;
};

Refinement differences(const LawRuns::Triple& runs, const std::vector<Index>& points, double dt, double until,
                       double floor) {
    Refinement result;
    result.force_floor = floor;
    for (std::size_t i = 0; i < 2; ++i) {
        const Run& a = *runs.at(i);
        const Run& b = *runs.at(i + 1);
        result.force.at(i) = force_difference(a, b, dt, until);
        result.impulse.at(i) = impulse_difference(a, b, dt, until);
        result.position.at(i) = position_difference(a, b, points, until);
    }
    return result;
}

Observed observed_force(const Refinement& refinement) {
    return observe_order(refinement.force[0], refinement.force[1], refinement.force_floor);
}

double shortest(const LawRuns::Triple& runs) { return std::min({runs[0]->until, runs[1]->until, runs[2]->until}); }

double force_floor_of(const Run& run, double dt) {
    return std::max(force_floor, relative_floor * force_in_band(sampled(run, dt, run.until), dt).worst);
}

/// Whether hard contact stays within the strain limit, where all these runs know it and agree.
std::optional<bool> clears(const std::vector<const Run*>& runs, const Scene& scene) {
    std::optional<bool> answer;
    const double scene_end = scene.dt * static_cast<double>(scene.ticks);
    for (const Run* run : runs) {
        const bool over = scene.has_tissue() && run->strain > scene.materials.strain_limit;
        const bool to_the_end = run->message.empty() && run->until > scene_end - 2.0 * run->step;
        if (!over && !to_the_end) return std::nullopt;
        if (answer && *answer == over) return std::nullopt;
        answer = !over;
    }
    return answer;
}

ReferenceSolution solve_law(const Scene& scene, ReferenceLaw law, const ReferencePlan& plan, double step, double grasp,
                            std::string& settings, const ReferenceProgress& progress) {
    const double scene_end = scene.dt * static_cast<double>(scene.ticks);
    const bool hard = law == ReferenceLaw::hard;
    if (!anything_is_free(scene)) {
        return unavailable(
            "nothing is free to give way: every vertex is held or follows its script, which alone decides where all "
            "is");
    }
    if (!scene.materials.enclosures.empty()) {
        return unavailable("the implicit solver knows no bulk modulus");
    }
    // A reference that ends early says little about a run: below half of it, it would pass for an answer.
    const double least_until = 0.5 * grasp;
    LawRuns runs(scene, law, plan, step, grasp, progress);
    const Run& first = runs.get(0, 0);
    if (first.until < least_until) {
        ReferenceSolution none = unavailable(first.message);
        if (hard) {
            none.clears_within_strain_limit = clears({&first}, scene);
            none.max_strain = first.strain;
            none.max_strain_time = first.strain_time;
        }
        return none;
    }
    if (grasp < scene_end && std::all_of(first.force.begin(), first.force.end(),
                                         [](const Vector3& force) { return force.norm() < force_floor; })) {
        return unavailable(
            fmt::format("before the jaws begin to close at {:g} s nothing touches; what they hold then depends on a "
                        "rule of grasping",
                        grasp));
    }
    const std::vector<Index> points = choose_points(scene, first);
    const double floor = force_floor_of(first, scene.dt);
    // Refined until an order shows; what is far below the floor needs none.
    const auto settled = [&](const LawRuns::Triple& triple) {
        const double until = shortest(triple);
        if (until < least_until) return false;
        const double coarse = force_difference(*triple[0], *triple[1], scene.dt, until);
        const double fine = force_difference(*triple[1], *triple[2], scene.dt, until);
        return observe_order(coarse, fine, 0.05 * floor).converges;
    };
    int stiffness = 0;
    const int most_stiffness = hard ? plan.more_gaps : plan.more_points;
    while (!settled(runs.by_stiffness(-1, stiffness)) && stiffness < most_stiffness) ++stiffness;
    int finest = 0;
    while (!settled(runs.by_step(finest, stiffness)) && finest < plan.more_steps) ++finest;
    const LawRuns::Triple by_step = runs.by_step(finest, stiffness);
    const LawRuns::Triple by_stiffness = runs.by_stiffness(-1, stiffness);
    const Run& best = *by_step[2];
    settings = hard ? fmt::format("step {:g} ms, rest gap {:g} um", best.step * 1e3, runs.rest_gap(stiffness) * 1e6)
                    : fmt::format("step {:g} ms, {} points on a triangle", best.step * 1e3,
                                  runs.points(stiffness) * runs.points(stiffness));

    ReferenceSolution solution;
    solution.time_step = best.step;
    solution.residual = best.residual;
    solution.worst_gap = std::isfinite(best.worst_gap) ? best.worst_gap : not_known;
    if (hard) solution.rest_gap = runs.rest_gap(stiffness);
    solution.max_strain = best.strain;
    solution.max_strain_time = best.strain_time;
    solution.final_strain = best.final_strain;
    std::vector<const Run*> all(by_step.begin(), by_step.end());
    all.insert(all.end(), by_stiffness.begin(), by_stiffness.end());
    solution.strain_range = {best.strain, best.strain};
    for (const Run* run : all) {
        solution.strain_range[0] = std::min(solution.strain_range[0], run->strain);
        solution.strain_range[1] = std::max(solution.strain_range[1], run->strain);
    }
    if (hard) solution.clears_within_strain_limit = clears(all, scene);

    solution.until = grasp;
    solution.reason = grasp < scene_end ? "then jaws close, and what they hold depends on a rule of grasping" : "";
    for (const Run* run : all) {
        if (run->message.empty() || run->until >= solution.until) continue;
        solution.until = run->until;
        solution.reason = run->message;
    }
    // The low-pass uses about one period of the future.
    if (solution.until < scene_end) solution.until -= 0.02;
    if (solution.until < least_until) return solution;

    const auto observe = [&](double until) {
        solution.by_time_step = differences(by_step, points, scene.dt, until, floor);
        solution.by_stiffness = differences(by_stiffness, points, scene.dt, until, floor);
        return observed_force(solution.by_time_step).converges && observed_force(solution.by_stiffness).converges;
    };
    bool converges = observe(solution.until);
    if (!converges) {
        const auto doubt = [](const Refinement& refinement, const char* what) {
            if (observed_force(refinement).converges) return std::string();
            return fmt::format(
                "the force does not converge when the {} is refined (differences {:.2g} and {:.2g} N RMS)", what,
                refinement.force[0], refinement.force[1]);
        };
        const std::string by_step_doubt = doubt(solution.by_time_step, "step");
        const std::string by_stiffness_doubt = doubt(solution.by_stiffness, hard ? "rest gap" : "sampling");
        const bool both = !by_step_doubt.empty() && !by_stiffness_doubt.empty();
        const std::string doubts = by_step_doubt + (both ? "; " : "") + by_stiffness_doubt;
        // Refined runs agree until something happens, such as a corner that slips off an edge, of which the moment is
        // not determined: up to there they agree.
        const double whole = solution.until;
        constexpr double shorter = 0.02;  // s
        for (double until = whole - shorter; !converges && until >= least_until; until -= shorter) {
            converges = observe(until);
            if (converges) solution.until = until;
        }
        if (!converges) observe(whole);
        solution.reason = converges ? "beyond it, " + doubts : doubts;
    }
    solution.order_time_step = observed_force(solution.by_time_step).order;
    solution.order_stiffness = observed_force(solution.by_stiffness).order;
    solution.force_bound = 0.0;
    solution.impulse_bound = 0.0;
    solution.position_bound = 0.0;
    for (const Refinement* refinement : {&solution.by_time_step, &solution.by_stiffness}) {
        solution.force_bound += observed_force(*refinement).bound;
        solution.impulse_bound +=
            observe_order(refinement->impulse[0], refinement->impulse[1], floor * impulse_window).bound;
        solution.position_bound +=
            observe_order(refinement->position[0], refinement->position[1], position_floor).bound;
    }
    if (!converges) return solution;

    solution.available = true;
    solution.points = points;
    const auto every = std::max<std::int64_t>(1, std::lround(0.002 / best.step));
    solution.sample_interval = best.step * static_cast<double>(every);
    std::vector<Vector3> samples;
    for (std::size_t i = 0; i < best.force.size(); i += static_cast<std::size_t>(every))
        samples.push_back(best.force[i]);
    solution.force.resize(3, static_cast<Eigen::Index>(samples.size()));
    for (std::size_t i = 0; i < samples.size(); ++i) solution.force.col(static_cast<Eigen::Index>(i)) = samples[i];
    solution.position_interval = position_interval;
    for (const Matrix3X& place : best.place) {
        Matrix3X chosen(3, static_cast<Eigen::Index>(solution.points.size()));
        for (std::size_t i = 0; i < solution.points.size(); ++i) {
            chosen.col(static_cast<Eigen::Index>(i)) = place.col(solution.points[i]);
        }
        solution.positions.push_back(chosen);
    }
    return solution;
}

bool is_weak(const Refinement& refinement) { return observed_force(refinement).order < trusted_order; }

bool is_weak(const ReferenceSolution& solution) {
    return is_weak(solution.by_time_step) || is_weak(solution.by_stiffness);
}

/// As solve_law, and where the orders are weak once more with shorter steps: what that finds stands if its orders can
/// be trusted; if not, the first answer is reported with a bound that covers what the shorter steps changed.
ReferenceSolution solve_law_surely(const Scene& scene, ReferenceLaw law, const ReferencePlan& plan, double step,
                                   double grasp, std::string& settings, const ReferenceProgress& progress) {
    ReferenceSolution solution = solve_law(scene, law, plan, step, grasp, settings, progress);
    if (!solution.available || !is_weak(solution) || plan.time_step) return solution;
    std::string finer_settings;
    ReferenceSolution finer = solve_law(scene, law, plan, shorter_steps * step, grasp, finer_settings, progress);
    if (finer.available && !is_weak(finer) && finer.until > solution.until - 1e-9) {
        settings = finer_settings;
        return finer;
    }
    widen_bounds(finer, solution);
    solution.reason += fmt::format(
        "{}weak order: surfaces that slip over edges or bounce switch contacts at moments that refinement keeps "
        "moving; steps a quarter as long still change the force by {:.2g} N RMS, which the bound covers",
        solution.reason.empty() ? "" : "; ", largest_changes(finer.by_time_step.force, finer.by_stiffness.force));
    return solution;
}

}  // namespace

double largest_changes(const std::array<double, 2>& by_time_step, const std::array<double, 2>& by_stiffness) {
    return std::max(by_time_step[0], by_time_step[1]) + std::max(by_stiffness[0], by_stiffness[1]);
}

void widen_bounds(const ReferenceSolution& finer, ReferenceSolution& solution) {
    const Refinement& step = finer.by_time_step;
    const Refinement& stiffness = finer.by_stiffness;
    // fmax passes over a NaN, which is what a solution without refinements has.
    solution.force_bound = std::fmax(solution.force_bound, largest_changes(step.force, stiffness.force));
    solution.impulse_bound = std::fmax(solution.impulse_bound, largest_changes(step.impulse, stiffness.impulse));
    solution.position_bound = std::fmax(solution.position_bound, largest_changes(step.position, stiffness.position));
}

Observed observe_order(double coarse, double fine, double floor) {
    Observed observed;
    const bool shrinks = fine < coarse;
    if (shrinks && fine > 0.0) observed.order = std::log2(coarse / fine);
    constexpr double least_order = 0.3;
    const bool ordered = shrinks && (fine == 0.0 || observed.order >= least_order);
    observed.converges = ordered || std::max(coarse, fine) <= floor;
    observed.bound = std::max(coarse, fine);
    if (shrinks && fine == 0.0) observed.bound = 0.0;
    if (ordered && fine > 0.0) observed.bound = fine / (std::exp2(std::min(observed.order, 2.0)) - 1.0);
    return observed;
}

Reference build_reference(const Scene& scene, const ReferencePlan& plan, const ReferenceProgress& progress) {
    Reference reference;
    reference.scene = scene.name;
    reference.scene_hash = fmt::format("{:016x}", scene.hash);
    reference.turned_k = scene.turned_k;
    const double step = step_of(scene, plan);
    reference.origin["seed"] = fmt::format("{} (no chance is involved)", scene.seed);
    const bool solves_hard = std::isnan(scene.turned_k);
    if (solves_hard && starts_crossed(scene)) {
        reference.origin["start"] = "hard: moved in from the end of the script in equilibrium, then still";
    }
    const double grasp = time_of_grasp(scene);
    std::string hard = "none";
    std::string equal_k = "none";
    if (solves_hard) {
        reference.hard = solve_law_surely(scene, ReferenceLaw::hard, plan, step, grasp, hard, progress);
    } else {
        reference.hard = unavailable("hard contact has no stiffness: it is solved once, for the scene's own k");
    }
    reference.equal_k = solve_law_surely(scene, ReferenceLaw::foundation, plan, step, grasp, equal_k, progress);
    reference.origin["settings"] = fmt::format(
        "BDF2, begun and taken up after every key of the script by backward Euler; Newton to 1e-6 of the largest "
        "contact; hard: {}; equal k: {}",
        hard, equal_k);
    return reference;
}

}  // namespace trocar
