// What a stepper that does not move the whole tissue at every tick costs in exactness: it and one that does run the
// same scene in step, and the force at the tool and the places of the tissue, near and far, are distinguished at every
// tick.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trocar::bench {

/// Bands of the tissue by the distance of a vertex at rest from where the tool goes in, m; the last has no end.
inline constexpr std::array<double, 3> band_starts{0.0, 0.015, 0.05};

struct FarFieldTick {
    double time = 0.0;                                        ///< s
    double force = 0.0;                                       ///< N, at the tool, whole tissue
    double other_force = 0.0;                                 ///< N, the stepper under test
    double force_error = 0.0;                                 ///< N, length of the difference of the two
    std::array<double, band_starts.size()> path{};            ///< m, furthest of a vertex from rest, whole tissue
    std::array<double, band_starts.size()> position_error{};  ///< m, largest of a vertex
    double advance_us = 0.0;                                  ///< of the whole tissue
    double other_advance_us = 0.0;
};

struct FarFieldRun {
    std::int64_t triangles = 0;
    std::string stepper;
    std::string whole;    ///< the stepper that moves all
    std::string outcome;  ///< "ok", or the first that was not, with its message
    std::vector<FarFieldTick> ticks;
};

/// A pinned sheet of 200 mm with the tissue of scenes/press_20k.json, in so many triangles: a blunt shaft goes 3 mm
/// deep, rests, is drawn 8 mm along and rises. Throws InputError for steppers that there are not.
FarFieldRun run_far_field(std::int64_t triangles, const std::string& stepper, const std::string& whole,
                          std::int64_t ticks);

/// Files of the report, path relative to its folder -> content. Pure.
std::map<std::string, std::string> far_field_report(const std::vector<FarFieldRun>& runs,
                                                    const std::map<std::string, std::string>& environment);

}  // namespace trocar::bench
