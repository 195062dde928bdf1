// What `run` and `export` share: the specification of one run from the words of the command line, and a run that can
// be interrupted.
#pragma once

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "measure/record.hpp"
#include "scene/scene.hpp"

namespace trocar::app {

/// The methods of a run as a person names them; empty: the default one.
struct MethodChoice {
    std::string detector = "ohc_clustered";
    std::string response = "unilateral";
    std::string contacts;                         ///< contact generator; empty: the response's own
    std::string stepper;                          ///< NAME[:key=value…]
    std::string device;                           ///< key=value,…
    std::optional<double> query_distance_margin;  ///< mean edges, see simulate/query_distance.hpp
};

/// Detector, response, contacts, stepper, device and query distance margin of a closed loop, as records have them
/// (parameters in alphabetical order). Throws InputError for an unknown or absent method and a bad value.
RunSpec spec_of(const MethodChoice& choice);

/// Throws InputError unless `ticks` (--ticks) is none or what a scene may ask for, too.
void check_ticks(std::optional<std::int64_t> ticks);

/// What of a specification the scene decides: name, file, hash, seed, and the ticks where `ticks` does not.
void set_scene(const Scene& scene, std::optional<std::int64_t> ticks, RunSpec& spec);

/// Takes Ctrl-C (and a polite kill) as a wish to stop after the current tick, for as long as it lives.
class InterruptHeld {
public:
    InterruptHeld();
    ~InterruptHeld();
    InterruptHeld(const InterruptHeld&) = delete;
    InterruptHeld& operator=(const InterruptHeld&) = delete;
    InterruptHeld(InterruptHeld&&) = delete;
    InterruptHeld& operator=(InterruptHeld&&) = delete;

private:
    struct sigaction old_interrupt_ {};
    struct sigaction old_terminate_ {};
};
/// True once the wish was there.
bool interrupt_asked();

}  // namespace trocar::app
