// Steppers beside a second one that runs the scene in step: the error of what is not updated at every tick.
#include <fmt/format.h>

#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// "12 (3.4 %)": the value in the unit of the column, and its share of another metric.
std::function<std::string(const SceneResult&)> with_share(Metric metric, Metric whole, double scale) {
    return [metric, whole, scale](const SceneResult& result) {
        const double value = result.first(metric);
        return fmt::format("{} ({} %)", scaled(value, scale), scaled(100.0 * value / result.first(whole)));
    };
}

}  // namespace

Table against_table(const Draft& draft) {
    const MetricTable differences{
        .caption = "Differences from a second stepper in step",
        .mode = "against",
        .columns = {{.header = "force, RMS (N, share of the largest)",
                     .metric = Metric::against_force_rms_n,
                     .text = with_share(Metric::against_force_rms_n, Metric::force_max_n, 1.0)},
                    {.header = "force, max (N, share of the largest)",
                     .metric = Metric::against_force_max_n,
                     .text = with_share(Metric::against_force_max_n, Metric::force_max_n, 1.0)},
                    {.header = "places, near (mm)", .metric = Metric::against_near_max_m, .scale = mm},
                    {.header = "places, far (mm, share of the largest path there)",
                     .metric = Metric::against_far_max_m,
                     .text = with_share(Metric::against_far_max_m, Metric::against_far_path_m, mm)},
                    {.header = "advance p50 (µs)", .metric = Metric::advance_median_ns, .scale = us},
                    {.header = "of the second (µs)", .metric = Metric::against_advance_median_ns, .scale = us}},
        .note =
            "Each stepper has its own contacts. Near: vertices within 15 mm of the first contact at rest; far: 50 mm "
            "and more. Order: scene, then method.",
        .folded = false};
    return table_of(draft, differences);
}

void add_against(Draft& draft) {
    Table table = against_table(draft);
    if (table.rows.empty()) return;
    draft.heading(2, "Steppers in step");
    std::string second;
    for (const Record& record : draft.records) {
        if (!record.spec.against.empty()) second = record.spec.against;
    }
    draft.paragraph("The second stepper is " + code(second) + ".");
    draft.add(std::move(table));
}

}  // namespace trocar
