// Runs a function in a forked child, so that crashes, hangs and output of a library do not affect the command.
#pragma once

#include <functional>
#include <string>

#include "contact/outcome.hpp"

namespace trocar::app {

struct IsolatedResult {
    Outcome outcome = {};    ///< ok, crashed or timed_out, with the reason
    std::string bytes = {};  ///< return value of `work`, when ok
};

/// Calls `work` in a forked child for at most `time_limit_s` seconds; its output goes to stderr. Precondition: the
/// caller is single-threaded. Throws std::runtime_error when fork fails.
IsolatedResult call_isolated(const std::function<std::string()>& work, double time_limit_s);

}  // namespace trocar::app
