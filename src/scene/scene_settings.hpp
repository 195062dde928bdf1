// Numbers that a scene may set. The reader and the JSON schema use these tables of key, unit, default, bounds and
// meaning.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "scene/motion.hpp"

namespace trocar {

enum class ValueBound { positive, non_negative };

template <typename Settings>
struct NumberSetting {
    const char* key;
    double Settings::*member;
    const char* unit;  ///< SI; "m" is read in the scene's unit
    ValueBound bounds;
    const char* meaning;
};

/// Tissue of one body; defaults are those of METHODS §12.
struct TissueSettings {
    double youngs_modulus = 38000.0;  ///< Pa
    double thickness = 0.003;         ///< m
    double density = 1060.0;          ///< kg/m³
    double preload = 0.2;             ///< p in T = p k L
    double damping = 0.02;            ///< N s/m, per spring
    double drag = 5.0;                ///< 1/s, times the vertex mass
    double strain_limit = 1.0;        ///< edge strain
    double bulk_modulus = 0.0;        ///< Pa, of the enclosed volume of a closed body; 0: no volume constraint
    std::optional<int> substeps;      ///< absent: 4, or more if the bound of METHODS §4 requires it
    bool rim_pinned = true;
    std::vector<Index> pinned;  ///< vertex numbers of the body's files
};

inline constexpr std::array<NumberSetting<TissueSettings>, 8> tissue_numbers{{
    {"youngs_modulus", &TissueSettings::youngs_modulus, "Pa", ValueBound::positive, "Young's modulus E"},
    {"thickness", &TissueSettings::thickness, "m", ValueBound::positive, "thickness h_t of the membrane"},
    {"density", &TissueSettings::density, "kg/m^3", ValueBound::positive, "density rho"},
    {"preload", &TissueSettings::preload, "1", ValueBound::non_negative, "p: tension at rest is p k L in every spring"},
    {"damping", &TissueSettings::damping, "N s/m", ValueBound::non_negative, "damping c of every spring"},
    {"drag", &TissueSettings::drag, "1/s", ValueBound::non_negative, "drag on every vertex, per mass"},
    {"strain_limit", &TissueSettings::strain_limit, "1", ValueBound::positive, "largest edge strain"},
    {"bulk_modulus", &TissueSettings::bulk_modulus, "Pa", ValueBound::non_negative,
     "closed bodies: K, over-pressure inside is -K (V - V0)/V0; 0 = none"},
}};
inline constexpr int most_substeps = 1000;

inline constexpr std::array<NumberSetting<OperatorModel>, 4> operator_numbers{{
    {"mass", &OperatorModel::mass, "kg", ValueBound::positive, "mass of operator and instrument"},
    {"damping", &OperatorModel::damping, "N s/m", ValueBound::non_negative, "damping of the device"},
    {"coupling_stiffness", &OperatorModel::coupling_stiffness, "N/m", ValueBound::non_negative,
     "stiffness of the virtual coupling to the script"},
    {"coupling_damping", &OperatorModel::coupling_damping, "N s/m", ValueBound::non_negative,
     "damping of the virtual coupling"},
}};

inline const std::vector<std::string> unit_words{"m", "mm", "cm"};
inline const std::vector<std::string> drive_words{"prescribed", "operator"};
inline constexpr double default_jaw_angle = 30.0;  ///< degrees, jaw part fully open

}  // namespace trocar
