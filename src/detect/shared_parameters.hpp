// Parameters common to the project's detectors, declared and read in one place.
#pragma once

#include <cstdint>
#include <limits>

#include "detect/narrow_phase.hpp"
#include "method/entry.hpp"

namespace trocar {

/// Choice of the triangle test (narrow_phase.hpp).
inline Parameter test_parameter() {
    return choice_parameter("test", "exact", {"exact", "interval", "moller"},
                            "triangle test; only exact is free of errors");
}

/// Limit on WorkCounters::work() of a tick; what it cuts sets ContactSet::truncated.
inline Parameter work_budget_parameter() {
    return integer_parameter("work_budget", "none", 0, 1e15,
                             "largest work (vertices read + cells visited + box tests + triangle tests) of a tick",
                             {"none"});
}

/// Whether contacts that begin between two frames are reported (swept.hpp).
inline Parameter swept_parameter() {
    return choice_parameter(
        "swept", "off", {"off", "on"},
        "also report the pairs that begin to touch between two frames and when; never part of the pairs");
}

/// Values of these parameters.
struct SharedSettings {
    static constexpr std::int64_t no_limit = std::numeric_limits<std::int64_t>::max();

    TriangleTest test = TriangleTest::exact;
    bool swept = false;
    std::int64_t work_budget = no_limit;

    [[nodiscard]] bool limited() const { return work_budget != no_limit; }
    void take(const ParameterValues& values) {
        test = triangle_test_from(values.text("test"));
        swept = values.is("swept", "on");
        work_budget = values.is("work_budget", "none") ? no_limit : values.integer("work_budget");
    }
};

}  // namespace trocar
