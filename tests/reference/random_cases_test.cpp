// `trocar respond` on cases that are in no file: every family of the data with random numbers, against closed forms
// that are written down here and share nothing with the program. One seed is one file of cases.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "geometry/types.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;

Json list(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
Json list(const std::vector<Vector3>& vectors) {
    Json result = Json::array();
    for (const Vector3& v : vectors) result.push_back(list(v));
    return result;
}

/// Random numbers and a random rigid transformation, so that no axis is special.
class Draw {
public:
    explicit Draw(unsigned seed) : engine_(seed) {
        Eigen::Quaterniond q{normal(), normal(), normal(), normal()};
        rotation_ = q.normalized().toRotationMatrix();
        shift_ = 0.3 * vector();
    }
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    /// Evenly in the logarithm.
    double magnitude(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
    Vector3 vector() { return {between(-1, 1), between(-1, 1), between(-1, 1)}; }
    [[nodiscard]] Vector3 turned(const Vector3& v) const { return rotation_ * v; }
    [[nodiscard]] Vector3 placed(const Vector3& v) const { return rotation_ * v + shift_; }
    [[nodiscard]] Json placed(const std::vector<Vector3>& vectors) const {
        std::vector<Vector3> result;
        result.reserve(vectors.size());
        for (const Vector3& v : vectors) result.push_back(placed(v));
        return list(result);
    }

private:
    double normal() { return std::normal_distribution<double>()(engine_); }
    std::mt19937_64 engine_;
    Eigen::Matrix3d rotation_;
    Vector3 shift_;
};

Json make_case(const std::string& id, Json input, Json expected, double relative, double absolute) {
    return {{"id", id},
            {"input", std::move(input)},
            {"expected", std::move(expected)},
            {"tolerance", {{"rel", relative}, {"abs", absolute}}}};
}

/// A right-angled face in the plane z = 0 with its outside above, and a triangle of which only `point` is below it, by
/// `depth`, next to the face's corner 0.
struct Pierced {
    std::vector<Vector3> face, other;
    Vector3 normal;
    double depth = 0.0;
};
Pierced pierced(Draw& draw) {
    Pierced result;
    const double size = draw.magnitude(0.003, 0.05);
    result.depth = size * draw.between(0.01, 0.2);
    result.face = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}};
    const Vector3 point(size * draw.between(0.05, 0.2), size * draw.between(0.05, 0.2), -result.depth);
    result.other = {point, point + Vector3(0.1 * size, 0.2 * size, 3.0 * size), point + Vector3(-0.2 * size, 0, size)};
    result.normal = draw.turned(Vector3::UnitZ());
    return result;
}

Json vertex_in_face(Draw& draw) {  // 3.4: F = (k d - mu (V2 - V1)·n) n on A2
    const Pierced p = pierced(draw);
    const std::vector<Vector3> v1{draw.vector(), draw.vector(), draw.vector()};
    const std::vector<Vector3> v2{draw.vector(), draw.vector(), draw.vector()};
    const double k = draw.magnitude(10, 1e5);
    const double mu = draw.between(0, 5);
    const double speed = (v2[0] - v1[0]).dot(p.normal);
    const double force = k * p.depth - mu * speed;
    return make_case("3.4-random",
                     {{"tri1", draw.placed(p.face)},
                      {"tri2", draw.placed(p.other)},
                      {"vel1", list(v1)},
                      {"vel2", list(v2)},
                      {"k", k},
                      {"mu", mu}},
                     {{"A2", 0},
                      {"A1", 0},
                      {"n", list(p.normal)},
                      {"depth", p.depth},
                      {"v_rel_n", speed},
                      {"F_scalar", force},
                      {"F_on_A2", list(Vector3(force * p.normal))},
                      {"F_on_A1", list(Vector3(-force * p.normal))}},
                     1e-9, 1e-9);
}

Json instrument_corner_in_tissue(Draw& draw) {  // 3.6, with the sign of 3.4 and as printed
    const Pierced p = pierced(draw);
    const std::vector<Vector3> v1{draw.vector(), draw.vector(), draw.vector()};
    const std::vector<Vector3> v2{draw.vector(), draw.vector(), draw.vector()};
    std::vector<double> springs;
    double mean = 0.0;
    const int count = 3 + static_cast<int>(draw.between(0, 4));
    springs.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) springs.push_back(draw.magnitude(50, 500));
    for (const double k : springs) mean += k / count;
    const double mu = draw.between(0, 3);
    const double printed_speed = (v2[0] - v1[0]).dot(p.normal);
    const double dissipative = mean * p.depth + mu * printed_speed;
    const double literal = mean * p.depth - mu * printed_speed;
    return make_case("3.6-random",
                     {{"tri_instrument", draw.placed(p.other)},
                      {"tri_tissue", draw.placed(p.face)},
                      {"vel_instrument", list(v1)},
                      {"vel_tissue", list(v2)},
                      {"k_springs_at_A2", springs},
                      {"mu", mu}},
                     {{"A1", 0},
                      {"A2", 0},
                      {"depth", p.depth},
                      {"n", list(p.normal)},
                      {"k_average", mean},
                      {"v_rel_n_2_minus_1", printed_speed},
                      {"F_scalar_literal", literal},
                      {"F_scalar_dissipative", dissipative},
                      {"F_on_A1_dissipative", list(Vector3(dissipative * p.normal))},
                      {"F_on_A2_dissipative", list(Vector3(-dissipative * p.normal))},
                      {"damper_power_dissipative", -mu * printed_speed * printed_speed},
                      {"damper_power_literal", mu * printed_speed * printed_speed}},
                     1e-9, 1e-9);
}

/// 3.5 and 3.9: two triangles in crossing planes whose intervals on the common line are [l1, r1] and [l2, r2] with
/// l1 < l2 < r1 < r2: they overlap by r1 - l2 and part when the second one moves to the right.
Json crossing_edges(Draw& draw, bool tissue) {
    const double size = draw.magnitude(0.004, 2.0);
    const double l1 = size * draw.between(-2.0, -1.0);
    const double r1 = size * draw.between(0.5, 1.0);
    const double l2 = r1 - size * draw.between(0.05, 0.4);
    const double r2 = size * draw.between(1.5, 3.0);
    const double apex1 = size * draw.between(-1, 1);
    const double apex2 = size * draw.between(-1, 1);
    const double height = size * draw.between(0.5, 2.0);
    // An edge from (apex, -h) to (2 s - apex, h) meets the line at s.
    const std::vector<Vector3> one{{apex1, -height, 0}, {2 * r1 - apex1, height, 0}, {2 * l1 - apex1, height, 0}};
    const std::vector<Vector3> two{{apex2, 0, -height}, {2 * l2 - apex2, 0, height}, {2 * r2 - apex2, 0, height}};
    const double overlap = r1 - l2;
    const Vector3 t = draw.turned(Vector3::UnitX());
    Json input{{"tri1", draw.placed(one)}, {"tri2", draw.placed(two)}};
    double k = draw.magnitude(10, 1e5);
    if (tissue) {
        const std::vector<double> edges{draw.magnitude(50, 500), draw.magnitude(50, 500), draw.magnitude(50, 500)};
        input["k_edges_tissue_triangle"] = edges;
        k = (edges[0] + edges[1] + edges[2]) / 3.0;
    } else {
        input["k"] = k;
    }
    Json expected{{"overlap_length", overlap},
                  {"t", list(t)},
                  {"F_magnitude", k * overlap},
                  {"F_on_A2", list(Vector3(k * overlap * t))},
                  {"F_on_A1", list(Vector3(-k * overlap * t))}};
    if (tissue) expected["k_average"] = k;
    return make_case(tissue ? "3.9-random" : "3.5-random", input, expected, 1e-9, 1e-9);
}

/// 3.7 and 3.8 on an instrument's face, 3.10 and 3.11 on a rigid one.
Json tissue_corner_in_face(Draw& draw, bool rigid) {
    const double size = draw.magnitude(0.005, 0.5);
    const std::vector<Vector3> face{{0, 0, 0}, {size, 0, 0}, {0, size, 0}};
    const Vector3 hit(size * draw.between(0.1, 0.25), size * draw.between(0.1, 0.25), 0.0);
    const double before = size * draw.between(0.01, 0.1);
    const double after = size * draw.between(0.01, 0.1);
    const Vector3 drift(size * draw.between(-0.05, 0.05), size * draw.between(-0.05, 0.05), 0.0);
    const double fraction = before / (before + after);
    const Vector3 from = hit - fraction * drift + before * Vector3::UnitZ();
    const Vector3 to = hit + (1.0 - fraction) * drift - after * Vector3::UnitZ();
    const Vector3 n = draw.turned(Vector3::UnitZ());
    const Vector3 v = 2.0 * draw.vector();
    const std::vector<Vector3> face_velocity{draw.vector(), draw.vector(), draw.vector()};
    const double closing = (v - (rigid ? Vector3(Vector3::Zero()) : face_velocity[0])).dot(n);
    const Vector3 kept = closing < 0.0 ? Vector3(v - closing * n) : v;
    Json input{{rigid ? "tri_rigid" : "tri_instrument", draw.placed(face)},
               {"PP", list(draw.placed(from))},
               {"PC", list(draw.placed(to))},
               {rigid ? "V" : "V2", list(v)}};
    if (!rigid) input["vel_instrument"] = list(face_velocity);
    return make_case(rigid ? "3.11-random" : "3.8-random", input,
                     {{"n", list(n)},
                      {"has_contact_point", true},
                      {"P", list(draw.placed(hit))},
                      {"fraction_of_step", fraction},
                      {"v_R", closing},
                      {"clamped", closing < 0.0},
                      {rigid ? "V_after" : "V2_after", list(kept)},
                      {"v_R_after", std::max(closing, 0.0)}},
                     1e-9, 1e-9);
}

Json held_corner(Draw& draw) {  // what springs and load leave for the instrument to hold
    const Vector3 place = draw.vector();
    std::vector<Vector3> neighbours;
    std::vector<double> rest, k;
    Vector3 net = 0.1 * draw.vector();
    const Json load = list(net);
    for (int i = 0; i < 5; ++i) {
        const Vector3 d = 0.01 * (draw.vector() + Vector3(1.5, 0, 0));
        neighbours.push_back(place + d);
        k.push_back(draw.magnitude(50, 500));
        rest.push_back(d.norm() * draw.between(0.8, 1.2));
        net += k.back() * (d.norm() - rest.back()) * d.normalized();
    }
    return make_case(
        "3.8-reaction",
        {{"A2", list(place)},
         {"neighbours", list(neighbours)},
         {"rest_lengths", rest},
         {"k", k},
         {"external_force_on_A2", load}},
        {{"net_force_on_A2", list(net)}, {"F_on_A1", list(net)}, {"constraint_force_on_A2", list(Vector3(-net))}}, 1e-9,
        1e-12);
}

Json elastic_exchange(Draw& draw) {  // 3.12-3.17: along V_R the whole relative velocity turns round
    const double m1 = draw.magnitude(1e-6, 1.0);
    const double m2 = draw.magnitude(1e-6, 1.0);
    const Vector3 v1 = 3.0 * draw.vector();
    const Vector3 v2 = 3.0 * draw.vector();
    const Vector3 relative = v2 - v1;
    const Vector3 v1_after = v1 + 2.0 * m2 / (m1 + m2) * relative;
    const Vector3 v2_after = v2 - 2.0 * m1 / (m1 + m2) * relative;
    return make_case("3.17-random", {{"m1", m1}, {"m2", m2}, {"V1", list(v1)}, {"V2", list(v2)}},
                     {{"V_R", list(relative)},
                      {"n_R", list(Vector3(relative.normalized()))},
                      {"V1R_after", v1_after.dot(relative.normalized())},
                      {"V2R_after", v2_after.dot(relative.normalized())},
                      {"V1_after", list(v1_after)},
                      {"V2_after", list(v2_after)},
                      {"momentum", list(Vector3(m1 * v1 + m2 * v2))},
                      {"kinetic_energy", 0.5 * m1 * v1.squaredNorm() + 0.5 * m2 * v2.squaredNorm()},
                      {"V_R_after", list(Vector3(-relative))}},
                     1e-10, 1e-12);
}

Json forces_to_wrench(Draw& draw) {
    const Vector3 tip = draw.vector();
    const Vector3 trocar = tip + 0.2 * (draw.vector() + Vector3(0, 0, 2));
    std::vector<Vector3> points, forces;
    Vector3 sum = Vector3::Zero(), about_tip = Vector3::Zero(), about_origin = Vector3::Zero(),
            torque = Vector3::Zero();
    const int count = 1 + static_cast<int>(draw.between(0, 40));
    for (int i = 0; i < count; ++i) {
        points.push_back(tip + 0.1 * draw.vector());
        forces.push_back(4.0 * draw.vector());
        sum += forces.back();
        about_tip += (points.back() - tip).cross(forces.back());
        about_origin += points.back().cross(forces.back());
        torque += (points.back() - trocar).cross(forces.back());
    }
    // METHODS §8: (tau x r) / |r|² + (u·sum F) u.
    const Vector3 r = tip - trocar;
    const Vector3 fulcrum = torque.cross(r) / r.squaredNorm() + sum.dot(r) / r.squaredNorm() * r;
    return make_case("wrench-random",
                     {{"tip", list(tip)}, {"points", list(points)}, {"forces", list(forces)}, {"trocar", list(trocar)}},
                     {{"F", list(sum)},
                      {"M_about_tip", list(about_tip)},
                      {"M_about_origin", list(about_origin)},
                      {"F_tip_fulcrum", list(fulcrum)}},
                     1e-10, 1e-12);
}

Json shared_out(Draw& draw) {  // f_i = a_i F, dx_i = (a_i / m_i) / sum(a_j² / m_j) dP
    const std::vector<Vector3> corner{draw.vector(), draw.vector(), draw.vector()};
    const double u = draw.between(0.1, 0.5);
    const double v = draw.between(0.1, 0.4);
    const std::array<double, 3> a{1.0 - u - v, u, v};
    const std::array<double, 3> m{draw.magnitude(1e-4, 1), draw.magnitude(1e-4, 1), draw.magnitude(1e-4, 1)};
    Vector3 point = Vector3::Zero();
    double mobility = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        point += a[i] * corner[i];
        mobility += a[i] * a[i] / m[i];
    }
    const Vector3 force = draw.vector();
    const Vector3 correction = draw.vector();
    std::vector<Vector3> forces, moves;
    for (std::size_t i = 0; i < 3; ++i) {
        forces.emplace_back(a[i] * force);
        moves.emplace_back(a[i] / m[i] / mobility * correction);
    }
    return make_case("distribute-random",
                     {{"tri", list(corner)},
                      {"point", list(point)},
                      {"F", list(force)},
                      {"correction", list(correction)},
                      {"masses", m}},
                     {{"weights", a},
                      {"corner_forces", list(forces)},
                      {"corner_corrections", list(moves)},
                      {"point_correction", list(correction)},
                      {"sum", list(force)},
                      {"moment_about_origin", list(Vector3(point.cross(force)))}},
                     1e-9, 1e-11);
}

Json rests_on_plane(Draw& draw) {
    const double m = draw.magnitude(0.01, 1.0);
    const double k = draw.magnitude(50, 5000);
    const double plane = draw.between(-1, 1);
    const double depth = m * 9.81 / k;
    return make_case("static-random", {{"m", m}, {"g", 9.81}, {"k_contact", k}, {"plane_z", plane}},
                     {{"depth", depth}, {"contact_force", m * 9.81}, {"z", plane - depth}}, 1e-6, 1e-8);
}

Json hangs_over_plane(Draw& draw) {
    const double m = draw.magnitude(0.01, 0.5);
    const double contact = draw.magnitude(100, 3000);
    const double spring = draw.magnitude(5, 300);
    const double rest = draw.between(0.02, 0.2);
    const double plane = draw.between(-0.3, 0.3);
    // Whether it reaches the plane is decided by where it would hang freely.
    const double anchor = plane + rest + m * 9.81 / spring * draw.between(0.3, 1.7);
    const double free_z = anchor - rest - m * 9.81 / spring;
    const bool touches = free_z < plane;
    const double depth = touches ? (m * 9.81 - spring * (anchor - rest - plane)) / (contact + spring) : 0.0;
    Json expected{{"z", touches ? plane - depth : free_z}, {"in_contact", touches}};
    if (touches) expected["contact_force"] = contact * depth;
    return make_case("static-random",
                     {{"m", m},
                      {"g", 9.81},
                      {"k_contact", contact},
                      {"k_spring", spring},
                      {"rest_length", rest},
                      {"anchor_z", anchor},
                      {"plane_z", plane}},
                     expected, 1e-6, 1e-7);
}

Json springs_in_series(Draw& draw) {
    const double tissue = draw.magnitude(5, 500);
    const double contact = draw.magnitude(20, 1e6);
    const double travel = draw.magnitude(1e-4, 1e-2);
    return make_case("static-random", {{"k_tissue", tissue}, {"k_contact", contact}, {"indentation_total", travel}},
                     {{"force", travel * tissue * contact / (tissue + contact)},
                      {"contact_depth", travel * tissue / (tissue + contact)}},
                     1e-6, 1e-12);
}

/// m x'' + c x' + k x = 0 by its two roots, which are complex, equal or real.
Json oscillator(Draw& draw, double damping_ratio) {
    const double m = draw.magnitude(0.01, 2.0);
    const double k = draw.magnitude(5, 500);
    const double w = std::sqrt(k / m);
    const double c = damping_ratio == 1.0 ? 2.0 * m * w : 2.0 * damping_ratio * m * w;
    const double x0 = draw.between(-0.1, 0.1);
    const double v0 = draw.between(-1, 1);
    const double a = c / (2.0 * m);
    Json motion = Json::array();
    std::vector<double> times;
    for (const double part : {0.3, 1.1, 2.4}) {
        const double t = part / w;
        times.push_back(t);
        double x = 0.0, v = 0.0;
        if (damping_ratio < 1.0) {
            const double d = std::sqrt(k / m - a * a);
            const double b = (v0 + a * x0) / d;
            x = std::exp(-a * t) * (x0 * std::cos(d * t) + b * std::sin(d * t));
            v = -a * x + std::exp(-a * t) * d * (b * std::cos(d * t) - x0 * std::sin(d * t));
        } else if (damping_ratio == 1.0) {
            x = std::exp(-a * t) * (x0 + (v0 + a * x0) * t);
            v = std::exp(-a * t) * (v0 + a * x0) - a * x;
        } else {
            const double d = std::sqrt(a * a - k / m);
            const double one = (v0 + (a + d) * x0) / (2.0 * d);
            const double two = x0 - one;
            x = one * std::exp((d - a) * t) + two * std::exp(-(d + a) * t);
            v = (d - a) * one * std::exp((d - a) * t) - (d + a) * two * std::exp(-(d + a) * t);
        }
        motion.push_back({{"t", t}, {"x", x}, {"v", v}});
    }
    return make_case("osc-random", {{"m", m}, {"k", k}, {"c", c}, {"x0", x0}, {"v0", v0}, {"times", times}},
                     {{"closed_form", motion}, {"order_band", {0.9, 1.1}}}, 1e-7, 1e-9);
}

Json sideways(Draw& draw) {
    const double k = draw.magnitude(20, 500);
    const double length = draw.between(0.01, 0.2);
    const double rest = length * draw.between(0.5, 0.95);
    const double y = length * draw.between(-0.5, 0.5);
    const double m = draw.magnitude(1e-4, 0.1);
    const double stretched = std::hypot(length, y);
    const double stiffness = 2.0 * k * (length - rest) / length;
    return make_case("preload-random", {{"k", k}, {"L", length}, {"rest_length", rest}, {"m", m}, {"y", y}},
                     {{"pretension", k * (length - rest)},
                      {"restoring_force", -2.0 * k * (stretched - rest) * y / stretched},
                      {"small_amplitude_stiffness", stiffness},
                      {"small_amplitude_omega", std::sqrt(stiffness / m)}},
                     1e-10, 1e-13);
}

Json chain(Draw& draw) {
    const int n = 2 + static_cast<int>(draw.between(0, 60));
    const double k = draw.magnitude(10, 1000);
    const double m = draw.magnitude(1e-4, 1e-1);
    const bool both_fixed = draw.between(0, 1) < 0.5;
    const double damping = draw.between(0, 1);
    const double angle =
        both_fixed ? n * std::numbers::pi / (2.0 * (n + 1)) : (2 * n - 1) * std::numbers::pi / (2.0 * (2 * n + 1));
    const double omega = 2.0 * std::sqrt(k / m) * std::sin(angle);
    const double rate = damping / m;
    return make_case(
        "stab-random",
        {{"N", n},
         {"k", k},
         {"m", m},
         {"ends", both_fixed ? "fixed-fixed" : "fixed-free"},
         {"damping_per_mass", damping}},
        {{"omega_max", omega}, {"dt_crit", (-rate + std::sqrt(rate * rate + 4.0 * omega * omega)) / (omega * omega)}},
        1e-8, 0.0);
}

Json one_mass_on_contact(Draw& draw) {
    const double tissue = draw.magnitude(10, 1000);
    const double contact = draw.magnitude(10, 1e6);
    const double m = draw.magnitude(1e-4, 1.0);
    const double omega = std::sqrt((tissue + contact) / m);
    return make_case("stab-random", {{"k_tissue_sum", tissue}, {"k_contact", contact}, {"m", m}},
                     {{"omega", omega}, {"dt_crit", 2.0 / omega}, {"stable_at_1kHz", 2.0 / omega > 1e-3}}, 1e-10, 0.0);
}

class RandomCases : public testing::TestWithParam<unsigned> {};

TEST_P(RandomCases, EveryFamilyMeetsItsClosedForm) {
    Draw draw(GetParam());
    Json cases = Json::array();
    for (int i = 0; i < 8; ++i) {
        cases.push_back(vertex_in_face(draw));
        cases.push_back(instrument_corner_in_tissue(draw));
        cases.push_back(crossing_edges(draw, false));
        cases.push_back(crossing_edges(draw, true));
        cases.push_back(tissue_corner_in_face(draw, false));
        cases.push_back(tissue_corner_in_face(draw, true));
        cases.push_back(held_corner(draw));
        cases.push_back(elastic_exchange(draw));
        cases.push_back(forces_to_wrench(draw));
        cases.push_back(shared_out(draw));
        cases.push_back(springs_in_series(draw));
        cases.push_back(sideways(draw));
        cases.push_back(chain(draw));
        cases.push_back(one_mass_on_contact(draw));
    }
    cases.push_back(rests_on_plane(draw));
    cases.push_back(hangs_over_plane(draw));
    cases.push_back(hangs_over_plane(draw));
    cases.push_back(oscillator(draw, draw.between(0.0, 0.7)));
    cases.push_back(oscillator(draw, 1.0));
    cases.push_back(oscillator(draw, draw.between(1.3, 3.0)));
    const test::TemporaryFolder folder;
    const auto file = folder.path() / "cases.json";
    std::ofstream(file) << Json{{"format", "response-cases-1"}, {"cases", cases}}.dump();
    const test::ProgramResult result = test::run_program("respond --json " + file.string());
    EXPECT_EQ(result.status, 0) << result.err;
    const Json answer = Json::parse(result.out);
    ASSERT_EQ(answer["cases"].size(), cases.size());
    EXPECT_EQ(answer["passed"], cases.size());
    for (std::size_t i = 0; i < cases.size(); ++i) {
        EXPECT_EQ(answer["cases"][i]["result"], "pass") << answer["cases"][i].dump() << "\n" << cases[i].dump();
    }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomCases, testing::Range(1U, 13U));

}  // namespace
}  // namespace trocar
