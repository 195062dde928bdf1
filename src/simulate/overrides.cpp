#include "simulate/overrides.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "geometry/random.hpp"
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
            fail("dt, k, substeps, cycles or dither");
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

/// Rotation vector, degrees, of a unit rotation.
Vector3 rotation_degrees_of(const Quaternion& rotation) {
    const Eigen::AngleAxisd turn(rotation);
    return turn.axis() * (turn.angle() * 180.0 / std::numbers::pi);
}

void dither_scripts(double amplitude, Scene& scene) {
    Random random(scene.seed);
    std::vector<Vector3> offsets{Vector3::Zero()};  // the run starts as the file says
    offsets.reserve(static_cast<std::size_t>(scene.ticks) + 1);
    for (std::int64_t tick = 1; tick <= scene.ticks; ++tick) {
        const std::uint64_t bits = random.next();
        const auto sign = [bits](unsigned bit) { return ((bits >> bit) & 1U) != 0 ? 1.0 : -1.0; };
        offsets.push_back(amplitude / std::sqrt(3.0) * Vector3(sign(0), sign(1), sign(2)));
    }
    bool any = false;
    for (SceneBody& body : scene.bodies) {
        if (!body.motion || body.motion->drive != Drive::prescribed) continue;
        any = true;
        std::vector<MotionKey> keys;
        keys.reserve(offsets.size());
        for (std::size_t tick = 0; tick < offsets.size(); ++tick) {
            const double time = scene.dt * static_cast<double>(tick);
            const Pose pose = body.motion->pose_at(time);
            keys.push_back({.time = time,
                            .translation = pose.translation + offsets[tick],
                            .rotation_degrees = rotation_degrees_of(pose.rotation),
                            .jaw = pose.jaw});
        }
        body.motion->keys = std::move(keys);
    }
    if (!any) throw InputError(scene.name, "/bodies", "a body with a prescribed motion to dither", "none");
}

}  // namespace

const std::vector<SceneKnob>& scene_knobs() {
    static const std::vector<SceneKnob> knobs{{"dt", "s", "length of a tick"},
                                              {"k", "N/m", "contact stiffness between every two bodies"},
                                              {"substeps", "1", "steps of the tissue's integrator per tick"},
                                              {"cycles", "1", "repetitions of the motion, each in another direction"},
                                              {"dither", "m", "displacement of scripted bodies at every tick"}};
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
        } else if (name == "dither") {
            dither_scripts(value, scene);
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
