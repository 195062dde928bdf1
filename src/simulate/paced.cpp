#include "simulate/paced.hpp"

#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <fstream>
#include <istream>
#include <numeric>
#include <sstream>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

std::int64_t read_clock(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return static_cast<std::int64_t>(time.tv_sec) * second_ns + time.tv_nsec;
}

std::int64_t wall_ns() { return read_clock(CLOCK_MONOTONIC); }

void wait_for_release(std::int64_t release_ns) {
    // clock_nanosleep returns about 50 µs late, so the last stretch polls the clock.
    constexpr std::int64_t spin_ns = 100'000;
    const std::int64_t wake = release_ns - spin_ns;
    if (wake > wall_ns()) {
        timespec time{};
        time.tv_sec = static_cast<time_t>(wake / second_ns);
        time.tv_nsec = static_cast<long>(wake % second_ns);
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) != 0) {
        }
    }
    while (wall_ns() < release_ns) {
    }
}

std::int64_t involuntary_switches() {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nivcsw;
}

std::optional<MachineTime> machine_time() {
    std::ifstream stat("/proc/stat");
    return read_machine_time(stat);
}

}  // namespace

PacedClock machine_clock() {
    return {.now_ns = wall_ns,
            .wait_until = wait_for_release,
            .cpu_ns = [] { return read_clock(CLOCK_THREAD_CPUTIME_ID); },
            .switches = involuntary_switches};
}

bool run_paced(std::int64_t periods, std::int64_t period_ns, const PacedClock& clock, const std::function<bool()>& work,
               PacedBlock& block) {
    block.periods = periods;
    block.ticks.clear();
    block.ticks.reserve(static_cast<std::size_t>(periods));
    const std::int64_t start = clock.now_ns() + period_ns;
    std::int64_t switches_before = clock.switches();
    for (std::int64_t release = 0; release < periods;) {
        const std::int64_t due = start + release * period_ns;
        clock.wait_until(due);
        const std::int64_t cpu_start = clock.cpu_ns();
        const bool go_on = work();
        const std::int64_t cpu_end = clock.cpu_ns();
        const std::int64_t latency = clock.now_ns() - due;
        const std::int64_t switches = clock.switches();
        block.ticks.push_back({.release = release,
                               .latency_ns = static_cast<double>(latency),
                               .cpu_ns = static_cast<double>(cpu_end - cpu_start),
                               .switches = switches - switches_before});
        switches_before = switches;
        if (!go_on) {
            block.periods = release + 1;
            return false;
        }
        // A tick that ends with its period is in time for the next release.
        release += std::max<std::int64_t>(1, (latency + period_ns - 1) / period_ns);
    }
    return true;
}

std::optional<MachineTime> read_machine_time(std::istream& stat) {
    // cpu user nice system idle iowait irq softirq steal guest guest_nice; user and nice hold the guests.
    std::string line;
    std::getline(stat, line);
    std::istringstream words(line);
    std::string name;
    words >> name;
    std::vector<double> times;
    constexpr std::size_t wanted = 8;
    times.reserve(wanted);
    for (double time = 0.0; times.size() < wanted && words >> time;) times.push_back(time);
    if (name != "cpu" || times.size() < wanted) return std::nullopt;
    return MachineTime{.steal = times.back(), .all = std::accumulate(times.begin(), times.end(), 0.0)};
}

PacedRun run_in_turns(std::int64_t periods, std::int64_t period_ns, const PacedClock& clock,
                      const std::function<bool()>& work) {
    PacedRun run;
    const std::optional<MachineTime> before = machine_time();
    for (std::int64_t block = 0; block < paced_blocks; ++block) {
        const std::int64_t length = periods * (block + 1) / paced_blocks - periods * block / paced_blocks;
        if (!run_paced(length, period_ns, clock, work, run.work.emplace_back())) break;
        run_paced(
            length, period_ns, clock, [] { return true; }, run.empty.emplace_back());
    }
    const std::optional<MachineTime> after = machine_time();
    if (before && after && after->all > before->all) {
        run.steal = (after->steal - before->steal) / (after->all - before->all);
    }
    return run;
}

PacedFigures figures_of(std::span<const PacedBlock> blocks, std::int64_t period_ns) {
    std::vector<double> latency;
    std::vector<double> cpu;
    std::vector<double> age;
    double overruns = 0.0;
    double switches = 0.0;
    double periods = 0.0;
    for (const PacedBlock& block : blocks) {
        periods += static_cast<double>(std::max<std::int64_t>(0, block.periods - paced_warm_up_periods));
        for (std::size_t i = 0; i < block.ticks.size(); ++i) {
            const PacedTick& tick = block.ticks[i];
            if (tick.release < paced_warm_up_periods) continue;
            latency.push_back(tick.latency_ns);
            cpu.push_back(tick.cpu_ns);
            overruns += tick.latency_ns > static_cast<double>(period_ns) ? 1.0 : 0.0;
            switches += static_cast<double>(tick.switches);
            if (i == 0) continue;
            const std::int64_t gap = tick.release - block.ticks[i - 1].release;
            age.insert(age.end(), static_cast<std::size_t>(gap),
                       static_cast<double>(gap * period_ns) + tick.latency_ns);
        }
    }
    if (latency.empty()) return {};
    return {.ticks = static_cast<double>(latency.size()),
            .overruns = overruns,
            .skipped = periods - static_cast<double>(latency.size()),
            .latency_median_ns = median(latency),
            .latency_p99_ns = quantile_with_ten_above(latency, 0.99),
            .latency_p999_ns = quantile_with_ten_above(latency, 0.999),
            .latency_max_ns = quantile(latency, 1.0),
            .cpu_median_ns = median(cpu),
            .cpu_p999_ns = quantile_with_ten_above(cpu, 0.999),
            .switches = switches,
            .age_p99_ns = quantile_with_ten_above(age, 0.99)};
}

}  // namespace trocar
