// The figures of a run's summary: name, unit, meaning, which way is better, and how they follow from the rows. One
// list, so that a figure is explained the same way wherever it is printed.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "measure/contact_event.hpp"
#include "measure/step_row.hpp"

namespace trocar {

enum class Better : std::uint8_t { lower, higher, neither };

struct SummaryFigure {
    std::string name;  ///< key of Record::summary
    std::string unit;  ///< SI or "ns", "1" for a pure number
    Better better = Better::neither;
    std::string meaning;
};

/// Every key that Record::summary may hold, in the order in which they are printed.
const std::vector<SummaryFigure>& summary_figures();

/// Throws std::logic_error for an unknown name.
const SummaryFigure& summary_figure(std::string_view name);

/// Figures of a run from its rows alone; a figure that does not apply is NaN ("n/a"). The first warm_up_ticks rows stay
/// out of the time figures and the allocation counts, and of nothing else.
std::map<std::string, double> summarize(const std::vector<StepRow>& rows);
/// Figures about contacts between frames, from the events; NaN without any event.
std::map<std::string, double> summarize(const std::vector<ContactEvent>& events);

}  // namespace trocar
