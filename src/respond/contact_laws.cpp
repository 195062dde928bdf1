#include "respond/contact_laws.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Weighted mean over a load's vertices. Negative weights, of a load beside its face, count as 0.
double mean_over(const std::array<Index, 3>& vertices, const std::array<double, 3>& weights,
                 const std::vector<double>& of) {
    double sum = 0.0;
    double all = 0.0;
    bool beyond = false;
    for (std::size_t i = 0; i < 3; ++i) {
        if (vertices[i] < 0) continue;
        beyond = beyond || weights[i] < 0.0;
        const double weight = std::max(weights[i], 0.0);
        sum += weight * of[at(vertices[i])];
        all += weight;
    }
    return beyond ? sum / all : sum;
}

}  // namespace

void ContactLaws::prepare(const Topology& topology, const Materials& materials, const LawSettings& settings) {
    settings_ = settings;
    topology_ = &topology;
    materials_ = &materials;
    bodies_ = topology.body_count();
    table_.assign(at(bodies_ * bodies_), {});
    for (Index a = 0; a < bodies_; ++a) {
        for (Index b = 0; b < bodies_; ++b) {
            Law& law = table_[at(a * bodies_ + b)];
            law.kind = collision_class(topology.bodies[at(a)].kind, topology.bodies[at(b)].kind);
            const Index pair = topology.body_pair(a, b);
            if (pair >= 0 && at(pair) < materials.contact_laws.size()) {
                law.k = materials.contact_laws[at(pair)].k;
                law.mu = materials.contact_laws[at(pair)].mu;
            }
            const bool rigid =
                topology.bodies[at(a)].kind != BodyKind::tissue && topology.bodies[at(b)].kind != BodyKind::tissue;
            if (settings.tissue_alone && rigid) continue;
            if (!std::isnan(settings.k)) {
                law.k = settings.k;
                law.mu = std::numeric_limits<double>::quiet_NaN();
            }
            if (!std::isnan(settings.mu)) law.mu = settings.mu;
        }
    }
    scale_ = tissue_scales(topology, materials);
    clear_speed_.assign(topology.bodies.size(), infinite);
    pressure_.assign(topology.bodies.size(), infinite);
    for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
        if (topology.bodies[b].kind != BodyKind::tissue) continue;
        constexpr double of_waves = 1.0 / 12.0;
        clear_speed_[b] = std::isnan(settings.clear_speed) ? of_waves * scale_[b].wave_speed : settings.clear_speed;
        pressure_[b] =
            std::isnan(settings.pressure) ? own_pressure(topology.bodies[b].vertices, scale_[b]) : settings.pressure;
    }
}

double ContactLaws::mu(Index body_a, Index body_b, double stiffness) const {
    const double given = law(body_a, body_b).mu;
    return std::isnan(given) ? stiffness * settings_.relaxation_time : given;
}

double ContactLaws::own_mu(double stiffness) const {
    return std::isnan(settings_.mu) ? stiffness * settings_.relaxation_time : settings_.mu;
}

double ContactLaws::mean_of_springs(const ContactPoint& load) const {
    return mean_over(load.vertices, load.weights, materials_->mean_stiffness);
}

/// Default pressure limit, Pa: 4 E h / t, with the membrane stiffness E h (N/m) and t = side / 30 in place of the
/// thickness. About 3 N per vertex on a mesh of 5 mm of the default material.
double ContactLaws::own_pressure(Range vertices, const TissueScale& scale) const {
    double mass = 0.0;
    for (Index v = vertices.first; v < vertices.end(); ++v) mass += materials_->mass[at(v)];
    const double membrane = scale.wave_speed * scale.wave_speed * mass / (scale.side * scale.side);
    constexpr double times = 4.0;
    constexpr double of_side = 1.0 / 30.0;
    const double pressure = times * membrane / (of_side * scale.side);
    return std::isfinite(pressure) ? pressure : infinite;
}

void ContactLaws::finish_on_tissue(Index tissue, const Vector3& other_velocity, ContactForceLaw& linear) const {
    if (settings_.by_area) {
        const double side = scale_[at(tissue)].side;
        const double mean_area = side * side / static_cast<double>(topology_->bodies[at(tissue)].vertices.count);
        const double weight = mean_over(linear.vertices, linear.weights, materials_->area) / mean_area;
        linear.k *= weight;
        linear.mu *= weight;
    }
    linear.gap -= settings_.contact_offset * scale_[at(tissue)].edge;
    // Bounds k d of a deep gap, which would accelerate light tissue too much.
    linear.gap = std::max(linear.gap, -clear_speed_[at(tissue)] * settings_.relaxation_time);
    if (pressure_[at(tissue)] < infinite)
        linear.limit = pressure_[at(tissue)] * mean_over(linear.vertices, linear.weights, materials_->area);
    if (settings_.friction <= 0.0) return;
    linear.friction = settings_.friction;
    linear.tangent_k = settings_.friction_k;
    linear.surface_velocity = other_velocity;
    linear.slip_key = ContactPoint{linear.vertices, linear.weights}.heaviest();
}

std::optional<ForceLawValues> ContactLaws::values_in_force(double on_tissue) const {
    double mass = 0.0;
    double springs = 0.0;
    double count = 0.0;
    for (Index body = 0; body < bodies_; ++body) {
        if (topology_->bodies[at(body)].kind != BodyKind::tissue) continue;
        const Range vertices = topology_->bodies[at(body)].vertices;
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            mass += materials_->mass[at(v)];
            springs += materials_->mean_stiffness[at(v)];
            count += 1.0;
        }
    }
    double stiffest = -1.0;
    double damping = 0.0;
    for (Index a = 0; a < bodies_; ++a) {
        for (Index b = a + 1; b < bodies_; ++b) {
            if (topology_->body_pair(a, b) < 0) continue;
            const bool tissue = topology_->bodies[at(b)].kind == BodyKind::tissue;
            if (count > 0.0 && !tissue) continue;
            double stiffness = tissue ? on_tissue : std::numeric_limits<double>::quiet_NaN();
            if (std::isnan(stiffness)) stiffness = k(a, b);
            if (std::isnan(stiffness)) stiffness = tissue ? springs / count : rigid_stiffness;
            if (!(stiffness > stiffest)) continue;
            stiffest = stiffness;
            damping = tissue && !std::isnan(on_tissue) ? own_mu(stiffness) : mu(a, b, stiffness);
        }
    }
    if (stiffest < 0.0) return std::nullopt;
    ForceLawValues values{.k = stiffest, .mu = damping};
    if (stiffest > 0.0) values.relaxation_time = damping / stiffest;
    if (stiffest > 0.0 && mass > 0.0) values.damping_ratio = damping / (2.0 * std::sqrt(stiffest * mass / count));
    return values;
}

std::vector<Parameter> law_parameters(const std::string& auto_k) {
    return {
        stiffness_parameter(auto_k),
        number_parameter("mu", "N s/m", "auto", 0.0, 1e6,
                         "contact damping; auto: the scene's where k is the scene's, else k × relaxation_time",
                         {"auto"}),
        number_parameter(
            "relaxation_time", "s", "0.003", 0.0, 10.0,
            "mu / k of laws whose k is not the scene's: the time constant in which an overlap decays; three ticks")};
}

std::vector<Parameter> law_parameters_on_tissue(const std::string& auto_k, bool on) {
    std::vector<Parameter> parameters = law_parameters(auto_k);
    const std::vector<Parameter> more{
        number_parameter(
            "contact_offset", "1", on ? "0.001" : "0", 0.0, 1.0,
            "distance at which features are held apart, in mean edges of the tissue; keeps the normal defined"),
        number_parameter(
            "clear_speed", "m/s", on ? "auto" : "none", 1e-6, 1e6,
            "fastest at which an overlap is taken back; auto: a twelfth of the tissue's sqrt(E/rho), 0.5 for the "
            "default material",
            {"auto", "none"}),
        number_parameter(
            "pressure", "Pa", on ? "auto" : "none", 1.0, 1e12,
            "force limit, on the area of the pushed feature: what presses harder passes; auto: 138 kPa for a "
            "sheet of 100 mm of the default material",
            {"auto", "none"}),
        number_parameter("friction", "1", "0", 0.0, 10.0, "Coulomb friction on tissue (0.1 is usual); 0: none"),
        number_parameter("friction_k", "N/m", "1000", 0.0, 1e6,
                         "tangential spring of a sticking contact with friction > 0")};
    parameters.insert(parameters.end(), more.begin(), more.end());
    return parameters;
}

LawSettings read_law_settings(const ParameterValues& values) {
    LawSettings settings;
    const auto read = [&values](const char* name, double& into) {
        if (!values.has(name)) return;
        into = values.is(name, "none") ? infinite : values.number(name);
    };
    read("k", settings.k);
    read("mu", settings.mu);
    read("relaxation_time", settings.relaxation_time);
    read("contact_offset", settings.contact_offset);
    read("clear_speed", settings.clear_speed);
    read("pressure", settings.pressure);
    read("friction", settings.friction);
    read("friction_k", settings.friction_k);
    settings.by_area = values.has("weight") && values.is("weight", "area");
    return settings;
}

}  // namespace trocar
