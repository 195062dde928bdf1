// The loop that a clock releases every millisecond, in turns with an empty loop: what a deadline means on this machine.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "report/metric_table.hpp"
#include "report/proportions.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

constexpr const char* by_the_clock = "paced";

/// Metrics of one of the two loops.
struct LoopMetrics {
    Metric ticks;
    Metric overruns;
    Metric skipped;
    Metric cpu_median;
    Metric cpu_p999;
    Metric age_p99;
};
constexpr LoopMetrics of_method{.ticks = Metric::paced_ticks,
                                .overruns = Metric::paced_overruns,
                                .skipped = Metric::paced_skipped,
                                .cpu_median = Metric::paced_cpu_median_ns,
                                .cpu_p999 = Metric::paced_cpu_p999_ns,
                                .age_p99 = Metric::paced_age_p99_ns};
constexpr LoopMetrics of_empty{.ticks = Metric::empty_ticks,
                               .overruns = Metric::empty_overruns,
                               .skipped = Metric::empty_skipped,
                               .cpu_median = Metric::empty_cpu_median_ns,
                               .cpu_p999 = Metric::empty_cpu_p999_ns,
                               .age_p99 = Metric::empty_age_p99_ns};

double loop_sum(const ResultSet& results, Metric metric) {
    return value_over(Over::sum, results.values(Processes::every, metric));
}
double loop_median(const ResultSet& results, Metric metric) {
    return value_over(Over::median, results.values(Processes::every, metric));
}
double loop_worst(const ResultSet& results, Metric metric) {
    return value_over(Over::largest, results.values(Processes::every, metric));
}

std::string overruns_text(const ResultSet& results, const LoopMetrics& loop) {
    return of_text(loop_sum(results, loop.overruns), loop_sum(results, loop.ticks));
}

std::string age_text(const ResultSet& results, const LoopMetrics& loop) {
    return scaled(loop_worst(results, loop.age_p99), ms, too_few);
}

/// "12.1, at most 15.0, p 0.001": overruns against those of the empty loop of the same runs.
std::string against_empty_text(const ResultSet& results) {
    const double ticks = loop_sum(results, Metric::paced_ticks);
    const double empty_ticks = loop_sum(results, Metric::empty_ticks);
    if (!(ticks > 0.0) || !(empty_ticks > 0.0)) return unknown_text;
    const RateRatio rates =
        compare_rates(std::llround(loop_sum(results, Metric::paced_overruns)), std::llround(ticks),
                      std::llround(loop_sum(results, Metric::empty_overruns)), std::llround(empty_ticks));
    if (std::isnan(rates.ratio)) return "none in both";
    constexpr double least_p = 1e-4;
    return scaled(rates.ratio) + ", at most " + scaled(rates.upper) + ", p " +
           (rates.p < least_p ? "< 0.0001" : scaled(rates.p));
}

struct ClockedRow {
    std::string name;
    ResultSet results;
    bool own = false;
};

/// Failed ones last; the smallest share of overruns first, then the least CPU time.
std::vector<ClockedRow> clocked_rows(const Draft& draft) {
    std::vector<ClockedRow> rows;
    const std::vector<std::string> scenes = draft.results.scenes(by_the_clock);
    for (const Method& method : draft.results.methods(by_the_clock)) {
        const bool own = draft.results.fact(method, "detector.own") == "yes";
        for (const SceneResult* result : possible(draft.results, method).results) {
            const std::string where = scenes.size() > 1 ? result->scene() + ": " : std::string();
            rows.push_back({.name = where + code(method.label()), .results = {{result}}, .own = own});
        }
    }
    const auto failed = [](const ClockedRow& row) { return row.results.failed_runs() > 0; };
    const auto share = [](const ClockedRow& row) {
        return or_last(loop_sum(row.results, Metric::paced_overruns) / loop_sum(row.results, Metric::paced_ticks));
    };
    const auto cpu = [](const ClockedRow& row) {
        return or_last(loop_median(row.results, Metric::paced_cpu_median_ns));
    };
    std::stable_sort(rows.begin(), rows.end(), [&](const ClockedRow& a, const ClockedRow& b) {
        if (failed(a) != failed(b)) return failed(b);
        if (share(a) != share(b)) return share(a) < share(b);
        return cpu(a) != cpu(b) ? cpu(a) < cpu(b) : a.name < b.name;
    });
    return rows;
}

/// Appends a row of one loop. `against` and what follows it are of methods alone.
void add_loop_row(Table& table, const std::string& name, const ResultSet& results, const LoopMetrics& loop,
                  const std::string& against, const std::string& force_step, const std::string& stiffness) {
    table.rows.push_back({});
    add_cell(table, {.header = "detector + response", .wide = true}, name);
    add_number(table, "CPU per tick p50 / p99.9 (µs)", Metric::paced_cpu_median_ns,
               scaled(loop_median(results, loop.cpu_median), us) + " / " +
                   scaled(loop_worst(results, loop.cpu_p999), us, too_few));
    add_number(table, "overruns of ticks", Metric::paced_overruns, overruns_text(results, loop));
    add_number(table, "skipped periods", Metric::paced_skipped, count_text(loop_sum(results, loop.skipped)));
    add_number(table, "overruns ÷ empty loop's", {}, against);
    add_number(table, "contact model age p99 (ms)", Metric::paced_age_p99_ns, age_text(results, loop));
    add_number(table, "force step in contact p99.9 (N)", Metric::paced_force_step_p999_n, force_step);
    add_number(table, "apparent stiffness p99.9 (N/m) / damping for passivity (N s/m)",
               Metric::paced_stiffness_p999_n_per_m, stiffness);
}

/// What moves the tip.
std::string motion_text(const Draft& draft) {
    const std::string key = "dither=";
    for (const Record* record : runs_of(draft.records, by_the_clock)) {
        if (!record->spec.overrides.starts_with(key)) continue;
        const double metres = std::strtod(record->spec.overrides.c_str() + key.size(), nullptr);
        return "by its script and a dither of " + scaled(metres, 1e6) + " µm at every tick";
    }
    return "by its script alone, without dither";
}

MetricTable wall_table() {
    constexpr auto every = Processes::every;
    MetricTable table{
        .caption = "Wall time of ticks of the paced loop, and of the empty loop in turn with it",
        .mode = by_the_clock,
        .columns = {count_column("ticks", Metric::paced_ticks),
                    count_column("sub-steps per tick", Metric::substeps),
                    time_column("p50 (µs)", Metric::paced_latency_median_ns),
                    time_column("p99 (µs)", Metric::paced_latency_p99_ns, Processes::interval, too_few),
                    time_column("p99.9 (µs)", Metric::paced_latency_p999_ns, Processes::interval, too_few),
                    time_column("max (µs)", Metric::paced_latency_max_ns, every),
                    count_column("involuntary switches", Metric::paced_switches),
                    value_column("steal (%)", Metric::paced_steal, 100.0),
                    {.header = "empty loop: overruns",
                     .metric = Metric::empty_overruns,
                     .text = [](const ResultSet& results) { return overruns_text(results, of_empty); }},
                    time_column("empty loop: p50 (µs)", Metric::empty_latency_median_ns),
                    time_column("empty loop: p99.9 (µs)", Metric::empty_latency_p999_ns, Processes::interval, too_few),
                    time_column("empty loop: max (µs)", Metric::empty_latency_max_ns, every),
                    count_column("empty loop: involuntary switches", Metric::empty_switches)},
        .folded = false};
    table.note =
        "Wall time counts from a tick's release to its end. n too small: p99 needs 1000 ticks, p99.9 ten thousand.";
    return table;
}

MetricTable stage_table() {
    MetricTable table{
        .caption = "Stages of a tick of the paced loop (first process)", .mode = by_the_clock, .folded = false};
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        table.columns.push_back({.header = std::string(stage_names.at(stage)) + ", p50 / p99 (µs)",
                                 .metric = stage_median(stage),
                                 .second = stage_p99(stage),
                                 .scale = us});
    }
    return table;
}

}  // namespace

void add_paced(Draft& draft) {
    if (draft.results.methods(by_the_clock).empty()) return;
    draft.heading(2, "Paced loop");
    draft.add(paced_page(draft));
    draft.add(table_of(draft, wall_table()));
    draft.add(table_of(draft, stage_table()));
}

std::string paced_sentence(const Draft& draft) {
    std::vector<ClockedRow> rows = clocked_rows(draft);
    std::erase_if(rows, [](const ClockedRow& row) {
        return row.results.failed_runs() > 0 || std::isnan(loop_sum(row.results, Metric::paced_overruns));
    });
    if (rows.empty()) return {};
    ResultSet all;
    for (const ClockedRow& row : rows) {
        all.results.insert(all.results.end(), row.results.results.begin(), row.results.results.end());
    }
    const auto part = [](const ClockedRow& row) {
        return overruns_text(row.results, of_method) + " (" + row.name + ")";
    };
    return "Released by the clock, ticks overrun the millisecond in " + part(rows.front()) +
           (rows.size() > 1 ? " to " + part(rows.back()) : std::string()) + ", those of an empty loop in " +
           overruns_text(all, of_empty) + ".";
}

Table paced_page(const Draft& draft) {
    Table table;
    table.caption = "Paced loop: at most one tick per period of the clock, in turns with an empty loop";
    const std::vector<ClockedRow> rows = clocked_rows(draft);
    if (rows.empty()) return table;
    ResultSet ended_well;
    for (const ClockedRow& row : rows) {
        const ResultSet ok = row.results.ok();
        ended_well.results.insert(ended_well.results.end(), ok.results.begin(), ok.results.end());
    }
    add_loop_row(table, "empty loop, of all runs", ended_well, of_empty, "", "", "");
    for (const ClockedRow& row : rows) {
        if (row.results.failed_runs() > 0) {
            table.rows.push_back(failed_row({row.name}, row.results.results.front()->failure(), table));
            continue;
        }
        add_loop_row(table, row.name, row.results, of_method, against_empty_text(row.results),
                     scaled(loop_worst(row.results, Metric::paced_force_step_p999_n), 1.0, too_few),
                     two_text(loop_worst(row.results, Metric::paced_stiffness_p999_n_per_m),
                              loop_worst(row.results, Metric::paced_damping_ns_per_m), 1.0, too_few));
        if (row.own) table.rows.back().style = TableRow::Style::own;
    }
    table.note =
        "Method and empty loop take turns in one thread, ten blocks each; the first 10 periods of a block are not "
        "counted. An overrun is a tick that ends after the next release; the next tick starts at the release that then "
        "lies ahead, and those in between are skipped. Overruns ÷ empty loop's: rate per tick over that of the empty "
        "loop of the same run, its upper 95 % bound, and the one-sided p of the conditional binomial test; where "
        "overruns come in bursts, bound and p are too small. Age: from the release whose frame a force comes from to "
        "the end of the tick that replaces it. Force step and stiffness |ΔF|/|Δx| are at the tip, in ticks with "
        "contact; stiffness where the tip moves by at least 1 µm, " +
        motion_text(draft) +
        ". Damping: that of a device that is passive at this stiffness, K·T/2 with the clock's period T (Colgate and "
        "Schenkel 1997). Order: empty loop, share of overruns, CPU time; failed last.";
    return table;
}

}  // namespace trocar
