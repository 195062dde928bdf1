#include "measure/metric.hpp"

#include <array>
#include <limits>
#include <stdexcept>

namespace trocar {
namespace {

constexpr std::array<MetricInfo, metric_count> list{{
#define TROCAR_METRIC(name, unit, better, source, meaning) \
    {Metric::name, #name, unit, Better::better, MetricSource::source, meaning},
#include "measure/metrics.def"
#undef TROCAR_METRIC
}};

}  // namespace

std::string_view name_of(Better better) {
    switch (better) {
        case Better::lower:
            return "lower";
        case Better::higher:
            return "higher";
        case Better::neither:
            break;
    }
    return "neither";
}

std::string_view text_of(MetricSource source) {
    switch (source) {
        case MetricSource::clock:
            return "clock";
        case MetricSource::paced_loop:
            return "paced loop";
        case MetricSource::counters:
            return "counters";
        case MetricSource::machine:
            return "memory of the process";
        case MetricSource::scene:
            return "scene and stepper";
        case MetricSource::pair_truth:
            return "pair truth";
        case MetricSource::space_time:
            return "space-time oracle";
        case MetricSource::depth_truth:
            return "depth truth, frame that detect saw";
        case MetricSource::geometry:
            return "geometry, frame after the tick";
        case MetricSource::passage:
            return "geometry, path between the frames after the ticks";
        case MetricSource::tool_force:
            return "force shown on the first driven instrument";
        case MetricSource::audit:
            return "trajectories, masses and forces shown";
        case MetricSource::method:
            return "reported by the response or the tissue";
        case MetricSource::reference:
            return "stored reference";
        case MetricSource::repetition:
            break;
    }
    return "the run made twice";
}

bool is_timed(MetricSource source) {
    return source == MetricSource::clock || source == MetricSource::paced_loop || source == MetricSource::machine;
}

std::span<const MetricInfo> metrics() { return list; }

const MetricInfo& info_of(Metric metric) { return list.at(static_cast<std::size_t>(metric)); }

std::optional<Metric> metric_named(std::string_view name) {
    for (const MetricInfo& info : list) {
        if (info.name == name) return info.metric;
    }
    return std::nullopt;
}

Metric metric_of(std::string_view name) {
    if (const auto metric = metric_named(name)) return *metric;
    throw std::logic_error("no metric is named " + std::string(name));
}

std::string header_of(const MetricInfo& info) {
    const std::string name(info.name);
    return info.unit == "1" ? name : name + " [" + std::string(info.unit) + "]";
}

double value_of(const Summary& summary, Metric metric) {
    const auto found = summary.find(metric);
    return found == summary.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
}

}  // namespace trocar
