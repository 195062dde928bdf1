// Shared by `run` and `export`: run specification from the command line, and interruption.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "app/progress.hpp"
#include "measure/record.hpp"
#include "scene/scene.hpp"
#include "study/child_process.hpp"

namespace trocar::app {

/// Methods of a run as the command line gives them; empty: default.
struct MethodChoice {
    std::string detector = "ohc_clustered";
    std::string response = "unilateral";
    std::string contacts;  ///< contact generator; empty: the response's default
    std::string stepper;   ///< NAME[:key=value…]
    std::string device;    ///< key=value,…
};

/// Closed-loop specification as in records: detector, response, contact generator, stepper, device. Parameters are
/// in alphabetical order. Throws InputError for an unknown or absent method and an invalid value.
RunSpec spec_of(const MethodChoice& choice);

/// Throws InputError when `ticks` (--ticks) is outside the range allowed for scenes.
void check_ticks(std::optional<std::int64_t> ticks);

/// Sets name, file, hash and seed of the scene, and its ticks unless `ticks` is given.
void set_scene(const Scene& scene, std::optional<std::int64_t> ticks, RunSpec& spec);

/// As RunLimits::progress: shows the number of finished ticks, and stops at SIGINT or SIGTERM, which `stopped` reports.
std::function<bool(std::int64_t)> until_interrupted(Progress& progress, SignalsHeld& signals, bool& stopped);

}  // namespace trocar::app
