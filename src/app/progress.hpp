// Progress on stderr: one overwritten line on a terminal, else one line per minute.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace trocar::app {

class Progress {
public:
    /// `unit`: counted item, singular. `total`: number of items.
    Progress(std::string unit, std::int64_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    Progress(Progress&&) = delete;
    Progress& operator=(Progress&&) = delete;

    /// Reports `done` finished items; `what` is in progress. A terminal is written at most ten times a second. The
    /// remaining time is extrapolated from the items since the first call, so resumed work does not count.
    void show(std::int64_t done, const std::string& what = {});
    /// Clears the terminal's line.
    void end();

private:
    using Clock = std::chrono::steady_clock;
    std::string unit_;
    std::int64_t total_;
    bool terminal_;
    Clock::time_point start_ = Clock::now();
    Clock::time_point reported_;
    std::int64_t found_ = -1;  ///< done at the first call
};

}  // namespace trocar::app
