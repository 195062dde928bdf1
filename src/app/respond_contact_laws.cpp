// The equations of the thesis on one case each, and how forces are gathered and shared out.
#include <array>

#include "app/respond_input.hpp"
#include "geometry/crossing.hpp"

namespace trocar::app {

namespace {

template <typename List>
Json to_json_list(const List& list) {
    Json json = Json::array();
    for (const Vector3& v : list) json.push_back(to_json(v));
    return json;
}

/// Outer normal, or a fault: no law of a face can be asked of a triangle without area.
Vector3 normal_of(const CaseInput& input, const std::string& key, const Corners& triangle) {
    Vector3 n = equations::unit_normal(triangle);
    if (n.isZero(0.0)) input.fault(key, "a triangle with an area", "three corners on a line");
    return n;
}

/// The mean of the stiffnesses under `key`, which is reported as k_average, else k; unset without either.
double stiffness_of(const CaseInput& input, const std::string& key, LawAnswer& answer) {
    if (!input.has(key)) return input.not_negative("k", unset);
    const std::vector<double> springs = input.numbers(key);
    if (springs.empty()) input.fault(key, "at least one stiffness", "none");
    const double k = equations::mean_stiffness(springs);
    answer.values["k_average"] = k;
    return k;
}

}  // namespace

// ---------------------------------------------------------------- 3.4 instrument to instrument, vertex in face
LawAnswer vertex_in_instrument(const CaseInput& input) {
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
LawAnswer edges_cross(const CaseInput& input) {
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
    const double k = stiffness_of(input, "k_edges_tissue_triangle", answer);
    if (std::isnan(k)) return answer;
    const Vector3 force = equations::edge_crossing(k, crossing.length, crossing.direction);
    answer.values["F_magnitude"] = force.norm();
    answer.values["F_on_A2"] = to_json(force);
    answer.values["F_on_A1"] = to_json(-force);
    return answer;
}

// ---------------------------------------------------------------- 3.6 instrument corner in tissue face
LawAnswer instrument_in_tissue(const CaseInput& input) {
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
    const double k = stiffness_of(input, "k_springs_at_A2", answer);
    if (std::isnan(k)) return answer;
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
LawAnswer projection(const CaseInput& input, bool rigid) {
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

LawAnswer equilibrium(const CaseInput& input) {
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
LawAnswer tissue_exchange(const CaseInput& input) {
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

// ---------------------------------------------------------------- wrench, distribute
LawAnswer wrench(const CaseInput& input) {
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

LawAnswer distribution(const CaseInput& input) {
    const Corners tri = input.corners(input.one_of({"tri", "tri1"}));
    const Vector3 weights = closest_point_on_triangle(tri, input.vector("point"));
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

}  // namespace trocar::app
