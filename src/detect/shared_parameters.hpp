// Settings that all of our detectors declare alike, so that one name has one meaning and one range.
#pragma once

#include "method/entry.hpp"

namespace trocar {

/// Which triangle test decides the candidates (narrow_phase.hpp).
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

/// Whether contacts that begin between two frames are told (swept.hpp).
inline Parameter swept_parameter() {
    return {.name = "swept",
            .type = Parameter::Type::choice,
            .default_value = "off",
            .choices = {"off", "on"},
            .meaning = "also tell the pairs that begin to touch between two frames and when; never part of the pairs"};
}

}  // namespace trocar
