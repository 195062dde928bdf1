// Executes one run in a child process under a time limit, so that a crash or hang becomes a row of the report.
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
    bool exited = false;  ///< by itself, with whatever status
    Outcome failure;      ///< of a run whose child left no complete result: timed_out or crashed, with the reason
};

/// Blocks SIGINT, SIGTERM and SIGCHLD during its lifetime; its functions collect them.
class SignalsHeld {
public:
    SignalsHeld();
    ~SignalsHeld();
    SignalsHeld(const SignalsHeld&) = delete;
    SignalsHeld& operator=(const SignalsHeld&) = delete;
    SignalsHeld(SignalsHeld&&) = delete;
    SignalsHeld& operator=(SignalsHeld&&) = delete;
    /// Signal mask before construction, which children inherit.
    [[nodiscard]] const sigset_t& before() const { return before_; }
    /// True when an interruption is pending; consumes it, and those that come before the end of this lifetime.
    bool take_interruption();
    /// Waits until a child may have ended, at most `seconds`. True for an interruption.
    static bool wait(double seconds);

private:
    sigset_t before_{};
    bool taken_ = false;
};

/// Starts `command` (program and arguments). stdin is empty, stdout is discarded, stderr goes to `log`. The child has
/// its own process group, which is killed at the time limit, on interruption, and in the destructor. The child itself
/// also dies with this process.
class ChildProcess {
public:
    ChildProcess(const std::vector<std::string>& command, std::filesystem::path log, double time_limit_s,
                 const SignalsHeld& signals);
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;
    ChildProcess(ChildProcess&&) = delete;
    ChildProcess& operator=(ChildProcess&&) = delete;

    /// Result once the child has ended; a child beyond its time limit is killed here.
    std::optional<ChildEnd> end();
    /// Time left, s; 0 at the limit.
    [[nodiscard]] double seconds_left() const;

private:
    using Clock = std::chrono::steady_clock;
    void kill_group() const;
    pid_t child_ = -1;
    std::string start_fault_;
    std::filesystem::path log_;
    double time_limit_s_;
    Clock::time_point deadline_;
};

/// Exclusive lock on a directory; the operating system releases it when the process ends. Throws InputError when the
/// directory is not writable or another process holds the lock.
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
