// One run in a process of its own, under a time limit, so that a method that crashes or hangs becomes a row of the
// report and not the end of the study. Also tells an interruption (Ctrl-C) from an end of the child.
#pragma once

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "contact/outcome.hpp"

namespace trocar {

struct ChildEnd {
    enum class Kind { exited, signalled, timed_out, interrupted, not_started };
    Kind kind = Kind::not_started;
    int code = 0;       ///< exit status, signal number, or errno when not started
    std::string error;  ///< last telling line that the child wrote to stderr
};

/// Keeps SIGINT, SIGTERM and SIGCHLD for run_child_process to collect, as long as it lives.
class SignalsHeld {
public:
    SignalsHeld();
    ~SignalsHeld();
    SignalsHeld(const SignalsHeld&) = delete;
    SignalsHeld& operator=(const SignalsHeld&) = delete;
    SignalsHeld(SignalsHeld&&) = delete;
    SignalsHeld& operator=(SignalsHeld&&) = delete;
    /// The mask that was in force before, and that a child gets.
    [[nodiscard]] const sigset_t& before() const { return before_; }
    /// True when an interruption has arrived meanwhile; takes it.
    static bool take_interruption();

private:
    sigset_t before_{};
};

/// Runs `command` (program and arguments) to its end, at most `time_limit_s`. stdin is empty, stdout is dropped, stderr
/// goes to `log`. The child leads a process group of its own, which is killed as a whole on time-out and interruption,
/// and dies with this process.
ChildEnd run_child_process(const std::vector<std::string>& command, const std::filesystem::path& log,
                           double time_limit_s, const SignalsHeld& signals);

/// What such an end means for the run when the child left no complete answer: timed_out or crashed, with the reason.
Outcome failure_of(const ChildEnd& end, double time_limit_s);

/// One runner per directory; the lock goes with the process, however it ends. Throws InputError when the directory
/// cannot be written or another process holds it.
class DirectoryLock {
public:
    explicit DirectoryLock(const std::filesystem::path& directory);
    ~DirectoryLock();
    DirectoryLock(const DirectoryLock&) = delete;
    DirectoryLock& operator=(const DirectoryLock&) = delete;
    DirectoryLock(DirectoryLock&&) = delete;
    DirectoryLock& operator=(DirectoryLock&&) = delete;

private:
    int descriptor_ = -1;
};

}  // namespace trocar
