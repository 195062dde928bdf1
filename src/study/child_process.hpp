// One run in a process of its own, under a time limit, so that a method that crashes or hangs becomes a row of the
// report and not the end of the study.
#pragma once

#include <chrono>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "contact/outcome.hpp"

namespace trocar {

struct ChildEnd {
    enum class Kind { exited, signalled, timed_out, not_started };
    Kind kind = Kind::not_started;
    int code = 0;       ///< exit status, signal number, or errno when not started
    std::string error;  ///< last reporting line that the child wrote to stderr
};

/// Keeps SIGINT, SIGTERM and SIGCHLD for its own calls to collect, as long as it lives.
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
    /// Sleeps until a child may have ended, or for `seconds`. True for an interruption.
    static bool wait(double seconds);

private:
    sigset_t before_{};
};

/// `command` (program and arguments), started at once. stdin is empty, stdout is dropped, stderr goes to `log`. The
/// child leads a process group of its own, which is killed as a whole when the time is up, on interruption, and with
/// this object; it dies with this process.
class ChildProcess {
public:
    ChildProcess(const std::vector<std::string>& command, std::filesystem::path log, double time_limit_s,
                 const SignalsHeld& signals);
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;
    ChildProcess(ChildProcess&&) = delete;
    ChildProcess& operator=(ChildProcess&&) = delete;

    /// How it has ended, once it has; a child beyond its time is ended here.
    std::optional<ChildEnd> end();
    /// Until its time is up; 0: it is.
    [[nodiscard]] double seconds_left() const;

private:
    using Clock = std::chrono::steady_clock;
    void kill_group() const;
    pid_t child_ = -1;
    int start_error_ = 0;
    std::string start_fault_;
    std::filesystem::path log_;
    Clock::time_point deadline_;
};

/// Waits for one child alone. Nothing when interrupted: the child then still runs, until its object goes.
std::optional<ChildEnd> wait_for(ChildProcess& child);

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
