// Parameters common to the project's detectors, declared and read in one place.
#pragma once

#include <cstdint>
#include <limits>

#include "detect/narrow_phase.hpp"
#include "method/entry.hpp"

namespace trocar {

/// Choice of the triangle test (narrow_phase.hpp).
inline Parameter test_parameter() {
    return {.name = "test",
            .type = Parameter::Type::choice,
            .default_value = "exact",
            .choices = {"exact", "interval", "moller"},
            .meaning = "triangle test; only exact is free of errors"};
}

/// Limit on the number of reported pairs.
inline Parameter max_pairs_parameter() {
    return {.name = "max_pairs",
            .type = Parameter::Type::integer,
            .unit = "1",
            .default_value = "none",
            .minimum = 0,
            .maximum = 1e15,
            .meaning = "report at most this many pairs and set `truncated`",
            .words = {"none"}};
}

/// Limit on WorkCounters::work() of a tick.
inline Parameter work_budget_parameter() {
    return {.name = "work_budget",
            .type = Parameter::Type::integer,
            .unit = "1",
            .default_value = "none",
            .minimum = 0,
            .maximum = 1e15,
            .meaning = "largest work (vertices read + cells visited + box tests + triangle tests) of a tick",
            .words = {"none"}};
}

/// Whether contacts that begin between two frames are reported (swept.hpp).
inline Parameter swept_parameter() {
    return {
        .name = "swept",
        .type = Parameter::Type::choice,
        .default_value = "off",
        .choices = {"off", "on"},
        .meaning = "also report the pairs that begin to touch between two frames and when; never part of the pairs"};
}

/// Values of these parameters.
struct SharedSettings {
    static constexpr std::int64_t no_limit = std::numeric_limits<std::int64_t>::max();

    TriangleTest test = TriangleTest::exact;
    bool swept = false;
    std::int64_t max_pairs = no_limit;
    std::int64_t work_budget = no_limit;

    [[nodiscard]] bool limited() const { return max_pairs != no_limit || work_budget != no_limit; }
    void take(const ParameterValues& values) {
        test = triangle_test_from(values.text("test"));
        swept = values.is("swept", "on");
        max_pairs = values.is("max_pairs", "none") ? no_limit : values.integer("max_pairs");
        work_budget = values.is("work_budget", "none") ? no_limit : values.integer("work_budget");
    }
};

}  // namespace trocar
