// What the contracts of responses share: every registered response, with each of its profiles, on every contact
// generator that it takes; and shipped scenes that are over in few ticks.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "method/registry.hpp"
#include "scene/scene.hpp"

namespace trocar::test {

struct ResponseMethod {
    std::string method;  ///< as on a command line
    std::string source;
    /// "unilateral_tracked_proximity", "thesis_profile_corrected_intersection": names of tests.
    [[nodiscard]] std::string name() const;
};
inline void PrintTo(const ResponseMethod& who, std::ostream* stream) { *stream << who.name(); }

/// Without the controls, and without native contacts where this build has no detector that reports any.
std::vector<ResponseMethod> response_methods();

/// A detector that can answer what the generator wants; empty where this build has none.
std::string detector_for(const ContactGeneratorEntry& source);

/// A shipped scene whose scripts run `faster` times as fast.
Scene quick_scene(const std::string& name, double faster);

/// What to expect of a check: nothing failed, or, where the gap is known, that something still does.
void expect_kept(const ResponseMethod& who, const std::string& check, const std::string& failures);

}  // namespace trocar::test
