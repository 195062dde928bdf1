// Compares two sets of records of one study, run by run and figure by figure, as a regression test. Times are excluded,
// because they vary between executions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct FigureChange {
    std::string run;  ///< "closed_loop i2t_poke: ohc + penalty (intersection)"
    std::string figure;
    std::string before;
    std::string after;
    double size = 0.0;  ///< change relative to the larger value; infinite where one of the two is no number
};

struct StudyComparison {
    std::int64_t compared = 0;          ///< runs in both sets
    std::vector<std::string> missing;   ///< runs only in `before`
    std::vector<std::string> extra;     ///< runs only in `after`
    std::vector<std::string> stale;     ///< runs whose scene, ticks or seed differ: not comparable
    std::vector<FigureChange> changes;  ///< largest first
    [[nodiscard]] bool same() const {
        return missing.empty() && extra.empty() && stale.empty() && changes.empty() && compared > 0;
    }
};

/// Compares first processes only. A figure counts as changed beyond the relative `tolerance`, a pair count at any
/// difference in a tick.
StudyComparison compare_studies(const std::vector<Record>& before, const std::vector<Record>& after, double tolerance);

}  // namespace trocar
