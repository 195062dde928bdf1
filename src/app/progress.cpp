#include "app/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <utility>

namespace trocar::app {
namespace {

std::string duration_text(double seconds) {
    const std::int64_t whole = std::llround(seconds);
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
    return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
}

}  // namespace

Progress::Progress(std::string unit, std::int64_t total)
    : unit_(std::move(unit)), total_(total), terminal_(isatty(STDERR_FILENO) == 1), reported_(start_) {}

Progress::~Progress() { end(); }

void Progress::show(std::int64_t done, const std::string& what) {
    if (found_ < 0) found_ = done;
    const Clock::time_point now = Clock::now();
    const auto between = terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(60'000);
    if (now - reported_ < between) return;
    reported_ = now;
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    std::string line = fmt::format("{} {} of {}, {}", unit_, done, total_, duration_text(elapsed));
    if (done > found_) {
        const double left = elapsed * static_cast<double>(total_ - done) / static_cast<double>(done - found_);
        line += fmt::format(", about {} left", duration_text(left));
    }
    if (!what.empty()) line += "  " + what;
    if (terminal_) {
        fmt::print(stderr, "\r{:.110}\033[K", line);
        std::fflush(stderr);
    } else {
        fmt::print(stderr, "trocar: {}\n", line);
    }
}

void Progress::end() {
    if (terminal_ && reported_ != start_) fmt::print(stderr, "\r\033[K");
}

}  // namespace trocar::app
