// Two sets of records of the same study held against each other, run by run and figure by figure, so that a change of
// a method is seen before it is shipped. Figures of the clock take no part: they differ from day to day.
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
    double size = 0.0;  ///< relative change of the larger value; infinite where one of the two is no number
};

struct StudyComparison {
    std::int64_t compared = 0;          ///< runs that both have
    std::vector<std::string> missing;   ///< runs that only `before` has
    std::vector<std::string> extra;     ///< runs that only `after` has: nothing guards them
    std::vector<std::string> stale;     ///< runs of another scene than before, or other ticks or seed: not comparable
    std::vector<FigureChange> changes;  ///< largest first
    [[nodiscard]] bool same() const {
        return missing.empty() && extra.empty() && stale.empty() && changes.empty() && compared > 0;
    }
};

/// First processes only. A figure is changed beyond the relative `tolerance`; a pair count as soon as one tick differs.
StudyComparison compare_studies(const std::vector<Record>& before, const std::vector<Record>& after, double tolerance);

}  // namespace trocar
