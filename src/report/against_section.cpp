// Steppers beside a second one that runs the scene in step: the error of what is not updated at every tick.
#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// A column "12 (3.4 %)": a value, and its share of another metric.
MetricColumn with_share(const std::string& header, Metric metric, Metric whole, double scale = 1.0) {
    return {.header = header, .metric = metric, .text = [metric, whole, scale](const ResultSet& results) {
                const double value = results.first()[metric];
                return scaled(value, scale) + " (" + scaled(100.0 * value / results.first()[whole]) + " %)";
            }};
}

}  // namespace

Table against_table(const Draft& draft) {
    const MetricTable differences{
        .caption = "Differences from a second stepper in step",
        .mode = "against",
        .columns = {with_share("force, RMS (N, share of the largest)", Metric::against_force_rms_n,
                               Metric::force_max_n),
                    with_share("force, max (N, share of the largest)", Metric::against_force_max_n,
                               Metric::force_max_n),
                    value_column("places, near (mm)", Metric::against_near_max_m, mm),
                    with_share("places, far (mm, share of the largest path there)", Metric::against_far_max_m,
                               Metric::against_far_path_m, mm),
                    value_column("advance p50 (µs)", Metric::advance_median_ns, us),
                    value_column("of the second (µs)", Metric::against_advance_median_ns, us)},
        .note =
            "Each stepper has its own contacts. Near: vertices within 15 mm of the first contact at rest; far: 50 mm "
            "and more.",
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
