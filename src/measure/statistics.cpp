#include "measure/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace trocar {
namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

/// splitmix64 (Steele, Lea and Flood 2014): standard distributions differ between libraries, this does not.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    /// 0 … count-1; the bias of the remainder is below 2^-40 for any count of ours.
    std::size_t below(std::size_t count) {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
        return static_cast<std::size_t>((z ^ (z >> 31U)) % count);
    }

private:
    std::uint64_t state_;
};

/// The middle 95 % of the resampled statistics (percentile bootstrap, Efron and Tibshirani 1993, ch. 13).
Bounds middle(const std::vector<double>& statistics) {
    return {.low = quantile(statistics, 0.025), .high = quantile(statistics, 0.975)};
}

/// Which process and which tick each entry of a resample is taken from.
struct Choice {
    std::size_t process = 0;
    std::size_t tick = 0;
};

void choose(const std::vector<std::size_t>& ticks_of_process, std::size_t block, Random& random,
            std::vector<Choice>& choices) {
    choices.clear();
    for (std::size_t i = 0; i < ticks_of_process.size(); ++i) {
        const std::size_t process = random.below(ticks_of_process.size());
        const std::size_t count = ticks_of_process[process];
        for (std::size_t filled = 0; filled < count;) {
            const std::size_t start = random.below(count);
            for (std::size_t k = 0; k < block && filled < count; ++k, ++filled) {
                choices.push_back({process, (start + k) % count});
            }
        }
    }
}

std::vector<std::size_t> sizes_of(const std::vector<std::vector<double>>& processes) {
    std::vector<std::size_t> sizes;
    sizes.reserve(processes.size());
    for (const std::vector<double>& ticks : processes) sizes.push_back(ticks.size());
    return sizes;
}

std::vector<double> pick(const std::vector<std::vector<double>>& processes, const std::vector<Choice>& choices) {
    std::vector<double> values;
    values.reserve(choices.size());
    for (const Choice& choice : choices) values.push_back(processes[choice.process][choice.tick]);
    return values;
}

}  // namespace

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double quantile(std::vector<double> values, double q) {
    std::erase_if(values, [](double value) { return std::isnan(value); });
    if (values.empty()) return not_known;
    std::sort(values.begin(), values.end());
    const double place = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    if (below + 1 >= values.size()) return values.back();
    const double part = place - static_cast<double>(below);
    if (part == 0.0) return values[below];
    return values[below] + part * (values[below + 1] - values[below]);
}

std::int64_t smallest_count(double q) {
    if (q <= 0.9) return 1;
    return q <= 0.99 ? 1000 : 100000;
}

std::optional<double> tail_quantile(const std::vector<double>& values, double q) {
    const auto known = std::count_if(values.begin(), values.end(), [](double value) { return !std::isnan(value); });
    if (known < smallest_count(q)) return std::nullopt;
    return quantile(values, q);
}

double geometric_mean(const std::vector<double>& values) {
    double sum = 0.0;
    std::size_t count = 0;
    for (const double value : values) {
        if (std::isnan(value)) continue;
        if (!(value > 0.0)) return not_known;
        sum += std::log(value);
        ++count;
    }
    return count == 0 ? not_known : std::exp(sum / static_cast<double>(count));
}

Bounds range_of(const std::vector<double>& values) { return {quantile(values, 0.0), quantile(values, 1.0)}; }

Bounds bootstrap(const std::vector<double>& values, const Statistic& statistic, std::uint64_t seed, int resamples) {
    std::vector<double> known = values;
    std::erase_if(known, [](double value) { return std::isnan(value); });
    if (known.empty()) return {};
    Random random(seed);
    std::vector<double> statistics;
    std::vector<double> sample(known.size());
    for (int i = 0; i < resamples; ++i) {
        for (double& value : sample) value = known[random.below(known.size())];
        statistics.push_back(statistic(sample));
    }
    return middle(statistics);
}

Bounds bootstrap_processes(const std::vector<std::vector<double>>& processes, const Statistic& statistic,
                           std::int64_t block, std::uint64_t seed, int resamples) {
    const std::vector<std::size_t> sizes = sizes_of(processes);
    if (sizes.empty()) return {};
    Random random(seed);
    std::vector<double> statistics;
    std::vector<Choice> choices;
    for (int i = 0; i < resamples; ++i) {
        choose(sizes, static_cast<std::size_t>(std::max<std::int64_t>(1, block)), random, choices);
        statistics.push_back(statistic(pick(processes, choices)));
    }
    return middle(statistics);
}

Bounds bootstrap_ratio(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b,
                       const Statistic& statistic, std::int64_t block, std::uint64_t seed, int resamples) {
    const std::vector<std::size_t> sizes = sizes_of(a);
    if (sizes != sizes_of(b)) throw std::logic_error("a ratio needs as many processes and ticks on both sides");
    if (sizes.empty()) return {};
    Random random(seed);
    std::vector<double> statistics;
    std::vector<Choice> choices;
    for (int i = 0; i < resamples; ++i) {
        choose(sizes, static_cast<std::size_t>(std::max<std::int64_t>(1, block)), random, choices);
        statistics.push_back(statistic(pick(a, choices)) / statistic(pick(b, choices)));
    }
    return middle(statistics);
}

}  // namespace trocar
