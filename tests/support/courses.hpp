// What a closed loop of a tool on tissue comes to, by the truth of depth.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "measure/depth_truth.hpp"
#include "support/closed_loop.hpp"

namespace trocar::test {

constexpr double clear_depth = 1e-4;  // m, what the requirement calls clear (METHODS §14, I26)

struct Course {
    double worst_depth = 0.0;  ///< m, after any tick
    double force = 0.0;        ///< N, largest on the tool
    std::int64_t ruptures = 0;
    int deep_unreported = 0;  ///< most ticks in a row deeper than `clear_depth` before the first rupture
};

/// Body 0 is the tool. A tick that fails is a failure of the test.
inline Course run_course(ClosedLoop& loop, int ticks) {
    Course course;
    DepthTruth truth(loop.topology, loop.frame);
    int deep = 0;
    for (int tick = 0; tick < ticks; ++tick) {
        if (!loop.step()) {
            ADD_FAILURE() << "tick " << tick << ": " << loop.outcome.message;
            break;
        }
        const double depth = truth.measure(loop.frame).residual_penetration;
        course.worst_depth = std::max(course.worst_depth, depth);
        course.force = std::max(course.force, loop.tool_force(0).norm());
        course.ruptures += loop.ruptures;
        deep = depth > clear_depth && course.ruptures == 0 ? deep + 1 : 0;
        course.deep_unreported = std::max(course.deep_unreported, deep);
    }
    return course;
}

}  // namespace trocar::test
