// Data shared by the parts of ohc: settings, and the work counters of a tick with the budget.
#pragma once

#include <cstdint>
#include <limits>

#include "contact/contact_set.hpp"
#include "detect/cell_map.hpp"
#include "detect/lattice.hpp"
#include "detect/shared_parameters.hpp"

namespace trocar {

struct OhcSettings : SharedSettings {
    double cell = std::numeric_limits<double>::quiet_NaN();  ///< m; NaN: chosen from the first frame
    CellHash hash = CellHash::fibonacci;
};

struct OhcWork {
    WorkCounters counters;
    bool truncated = false;  ///< the answer is incomplete for lack of budget
    std::int64_t budget = SharedSettings::no_limit;

    /// Resets for a tick.
    void start() {
        counters = {};
        truncated = false;
    }
    /// Adds `amount` to a counter. False, with truncated set, when that would exceed the budget.
    bool spend(std::int64_t& counter, std::int64_t amount) {
        if (amount > budget - counters.work()) {
            truncated = true;
            return false;
        }
        counter += amount;
        return true;
    }
    /// Whether the budget allows one more range of cells.
    bool afford(const CellRange& range) {
        if (budget == SharedSettings::no_limit) return true;
        if (range.cell_count() <= static_cast<double>(budget - counters.work())) return !truncated;
        truncated = true;
        return false;
    }
};

}  // namespace trocar
