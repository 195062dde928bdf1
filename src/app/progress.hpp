// How far long work is, on stderr: one line that is written over on a terminal, a line a minute anywhere else.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace trocar::app {

class Progress {
public:
    /// `unit`: what is counted, in the singular. `total`: how many there are; 0: nobody knows.
    Progress(std::string unit, std::int64_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    Progress(Progress&&) = delete;
    Progress& operator=(Progress&&) = delete;

    /// `done` of the total are finished; `what` is being done. Cheap enough for every tick: a terminal is written to
    /// ten times a second at most. The time left assumes that what is left takes as long as what was done since the
    /// first call, so that work found from an earlier start does not count.
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
