// What the parts of ohc share: the detector's settings and the book of a tick's work, which also says when the budget
// is spent. Nothing is computed here.
#pragma once

#include <cstdint>
#include <limits>

#include "contact/contact_set.hpp"
#include "detect/cell_map.hpp"
#include "detect/lattice.hpp"
#include "detect/narrow_phase.hpp"

namespace trocar {

struct OhcSettings {
    double cell = std::numeric_limits<double>::quiet_NaN();  ///< m; NaN: chosen from the first frame
    CellHash hash = CellHash::fibonacci;
    int hash_bits = 12;
    double margin = 0.0;  ///< m
    bool incremental = false;
    bool swept = false;  ///< boxes hold the triangle at both ends of the tick
    TriangleTest test = TriangleTest::exact;
    std::int64_t max_pairs = std::numeric_limits<std::int64_t>::max();
    std::int64_t work_budget = std::numeric_limits<std::int64_t>::max();
    [[nodiscard]] bool limited() const {
        return max_pairs != std::numeric_limits<std::int64_t>::max() ||
               work_budget != std::numeric_limits<std::int64_t>::max();
    }
};

struct OhcWork {
    WorkCounters counters;
    bool truncated = false;  ///< something was left out for want of budget or pairs
    std::int64_t budget = std::numeric_limits<std::int64_t>::max();

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
    /// Under a budget: whether one more range of cells can be looked at.
    bool afford(const CellRange& range) {
        if (budget == std::numeric_limits<std::int64_t>::max()) return true;
        if (range.cell_count() <= static_cast<double>(budget - counters.work())) return !truncated;
        truncated = true;
        return false;
    }
};

}  // namespace trocar
