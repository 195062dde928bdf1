// Error of a stepper that does not update the whole tissue in every tick, against one that does. Both run the same
// scene in step; tool force and tissue positions, near and far, are compared at every tick.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trocar::bench {

/// Lower limits of the distance bands, m: rest distance of a vertex from the point of contact. The last band is
/// unbounded.
inline constexpr std::array<double, 3> band_starts{0.0, 0.015, 0.05};

struct FarFieldTick {
    double time = 0.0;                                        ///< s
    double force = 0.0;                                       ///< N, at the tool, whole tissue
    double other_force = 0.0;                                 ///< N, the stepper under test
    double force_error = 0.0;                                 ///< N, length of the difference of the two
    std::array<double, band_starts.size()> path{};            ///< m, maximum displacement from rest, whole tissue
    std::array<double, band_starts.size()> position_error{};  ///< m, maximum over vertices
    double advance_us = 0.0;                                  ///< µs, whole-tissue stepper
    double other_advance_us = 0.0;
};

struct FarFieldRun {
    std::int64_t triangles = 0;
    std::string stepper;
    std::string whole;    ///< stepper that updates the whole tissue
    std::string outcome;  ///< "ok", or the first other outcome with its message
    std::vector<FarFieldTick> ticks;
};

/// Pinned sheet of 200 mm with `triangles` triangles and the tissue of scenes/press_20k.json. A blunt shaft presses 3
/// mm deep, rests, moves 8 mm sideways and rises. Throws InputError for unknown steppers.
FarFieldRun run_far_field(std::int64_t triangles, const std::string& stepper, const std::string& whole,
                          std::int64_t ticks);

/// Files of the report: path relative to its folder -> content. Pure.
std::map<std::string, std::string> far_field_report(const std::vector<FarFieldRun>& runs,
                                                    const std::map<std::string, std::string>& environment);

}  // namespace trocar::bench
