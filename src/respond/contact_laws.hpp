// Force laws of contacts, shared by all responses: stiffness, damping, and options on tissue (contact offset, clear
// speed, force limit, friction).
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "contact/response_output.hpp"
#include "geometry/types.hpp"
#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/tissue_scale.hpp"
#include "scene/world.hpp"

namespace trocar {

/// User settings of a response's force laws. NaN: `auto`.
struct LawSettings {
    double k = std::numeric_limits<double>::quiet_NaN();           ///< N/m
    double mu = std::numeric_limits<double>::quiet_NaN();          ///< N s/m
    double relaxation_time = 0.003;                                ///< s, mu / k
    double contact_offset = 0.0;                                   ///< mean edges of the tissue
    double clear_speed = std::numeric_limits<double>::infinity();  ///< m/s
    double pressure = std::numeric_limits<double>::infinity();     ///< Pa
    double friction = 0.0;                                         ///< Coulomb coefficient
    double friction_k = 1000.0;                                    ///< N/m
    bool tissue_alone = false;                                     ///< k and mu apply on tissue only
    bool by_area = false;  ///< on tissue k and mu are times the pushed feature's area over the mean of a vertex
};

/// Force laws per body pair, in a table built once per run.
class ContactLaws {
public:
    void prepare(const Topology& topology, const Materials& materials, const LawSettings& settings);
    /// N/m: the method's value, else the scene's; NaN if neither sets one.
    [[nodiscard]] double k(Index body_a, Index body_b) const { return law(body_a, body_b).k; }
    /// N s/m, of a law of stiffness `stiffness` (N/m): the method's value; else the scene's, unless the method sets the
    /// stiffness; else stiffness × relaxation time.
    [[nodiscard]] double mu(Index body_a, Index body_b, double stiffness) const;
    /// N s/m, of a law with the method's own stiffness (N/m): the method's value, else stiffness × relaxation time.
    [[nodiscard]] double own_mu(double stiffness) const;
    [[nodiscard]] CollisionClass kind(Index body_a, Index body_b) const { return law(body_a, body_b).kind; }
    /// N/m, default on tissue if k() is NaN: weighted mean of the springs at the load's vertices.
    [[nodiscard]] double mean_of_springs(const ContactPoint& load) const;
    /// Completes a law that pushes `tissue`: weight by area, contact offset, depth clamp by clear speed, force limit
    /// and friction. `other_velocity`: m/s, of the other surface.
    void finish_on_tissue(Index tissue, const Vector3& other_velocity, ContactForceLaw& linear) const;
    /// Values of the stiffest pair with tissue, else of the stiffest pair; none without a pair. `on_tissue`: N/m, the
    /// method's own stiffness there; NaN: that of the table.
    [[nodiscard]] std::optional<ForceLawValues> values_in_force(
        double on_tissue = std::numeric_limits<double>::quiet_NaN()) const;

private:
    struct Law {
        double k = std::numeric_limits<double>::quiet_NaN();
        double mu = std::numeric_limits<double>::quiet_NaN();
        CollisionClass kind = CollisionClass::none;
    };
    [[nodiscard]] const Law& law(Index a, Index b) const {
        return table_[static_cast<std::size_t>(a) * static_cast<std::size_t>(bodies_) + static_cast<std::size_t>(b)];
    }
    [[nodiscard]] double own_pressure(Range vertices, const TissueScale& scale) const;

    LawSettings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    Index bodies_ = 0;
    std::vector<Law> table_;
    std::vector<TissueScale> scale_;   ///< per body
    std::vector<double> clear_speed_;  ///< m/s, per body
    std::vector<double> pressure_;     ///< Pa, per body
};

/// `k`, `mu` and `relaxation_time`. `auto_k`: value of `k=auto`.
std::vector<Parameter> law_parameters(const std::string& auto_k);
/// These and the options on tissue: `contact_offset`, `clear_speed`, `pressure`, `friction` and `friction_k`. `on`:
/// with the defaults of the response `unilateral`; else all off.
std::vector<Parameter> law_parameters_on_tissue(const std::string& auto_k, bool on);
/// Reads those parameters that `values` declare.
LawSettings read_law_settings(const ParameterValues& values);

}  // namespace trocar
