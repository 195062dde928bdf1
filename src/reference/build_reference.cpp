#include "reference/build_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr double position_interval = 0.008;  ///< s, a multiple of every coarsest step
constexpr std::size_t most_points = 6;
/// Differences of force below these count as agreement: N, RMS; and part of the largest force of the run.
constexpr double force_floor = 1e-4;
constexpr double relative_floor = 0.005;
constexpr double position_floor = 1e-6;  ///< m

/// Body whose force a run shows: the first instrument that has a motion, else the first instrument.
Index shown_body(const Scene& scene) {
    Index shown = -1;
    for (Index b = 0; b < scene.topology.body_count(); ++b) {
        if (scene.topology.bodies[at(b)].kind != BodyKind::instrument) continue;
        if (shown < 0 || (scene.bodies[at(b)].motion && !scene.bodies[at(shown)].motion)) shown = b;
    }
    return shown;
}

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

/// Longest way of a scripted vertex in one tick, m.
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
    double strain = 0.0;
};

bool starts_crossed(const Scene& scene) {
    const Topology& topology = scene.topology;
    const auto corners = [&](Index t) {
        const auto corner = topology.triangles.col(t);
        const Matrix3X& x = scene.first.position;
        return Corners{x.col(corner[0]), x.col(corner[1]), x.col(corner[2])};
    };
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
/// other: every scripted body is led in from the end of its script, in equilibrium all the way. Nothing when that
/// fails; `message` then says why.
std::optional<Scene> led_in(const Scene& scene, double rest_gap, std::string& message) {
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
            message = "while bodies that begin inside each other are led in: " + solver.message();
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
        run.strain = std::max(run.strain, solver.max_strain());
    }
    return run;
}

std::vector<Vector3> band_limited(const Run& run, double dt, double until) {
    std::vector<Vector3> samples;
    for (double time = 0.0; time <= until + 1e-9; time += dt) {
        const double x = std::min(time / run.step, static_cast<double>(run.force.size() - 1));
        const auto left = static_cast<std::size_t>(x);
        const std::size_t right = std::min(left + 1, run.force.size() - 1);
        const double w = x - static_cast<double>(left);
        samples.emplace_back((1.0 - w) * run.force[left] + w * run.force[right]);
    }
    return low_pass(samples, dt, force_band_hz);
}

double force_difference(const Run& a, const Run& b, double dt, double until) {
    const auto first = band_limited(a, dt, until);
    const auto second = band_limited(b, dt, until);
    double sum = 0.0;
    for (std::size_t i = 0; i < first.size(); ++i) sum += (first[i] - second[i]).squaredNorm();
    return first.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(first.size()));
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
    double edge = 0.0;
    for (const Spring& spring : scene.materials.springs) edge += spring.rest;
    edge /= static_cast<double>(scene.materials.springs.size());
    for (const auto& [far, v] : moved) {
        if (points.size() == most_points) break;
        const bool apart = std::none_of(points.begin(), points.end(), [&](Index p) {
            return (scene.first.position.col(p) - scene.first.position.col(v)).norm() < 1.5 * edge;
        });
        if (apart) points.push_back(v);
    }
    std::sort(points.begin(), points.end());
    return points;
}

ReferenceSolution unavailable(std::string reason) {
    ReferenceSolution solution;
    solution.reason = std::move(reason);
    return solution;
}

ReferenceSolution solve_law(const Scene& scene, ReferenceLaw law, const ReferencePlan& plan, double step, double grasp,
                            const ReferenceProgress& progress) {
    const double scene_end = scene.dt * static_cast<double>(scene.ticks);
    const Index shown = shown_body(scene);
    const bool hard = law == ReferenceLaw::hard;
    const bool crossed = starts_crossed(scene);
    const auto run = [&](double step_factor, int coarser) {
        SolverSettings settings;
        settings.law = law;
        settings.time_step = step * step_factor;
        settings.rest_gap = plan.rest_gap * coarser;
        settings.foundation_points = std::max(1, plan.foundation_points / coarser);
        if (progress) {
            progress(fmt::format("{} contact, step {:g} ms, {}", hard ? "hard" : "equal k", settings.time_step * 1e3,
                                 hard ? fmt::format("rest gap {:g} um", settings.rest_gap * 1e6)
                                      : fmt::format("{} points on a triangle",
                                                    settings.foundation_points * settings.foundation_points)));
        }
        if (!hard || !crossed) return run_solver(scene, settings, shown, grasp);
        Run failed;
        const std::optional<Scene> ready = led_in(scene, settings.rest_gap, failed.message);
        return ready ? run_solver(*ready, settings, shown, grasp) : failed;
    };
    const Run finest = run(1.0, 1);
    const bool starts = finest.until >= 0.02 * scene_end;
    if (!starts) return unavailable(finest.message.empty() ? "jaws close at once" : finest.message);
    const Run middle = run(2.0, 1);
    const std::array<Run, 3> by_step{run(4.0, 1), middle, finest};
    const std::array<Run, 3> by_stiffness{run(2.0, 4), run(2.0, 2), middle};

    ReferenceSolution solution;
    solution.until = grasp;
    solution.reason = grasp < scene_end ? "jaws close: what is held depends on a rule of grasping" : "";
    for (const auto* runs : {&by_stiffness, &by_step}) {
        for (const Run& other : *runs) {
            if (other.message.empty() || other.until >= solution.until) continue;
            solution.until = other.until;
            solution.reason = other.message;
        }
    }
    // The low-pass looks ahead by about its period.
    if (solution.until < scene_end) solution.until -= 0.02;
    const double until = solution.until;
    // A reference that ends early says little about a run: below half of it, it would look like an answer.
    if (until < 0.5 * scene_end) return unavailable(solution.reason);
    solution.points = choose_points(scene, finest);

    double largest = 0.0;
    for (const Vector3& force : band_limited(finest, scene.dt, until)) largest = std::max(largest, force.norm());
    const double floor = std::max(force_floor, relative_floor * largest);
    std::string doubts;
    const auto observe = [&](const std::array<Run, 3>& runs, const char* what, double& order) {
        const double coarse = force_difference(runs[0], runs[1], scene.dt, until);
        const double fine = force_difference(runs[1], runs[2], scene.dt, until);
        const Observed f = observe_order(coarse, fine, floor);
        const Observed p = observe_order(position_difference(runs[0], runs[1], solution.points, until),
                                         position_difference(runs[1], runs[2], solution.points, until), position_floor);
        order = f.order;
        solution.force_bound += f.bound;
        solution.position_bound += p.bound;
        if (f.converges) return;
        doubts +=
            fmt::format("{}the force does not converge when the {} is refined (differences {:.2g} and {:.2g} N RMS)",
                        doubts.empty() ? "" : "; ", what, coarse, fine);
    };
    solution.force_bound = 0.0;
    solution.position_bound = 0.0;
    observe(by_step, "step", solution.order_time_step);
    observe(by_stiffness, hard ? "rest gap" : "sampling", solution.order_stiffness);
    solution.time_step = step;
    solution.residual = finest.residual;
    solution.worst_gap = std::isfinite(finest.worst_gap) ? finest.worst_gap : ReferenceSolution::unset;
    if (hard) solution.rest_gap = plan.rest_gap;
    solution.max_strain = finest.strain;
    solution.clears_within_strain_limit =
        hard && finest.message.empty() && (!scene.has_tissue() || finest.strain <= scene.materials.strain_limit);
    if (!doubts.empty()) {
        solution.reason = doubts;
        solution.force.resize(3, 0);
        solution.points.clear();
        return solution;
    }
    solution.available = true;
    const auto every = std::max<std::int64_t>(1, std::lround(0.002 / step));
    solution.sample_interval = step * static_cast<double>(every);
    std::vector<Vector3> samples;
    for (std::size_t i = 0; i < finest.force.size(); i += static_cast<std::size_t>(every))
        samples.push_back(finest.force[i]);
    solution.force.resize(3, static_cast<Eigen::Index>(samples.size()));
    for (std::size_t i = 0; i < samples.size(); ++i) solution.force.col(static_cast<Eigen::Index>(i)) = samples[i];
    solution.position_interval = position_interval;
    for (const Matrix3X& place : finest.place) {
        Matrix3X chosen(3, static_cast<Eigen::Index>(solution.points.size()));
        for (std::size_t i = 0; i < solution.points.size(); ++i) {
            chosen.col(static_cast<Eigen::Index>(i)) = place.col(solution.points[i]);
        }
        solution.positions.push_back(chosen);
    }
    return solution;
}

}  // namespace

Observed observe_order(double coarse, double fine, double floor) {
    Observed observed;
    const bool shrinks = fine < coarse;
    if (shrinks && fine > 0.0) observed.order = std::log2(coarse / fine);
    constexpr double least_order = 0.3;
    const bool ordered = shrinks && (fine == 0.0 || observed.order >= least_order);
    observed.converges = ordered || std::max(coarse, fine) <= floor;
    observed.bound = std::max(coarse, fine);
    if (shrinks && fine == 0.0) observed.bound = 0.0;
    if (ordered && fine > 0.0) observed.bound = fine / (std::exp2(std::clamp(observed.order, 0.5, 2.0)) - 1.0);
    return observed;
}

Reference build_reference(const Scene& scene, const ReferencePlan& plan, const ReferenceProgress& progress) {
    Reference reference;
    reference.scene = scene.name;
    reference.scene_hash = fmt::format("{:016x}", scene.hash);
    const double step = step_of(scene, plan);
    reference.origin["settings"] = fmt::format(
        "BDF2, step {0:g} ms (also {1:g} and {2:g}); hard: rest gap {3:g} um (also {4:g} and {5:g}); equal k: {6} "
        "points on a triangle (also {7} and {8}); Newton to 1e-6 of the largest contact",
        step * 1e3, step * 2e3, step * 4e3, plan.rest_gap * 1e6, plan.rest_gap * 2e6, plan.rest_gap * 4e6,
        plan.foundation_points * plan.foundation_points, plan.foundation_points * plan.foundation_points / 4,
        std::max(1, plan.foundation_points * plan.foundation_points / 16));
    reference.origin["seed"] = fmt::format("{} (no chance is involved)", scene.seed);
    if (starts_crossed(scene)) {
        reference.origin["start"] = "hard: led in from the end of the script in equilibrium, then still";
    }
    const double grasp = time_of_grasp(scene);
    reference.hard = solve_law(scene, ReferenceLaw::hard, plan, step, grasp, progress);
    reference.equal_k = solve_law(scene, ReferenceLaw::foundation, plan, step, grasp, progress);
    return reference;
}

}  // namespace trocar
