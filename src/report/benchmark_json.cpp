#include "report/benchmark_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "measure/metrics.hpp"
#include "report/figures.hpp"

namespace trocar {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// The processes of one run.
struct Repetitions {
    std::string name;
    std::vector<const Record*> records;
};

/// Runs in their order, each with a name of its own.
std::vector<Repetitions> repetitions_of(const std::vector<const Record*>& records) {
    std::vector<Repetitions> runs;
    std::map<std::string, std::size_t> known;
    std::set<std::string> names;
    for (const Record* record : records) {
        RunSpec spec = record->spec;
        spec.repetition = 0;
        const std::string id = run_id(spec);
        const auto [place, is_new] = known.emplace(id, runs.size());
        if (is_new) {
            std::string name = fmt::format("{}/{}/{}", spec.mode, spec.scene, method_of(spec).label());
            if (!spec.overrides.empty()) name += "/" + spec.overrides;
            if (!spec.point.empty()) name += fmt::format("/{}={}", spec.knob, spec.point);
            if (!names.insert(name).second) name += "/" + id;
            runs.push_back({.name = name, .records = {}});
        }
        runs[place->second].records.push_back(record);
    }
    return runs;
}

void expect_one_machine(const std::vector<const Record*>& runs) {
    std::set<std::string> machines;
    for (const Record* record : runs) machines.insert(fact_of(*record, "machine"));
    if (machines.size() > 1) {
        throw InputError("--where", "",
                         fmt::format("machine=NAME, one of {}, where times are asked for", fmt::join(machines, ", ")),
                         "runs of several machines");
    }
}

/// ns; NaN where nobody times the run.
double time_of(const Record& record) {
    if (!is_timed(record.spec)) return not_known;
    const double paced = value_of(record.summary, Metric::paced_latency_median_ns);
    return std::isnan(paced) ? value_of(record.summary, Metric::total_median_ns) : paced;
}

OrderedJson context_of(const Record& record) {
    const auto text = [&](const char* fact) {
        const std::string& value = fact_of(record, fact);
        return value.empty() ? OrderedJson(nullptr) : OrderedJson(value);
    };
    const auto number = [&](const char* fact) {
        const std::optional<double> value = number_of_text<double>(fact_of(record, fact));
        return value ? OrderedJson(*value) : OrderedJson(nullptr);
    };
    std::string build = fact_of(record, "build_type");
    std::transform(build.begin(), build.end(), build.begin(), [](unsigned char c) { return std::tolower(c); });
    return {{"host_name", text("machine")}, {"executable", "trocar " + fact_of(record, "version")},
            {"num_cpus", number("cores")},  {"load_avg", {number("load")}},
            {"library_build_type", build},  {"cpu", text("cpu")},
            {"commit", text("commit")},     {"binary", text("binary")},
            {"study", record.spec.study}};
}

std::string text_of_json(const OrderedJson& json) {
    return json.dump(1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

}  // namespace

std::string google_benchmark_json(const std::vector<const Record*>& runs) {
    std::vector<const Record*> timed = runs;
    std::erase_if(timed, [](const Record* record) { return std::isnan(time_of(*record)); });
    if (timed.empty()) throw InputError("--where", "", "a run with a time of its ticks", "none");
    expect_one_machine(timed);
    OrderedJson benchmarks = OrderedJson::array();
    for (const Repetitions& run : repetitions_of(timed)) {
        for (const Record* record : run.records) {
            const double time = time_of(*record);
            const double cpu = value_of(record->summary, Metric::paced_cpu_median_ns);
            OrderedJson entry{{"name", run.name},
                              {"run_name", run.name},
                              {"run_type", "iteration"},
                              {"repetitions", run.records.size()},
                              {"repetition_index", record->spec.repetition},
                              {"threads", 1},
                              {"iterations", std::llround(value_of(record->summary, Metric::ticks))},
                              {"real_time", time},
                              {"cpu_time", std::isnan(cpu) ? time : cpu},
                              {"time_unit", "ns"}};
            for (const MetricInfo& info : metrics()) {
                const double value = value_of(record->summary, info.metric);
                if (info.unit == "ns" && std::isfinite(value)) entry[std::string(info.name)] = value;
            }
            benchmarks.push_back(std::move(entry));
        }
    }
    return text_of_json({{"context", context_of(*timed.front())}, {"benchmarks", std::move(benchmarks)}});
}

std::string smaller_is_better_json(const std::vector<const Record*>& runs, const std::vector<std::string>& metrics) {
    const std::vector<std::string> usual{"total_median_ns", "total_p99_ns", "residual_penetration_max_m",
                                         "false_negatives"};
    OrderedJson entries = OrderedJson::array();
    bool is_any_timed = false;
    for (const Repetitions& run : repetitions_of(runs)) {
        for (const std::string& name : metrics.empty() ? usual : metrics) {
            const std::optional<Metric> metric = metric_named(name);
            if (!metric || info_of(*metric).better != Better::lower) {
                throw InputError("--columns", "",
                                 "figures of which smaller is better (trocar schema figures), without a unit",
                                 fmt::format("'{}'", name));
            }
            const MetricInfo& info = info_of(*metric);
            if (is_timed(info.source) && !is_timed(run.records.front()->spec)) continue;
            std::vector<double> values;
            for (const Record* record : run.records) {
                const double value = value_of(record->summary, *metric);
                if (std::isfinite(value)) values.push_back(value);
            }
            if (values.empty()) continue;
            is_any_timed = is_any_timed || is_timed(info.source);
            OrderedJson entry{{"name", fmt::format("{}/{}", run.name, name)},
                              {"unit", info.unit},
                              {"value", across_processes(values).value}};
            if (values.size() > 1) {
                const auto [low, high] = std::minmax_element(values.begin(), values.end());
                entry["range"] = fmt::format("{} to {}", *low, *high);
            }
            entries.push_back(std::move(entry));
        }
    }
    if (entries.empty()) throw InputError("--where", "", "a run that has one of the figures", "none");
    if (is_any_timed) expect_one_machine(runs);
    return text_of_json(entries);
}

}  // namespace trocar
