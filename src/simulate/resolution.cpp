#include "simulate/resolution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/input_error.hpp"
#include "measure/statistics.hpp"
#include "scene/vertex_springs.hpp"
#include "simulate/query_distance.hpp"

namespace trocar {
namespace {

constexpr double depth_edges = 0.02;
constexpr double place_edges = 0.25;
constexpr double place_share = 0.95;
constexpr double least_force = 0.05;  // N
constexpr double force_share = 0.25;
constexpr double still_falling = 0.9;  // depth at the end, relative to that at the start of the rest

using Tick = ResolutionTrail::Tick;

std::int64_t ticks_in(const Scene& scene, double seconds) { return std::llround(seconds / scene.dt); }

ResolutionWindow window_of(const Scene& scene) {
    ResolutionWindow window;
    window.begin = std::max<std::int64_t>(0, ticks_in(scene, scene.contact_off->to));
    window.end = window.begin + ticks_in(scene, ResolutionWindow::length);
    window.rest_begin = window.end - ticks_in(scene, ResolutionWindow::rest);
    return window;
}

/// Largest of a member over ticks.
double largest(std::span<const Tick> ticks, double Tick::*member) {
    double most = 0.0;
    for (const Tick& tick : ticks) most = std::fmax(most, tick.*member);
    return most;
}

double mean(std::span<const Tick> ticks, double Tick::*member) {
    double sum = 0.0;
    for (const Tick& tick : ticks) sum += tick.*member;
    return ticks.empty() ? std::nan("") : sum / static_cast<double>(ticks.size());
}

Vector3 mean_force(std::span<const Tick> ticks) {
    Vector3 sum = Vector3::Zero();
    for (const Tick& tick : ticks) sum += tick.force;
    return ticks.empty() ? sum : sum / static_cast<double>(ticks.size());
}

/// m, distances of free tissue vertices; without tissue, of the instruments'.
std::vector<double> distances(const Scene& scene, const Matrix3X& one, const Matrix3X& other) {
    std::vector<double> list;
    list.reserve(static_cast<std::size_t>(one.cols()));
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind != (scene.has_tissue() ? BodyKind::tissue : BodyKind::instrument)) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            if (scene.has_tissue() && !scene.materials.is_free(v)) continue;
            list.push_back((one.col(v) - other.col(v)).norm());
        }
    }
    return list;
}

/// m, mean over the springs of the tissue; without tissue, the smallest mean edge of a body that moves.
double edge_of(const Scene& scene) {
    if (!scene.has_tissue()) return QueryDistance(scene).edge();
    return mean_spring_length(scene.materials);
}

/// A window of one run beside that of its twin.
struct Comparison {
    const Scene& scene;
    const ResolutionTrail& trail;
    const ResolutionTrail& twin;
    ResolutionWindow window;
    double edge;  ///< m

    [[nodiscard]] std::size_t rest_begin() const { return static_cast<std::size_t>(window.rest_begin - window.begin); }
    [[nodiscard]] bool is_whole() const {
        const auto length = static_cast<std::size_t>(window.end - window.begin);
        return trail.ticks.size() == length && twin.ticks.size() == length;
    }
    [[nodiscard]] std::span<const Tick> rest(const ResolutionTrail& of) const {
        const std::span<const Tick> all(of.ticks);
        return all.subspan(std::min(rest_begin(), all.size()));
    }
    [[nodiscard]] double twin_depth() const { return largest(rest(twin), &Tick::depth); }
    [[nodiscard]] double place_difference() const {
        const std::vector<double> list = distances(scene, trail.mean_position, twin.mean_position);
        return list.empty() ? 0.0 : quantile(list, place_share);
    }

    [[nodiscard]] bool violates(const Tick& tick) const {
        return !(tick.depth <= twin_depth() + depth_edges * edge) ||
               tick.wrong_side_area > largest(rest(twin), &Tick::wrong_side_area) + edge * edge ||
               tick.strain_over > 0.0;
    }
    /// Ticks to the last violation and one more; the window's length where it ends with one.
    [[nodiscard]] std::size_t clock() const {
        std::size_t after = 0;
        for (std::size_t t = 0; t < trail.ticks.size(); ++t) {
            if (violates(trail.ticks[t])) after = t + 1;
        }
        return after;
    }
    [[nodiscard]] bool rests_like_the_twin() const {
        const Vector3 expected = mean_force(rest(twin));
        const double allowed = std::max(least_force, force_share * expected.norm());
        return (mean_force(rest(trail)) - expected).norm() <= allowed && place_difference() <= place_edges * edge;
    }
    [[nodiscard]] bool tears() const {
        return std::any_of(trail.ticks.begin(), trail.ticks.end(), [](const Tick& tick) { return tick.ruptures > 0; });
    }
    [[nodiscard]] bool twin_resolves() const { return twin_depth() <= 0.5 * trail.depth_before; }
};

Unresolved cause_of(const Comparison& with, const Outcome& outcome) {
    const std::vector<Tick>& ticks = with.trail.ticks;
    if (!outcome.ok() || ticks.empty() || ticks.back().strain_over > 0.0) return Unresolved::unstable;
    if (with.tears()) return Unresolved::rupture;
    if (ticks.back().offered == 0) return Unresolved::nothing_reported;
    const std::span<const Tick> rest = with.rest(with.trail);
    const Vector3 force = mean_force(rest);
    if (ticks.back().used == 0 || force.isZero(0.0)) return Unresolved::no_direction;
    const bool deep = with.violates(ticks.back());
    const bool opposed = force.dot(mean_force(with.rest(with.twin))) <= 0.0 && force.norm() > least_force;
    if (!deep || opposed) return Unresolved::wrong_side_held;
    if (rest.back().depth < still_falling * rest.front().depth) return Unresolved::too_slow;
    return Unresolved::balance_of_forces;
}

}  // namespace

Scene twin_of(const Scene& scene) {
    Scene twin = scene;
    const std::int64_t earlier = scene.prelude_ticks();
    const double shift = static_cast<double>(earlier) * scene.dt;
    twin.first = scripted_frame(scene, -earlier);
    twin.first.tick = 0;
    twin.first.time = 0.0;
    for (SceneBody& body : twin.bodies) {
        if (!body.motion) continue;
        for (MotionKey& key : body.motion->keys) key.time += shift;
    }
    twin.ticks += earlier;
    twin.contact_off.reset();
    return twin;
}

bool has_resolution_window(const Scene& scene) { return scene.contact_off && window_of(scene).end <= scene.ticks; }

ResolutionWindow resolution_window(const Scene& scene) {
    if (!has_resolution_window(scene)) {
        throw InputError(scene.file.empty() ? scene.name : scene.file.string(), "/contact_off",
                         fmt::format("an interval that ends {} s before the scene does", ResolutionWindow::length),
                         scene.contact_off ? fmt::format("one to {} s, {} ticks", scene.contact_off->to, scene.ticks)
                                           : std::string("none"));
    }
    return window_of(scene);
}

ResolutionObserver::ResolutionObserver(const Scene& scene, std::int64_t delay)
    : window_(resolution_window(scene)), delay_(delay) {
    trail_.ticks.reserve(static_cast<std::size_t>(window_.end - window_.begin));
    trail_.mean_position = Matrix3X::Zero(3, scene.topology.vertex_count);
    trail_.last_position = scene.first.position;
}

void ResolutionObserver::observe(const Simulation& simulation, const StepRow& row) {
    const std::int64_t tick = row.tick - delay_;
    if (row.outcome != OutcomeKind::ok) return;
    if (tick == window_.begin - 1) trail_.depth_before = row.residual_penetration;
    trail_.last_position = simulation.frame().position;
    if (tick < window_.begin || tick >= window_.end) return;
    if (tick == window_.begin) trail_.meets = row.true_pairs > 0;
    trail_.ticks.push_back({.depth = row.residual_penetration,
                            .wrong_side_area = row.wrong_side_area,
                            .force = row.tool_force,
                            .energy = simulation.tissue_energy_gain(),
                            .overshoot = std::isnan(row.overshoot) ? 0.0 : row.overshoot,
                            .strain_over = std::isnan(row.strain_over) ? 0.0 : row.strain_over,
                            .ruptures = row.ruptures,
                            .offered = row.contacts_offered,
                            .used = row.contacts_used});
    if (tick < window_.rest_begin) return;
    ++resting_;
    trail_.mean_position += (simulation.frame().position - trail_.mean_position) / static_cast<double>(resting_);
}

std::string_view text_of(Unresolved cause) {
    static constexpr std::array<std::string_view, 8> texts{"resolved",         "unstable",         "rupture",
                                                           "nothing reported", "no direction",     "wrong side held",
                                                           "too slow",         "balance of forces"};
    return texts.at(static_cast<std::size_t>(cause));
}

Resolution compare_resolution(const Scene& scene, const Outcome& outcome, const ResolutionTrail& trail,
                              const ResolutionTrail& twin) {
    const Comparison with{scene, trail, twin, resolution_window(scene), edge_of(scene)};
    const std::vector<Tick>& ticks = trail.ticks;
    const std::size_t clock = with.clock();
    const bool resolved = outcome.ok() && with.is_whole() && clock < ticks.size() && !with.tears() &&
                          with.rests_like_the_twin() && with.twin_resolves();
    Resolution result;
    Summary& figures = result.figures;
    figures[Metric::resolution_resolved] = resolved ? 1.0 : 0.0;
    figures[Metric::resolution_cleared] =
        resolved && largest(ticks, &Tick::depth) <= depth_edges * with.edge ? 1.0 : 0.0;
    figures[Metric::resolution_meets] = trail.meets ? 1.0 : 0.0;
    figures[Metric::resolution_depth_before_m] = trail.depth_before;
    figures[Metric::resolution_depth_after_m] = ticks.empty() ? std::nan("") : ticks.back().depth;
    figures[Metric::resolution_depth_twin_m] = with.twin_depth();
    figures[Metric::resolution_ticks] = resolved ? static_cast<double>(clock) : std::nan("");
    if (!resolved) result.cause = cause_of(with, outcome);
    if (!with.is_whole()) return result;
    const double expected = std::max(least_force, mean_force(with.rest(twin)).norm());
    double kick = 0.0;
    double step = 0.0;
    Vector3 before = Vector3::Zero();
    for (const Tick& tick : ticks) {
        kick = std::fmax(kick, tick.force.norm());
        step = std::fmax(step, (tick.force - before).norm());
        before = tick.force;
    }
    const double stored = mean(with.rest(twin), &Tick::energy);
    figures[Metric::resolution_kick] = kick / expected;
    figures[Metric::resolution_force_step_n] = step;
    figures[Metric::resolution_excess_energy] =
        stored > 0.0 ? largest(ticks, &Tick::energy) / stored - 1.0 : std::nan("");
    figures[Metric::resolution_overshoot_m] =
        std::max(0.0, largest(ticks, &Tick::overshoot) - largest(twin.ticks, &Tick::overshoot));
    figures[Metric::resolution_wrong_side_m2] = ticks.back().wrong_side_area;
    figures[Metric::resolution_place_difference_m] = with.place_difference();
    const std::vector<double> left = distances(scene, trail.last_position, twin.last_position);
    const bool goes_on = scene.ticks >= with.window.end + ticks_in(scene, ResolutionWindow::rest);
    figures[Metric::resolution_left_behind_m] =
        goes_on && !left.empty() ? *std::max_element(left.begin(), left.end()) : std::nan("");
    return result;
}

}  // namespace trocar
