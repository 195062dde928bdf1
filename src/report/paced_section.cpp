// The haptic table of loops that a clock releases every millisecond, beside an empty loop at the same time: what a
// deadline means on this machine.
#include <set>

#include "report/metric_table.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

/// A tick against what the reference takes to update and detect on the same scene with the same response and stepper.
std::string ratio_text(const Draft& draft, const SceneResult& result) {
    Method yardstick = method_of(result.record().spec);
    yardstick.detector = draft.reference;
    const SceneResult* reference = draft.results.find(yardstick, result.scene());
    if (reference == nullptr || !reference->ok()) return unknown_text;
    return scaled(result.of(Metric::total_median_ns).value /
                  (reference->of(Metric::update_median_ns).value + reference->of(Metric::detect_median_ns).value));
}

MetricTable paced_table(const Draft& draft, bool on_page_one) {
    constexpr auto every = Processes::every;
    MetricTable table{.caption = "Paced loop: one tick released per millisecond, timed from its scheduled release",
                      .mode = "paced",
                      .columns = {count_column("n per process (ticks)", Metric::timed_ticks),
                                  count_column("sub-steps per tick", Metric::substeps),
                                  time_column("p50 (µs)", Metric::paced_median_ns),
                                  time_column("p99 (µs)", Metric::paced_p99_ns, Processes::interval, too_few),
                                  time_column("p99.9 (µs)", Metric::paced_p999_ns, Processes::interval, too_few),
                                  time_column("max (µs)", Metric::paced_max_ns, every),
                                  misses_column("deadline misses", Metric::paced_misses),
                                  count_column("longest burst (ticks)", Metric::paced_burst, every),
                                  {.header = "empty loop: p50 / max (µs)",
                                   .metric = Metric::empty_median_ns,
                                   .second = Metric::empty_max_ns,
                                   .processes = every,
                                   .scale = us},
                                  misses_column("empty loop: misses", Metric::empty_misses)},
                      .folded = false};
    if (on_page_one) {
        const std::set<Metric> shown{Metric::paced_median_ns, Metric::paced_p99_ns, Metric::paced_misses,
                                     Metric::empty_misses};
        std::erase_if(table.columns, [&shown](const MetricColumn& column) { return !shown.contains(*column.metric); });
    }
    if (!draft.reference.empty()) {
        table.columns.push_back(
            {.header = "tick / update and detect of " + code(draft.reference) + ", p50",
             .metric = Metric::total_median_ns,
             .text = [&draft](const ResultSet& results) { return ratio_text(draft, *results.results.front()); }});
    }
    table.note =
        "A tick that ends after the next one's release is a miss, and the next one starts late: its time counts from "
        "its own release, so that no lateness is left out. The empty loop of the same length runs at the same time in "
        "a thread of its own and is not prolonged where the other falls behind: what it shows is the machine's beside "
        "that work. A ratio holds a whole tick, without waiting, against what the reference takes to update and "
        "detect on the same scene with the same response and stepper. n too small: p99 needs 1000 "
        "ticks, p99.9 a hundred thousand.";
    return table;
}

MetricTable stage_table() {
    MetricTable table{
        .caption = "Stages of a tick of the paced loop (first process)", .mode = "paced", .folded = false};
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
    if (draft.results.methods("paced").empty()) return;
    draft.heading(2, "Paced loop");
    draft.add(table_of(draft, paced_table(draft, false)));
    draft.add(table_of(draft, stage_table()));
}

Table paced_page(const Draft& draft) {
    Table table = table_of(draft, paced_table(draft, true));
    table.note.clear();
    return table;
}

}  // namespace trocar
