// Shared by the laws of `respond`: typed values of a case's `input`, and the functions for each family of cases.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "app/respond_laws.hpp"
#include "geometry/exact.hpp"
#include "geometry/input_error.hpp"
#include "respond/equations.hpp"
#include "scene/json_node.hpp"

namespace trocar::app {

using Json = nlohmann::ordered_json;

inline constexpr double unset = std::numeric_limits<double>::quiet_NaN();

/// Reads typed values of one case's `input`. Throws InputError with the JSON pointer of the fault.
class CaseInput {
public:
    /// Refers to both for its lifetime.
    CaseInput(const trocar::Json& json, const std::string& file, const std::string& pointer)
        : node_(json, file, pointer), file_(file) {}

    [[nodiscard]] bool has(const std::string& key) const { return node_.has(key); }

    [[noreturn]] void fault(const std::string& key, std::string_view expected, std::string_view found) const {
        throw InputError(file_, node_.place() + "/" + key, expected, found);
    }

    /// First of `keys` that is present. Without any, a fault that names the first.
    [[nodiscard]] std::string one_of(std::initializer_list<const char*> keys) const {
        for (const char* key : keys) {
            if (has(key)) return key;
        }
        fault(*keys.begin(), "a value", "nothing");
    }

    [[nodiscard]] double number(const std::string& key) const { return value(key).number(); }
    [[nodiscard]] double number(const std::string& key, double otherwise) const {
        return has(key) ? number(key) : otherwise;
    }
    [[nodiscard]] double positive(const std::string& key) const { return value(key).positive(); }
    [[nodiscard]] double not_negative(const std::string& key) const { return value(key).non_negative(); }
    [[nodiscard]] double not_negative(const std::string& key, double otherwise) const {
        return has(key) ? not_negative(key) : otherwise;
    }
    /// Written as a whole number or as a decimal one.
    [[nodiscard]] std::int64_t count(const std::string& key, std::int64_t most) const {
        const double x = number(key);
        if (x != std::floor(x) || x < 1.0 || x > static_cast<double>(most)) {
            fault(key, fmt::format("a whole number from 1 to {}", most), fmt::format("{}", x));
        }
        return static_cast<std::int64_t>(x);
    }
    [[nodiscard]] std::string word(const std::string& key, const std::vector<std::string>& choices) const {
        return value(key).word(choices);
    }
    [[nodiscard]] Vector3 vector(const std::string& key) const { return value(key).vector3(); }
    [[nodiscard]] Vector3 vector(const std::string& key, const Vector3& otherwise) const {
        return has(key) ? vector(key) : otherwise;
    }
    [[nodiscard]] std::vector<double> numbers(const std::string& key) const {
        std::vector<double> result;
        for (const JsonNode& item : value(key).list()) result.push_back(item.number());
        return result;
    }
    [[nodiscard]] std::vector<Vector3> vectors(const std::string& key) const {
        std::vector<Vector3> result;
        for (const JsonNode& item : value(key).list()) result.push_back(item.vector3());
        return result;
    }
    [[nodiscard]] Corners corners(const std::string& key) const {
        const std::vector<Vector3> list = vectors(key);
        if (list.size() != 3) fault(key, "3 corners", fmt::format("{}", list.size()));
        return {list[0], list[1], list[2]};
    }
    /// Velocities of a triangle's corners; zero when absent.
    [[nodiscard]] Corners velocities(std::initializer_list<const char*> keys) const {
        const bool given = std::any_of(keys.begin(), keys.end(), [this](const char* key) { return has(key); });
        return given ? corners(one_of(keys)) : Corners{Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
    }

private:
    [[nodiscard]] JsonNode value(const std::string& key) const { return node_.at(one_of({key.c_str()})); }

    JsonNode node_;
    const std::string& file_;
};

inline Json to_json(const Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

// respond_contact_laws.cpp: equations of the thesis, wrench and distribution
LawAnswer vertex_in_instrument(const CaseInput& input);    ///< 3.4
LawAnswer edges_cross(const CaseInput& input);             ///< 3.5, 3.9
LawAnswer instrument_in_tissue(const CaseInput& input);    ///< 3.6
LawAnswer projection(const CaseInput& input, bool rigid);  ///< 3.7-3.8, 3.10-3.11
LawAnswer equilibrium(const CaseInput& input);             ///< reaction of displaced tissue in equilibrium
LawAnswer tissue_exchange(const CaseInput& input);         ///< 3.12-3.17
LawAnswer wrench(const CaseInput& input);
LawAnswer distribution(const CaseInput& input);

// respond_motion_laws.cpp: motions computed with the tissue integrator
LawAnswer mass_on_plane(const CaseInput& input);
LawAnswer springs_in_series(const CaseInput& input);
LawAnswer oscillation(const CaseInput& input, const Json& expected);
LawAnswer oscillation_energy(const CaseInput& input);
LawAnswer preloaded_pair(const CaseInput& input);
LawAnswer chain_limits(const CaseInput& input);
LawAnswer sheet_limits(const CaseInput& input);
LawAnswer contact_limits(const CaseInput& input);

}  // namespace trocar::app
