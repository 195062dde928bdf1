#include "report/words.hpp"

#include <array>
#include <string_view>

#include "measure/metrics.hpp"
#include "report/document.hpp"

namespace trocar {
namespace {

/// Beginnings of headers and the figure that they print; the first that fits counts.
struct Word {
    std::string_view header;
    std::string_view figure;
};
constexpr std::array words{
    Word{"depth median", "residual_penetration_median_m"},
    Word{"depth worst", "residual_penetration_max_m"},
    Word{"force error median", "force_error_rms_hard"},
    Word{"position error", "position_error_rms_hard"},
    Word{"force jump", "force_jump_max_n"},
    Word{"residual penetration, median / max", "residual_penetration_max_m"},
    Word{"residual penetration, median", "residual_penetration_median_m"},
    Word{"residual penetration, max", "residual_penetration_max_m"},
    Word{"force without touch", "force_without_touch_m"},
    Word{"tears", "ruptures"},
    Word{"tick p99, worst run", "total_p99_ns"},
    Word{"tick p99", "total_p99_ns"},
    Word{"tick p50", "total_median_ns"},
    Word{"µs p50", "total_median_ns"},
    Word{"µs p99", "total_p99_ns"},
    Word{"time / ", "total_median_ns"},
    Word{"missed between frames", "contact_events_missed"},
    Word{"false positives", "false_positives"},
    Word{"false negatives", "false_negatives"},
    Word{"proximity false negatives", "proximity_false_negatives"},
    Word{"true pairs", "true_pairs"},
    Word{"of these touching", "true_pairs"},
    Word{"recall", "false_negatives"},
    Word{"precision", "false_positives"},
    Word{"depth error", "depth_error_max_m"},
    Word{"native, median", "native_depth_error_max_m"},
    Word{"residual at the end", "residual_penetration_final_m"},
    Word{"largest increase of residual penetration", "residual_penetration_max_m"},
    Word{"error over scenes", "residual_penetration_max_m"},
    Word{"force error, worst", "force_error_worst_equal_k"},
    Word{"force error", "force_error_rms_equal_k"},
    Word{"largest force", "force_max_n"},
    Word{"most force changed", "force_max_n"},
    Word{"force flips", "force_flips"},
    Word{"direction flips", "force_flips"},
    Word{"force above 30 Hz", "force_above_30hz_rms_n"},
    Word{"ticks over 1 ms", "deadline_misses"},
    Word{"misses at 1 ms", "deadline_misses"},
    Word{"1 kHz misses", "paced_misses"},
    Word{"longest burst", "longest_burst"},
    Word{"n per process", "timed_ticks"},
    Word{"p50 (", "total_median_ns"},
    Word{"p90 (", "total_p90_ns"},
    Word{"p99 (", "total_p99_ns"},
    Word{"p99.9 (", "total_p999_ns"},
    Word{"max (µs)", "total_max_ns"},
    Word{"first contact", "total_cold_ns"},
    Word{"work, max", "work_max"},
    Word{"allocations", "allocations_median"},
    Word{"sub-steps", "substeps"},
    Word{"strain over the limit", "strain_over_max"},
    Word{"largest strain", "max_strain"},
    Word{"ruptures", "ruptures"},
    Word{"wrong-side vertices", "wrong_side_vertices_max"},
    Word{"ticks to clear", "ticks_to_clear_max"},
    Word{"re-penetrations", "re_penetrations"},
    Word{"overshoot", "overshoot_max_m"},
    Word{"overlap volume", "overlap_volume_max_m3"},
    Word{"minimum translation", "min_translation_max_m"},
    Word{"momentum error", "momentum_residual_share"},
    Word{"energy error", "energy_residual_share"},
    Word{"hard contact clears", "reference_clears_hard"},
};

}  // namespace

std::string help_for(const std::string& header) {
    // Counts runs, which no figure of a run does.
    if (header.starts_with("failed")) {
        return "Runs of the row that ended other than ok (failed, unstable, timed out, crashed) of all that it has";
    }
    for (const Word& word : words) {
        if (header.rfind(word.header, 0) != 0) continue;
        const SummaryFigure& figure = summary_figure(word.figure);
        return figure.meaning + ". Figure " + figure.name + (figure.unit == "1" ? "" : " in " + figure.unit) +
               ", from: " + figure.source;
    }
    return {};
}

void explain_headers(Table& table) {
    for (Column& column : table.columns) {
        if (column.help.empty()) column.help = help_for(column.header);
    }
}

}  // namespace trocar
