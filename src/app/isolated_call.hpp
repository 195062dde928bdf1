// Runs a piece of work in a copy of this process, so that a library that crashes, hangs or prints cannot take the
// command with it: it becomes a row with an outcome.
#pragma once

#include <functional>
#include <string>

namespace trocar::app {

struct IsolatedResult {
    enum class Kind { complete, crashed, timed_out };
    Kind kind = Kind::crashed;
    std::string bytes;    ///< what the work returned, when complete
    std::string message;  ///< one sentence, otherwise
};

/// Calls `work` in a forked child, at most `time_limit_s` seconds; what the child prints goes to stderr. The caller
/// must be single-threaded, as forked children are. Throws std::runtime_error when no child can be made.
IsolatedResult call_isolated(const std::function<std::string()>& work, double time_limit_s);

}  // namespace trocar::app
