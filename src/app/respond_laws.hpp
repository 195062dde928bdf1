// The law behind each family of response cases (DESIGN §10, `respond`): chosen by the family of the id and the keys of
// `input`. Forces and velocities come from respond/equations, everything that moves from the tissue integrator itself.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace trocar::app {

/// How an expected value is to be held against ours.
enum class Rule {
    equal,        ///< max(abs(got - want)) <= abs + rel * max(abs(want))
    lower_bound,  ///< ours must not be less
    upper_bound,  ///< ours must not be more
    band,         ///< ours is [lowest, highest] and must lie inside the expected pair
    information   ///< not judged
};

// clang-tidy takes the assertions in nlohmann's move constructor for exceptions.
// NOLINTNEXTLINE(bugprone-exception-escape)
struct LawAnswer {
    nlohmann::ordered_json values;      ///< every quantity the law gives for this input
    std::map<std::string, Rule> rules;  ///< where not `equal`
    std::string message;                ///< a remark for the reader; empty when there is nothing to say
    bool sound = true;                  ///< false: a check of the law against the running integrator failed
};

/// True when `family` is one of DESIGN §10's.
bool known_family(const std::string& family);

/// Answers one case. `input` is read strictly: throws InputError with `file` and a JSON pointer below `pointer` for a
/// missing key, a wrong type or shape, or an impossible value. `expected` (may be null) only reports at which step
/// sizes an oscillator is to be sampled.
LawAnswer answer_case(const std::string& family, const nlohmann::ordered_json& input,
                      const nlohmann::ordered_json& expected, const std::string& file, const std::string& pointer);

}  // namespace trocar::app
