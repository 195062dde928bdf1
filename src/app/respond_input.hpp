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

namespace trocar::app {

using Json = nlohmann::ordered_json;

inline constexpr double unset = std::numeric_limits<double>::quiet_NaN();

/// Reads typed values of one case's `input`. Throws InputError with the JSON pointer of the fault.
class Input {
public:
    Input(const Json& json, std::string file, std::string pointer)
        : json_(json), file_(std::move(file)), pointer_(std::move(pointer)) {}

    [[nodiscard]] bool has(const std::string& key) const { return json_.contains(key); }

    [[noreturn]] void fault(const std::string& key, std::string_view expected, std::string_view found) const {
        throw InputError(file_, pointer_ + "/" + key, expected, found);
    }

    /// First of `keys` that is present. Without any, a fault that names the first.
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
            std::string text = json.get<std::string>();
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
    /// Velocities of a triangle's corners; zero when absent.
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

inline Json to_json(const Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

// respond_contact_laws.cpp: equations of the thesis, wrench and distribution
LawAnswer vertex_in_instrument(const Input& input);    ///< 3.4
LawAnswer edges_cross(const Input& input);             ///< 3.5, 3.9
LawAnswer instrument_in_tissue(const Input& input);    ///< 3.6
LawAnswer projection(const Input& input, bool rigid);  ///< 3.7-3.8, 3.10-3.11
LawAnswer equilibrium(const Input& input);             ///< reaction of displaced tissue in equilibrium
LawAnswer tissue_exchange(const Input& input);         ///< 3.12-3.17
LawAnswer wrench(const Input& input);
LawAnswer distribution(const Input& input);

// respond_motion_laws.cpp: motions computed with the tissue integrator
LawAnswer mass_on_plane(const Input& input);
LawAnswer springs_in_series(const Input& input);
LawAnswer oscillation(const Input& input, const Json& expected);
LawAnswer oscillation_energy(const Input& input);
LawAnswer preloaded_pair(const Input& input);
LawAnswer chain_limits(const Input& input);
LawAnswer sheet_limits(const Input& input);
LawAnswer contact_limits(const Input& input);

}  // namespace trocar::app
