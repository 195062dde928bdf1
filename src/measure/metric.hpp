// The list of metrics, measure/metrics.def, as an enumeration with name, unit, direction, source and meaning. A metric
// that is computed, stored or printed is an enumerator, so that a wrong name does not compile.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trocar {

enum class Metric : std::uint16_t {
#define TROCAR_METRIC(name, unit, better, source, meaning) name,
#include "measure/metrics.def"
#undef TROCAR_METRIC
};

inline constexpr std::size_t metric_count =
    std::initializer_list<int>{
#define TROCAR_METRIC(name, unit, better, source, meaning) 0,
#include "measure/metrics.def"
#undef TROCAR_METRIC
    }
        .size();

enum class Better : std::uint8_t { lower, higher, neither };
std::string_view name_of(Better better);

/// Where the values of a metric come from.
enum class MetricSource : std::uint8_t {
    clock,
    paced_loop,  ///< the clock too
    counters,
    machine,      ///< its memory
    scene,        ///< scene and stepper
    pair_truth,   ///< exact oracle
    space_time,   ///< oracle of contacts between frames
    depth_truth,  ///< on the frame that the detector saw
    geometry,     ///< truth on the frame after the tick: equal for equal motion
    passage,      ///< path of bodies between the frames
    tool_force,   ///< force shown on the first driven instrument
    audit,        ///< of energy and momentum, from trajectories, masses and forces
    method,       ///< reported by the response or the tissue
    reference,    ///< stored reference
    repetition    ///< the run made twice
};
/// In words, as outputs print it.
std::string_view text_of(MetricSource source);
/// True when the machine's clock or memory is in the values.
bool is_timed(MetricSource source);

struct MetricInfo {
    Metric metric;
    std::string_view name;  ///< key of Record::summary in files
    std::string_view unit;  ///< SI or "ns", "1" for a pure number
    Better better;
    MetricSource source;
    std::string_view meaning;
};

/// All metrics, in printing order.
std::span<const MetricInfo> metrics();
const MetricInfo& info_of(Metric metric);
/// The metric with that key; none for an unknown one.
std::optional<Metric> metric_named(std::string_view name);

/// The same for a name that is put together. Throws std::logic_error for an unknown one.
Metric metric_of(std::string_view name);

/// Column header with the unit: "residual_penetration_max_m [m]"; a pure number has none.
std::string header_of(const MetricInfo& info);

/// Values of a run. A metric that does not apply to it is NaN, or absent.
using Summary = std::map<Metric, double>;
/// NaN where the summary has no such metric.
double value_of(const Summary& summary, Metric metric);

}  // namespace trocar
