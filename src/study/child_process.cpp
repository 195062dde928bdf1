#include "study/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <fstream>
#include <utility>

#include "geometry/input_error.hpp"

namespace trocar {
namespace {

sigset_t held_signals() {
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) sigaddset(&set, signal);
    return set;
}

/// The caller's environment; the sanitizers must abort, since an exit status would pass for an ordinary end.
std::vector<std::string> child_environment() {
    std::vector<std::string> variables;
    std::string sanitizer = "ASAN_OPTIONS=";
    for (char** entry = environ; *entry != nullptr; ++entry) {
        const std::string variable = *entry;
        if (variable.rfind(sanitizer.substr(0, 13), 0) == 0) {
            sanitizer = variable + ":";
        } else {
            variables.push_back(variable);
        }
    }
    variables.push_back(sanitizer + "abort_on_error=1");
    return variables;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> list;
    list.reserve(texts.size() + 1);
    for (std::string& text : texts) list.push_back(text.data());
    list.push_back(nullptr);
    return list;
}

/// The line a person would quote: the sanitizer's headline or the uncaught exception, else the last line.
std::string reporting_line(const std::filesystem::path& log) {
    std::ifstream stream(log);
    std::string line;
    std::string last;
    while (std::getline(stream, line)) {
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        last = line;
        if (line.find("ERROR: ") != std::string::npos || line.find("runtime error: ") != std::string::npos ||
            line.find("what(): ") != std::string::npos) {
            break;
        }
    }
    constexpr std::size_t longest = 200;
    return last.substr(0, longest);
}

/// Only what is safe between fork and exec.
[[noreturn]] void become_child(char* const* arguments, char* const* environment, int log, pid_t parent,
                               const sigset_t& mask) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    const int nothing = open("/dev/null", O_RDWR);
    dup2(nothing, STDIN_FILENO);
    dup2(nothing, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    pthread_sigmask(SIG_SETMASK, &mask, nullptr);
    execvpe(arguments[0], arguments, environment);
    _exit(127);
}

}  // namespace

SignalsHeld::SignalsHeld() {
    // An inherited "ignore" of SIGCHLD would make the kernel drop the child's end.
    std::signal(SIGCHLD, SIG_DFL);
    const sigset_t held = held_signals();
    pthread_sigmask(SIG_BLOCK, &held, &before_);
}

SignalsHeld::~SignalsHeld() {
    while (taken_ && take_interruption()) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

bool SignalsHeld::take_interruption() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    const timespec at_once{0, 0};
    const bool pending = sigtimedwait(&set, nullptr, &at_once) > 0;
    taken_ = taken_ || pending;
    return pending;
}

bool SignalsHeld::wait(double seconds) {
    const sigset_t held = held_signals();
    const double whole = std::floor(std::max(seconds, 0.0));
    const timespec time{static_cast<time_t>(whole), static_cast<long>(1e9 * (std::max(seconds, 0.0) - whole))};
    const int signal = sigtimedwait(&held, nullptr, &time);
    return signal == SIGINT || signal == SIGTERM;
}

ChildProcess::ChildProcess(const std::vector<std::string>& command, std::filesystem::path log, double time_limit_s,
                           const SignalsHeld& signals)
    : log_(std::move(log)), time_limit_s_(time_limit_s) {
    std::vector<std::string> arguments = command;
    std::vector<std::string> environment = child_environment();
    const std::vector<char*> argument_list = pointers(arguments);
    const std::vector<char*> environment_list = pointers(environment);
    const int log_file = open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (log_file < 0) {
        start_fault_ = ": no log file " + log_.string();
        return;
    }
    const pid_t parent = getpid();
    child_ = fork();
    if (child_ == 0) become_child(argument_list.data(), environment_list.data(), log_file, parent, signals.before());
    close(log_file);
    if (child_ < 0) return;
    setpgid(child_, child_);
    deadline_ = Clock::now() +
                std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::min(time_limit_s, 1e8)));
}

ChildProcess::~ChildProcess() {
    if (child_ < 0) return;
    kill_group();
    waitpid(child_, nullptr, 0);
}

void ChildProcess::kill_group() const { kill(-child_, SIGKILL); }

double ChildProcess::seconds_left() const {
    if (child_ < 0) return 0.0;
    return std::max(0.0, std::chrono::duration<double>(deadline_ - Clock::now()).count());
}

std::optional<ChildEnd> ChildProcess::end() {
    if (child_ < 0) {
        return ChildEnd{.failure = {OutcomeKind::crashed, "the process could not be started" + start_fault_}};
    }
    int status = 0;
    const bool is_over = waitpid(child_, &status, WNOHANG) == child_;
    if (!is_over && Clock::now() < deadline_) return std::nullopt;
    kill_group();  // the child, or whatever it left running
    if (!is_over) waitpid(child_, &status, 0);
    child_ = -1;
    if (!is_over) {
        return ChildEnd{
            .failure = {OutcomeKind::timed_out, fmt::format("ended after the limit of {} s", time_limit_s_)}};
    }
    const std::string words = reporting_line(log_);
    const std::string detail = words.empty() ? std::string() : ": " + words;
    if (!WIFSIGNALED(status)) {
        return ChildEnd{.exited = true,
                        .failure = {OutcomeKind::crashed, fmt::format("exit status {} without a complete record{}",
                                                                      WEXITSTATUS(status), detail)}};
    }
    const char* const name = strsignal(WTERMSIG(status));
    return ChildEnd{.failure = {OutcomeKind::crashed, fmt::format("signal {} ({}){}", WTERMSIG(status),
                                                                  name == nullptr ? "unknown" : name, detail)}};
}

DirectoryLock::DirectoryLock(const std::filesystem::path& directory) {
    const std::filesystem::path file = directory / "lock";
    descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor_ < 0) throw InputError(file.string(), "", "a writable folder", std::strerror(errno));
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
        close(descriptor_);
        throw InputError(directory.string(), "", "a folder that nothing else is running in", "one that is in use");
    }
}

DirectoryLock::~DirectoryLock() { close(descriptor_); }

}  // namespace trocar
