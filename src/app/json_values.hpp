// Numbers in the JSON output of commands.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/types.hpp"

namespace trocar::app {

/// null for NaN and infinity, which JSON lacks.
inline nlohmann::ordered_json json_number(double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

inline nlohmann::ordered_json json_vector(const Vector3& v) {
    return {json_number(v.x()), json_number(v.y()), json_number(v.z())};
}

}  // namespace trocar::app
