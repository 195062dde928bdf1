#include "simulate/overrides.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "method/registry.hpp"

namespace trocar {
namespace {

std::map<std::string, double> parse(const std::string& text) {
    std::map<std::string, double> values;
    if (text.empty()) return values;
    const auto malformed = [](const std::string& found) {
        return InputError("scene override", "", "NAME=NUMBER[,NAME=NUMBER...]", found);
    };
    for (const auto& [name, digits] : parse_settings(text, malformed)) {
        const auto fail = [&name = name, &digits = digits](const char* expected) {
            throw InputError("scene override", name, expected, "'" + digits + "'");
        };
        const auto& knobs = scene_knobs();
        if (std::none_of(knobs.begin(), knobs.end(),
                         [&name = name](const SceneKnob& knob) { return knob.name == name; }))
            fail("dt, k, substeps or cycles");
        const double value = number_of_text<double>(digits).value_or(0.0);
        if (!(value > 0.0) || !std::isfinite(value)) fail("a number > 0");
        if ((name == "substeps" || name == "cycles") && (value != std::floor(value) || value > 1000.0)) {
            fail("a whole number up to 1000");
        }
        values[name] = value;
    }
    return values;
}

void repeat_motion(std::int64_t cycles, Scene& scene) {
    Motion* motion = nullptr;
    for (SceneBody& body : scene.bodies) {
        if (!body.motion) continue;
        if (motion != nullptr) throw InputError(scene.name, "/bodies", "one body with a motion to repeat", "several");
        motion = &*body.motion;
    }
    if (motion == nullptr) throw InputError(scene.name, "/bodies", "one body with a motion to repeat", "none");
    constexpr double return_time = 0.1;  // s
    const std::vector<MotionKey> once = std::exchange(motion->keys, {});
    const double period = once.back().time + return_time;
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (std::int64_t cycle = 0; cycle < cycles; ++cycle) {
        const Matrix3 turn =
            Eigen::AngleAxisd(golden_angle * static_cast<double>(cycle), Vector3::UnitZ()).toRotationMatrix();
        for (MotionKey key : once) {
            key.time += period * static_cast<double>(cycle);
            key.translation = turn * key.translation;
            motion->keys.push_back(key);
        }
    }
    scene.ticks = std::llround(period * static_cast<double>(cycles) / scene.dt);
}

}  // namespace

const std::vector<SceneKnob>& scene_knobs() {
    static const std::vector<SceneKnob> knobs{{"dt", "s", "length of a tick"},
                                              {"k", "N/m", "contact stiffness between every two bodies"},
                                              {"substeps", "1", "steps of the tissue's integrator per tick"},
                                              {"cycles", "1", "repetitions of the motion, each in another direction"}};
    return knobs;
}

void apply_overrides(const std::string& overrides, Scene& scene) {
    for (const auto& [name, value] : parse(overrides)) {
        if (name == "dt") {
            const double factor = value / scene.dt;
            scene.materials.substeps =
                std::max(1, static_cast<int>(std::ceil(scene.materials.substeps * factor - 1e-9)));
            scene.ticks = std::llround(static_cast<double>(scene.ticks) / factor);
            scene.dt = value;
        } else if (name == "k") {
            for (ContactLaw& law : scene.materials.contact_laws) {
                if (law.k == value) continue;  // unchanged, so no override
                law.k = value;
                scene.turned_k = value;
            }
        } else if (name == "cycles") {
            repeat_motion(static_cast<std::int64_t>(value), scene);
        } else {
            scene.materials.substeps = static_cast<int>(value);
        }
    }
}

double override_value(const std::string& overrides, const std::string& knob) {
    const auto values = parse(overrides);
    const auto found = values.find(knob);
    return found == values.end() ? 0.0 : found->second;
}

}  // namespace trocar
