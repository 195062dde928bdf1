// What the parts of ohc share: the detector's settings and the book of a tick's work, which also says when the budget
// is spent. Nothing is computed here.
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
    int hash_bits = 12;
    double margin = 0.0;  ///< m
};

struct OhcWork {
    WorkCounters counters;
    bool truncated = false;  ///< something was left out for want of budget or pairs
    std::int64_t budget = SharedSettings::no_limit;

    /// Empties the book for a tick.
    void start() {
        counters = {};
        truncated = false;
    }
    /// Adds `amount` to one of the counters; false, and the answer is marked as cut, when that would exceed the budget.
    bool spend(std::int64_t& counter, std::int64_t amount) {
        if (amount > budget - counters.work()) {
            truncated = true;
            return false;
        }
        counter += amount;
        return true;
    }
    /// Under a budget: whether one more range of cells can be examined.
    bool afford(const CellRange& range) {
        if (budget == SharedSettings::no_limit) return true;
        if (range.cell_count() <= static_cast<double>(budget - counters.work())) return !truncated;
        truncated = true;
        return false;
    }
};

}  // namespace trocar
