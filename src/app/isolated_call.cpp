#include "app/isolated_call.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace trocar::app {
namespace {

using Clock = std::chrono::steady_clock;

bool write_all(int file, const char* bytes, std::size_t size) {
    while (size > 0) {
        const ssize_t written = write(file, bytes, size);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        bytes += written;
        size -= static_cast<std::size_t>(written);
    }
    return true;
}

/// The answer goes first by its length, so that a child that dies while writing is known to be incomplete.
[[noreturn]] void be_child(const std::function<std::string()>& work, int answer, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    dup2(STDERR_FILENO, STDOUT_FILENO);
    bool written = false;
    try {
        const std::string bytes = work();
        const std::uint64_t size = bytes.size();
        std::array<char, sizeof size> head{};
        std::memcpy(head.data(), &size, sizeof size);
        written = write_all(answer, head.data(), head.size()) && write_all(answer, bytes.data(), bytes.size());
    } catch (...) {
        written = false;
    }
    std::fflush(nullptr);
    _exit(written ? 0 : 1);
}

/// Reads to the end of the pipe; false when the deadline comes first.
bool read_until(int answer, Clock::time_point deadline, std::string& bytes) {
    std::array<char, 1 << 16> block{};
    for (;;) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
        if (left <= 0) return false;
        pollfd ready{answer, POLLIN, 0};
        const int events = poll(&ready, 1, static_cast<int>(std::min<std::int64_t>(left, 1'000'000)));
        if (events <= 0) continue;
        const ssize_t got = read(answer, block.data(), block.size());
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return true;
        bytes.append(block.data(), static_cast<std::size_t>(got));
    }
}

}  // namespace

IsolatedResult call_isolated(const std::function<std::string()>& work, double time_limit_s) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) throw std::runtime_error(fmt::format("pipe: {}", std::strerror(errno)));
    std::fflush(nullptr);
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0) {
        close(ends[0]);
        close(ends[1]);
        throw std::runtime_error(fmt::format("fork: {}", std::strerror(errno)));
    }
    if (child == 0) {
        close(ends[0]);
        be_child(work, ends[1], parent);
    }
    close(ends[1]);
    constexpr double longest_s = 1e8;
    const auto limit = std::chrono::duration<double>(std::min(time_limit_s, longest_s));
    std::string bytes;
    const bool in_time = read_until(ends[0], Clock::now() + std::chrono::duration_cast<Clock::duration>(limit), bytes);
    close(ends[0]);
    if (!in_time) kill(child, SIGKILL);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (!in_time) return {.outcome = {OutcomeKind::timed_out, fmt::format("no answer within {:g} s", time_limit_s)}};
    std::uint64_t size = 0;
    const bool has_size = bytes.size() >= sizeof size;
    if (has_size) std::memcpy(&size, bytes.data(), sizeof size);
    if (has_size && bytes.size() - sizeof size == size) return {.outcome = {}, .bytes = bytes.substr(sizeof size)};
    const std::string end = WIFSIGNALED(status)
                                ? fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                                : fmt::format("exit status {} without an answer", WEXITSTATUS(status));
    return {.outcome = {OutcomeKind::crashed, end}};
}

}  // namespace trocar::app
