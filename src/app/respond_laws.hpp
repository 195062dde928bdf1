// Laws of the response cases (DESIGN §10, `respond`), selected by the family of the id and the keys of `input`. Forces
// and velocities come from respond/equations, motions from the tissue integrator.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace trocar::app {

/// Comparison of an expected value with the computed one.
enum class Rule {
    equal,        ///< max(abs(got - want)) <= abs + rel * max(abs(want))
    lower_bound,  ///< computed value must not be less
    upper_bound,  ///< computed value must not be more
    band,         ///< computed [lowest, highest] must lie inside the expected pair
    information   ///< not judged
};

// clang-tidy takes the assertions in nlohmann's move constructor for exceptions.
// NOLINTNEXTLINE(bugprone-exception-escape)
struct LawAnswer {
    nlohmann::ordered_json values;      ///< all quantities computed for this input
    std::map<std::string, Rule> rules;  ///< rules other than `equal`
    std::string message;                ///< remark for the user; may be empty
    bool sound = true;                  ///< false: the law disagrees with the integrator
};

/// True for a family of DESIGN §10.
bool known_family(const std::string& family);

/// Computes one case. Throws InputError with `file` and a JSON pointer below `pointer` for a missing key, wrong type or
/// shape, or value out of range. `expected` (may be null) only selects the step sizes at which an oscillator is
/// sampled.
LawAnswer answer_case(const std::string& family, const nlohmann::ordered_json& input,
                      const nlohmann::ordered_json& expected, const std::string& file, const std::string& pointer);

}  // namespace trocar::app
