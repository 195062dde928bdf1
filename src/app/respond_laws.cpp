#include "app/respond_laws.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/crossing.hpp"
#include "geometry/input_error.hpp"
#include "respond/equations.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;
using equations::Corners;

constexpr double unset = std::numeric_limits<double>::quiet_NaN();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Reads typed values out of one case's `input` and names the place of every fault.
class Input {
public:
    Input(const Json& json, std::string file, std::string pointer)
        : json_(json), file_(std::move(file)), pointer_(std::move(pointer)) {}

    [[nodiscard]] bool has(const std::string& key) const { return json_.contains(key); }

    [[noreturn]] void fault(const std::string& key, std::string_view expected, std::string_view found) const {
        throw InputError(file_, pointer_ + "/" + key, expected, found);
    }

    /// The first of `keys` that is there; a fault naming the first if none is.
    [[nodiscard]] std::string one_of(std::initializer_list<const char*> keys) const {
        for (const char* key : keys) {
            if (has(key)) return key;
        }
        fault(*keys.begin(), "a value", "nothing");
    }
    [[nodiscard]] bool has_one_of(std::initializer_list<const char*> keys) const {
        return std::any_of(keys.begin(), keys.end(), [this](const char* key) { return has(key); });
    }

    [[nodiscard]] double number(const std::string& key) const { return number_at(value(key), key); }
    [[nodiscard]] double number(const std::string& key, double otherwise) const {
        return has(key) ? number(key) : otherwise;
    }
    [[nodiscard]] double positive(const std::string& key) const {
        const double x = number(key);
        if (!(x > 0.0)) fault(key, "a number > 0", fmt::format("{}", x));
        return x;
    }
    [[nodiscard]] double not_negative(const std::string& key) const {
        const double x = number(key);
        if (!(x >= 0.0)) fault(key, "a number >= 0", fmt::format("{}", x));
        return x;
    }
    [[nodiscard]] double not_negative(const std::string& key, double otherwise) const {
        return has(key) ? not_negative(key) : otherwise;
    }
    [[nodiscard]] std::int64_t count(const std::string& key, std::int64_t most) const {
        const double x = number(key);
        if (x != std::floor(x) || x < 1.0 || x > static_cast<double>(most)) {
            fault(key, fmt::format("a whole number from 1 to {}", most), fmt::format("{}", x));
        }
        return static_cast<std::int64_t>(x);
    }
    [[nodiscard]] std::string word(const std::string& key, std::initializer_list<const char*> choices) const {
        const Json& json = value(key);
        if (json.is_string()) {
            const std::string text = json.get<std::string>();
            for (const char* choice : choices) {
                if (text == choice) return text;
            }
        }
        fault(key, fmt::format("one of {}", fmt::join(choices, ", ")), json.dump());
    }
    [[nodiscard]] Vector3 vector(const std::string& key) const { return vector_at(value(key), key); }
    [[nodiscard]] Vector3 vector(const std::string& key, const Vector3& otherwise) const {
        return has(key) ? vector(key) : otherwise;
    }
    [[nodiscard]] std::vector<double> numbers(const std::string& key) const {
        const Json& list = array(key);
        std::vector<double> result;
        for (std::size_t i = 0; i < list.size(); ++i)
            result.push_back(number_at(list[i], fmt::format("{}/{}", key, i)));
        return result;
    }
    [[nodiscard]] std::vector<Vector3> vectors(const std::string& key) const {
        const Json& list = array(key);
        std::vector<Vector3> result;
        for (std::size_t i = 0; i < list.size(); ++i)
            result.push_back(vector_at(list[i], fmt::format("{}/{}", key, i)));
        return result;
    }
    [[nodiscard]] Corners corners(const std::string& key) const {
        const std::vector<Vector3> list = vectors(key);
        if (list.size() != 3) fault(key, "3 corners", fmt::format("{}", list.size()));
        return {list[0], list[1], list[2]};
    }
    /// Velocities of a triangle's corners; zero where the case is silent.
    [[nodiscard]] Corners velocities(std::initializer_list<const char*> keys) const {
        if (!has_one_of(keys)) return {Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
        return corners(one_of(keys));
    }

private:
    [[nodiscard]] const Json& value(const std::string& key) const {
        const auto found = json_.find(key);
        if (found == json_.end()) fault(key, "a value", "nothing");
        return *found;
    }
    [[nodiscard]] const Json& array(const std::string& key) const {
        const Json& json = value(key);
        if (!json.is_array()) fault(key, "an array", json.type_name());
        return json;
    }
    [[nodiscard]] double number_at(const Json& json, const std::string& place) const {
        if (!json.is_number()) fault(place, "a number", json.is_null() ? "null" : json.type_name());
        const double x = json.get<double>();
        if (!std::isfinite(x)) fault(place, "a finite number", fmt::format("{}", x));
        return x;
    }
    [[nodiscard]] Vector3 vector_at(const Json& json, const std::string& place) const {
        if (!json.is_array() || json.size() != 3) fault(place, "3 numbers", json.dump());
        Vector3 result;
        for (int i = 0; i < 3; ++i) result[i] = number_at(json[at(i)], fmt::format("{}/{}", place, i));
        return result;
    }

    const Json& json_;
    std::string file_;
    std::string pointer_;
};

Json to_json(const Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

template <typename List>
Json to_json_list(const List& list) {
    Json json = Json::array();
    for (const Vector3& v : list) json.push_back(to_json(v));
    return json;
}

/// Outer normal, or a fault: no law of a face can be asked of a triangle without area.
Vector3 normal_of(const Input& input, const std::string& key, const Corners& triangle) {
    const Vector3 n = equations::unit_normal(triangle);
    if (n.isZero(0.0)) input.fault(key, "a triangle with an area", "three corners on a line");
    return n;
}

// ---------------------------------------------------------------- 3.4 instrument to instrument, vertex in face
LawAnswer vertex_in_instrument(const Input& input) {
    const std::string key1 = input.one_of({"tri1", "tri_instrument"});
    const Corners tri1 = input.corners(key1);
    const Corners tri2 = input.corners(input.one_of({"tri2", "tri_rigid"}));
    const Vector3 n = normal_of(input, key1, tri1);
    const std::array<double, 3> depths = equations::depths_below(tri1, tri2);
    const int a2 = equations::deepest_corner(depths);
    const int a1 = equations::nearest_corner(tri1, tri2[at(a2)]);
    const double depth = depths[at(a2)];
    const auto inside = std::count_if(depths.begin(), depths.end(), [](double d) { return d > 0.0; });
    LawAnswer answer;
    answer.values = {{"A2", a2},       {"A1", a1},         {"n", to_json(n)},
                     {"depth", depth}, {"depths", depths}, {"count_positive", inside}};
    if (inside > 1) answer.message = "more than one corner inside: the deepest is A2";
    if (!input.has("k")) {
        answer.message = "no k in the input: geometry only, no force";
        return answer;
    }
    const double k = input.not_negative("k");
    const double mu = input.not_negative("mu", 0.0);
    const Vector3 v1 = input.velocities({"vel1", "vel_instrument"})[at(a1)];
    const Vector3 v2 = input.velocities({"vel2", "vel_rigid"})[at(a2)];
    const Vector3 force = equations::instrument_instrument_vertex(k, depth, mu, v1, v2, n);
    const double separating = (v2 - v1).dot(n);
    const double scalar = equations::vertex_in_face_force(k, depth, mu, separating);
    answer.values["v_rel_n"] = separating;
    answer.values["F_scalar"] = scalar;
    answer.values["F_on_A2"] = to_json(force);
    answer.values["F_on_A1"] = to_json(-force);
    answer.values["F_on_A2_if_adhesion_is_clamped"] = to_json(std::max(scalar, 0.0) * n);
    if (scalar < 0.0) answer.message = "the printed equation pulls here; no clamp (profiles faithful and printed)";
    return answer;
}

// ---------------------------------------------------------------- 3.5, 3.9 edges cross
LawAnswer edges_cross(const Input& input) {
    const Corners tri1 = input.corners(input.one_of({"tri1", "tri_instrument"}));
    const Corners tri2 = input.corners(input.one_of({"tri2", "tri_tissue", "tri_rigid"}));
    const Crossing crossing = cross_triangles(tri1, tri2);
    const equations::CornerPair pair = equations::closest_corners(tri1, tri2);
    LawAnswer answer;
    answer.values = {{"overlap_length", crossing.length},
                     {"t", to_json(crossing.direction)},
                     {"A1", pair.first},
                     {"A2", pair.second},
                     {"A1_A2_distance", pair.distance}};
    if (crossing.kind != CrossingKind::crossing) answer.message = "the triangles do not cross: no force";
    double k = unset;
    if (input.has("k_edges_tissue_triangle")) {
        const std::vector<double> edges = input.numbers("k_edges_tissue_triangle");
        if (edges.empty()) input.fault("k_edges_tissue_triangle", "at least one stiffness", "none");
        k = equations::mean_stiffness(edges);
        answer.values["k_average"] = k;
    } else if (input.has("k")) {
        k = input.not_negative("k");
    } else {
        return answer;
    }
    const Vector3 force = equations::edge_crossing(k, crossing.length, crossing.direction);
    answer.values["F_magnitude"] = force.norm();
    answer.values["F_on_A2"] = to_json(force);
    answer.values["F_on_A1"] = to_json(-force);
    return answer;
}

// ---------------------------------------------------------------- 3.6 instrument corner in tissue face
LawAnswer instrument_in_tissue(const Input& input) {
    const std::string key1 = input.one_of({"tri_instrument", "tri1"});
    const std::string key2 = input.one_of({"tri_tissue", "tri2"});
    const Corners tool = input.corners(key1);
    const Corners tissue = input.corners(key2);
    const Vector3 n = normal_of(input, key2, tissue);
    const std::array<double, 3> depths = equations::depths_below(tissue, tool);
    const int a1 = equations::deepest_corner(depths);
    const int a2 = equations::nearest_corner(tissue, tool[at(a1)]);
    const double depth = depths[at(a1)];
    LawAnswer answer;
    answer.values = {{"A1", a1}, {"A2", a2}, {"depth", depth}, {"n", to_json(n)}};
    double k = unset;
    if (input.has("k_springs_at_A2")) {
        const std::vector<double> springs = input.numbers("k_springs_at_A2");
        if (springs.empty()) input.fault("k_springs_at_A2", "at least one stiffness", "none");
        k = equations::mean_stiffness(springs);
        answer.values["k_average"] = k;
    } else if (input.has("k")) {
        k = input.not_negative("k");
    } else {
        return answer;
    }
    const double mu = input.not_negative("mu", 0.0);
    const Vector3 v1 = input.velocities({"vel_instrument", "vel1"})[at(a1)];
    const Vector3 v2 = input.velocities({"vel_tissue", "vel2"})[at(a2)];
    const double relative = (v2 - v1).dot(n);
    const Vector3 dissipative = equations::instrument_tissue_vertex_dissipative(k, depth, mu, v1, v2, n);
    const Vector3 literal = equations::instrument_tissue_vertex_literal(k, depth, mu, v1, v2, n);
    answer.values["v_rel_n_2_minus_1"] = relative;
    answer.values["F_scalar_literal"] = equations::vertex_in_face_force(k, depth, mu, relative);
    answer.values["F_scalar_dissipative"] = equations::vertex_in_face_force(k, depth, mu, -relative);
    answer.values["F_on_A1_literal"] = to_json(literal);
    answer.values["F_on_A1_dissipative"] = to_json(dissipative);
    answer.values["F_on_A2_literal"] = to_json(-literal);
    answer.values["F_on_A2_dissipative"] = to_json(-dissipative);
    // Power of the damper's part on both bodies: F_damper·(V1 - V2).
    answer.values["damper_power_dissipative"] = -mu * relative * relative;
    answer.values["damper_power_literal"] = mu * relative * relative;
    return answer;
}

// ---------------------------------------------------------------- 3.7-3.8, 3.10-3.11 projection
LawAnswer projection(const Input& input, bool rigid) {
    const std::string key = rigid ? input.one_of({"tri_rigid", "tri1"}) : input.one_of({"tri_instrument", "tri1"});
    const Corners face = input.corners(key);
    const Vector3 n = normal_of(input, key, face);
    const Vector3 previous = input.vector("PP");
    const Vector3 current = input.vector("PC");
    const Vector3 velocity = input.vector(input.one_of({rigid ? "V" : "V2", rigid ? "V2" : "V"}));
    const double restitution = input.not_negative("e", 0.0);
    const equations::PathHit hit = equations::path_hit(face, previous, current);
    LawAnswer answer;
    answer.values["n"] = to_json(n);
    answer.values["has_contact_point"] = hit.found;
    answer.values["P"] = hit.found ? to_json(hit.point) : Json();
    answer.values["fraction_of_step"] = hit.found ? Json(hit.fraction) : Json();
    if (!hit.found) answer.message = "no contact position: the position is left alone, the velocity rule still acts";
    Vector3 tool = Vector3::Zero();
    Vector3 after;
    double v_r = 0.0;
    if (rigid) {
        v_r = equations::rigid_normal_velocity(velocity, n);
        after = equations::rigid_projected_velocity(velocity, n, restitution);
    } else {
        const int a1 = equations::nearest_corner(face, current);
        answer.values["A1"] = a1;
        tool = input.velocities({"vel_instrument", "vel1"})[at(a1)];
        v_r = equations::relative_normal_velocity(tool, velocity, n);
        after = equations::projected_velocity(tool, velocity, n, restitution);
    }
    answer.values["v_R"] = v_r;
    answer.values["clamped"] = v_r < 0.0;
    answer.values[rigid ? "V_after" : "V2_after"] = to_json(after);
    answer.values["v_R_after"] = equations::relative_normal_velocity(tool, after, n);
    return answer;
}

LawAnswer equilibrium(const Input& input) {
    const Vector3 position = input.vector("A2");
    const std::vector<Vector3> neighbours = input.vectors("neighbours");
    const auto sized = [&](const std::string& key, double otherwise) {
        if (!input.has(key)) return std::vector<double>(neighbours.size(), otherwise);
        std::vector<double> list = input.numbers(key);
        if (list.size() != neighbours.size()) {
            input.fault(key, fmt::format("{} numbers, one per neighbour", neighbours.size()),
                        fmt::format("{}", list.size()));
        }
        return list;
    };
    if (!input.has("k")) input.fault("k", "a value", "nothing");
    if (!input.has("rest_lengths")) input.fault("rest_lengths", "a value", "nothing");
    const std::vector<double> k = sized("k", 0.0);
    const std::vector<double> rest = sized("rest_lengths", 0.0);
    const std::vector<double> preload = sized("preload", 0.0);
    std::vector<equations::NeighbourSpring> springs;
    for (std::size_t i = 0; i < neighbours.size(); ++i) {
        springs.push_back({.neighbour = neighbours[i], .rest = rest[i], .k = k[i], .preload = preload[i]});
    }
    const Vector3 external = input.vector("external_force_on_A2", Vector3::Zero());
    const Vector3 net = equations::equilibrium_force(position, Vector3::Zero(), springs, external);
    LawAnswer answer;
    answer.values = {
        {"net_force_on_A2", to_json(net)}, {"F_on_A1", to_json(net)}, {"constraint_force_on_A2", to_json(-net)}};
    return answer;
}

// ---------------------------------------------------------------- 3.12-3.17 tissue to tissue
LawAnswer tissue_exchange(const Input& input) {
    const double m1 = input.positive("m1");
    const double m2 = input.positive("m2");
    const Vector3 v1 = input.vector("V1");
    const Vector3 v2 = input.vector("V2");
    const equations::Exchange e = equations::tissue_tissue(m1, m2, v1, v2);
    const auto if_defined = [&](const Json& json) { return e.direction_defined ? json : Json(); };
    LawAnswer answer;
    answer.values = {
        {"V_R", to_json(e.relative)},
        {"n_R_defined", e.direction_defined},
        {"n_R", if_defined(to_json(e.direction))},
        {"V1R", if_defined(e.speed1)},
        {"V2R", if_defined(e.speed2)},
        {"V1R_after", if_defined(e.speed1_after)},
        {"V2R_after", if_defined(e.speed2_after)},
        {"V1_after", to_json(e.velocity1_after)},
        {"V2_after", to_json(e.velocity2_after)},
        {"momentum", to_json(m1 * e.velocity1_after + m2 * e.velocity2_after)},
        {"kinetic_energy", 0.5 * m1 * e.velocity1_after.squaredNorm() + 0.5 * m2 * e.velocity2_after.squaredNorm()},
        {"V_R_after", to_json(e.velocity2_after - e.velocity1_after)}};
    if (!e.direction_defined) answer.message = "V_R = 0: nothing changes";
    return answer;
}

// ---------------------------------------------------------------- what moves: the tissue integrator itself
/// A tissue without triangles for the integrator's cases.
struct System {
    Topology topology;
    Materials materials;
    Frame frame;
    Effect effect;
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
        effect.resize(n, 1);
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
        system.effect.contacts.clear();
        contact(system.effect.contacts);
        const Vector3 before = system.frame.position.col(0);
        if (!tissue.advance(system.effect, dt, system.frame, system.reaction).ok()) return false;
        const double moved = (system.frame.position.col(0) - before).norm();
        quiet = moved <= 1e-14 * std::max(before.norm(), 1e-3) ? quiet + 1 : 0;
    }
    return quiet >= 100;
}

LinearContact plane_contact(const Vector3& normal, double gap, double k, double mu) {
    LinearContact contact;
    contact.vertices = {0, -1, -1};
    contact.weights = {1.0, 0.0, 0.0};
    contact.normal = normal;
    contact.gap = gap;
    contact.k = k;
    contact.mu = mu;
    return contact;
}

// ---------------------------------------------------------------- static
LawAnswer mass_on_plane(const Input& input) {
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
    const double stiffer = hung ? std::max(k_spring, k_contact) : k_contact;
    const double drag = 2.0 * std::sqrt((hung ? k_spring : k_contact) * m);
    const double dt = std::min(0.1 * std::sqrt(m / stiffer), 0.2 * m / drag);
    System system(points, m, pinned, springs, drag);
    system.effect.held_force(2, 0) = -m * g;
    const double mu = input.not_negative("mu", 0.0);
    LawAnswer answer;
    if (!settle(system, dt, [&](std::vector<LinearContact>& contacts) {
            const double gap = system.frame.position(2, 0) - plane;
            if (gap < 0.0) contacts.push_back(plane_contact(Vector3::UnitZ(), gap, k_contact, mu));
        })) {
        answer.sound = false;
        answer.message = "the mass did not come to rest";
    }
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

LawAnswer springs_in_series(const Input& input) {
    const double k_tissue = input.positive("k_tissue");
    const double k_contact = input.positive("k_contact");
    const double total = input.not_negative("indentation_total");
    const double m = input.has("m") ? input.positive("m") : 1e-3;
    // The mass hangs on a tissue spring whose free end is at the origin; the tool's plane came down by `total`.
    const double length = 100.0 * std::max(total, 1e-6);
    const double drag = 2.0 * std::sqrt(k_tissue * m);
    const double dt = std::min(0.1 * std::sqrt(m / k_tissue), 0.2 * m / drag);
    System system({Vector3::Zero(), Vector3(0.0, 0.0, -length)}, m, {0, 1},
                  {Spring{.i = 0, .j = 1, .rest = length, .k = k_tissue}}, drag);
    LawAnswer answer;
    if (!settle(system, dt, [&](std::vector<LinearContact>& contacts) {
            const double gap = -total - system.frame.position(2, 0);
            if (gap <= 0.0) contacts.push_back(plane_contact(-Vector3::UnitZ(), gap, k_contact, 0.0));
        })) {
        answer.sound = false;
        answer.message = "the mass did not come to rest";
    }
    const double depth = std::max(total + system.frame.position(2, 0), 0.0);
    answer.values = {{"force", k_contact * depth}, {"contact_depth", depth}};
    return answer;
}

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

LawAnswer oscillation(const Input& input, const Json& expected) {
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
    constexpr std::int64_t most_steps = 20'000'000;
    if (expected.is_object() && expected.contains("semi_implicit_euler") &&
        expected["semi_implicit_euler"].is_array()) {
        for (const Json& entry : expected["semi_implicit_euler"]) {
            if (!entry.is_object() || !entry.contains("h") || !entry.contains("steps")) continue;
            if (!entry["h"].is_number() || !entry["steps"].is_number_integer()) continue;
            const auto steps = entry["steps"].get<std::int64_t>();
            if (steps >= 1 && steps <= most_steps) runs.emplace_back(entry["h"].get<double>(), steps);
        }
    }
    if (runs.empty() && input.has("h")) {
        const double h = input.positive("h");
        const auto steps =
            input.has("steps") ? input.count("steps", most_steps) : static_cast<std::int64_t>(std::llround(end / h));
        if (steps > most_steps) input.fault("h", "at most 20000000 steps", fmt::format("{}", steps));
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
            const Outcome outcome = tissue.advance(system.effect, h, system.frame, system.reaction);
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

LawAnswer oscillation_energy(const Input& input) {
    const double m = input.positive("m");
    const double k = input.positive("k");
    const double c = input.not_negative("c", 0.0);
    const double h = input.positive("h");
    const double x0 = input.number("x0");
    const double v0 = input.number("v0", 0.0);
    const std::int64_t steps = input.count("steps", 20'000'000);
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
        const Outcome outcome = tissue.advance(system.effect, h, system.frame, system.reaction);
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
LawAnswer preloaded_pair(const Input& input) {
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
            if (!tissue.advance(run.effect, factor * critical, run.frame, run.reaction).ok()) {
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

LawAnswer chain_limits(const Input& input) {
    const auto n = static_cast<Index>(input.count("N", 20000));
    const double k = input.positive("k");
    const double m = input.positive("m");
    const std::string ends = input.has("ends")
                                 ? input.word("ends", {"fixed-fixed", "fixed-free", "free-fixed", "free-free"})
                                 : "fixed-fixed";
    const double damping =
        input.has("damping_per_mass") ? input.not_negative("damping_per_mass") : input.not_negative("damping", 0.0);
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

LawAnswer sheet_limits(const Input& input) {
    const auto n = static_cast<Index>(input.count("n", 150));
    const double spacing = input.positive("spacing");
    const double k = input.positive("k");
    const double m = input.positive("m");
    const bool fixed = input.has("boundary") && input.word("boundary", {"free", "boundary fixed", "fixed"}) != "free";
    const double ratio = input.not_negative("rest_length_over_length", 1.0);
    const double damping =
        input.has("damping_per_mass") ? input.not_negative("damping_per_mass") : input.not_negative("damping", 0.0);
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

LawAnswer contact_limits(const Input& input) {
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

// ---------------------------------------------------------------- wrench, distribute
LawAnswer wrench(const Input& input) {
    const Vector3 tip = input.vector("tip");
    const std::vector<Vector3> points = input.vectors("points");
    const std::vector<Vector3> forces = input.vectors("forces");
    if (points.size() != forces.size()) {
        input.fault("forces", fmt::format("{} forces, one per point", points.size()), fmt::format("{}", forces.size()));
    }
    const Wrench about_tip = equations::resultant(points, forces, tip);
    LawAnswer answer;
    answer.values = {{"F", to_json(about_tip.force)},
                     {"M_about_tip", to_json(about_tip.moment)},
                     {"M_about_origin", to_json(equations::resultant(points, forces, Vector3::Zero()).moment)}};
    if (input.has("trocar")) {
        const Vector3 pivot = input.vector("trocar");
        answer.values["F_tip_fulcrum"] =
            to_json(fulcrum_tip_force(equations::resultant(points, forces, pivot), pivot, tip));
    }
    return answer;
}

LawAnswer distribution(const Input& input) {
    const Corners tri = input.corners(input.one_of({"tri", "tri1"}));
    const Vector3 weights = equations::nearest_weights(tri, input.vector("point"));
    LawAnswer answer;
    answer.values["weights"] = to_json(weights);
    if (input.has("F")) {
        const auto forces = equations::distribute_force(weights, input.vector("F"));
        const Wrench total = equations::resultant(tri, forces, Vector3::Zero());
        answer.values["corner_forces"] = to_json_list(forces);
        answer.values["sum"] = to_json(total.force);
        answer.values["moment_about_origin"] = to_json(total.moment);
    }
    if (input.has("correction")) {
        const Vector3 masses = input.vector("masses", Vector3::Ones());
        const auto moves = equations::distribute_correction(weights, masses, input.vector("correction"));
        answer.values["corner_corrections"] = to_json_list(moves);
        answer.values["point_correction"] =
            to_json(weights[0] * moves[0] + weights[1] * moves[1] + weights[2] * moves[2]);
    }
    return answer;
}

constexpr std::array families{"3.4",    "3.5", "3.6",     "3.8",  "3.9",    "3.11",      "3.17",
                              "static", "osc", "preload", "stab", "wrench", "distribute"};

}  // namespace

bool known_family(const std::string& family) {
    return std::find(families.begin(), families.end(), family) != families.end();
}

LawAnswer answer_case(const std::string& family, const Json& json, const Json& expected, const std::string& file,
                      const std::string& pointer) {
    const Input input(json, file, pointer);
    if (family == "3.4") return vertex_in_instrument(input);
    if (family == "3.5" || family == "3.9") return edges_cross(input);
    if (family == "3.6") return instrument_in_tissue(input);
    if (family == "3.8") return input.has("neighbours") ? equilibrium(input) : projection(input, false);
    if (family == "3.11") return projection(input, true);
    if (family == "3.17") return tissue_exchange(input);
    if (family == "static") return input.has("k_tissue") ? springs_in_series(input) : mass_on_plane(input);
    if (family == "osc") return input.has("times") ? oscillation(input, expected) : oscillation_energy(input);
    if (family == "preload") return preloaded_pair(input);
    if (family == "stab") {
        if (input.has("N")) return chain_limits(input);
        return input.has("n") ? sheet_limits(input) : contact_limits(input);
    }
    if (family == "wrench") return wrench(input);
    return distribution(input);
}

}  // namespace trocar::app
