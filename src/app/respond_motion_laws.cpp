// Laws of what moves: rest, oscillation, preload and the limits of the step, each by the tissue integrator itself
// beside its closed form.
#include <array>

#include "app/respond_input.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar::app {

namespace {

/// Of one case, a fraction of a second.
constexpr std::int64_t most_steps_of_a_case = 2'000'000;

// ---------------------------------------------------------------- what moves: the tissue integrator itself
/// A tissue without triangles for the integrator's cases.
struct System {
    Topology topology;
    Materials materials;
    Frame frame;
    ResponseOutput output;
    std::vector<Wrench> reaction;

    System(const std::vector<Vector3>& points, double mass, const std::vector<std::uint8_t>& pinned,
           std::vector<Spring> springs, double drag) {
        const auto n = static_cast<Index>(points.size());
        topology = make_topology({Body{.name = "masses", .kind = BodyKind::tissue, .vertex_count = n}});
        materials.springs = std::move(springs);
        materials.pinned = pinned;
        materials.mass.assign(points.size(), mass);
        materials.drag.assign(points.size(), drag);
        materials.substeps = 1;
        materials.strain_limit = std::numeric_limits<double>::infinity();
        frame.position.resize(3, n);
        for (Index i = 0; i < n; ++i) frame.position.col(i) = points[at(i)];
        frame.previous = frame.position;
        frame.velocity = Matrix3X::Zero(3, n);
        output.resize(n, 1);
        reaction.assign(1, {});
    }
};

/// Steps until the free mass (vertex 0) is at rest. `contact` gives the plane contact for the present state.
template <typename Contact>
bool settle(System& system, double dt, const Contact& contact) {
    MassSpring tissue(system.topology, system.materials);
    constexpr int most_steps = 2'000'000;
    int quiet = 0;
    for (int step = 0; step < most_steps && quiet < 100; ++step) {
        system.output.contacts.clear();
        contact(system.output.contacts);
        const Vector3 before = system.frame.position.col(0);
        if (!tissue.advance(system.output, dt, system.frame, system.reaction).ok()) return false;
        const double moved = (system.frame.position.col(0) - before).norm();
        quiet = moved <= 1e-14 * std::max(before.norm(), 1e-3) ? quiet + 1 : 0;
    }
    return quiet >= 100;
}

ContactForceLaw plane_contact(const Vector3& normal, double gap, double k, double mu) {
    ContactForceLaw contact;
    contact.vertices = {0, -1, -1};
    contact.weights = {1.0, 0.0, 0.0};
    contact.normal = normal;
    contact.gap = gap;
    contact.k = k;
    contact.mu = mu;
    return contact;
}

LawAnswer answer_at_rest(bool settled) {
    LawAnswer answer;
    answer.sound = settled;
    if (!settled) answer.message = "the mass did not come to rest";
    return answer;
}

}  // namespace

// ---------------------------------------------------------------- static
LawAnswer mass_on_plane(const CaseInput& input) {
    const double m = input.positive("m");
    const double g = input.number("g", 9.81);
    const double k_contact = input.positive("k_contact");
    const double plane = input.number("plane_z", 0.0);
    const bool hung = input.has("k_spring");
    const double k_spring = hung ? input.positive("k_spring") : 0.0;
    const double rest = hung ? input.not_negative("rest_length") : 0.0;
    const double anchor = hung ? input.number("anchor_z") : 0.0;
    const double start = input.number("z0", plane + 1e-3);

    std::vector<Vector3> points{Vector3(0.0, 0.0, start)};
    std::vector<std::uint8_t> pinned{0};
    std::vector<Spring> springs;
    if (hung) {
        points.emplace_back(0.0, 0.0, anchor);
        pinned.push_back(1);
        springs.push_back({.i = 0, .j = 1, .rest = rest, .k = k_spring});
    }
    // Any damping leads to the same rest. Critical for the spring that pulls from afar: less would let a mass that
    // starts far below shoot through its anchor and come to rest above it.
    const double drag = 2.0 * std::sqrt((hung ? k_spring : k_contact) * m);
    const double dt = 0.2 * m / drag;  // the plane's own stiffness is taken implicitly and bears any step
    System system(points, m, pinned, springs, drag);
    system.output.held_force(2, 0) = -m * g;
    const double mu = input.not_negative("mu", 0.0);
    LawAnswer answer = answer_at_rest(settle(system, dt, [&](std::vector<ContactForceLaw>& contacts) {
        const double gap = system.frame.position(2, 0) - plane;
        if (gap < 0.0) contacts.push_back(plane_contact(Vector3::UnitZ(), gap, k_contact, mu));
    }));
    const double z = system.frame.position(2, 0);
    const double depth = std::max(plane - z, 0.0);
    answer.values = {{"depth", depth}, {"contact_force", k_contact * depth}, {"z", z}, {"in_contact", depth > 0.0}};
    if (hung) {
        answer.values["spring_force_up"] =
            spring_force(system.materials.springs[0], system.frame.position, Matrix3X::Zero(3, 2)).z();
        Matrix3X at_plane = system.frame.position;
        at_plane(2, 0) = plane;
        answer.values["pretension_at_plane_height"] =
            spring_force(system.materials.springs[0], at_plane, Matrix3X::Zero(3, 2)).z();
    }
    return answer;
}

LawAnswer springs_in_series(const CaseInput& input) {
    const double k_tissue = input.positive("k_tissue");
    const double k_contact = input.positive("k_contact");
    const double total = input.not_negative("indentation_total");
    const double m = input.has("m") ? input.positive("m") : 1e-3;
    // The mass hangs on a tissue spring whose free end is at the origin; the tool's plane came down by `total`.
    const double length = 100.0 * std::max(total, 1e-6);
    const double drag = 2.0 * std::sqrt(k_tissue * m);
    const double dt = 0.1 * std::sqrt(m / k_tissue);  // the critical drag asks for the same
    System system({Vector3::Zero(), Vector3(0.0, 0.0, -length)}, m, {0, 1},
                  {Spring{.i = 0, .j = 1, .rest = length, .k = k_tissue}}, drag);
    LawAnswer answer = answer_at_rest(settle(system, dt, [&](std::vector<ContactForceLaw>& contacts) {
        const double gap = -total - system.frame.position(2, 0);
        if (gap <= 0.0) contacts.push_back(plane_contact(-Vector3::UnitZ(), gap, k_contact, 0.0));
    }));
    const double depth = std::max(total + system.frame.position(2, 0), 0.0);
    answer.values = {{"force", k_contact * depth}, {"contact_depth", depth}};
    return answer;
}

namespace {

// ---------------------------------------------------------------- osc
/// x and v of m x'' + c x' + k x = 0 at time t.
std::array<double, 2> damped_motion(double m, double k, double c, double x0, double v0, double t) {
    const double decay = c / (2.0 * m);
    const double omega2 = k / m;
    const double difference = decay * decay - omega2;
    double cosine = 0.0;  // e^(-decay t) cos or cosh
    double sine = 0.0;    // e^(-decay t) sin/omega_d or sinh/b
    const double b = std::sqrt(std::abs(difference));
    if (b * t < 1e-6) {
        cosine = std::exp(-decay * t) * (1.0 + 0.5 * difference * t * t);
        sine = std::exp(-decay * t) * t * (1.0 + difference * t * t / 6.0);
    } else if (difference < 0.0) {
        cosine = std::exp(-decay * t) * std::cos(b * t);
        sine = std::exp(-decay * t) * std::sin(b * t) / b;
    } else {
        const double slow = std::exp((b - decay) * t);
        const double fast = std::exp((-b - decay) * t);
        cosine = 0.5 * (slow + fast);
        sine = 0.5 * (slow - fast) / b;
    }
    return {x0 * cosine + (v0 + decay * x0) * sine, v0 * cosine - (decay * v0 + omega2 * x0) * sine};
}

/// Oscillator along x: a mass on a spring of rest length zero, which is exactly linear through its anchor.
System oscillator(double m, double k, double c, double x0, double v0) {
    System system({Vector3(x0, 0.0, 0.0), Vector3::Zero()}, m, {0, 1}, {Spring{.i = 0, .j = 1, .rest = 0.0, .k = k}},
                  c);
    system.frame.velocity(0, 0) = v0;
    return system;
}

}  // namespace

LawAnswer oscillation(const CaseInput& input, const Json& expected) {
    const double m = input.positive("m");
    const double k = input.not_negative("k");
    const double c = input.not_negative("c", 0.0);
    const double x0 = input.number("x0");
    const double v0 = input.number("v0", 0.0);
    const std::vector<double> times = input.numbers("times");
    if (times.empty()) input.fault("times", "at least one time", "none");
    for (std::size_t i = 0; i < times.size(); ++i) {
        if (times[i] < 0.0) input.fault(fmt::format("times/{}", i), "a time >= 0", fmt::format("{}", times[i]));
    }
    LawAnswer answer;
    Json closed = Json::array();
    for (const double t : times) {
        const auto [x, v] = damped_motion(m, k, c, x0, v0, t);
        closed.push_back({{"t", t}, {"x", x}, {"v", v}});
    }
    answer.values["closed_form"] = closed;

    // Step sizes: those the case asks for, else 512 steps to the last time and three halvings.
    const double end = times.back();
    std::vector<std::pair<double, std::int64_t>> runs;
    if (expected.is_object() && expected.contains("semi_implicit_euler") &&
        expected["semi_implicit_euler"].is_array()) {
        for (const Json& entry : expected["semi_implicit_euler"]) {
            if (!entry.is_object() || !entry.contains("h") || !entry.contains("steps")) continue;
            if (!entry["h"].is_number() || !entry["steps"].is_number_integer()) continue;
            const auto steps = entry["steps"].get<std::int64_t>();
            if (steps >= 1 && steps <= most_steps_of_a_case) runs.emplace_back(entry["h"].get<double>(), steps);
        }
    }
    if (runs.empty() && input.has("h")) {
        const double h = input.positive("h");
        const auto steps = input.has("steps") ? input.count("steps", most_steps_of_a_case)
                                              : static_cast<std::int64_t>(std::llround(end / h));
        if (steps > most_steps_of_a_case)
            input.fault("h", fmt::format("at most {} steps", most_steps_of_a_case), fmt::format("{}", steps));
        runs.emplace_back(h, std::max<std::int64_t>(steps, 1));
    }
    if (runs.empty() && end > 0.0) {
        for (std::int64_t steps = 512; steps <= 4096; steps *= 2)
            runs.emplace_back(end / static_cast<double>(steps), steps);
    }
    Json scheme = Json::array();
    std::vector<double> errors;
    for (const auto& [h, steps] : runs) {
        System system = oscillator(m, k, c, x0, v0);
        MassSpring tissue(system.topology, system.materials);
        for (std::int64_t step = 0; step < steps; ++step) {
            const Outcome outcome = tissue.advance(system.output, h, system.frame, system.reaction);
            if (outcome.ok()) continue;
            answer.message = outcome.message;
            break;
        }
        const double x = system.frame.position(0, 0);
        const double v = system.frame.velocity(0, 0);
        const double error = std::abs(x - damped_motion(m, k, c, x0, v0, h * static_cast<double>(steps))[0]);
        errors.push_back(error);
        scheme.push_back({{"h", h}, {"steps", steps}, {"x", x}, {"v", v}, {"abs_error_x", error}});
    }
    answer.values["semi_implicit_euler"] = scheme;
    std::vector<double> orders;
    for (std::size_t i = 1; i < errors.size(); ++i) {
        orders.push_back(std::log(errors[i - 1] / errors[i]) / std::log(runs[i - 1].first / runs[i].first));
    }
    if (!orders.empty()) {
        const auto [low, high] = std::minmax_element(orders.begin(), orders.end());
        answer.values["observed_orders"] = orders;
        answer.values["order_expected"] = 1.0;  // the scheme's order
        answer.values["order_band"] = Json::array({*low, *high});
    }
    answer.rules = {{"observed_orders", Rule::information}, {"order_band", Rule::band}};
    return answer;
}

LawAnswer oscillation_energy(const CaseInput& input) {
    const double m = input.positive("m");
    const double k = input.positive("k");
    const double c = input.not_negative("c", 0.0);
    const double h = input.positive("h");
    const double x0 = input.number("x0");
    const double v0 = input.number("v0", 0.0);
    const std::int64_t steps = input.count("steps", most_steps_of_a_case);
    System system = oscillator(m, k, c, x0, v0);
    MassSpring tissue(system.topology, system.materials);
    const auto energy = [&] {
        const double x = system.frame.position(0, 0);
        const double v = system.frame.velocity(0, 0);
        return 0.5 * k * x * x + 0.5 * m * v * v;
    };
    const auto invariant = [&] {
        return energy() - 0.5 * h * k * system.frame.position(0, 0) * system.frame.velocity(0, 0);
    };
    const double first = energy();
    const double first_invariant = invariant();
    if (!(first > 0.0)) input.fault("x0", "a start with energy", "rest");
    double low = 1.0;
    double high = 1.0;
    double first_crossing = unset;
    double last_crossing = unset;
    std::int64_t crossings = 0;
    LawAnswer answer;
    for (std::int64_t step = 0; step < steps; ++step) {
        const double before = system.frame.position(0, 0);
        const Outcome outcome = tissue.advance(system.output, h, system.frame, system.reaction);
        if (!outcome.ok()) {
            answer.message = outcome.message;
            high = std::numeric_limits<double>::infinity();
            break;
        }
        const double after = system.frame.position(0, 0);
        const double ratio = energy() / first;
        low = std::min(low, ratio);
        high = std::max(high, ratio);
        if (before < 0.0 && after >= 0.0) {
            last_crossing = static_cast<double>(step) + before / (before - after);
            if (crossings == 0) first_crossing = last_crossing;
            ++crossings;
        }
    }
    // Rounding makes a random walk of the invariant; only what exceeds it is a drift of the scheme.
    const double change = (invariant() - first_invariant) / first_invariant;
    const double rounding = 16.0 * std::numeric_limits<double>::epsilon() * std::sqrt(static_cast<double>(steps));
    const double drift = std::abs(change) <= rounding ? 0.0 : change / static_cast<double>(steps);
    const double omega = std::sqrt(k / m);
    answer.values = {
        {"omega_h", omega * h}, {"energy_ratio_min", low}, {"energy_ratio_max", high}, {"drift_per_step", drift}};
    if (crossings > 1) {
        const double period = (last_crossing - first_crossing) / static_cast<double>(crossings - 1) * h;
        answer.values["numerical_frequency_ratio"] = 2.0 * EIGEN_PI / period / omega;
    }
    if (answer.message.empty()) {
        answer.message =
            fmt::format("relative change of the modified energy {:.1e}, rounding allows {:.1e}", change, rounding);
    }
    answer.rules = {{"energy_ratio_min", Rule::lower_bound}, {"energy_ratio_max", Rule::upper_bound}};
    return answer;
}

// ---------------------------------------------------------------- preload
LawAnswer preloaded_pair(const CaseInput& input) {
    const double k = input.positive("k");
    const double length = input.positive("L");
    const double rest = input.not_negative("rest_length");
    const double y = input.number("y", 0.0);
    const double m = input.has("m") ? input.positive("m") : unset;
    const std::vector<Spring> springs{{.i = 0, .j = 1, .rest = rest, .k = k}, {.i = 0, .j = 2, .rest = rest, .k = k}};
    System system({Vector3::Zero(), Vector3(length, 0.0, 0.0), Vector3(-length, 0.0, 0.0)}, input.has("m") ? m : 1.0,
                  {0, 1, 1}, springs, 0.0);
    const Matrix3X zero = Matrix3X::Zero(3, 3);
    const double tension = spring_force(springs[0], system.frame.position, zero).x();
    Matrix3X sideways = zero;
    sideways(1, 0) = 1.0;
    Matrix3X force;
    apply_stiffness(system.materials, system.frame.position, sideways, force);
    const double stiffness = force(1, 0);
    LawAnswer answer;
    Matrix3X moved = system.frame.position;
    moved(1, 0) = y;
    internal_force(system.materials, moved, zero, force);
    answer.values = {{"pretension", tension},
                     {"restoring_force", force(1, 0)},
                     {"small_amplitude_stiffness", stiffness},
                     {"leading_term", stiffness != 0.0 ? -stiffness * y : -k * y * y * y / (length * length)}};
    if (input.has("m")) answer.values["small_amplitude_omega"] = std::sqrt(std::max(stiffness, 0.0) / m);
    return answer;
}

namespace {

// ---------------------------------------------------------------- stab
/// Step limits of a system, checked by running the integrator on its stiffest mode on either side of the limit.
LawAnswer step_limits(System system, double damping_rate) {
    const LargestMode mode = largest_mode(system.materials, system.frame.position);
    const double critical = critical_time_step(mode.omega, damping_rate);
    LawAnswer answer;
    answer.values = {{"omega_max", mode.omega},
                     {"dt_crit_undamped", critical_time_step(mode.omega, 0.0)},
                     {"dt_crit", critical},
                     {"gershgorin_bound_omega", gershgorin_bound_omega(system.materials, system.frame.position)},
                     {"stable_at_1kHz", 1e-3 < critical}};
    if (!std::isfinite(critical)) return answer;
    // The state the data linearises about is held by a constant load where springs are preloaded.
    internal_force(system.materials, system.frame.position, system.frame.velocity, system.materials.rest_bias);
    system.materials.rest_bias *= -1.0;
    double scale = std::numeric_limits<double>::infinity();
    for (const Spring& spring : system.materials.springs) {
        scale = std::min(scale, (system.frame.position.col(spring.j) - system.frame.position.col(spring.i)).norm());
    }
    const double amplitude = 1e-9 * scale * mode.omega;
    const auto growth = [&](double factor) {
        System run = system;
        run.frame.velocity = amplitude * mode.shape;
        MassSpring tissue(run.topology, run.materials);
        double largest = 0.0;
        for (int step = 0; step < 2000 && largest < 1e4; ++step) {
            if (!tissue.advance(run.output, factor * critical, run.frame, run.reaction).ok()) {
                return std::numeric_limits<double>::infinity();
            }
            largest = std::max(largest, run.frame.velocity.cwiseAbs().maxCoeff() / amplitude);
        }
        return largest;
    };
    const double below = growth(0.99);
    const double above = growth(1.01);
    answer.sound = below < 100.0 && above >= 1e4;
    answer.message = fmt::format("up to 2000 steps of the integrator: growth {:.3g} at 0.99 dt_crit, {} at 1.01", below,
                                 above >= 1e4 ? std::string("over 10000") : fmt::format("{:.3g}", above));
    return answer;
}

}  // namespace

LawAnswer chain_limits(const CaseInput& input) {
    const auto n = static_cast<Index>(input.count("N", 1000));
    const double k = input.positive("k");
    const double m = input.positive("m");
    const std::string ends = input.has("ends")
                                 ? input.word("ends", {"fixed-fixed", "fixed-free", "free-fixed", "free-free"})
                                 : "fixed-fixed";
    const double damping = input.not_negative(input.has("damping_per_mass") ? "damping_per_mass" : "damping", 0.0);
    const double spacing = input.has("spacing") ? input.positive("spacing") : 1.0;
    const double ratio = input.not_negative("rest_length_over_length", 1.0);
    const bool fixed_first = ends.starts_with("fixed");
    const bool fixed_last = ends.ends_with("-fixed");
    std::vector<Vector3> points;
    std::vector<std::uint8_t> pinned;
    const Index count = n + (fixed_first ? 1 : 0) + (fixed_last ? 1 : 0);
    std::vector<Spring> springs;
    for (Index i = 0; i < count; ++i) {
        points.emplace_back(spacing * i, 0.0, 0.0);
        pinned.push_back((i == 0 && fixed_first) || (i == count - 1 && fixed_last) ? 1 : 0);
        if (i > 0) springs.push_back({.i = i - 1, .j = i, .rest = ratio * spacing, .k = k});
    }
    return step_limits(System(points, m, pinned, springs, damping), damping / m);
}

LawAnswer sheet_limits(const CaseInput& input) {
    const auto n = static_cast<Index>(input.count("n", 150));
    const double spacing = input.positive("spacing");
    const double k = input.positive("k");
    const double m = input.positive("m");
    const bool fixed = input.has("boundary") && input.word("boundary", {"free", "boundary fixed", "fixed"}) != "free";
    const double ratio = input.not_negative("rest_length_over_length", 1.0);
    const double damping = input.not_negative(input.has("damping_per_mass") ? "damping_per_mass" : "damping", 0.0);
    std::vector<Vector3> points;
    std::vector<std::uint8_t> pinned;
    std::vector<Spring> springs;
    const auto join = [&](Index i, Index j) {
        const double length = (points[at(i)] - points[at(j)]).norm();
        springs.push_back({.i = i, .j = j, .rest = ratio * length, .k = k});
    };
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) {
            points.emplace_back(spacing * i, spacing * j, 0.0);
            pinned.push_back(fixed && (i == 0 || j == 0 || i == n - 1 || j == n - 1) ? 1 : 0);
        }
    }
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) {
            const Index here = i * n + j;
            if (i + 1 < n) join(here, here + n);
            if (j + 1 < n) join(here, here + 1);
            if (i + 1 < n && j + 1 < n) join(here, here + n + 1);
        }
    }
    const auto edges = springs.size();
    LawAnswer answer = step_limits(System(points, m, pinned, springs, damping), damping / m);
    answer.values["edge_count"] = edges;
    return answer;
}

LawAnswer contact_limits(const CaseInput& input) {
    const double k_tissue = input.not_negative("k_tissue_sum");
    const double k_contact = input.not_negative("k_contact");
    const double m = input.positive("m");
    const double damping = input.not_negative(input.has("mu") ? "mu" : "damping", 0.0);
    if (k_tissue + k_contact <= 0.0) input.fault("k_contact", "some stiffness", "0");
    // An explicit contact is one more spring at the mass.
    const System system(
        {Vector3::Zero(), Vector3(1.0, 0.0, 0.0), Vector3(-1.0, 0.0, 0.0)}, m, {0, 1, 1},
        {Spring{.i = 0, .j = 1, .rest = 1.0, .k = k_tissue}, Spring{.i = 0, .j = 2, .rest = 1.0, .k = k_contact}},
        damping);
    LawAnswer answer = step_limits(system, damping / m);
    answer.values["omega"] = answer.values["omega_max"];
    return answer;
}

}  // namespace trocar::app
