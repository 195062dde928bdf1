#include "simulate/paced.hpp"

#include <time.h>

#include <algorithm>
#include <limits>
#include <stop_token>
#include <thread>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

std::int64_t now_ns() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return static_cast<std::int64_t>(time.tv_sec) * second_ns + time.tv_nsec;
}

void wait_until(std::int64_t release_ns) {
    // clock_nanosleep returns about 50 µs late, so the last stretch polls the clock.
    constexpr std::int64_t spin_ns = 100'000;
    const std::int64_t wake = release_ns - spin_ns;
    if (wake > now_ns()) {
        timespec time{};
        time.tv_sec = static_cast<time_t>(wake / second_ns);
        time.tv_nsec = static_cast<long>(wake % second_ns);
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) != 0) {
        }
    }
    while (now_ns() < release_ns) {
    }
}

}  // namespace

PacedTimes run_paced(std::int64_t ticks, std::int64_t period_ns, const std::function<bool()>& work) {
    PacedTimes times;
    times.latency_ns.reserve(static_cast<std::size_t>(ticks));
    const std::int64_t start = now_ns() + period_ns;
    for (std::int64_t tick = 0; tick < ticks; ++tick) {
        const std::int64_t release = start + tick * period_ns;
        wait_until(release);
        const bool go_on = work();
        times.latency_ns.push_back(static_cast<double>(now_ns() - release));
        if (!go_on) break;
    }
    return times;
}

PacedBeside run_beside_empty(std::int64_t ticks, std::int64_t period_ns, const std::function<bool()>& work) {
    PacedBeside beside;
    std::jthread other([&](const std::stop_token& stop) {
        beside.empty = run_paced(ticks, period_ns, [&stop] { return !stop.stop_requested(); });
    });
    beside.work = run_paced(ticks, period_ns, work);
    if (static_cast<std::int64_t>(beside.work.latency_ns.size()) < ticks) other.request_stop();
    other.join();
    return beside;
}

PacedLatency latency_of(const PacedTimes& times, std::int64_t period_ns) {
    std::vector<double> latency;
    double misses = 0.0;
    double burst = 0.0;
    double longest = 0.0;
    for (std::size_t i = static_cast<std::size_t>(warm_up_ticks); i < times.latency_ns.size(); ++i) {
        latency.push_back(times.latency_ns[i]);
        const bool miss = times.latency_ns[i] > static_cast<double>(period_ns);
        burst = miss ? burst + 1.0 : 0.0;
        misses += miss ? 1.0 : 0.0;
        longest = std::max(longest, burst);
    }
    return {.median_ns = median(latency),
            .p99_ns = tail_quantile(latency, 0.99).value_or(not_known),
            .p999_ns = tail_quantile(latency, 0.999).value_or(not_known),
            .max_ns = quantile(latency, 1.0),
            .misses = latency.empty() ? not_known : misses,
            .burst = latency.empty() ? not_known : longest};
}

}  // namespace trocar
