// The one table of everything that is measured: name, unit, meaning, which way is better. Rows, summaries, reports and
// documents print from it, so that a figure is explained the same way everywhere.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "measure/step_row.hpp"

namespace trocar {

enum class Better : std::uint8_t { lower, higher, neither };

struct Metric {
    std::string name;  ///< key of Record::summary
    std::string unit;  ///< SI or "ns", "1" for a pure number
    Better better = Better::neither;
    std::string meaning;
};

/// Every key that Record::summary may hold, in the order in which reports print them.
const std::vector<Metric>& metrics();

/// Throws std::logic_error for an unknown name.
const Metric& metric(std::string_view name);

/// Figures of a run from its rows alone; a figure that does not apply is NaN ("n/a"). The first `warm_up` rows stay out
/// of the time figures and the allocation counts, and of nothing else.
std::map<std::string, double> summarize(const std::vector<StepRow>& rows, std::int64_t warm_up = 0);

/// Warm-up rule for a run of that many ticks: a twentieth of it, at least 1 and at most 50 ticks.
std::int64_t warm_up_ticks(std::int64_t ticks);

}  // namespace trocar
