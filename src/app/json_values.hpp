// JSON output of commands: one document on one line.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
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

/// Prints one line on standard output. Bytes that are not UTF-8 are replaced.
template <typename Json>
void print_json_line(const Json& document) {
    fmt::print("{}\n", document.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace trocar::app
