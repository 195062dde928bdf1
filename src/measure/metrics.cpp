#include "measure/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

std::vector<SummaryFigure> make_figures() {
    std::vector<SummaryFigure> list{
        {"ticks", "1", Better::neither, "Ticks done"},
        {"failed_ticks", "1", Better::lower, "Ticks whose outcome is not ok"},
        {"truncated_ticks", "1", Better::lower, "Ticks on which a limit cut the list of pairs"},
        {"total_median_ns", "ns", Better::lower, "Median time of a tick: all stages present, truth never included"},
        {"total_p99_ns", "ns", Better::lower, "99 % of the ticks take at most this long; n/a below 1000 timed ticks"},
        {"total_max_ns", "ns", Better::lower, "Longest tick"},
        {"total_cold_ns", "ns", Better::lower, "Time of the first tick with a pair, warm-up included"},
    };
    for (const char* stage : stage_names) {
        const std::string name = stage;
        list.push_back({name + "_median_ns", "ns", Better::lower, "Median time of the stage " + name});
        list.push_back({name + "_p99_ns", "ns", Better::lower,
                        "99 % of the ticks spend at most this long in the stage " + name + "; n/a below 1000 ticks"});
    }
    const std::vector<SummaryFigure> rest{
        {"allocations_median", "1", Better::lower, "Median number of heap allocations inside the stages of a tick"},
        {"allocations_max", "1", Better::lower, "Most heap allocations inside the stages of a tick"},
        {"work_median", "1", Better::lower,
         "Median work of a tick: vertices read + cells visited + box tests + triangle tests"},
        {"work_max", "1", Better::lower, "Largest work of a tick"},
        {"pairs_median", "1", Better::neither, "Median number of pairs over the ticks that have one"},
        {"pairs_max", "1", Better::neither, "Most pairs in a tick"},
        {"judged_ticks", "1", Better::neither, "Ticks on which truth was computed"},
        {"true_pairs", "1", Better::neither, "True pairs, summed over the judged ticks"},
        {"missing", "1", Better::lower,
         "True pairs not reported, summed over the judged ticks (one whose list a limit cut is always judged)"},
        {"missing_touch", "1", Better::lower, "Of these, pairs that only touch"},
        {"extra", "1", Better::lower, "Reported pairs that are not true, summed over the judged ticks"},
        {"precision", "1", Better::higher, "Share of the reported pairs that are true"},
        {"recall", "1", Better::higher, "Share of the true pairs that are reported, touches included"},
        {"recall_without_touches", "1", Better::higher, "The same over pairs that do more than touch"},
        {"f1", "1", Better::higher, "Harmonic mean of precision and recall"},
        {"true_swept", "1", Better::neither,
         "Pairs that begin to touch between two frames (space-time oracle), summed over the ticks"},
        {"missing_swept", "1", Better::lower,
         "Of these: told neither as begun between frames nor as pair of the frame after"},
        {"extra_swept", "1", Better::lower, "Contacts said to begin between frames that do not"},
        {"swept_time_error_max", "1", Better::lower, "Worst error of a told time of first contact, part of a tick"},
        {"contact_events", "1", Better::neither, "Contacts of two bodies, from first touch until they are apart"},
        {"contact_events_missed", "1", Better::lower, "Of these: never told, neither at a frame nor between frames"},
        {"onset_latency_median_s", "s", Better::lower,
         "Median time from first touch to the frame at which the detector first tells of it, over the events told"},
        {"onset_latency_max_s", "s", Better::lower, "Largest of the same"},
        {"depth_error_median_m", "m", Better::lower,
         "Median over ticks with a contact of the worst difference between a contact's depth and the true depth of the "
         "penetrating vertex"},
        {"depth_error_max_m", "m", Better::lower, "Largest of the same"},
        {"native_depth_error_median_m", "m", Better::lower,
         "The same for the library's own contacts, against the deepest corner of the two triangles"},
        {"native_depth_error_max_m", "m", Better::lower, "Largest of the same"},
        {"residual_median_m", "m", Better::lower,
         "True depth left after the tick: median over ticks with a pair or a depth"},
        {"residual_max_m", "m", Better::lower, "Largest true depth left after a tick"},
        {"residual_last_m", "m", Better::lower, "True depth left after the last judged tick"},
        {"wrong_side_max", "1", Better::lower, "Most sample points left on the wrong side after a tick"},
        {"wrong_side_last", "1", Better::lower, "Sample points on the wrong side after the last judged tick"},
        {"force_rms_n", "N", Better::neither, "Root mean square of the tool force"},
        {"force_max_n", "N", Better::neither, "Largest tool force (mean over a tick)"},
        {"force_error_rms_n", "N", Better::lower,
         "Root mean square difference to the analytic force; n/a without an analytic answer"},
        {"force_jump_max_n", "N", Better::lower, "Largest change of the tool force from one tick to the next"},
        {"tool_moment_max_nm", "N m", Better::neither, "Largest moment about the tip on the tool"},
        {"tip_force_max_n", "N", Better::neither,
         "Largest force at the tip by the response's rule, before any limiter"},
        {"tip_force_jump_max_n", "N", Better::lower, "Largest change of the same from one tick to the next"},
        {"device_force_max_n", "N", Better::neither, "Largest force shown after the response's limiters"},
        {"device_force_jump_max_n", "N", Better::lower, "Largest change of the same from one tick to the next"},
        {"roll_torque_max_nm", "N m", Better::lower,
         "Largest torque about the shaft, which a 3-DOF device cannot show; n/a without a trocar"},
        {"saturated_ticks", "1", Better::lower, "Ticks in which the tip force was larger than the device's largest"},
        {"grasped_max", "1", Better::neither, "Most tissue vertices held by a grasp in a tick"},
        {"detached", "1", Better::neither, "Grasped vertices that slipped or tore loose"},
        {"max_strain", "1", Better::lower, "Largest edge strain of the tissue (1 = doubled length)"},
        {"ruptures", "1", Better::neither, "Ruptures that the response declared"},
        {"skipped", "1", Better::neither, "Contacts without a response, summed over the ticks"},
        {"no_hit", "1", Better::lower, "Projections for which no contact point was found, summed over the ticks"},
        {"limited_edges", "1", Better::lower, "Edges that the strain limiter acted on, summed over the ticks"},
        {"iterations", "1", Better::neither, "Triangle-pair study: ticks with at least one pair"},
        {"pairs_per_iteration", "1", Better::neither, "Triangle-pair study: mean number of pairs in those ticks"},
    };
    list.insert(list.end(), rest.begin(), rest.end());
    // Filled by the comparison with the stored reference (reference/reference.hpp), once for each law of contact.
    for (const auto& [ending, law] : {std::pair{"_equal_k", "the reference with contact as stiff as the scene says"},
                                      std::pair{"_hard", "the reference with hard contact"}}) {
        const std::string end = ending;
        const std::string against = std::string("; against ") + law + ", n/a without one";
        list.push_back({"force_error_rms" + end, "N", Better::lower,
                        "Root mean square error of the tool force below 30 Hz" + against});
        list.push_back(
            {"force_error_worst" + end, "N", Better::lower, "Largest error of the tool force below 30 Hz" + against});
        list.push_back({"impulse_error_worst" + end, "N s", Better::lower,
                        "Largest error of the tool's impulse over 10 ms" + against});
        list.push_back({"position_error_rms" + end, "m", Better::lower,
                        "Root mean square error of the place of the reference's points" + against});
        list.push_back({"position_error_worst" + end, "m", Better::lower,
                        "Largest error of the place of the reference's points" + against});
        list.push_back({"force_bound" + end, "N", Better::neither,
                        "How far the reference itself may be off, root mean square" + against});
    }
    list.push_back({"reference_clears_hard", "1", Better::neither,
                    "1: the hard reference clears every depth within the strain limit; 0: it cannot; n/a without one"});
    for (const auto& [variant, span] : {std::pair{"without", "response alone, the intersections given"},
                                        std::pair{"with", "triangle test of the same pairs and response"}}) {
        for (const auto& [unit, meaning] :
             {std::pair{"pair", "one triangle pair"}, std::pair{"iteration", "one iteration"}}) {
            for (const auto& [kind, word] : {std::pair{"median", "median"}, std::pair{"p99", "99 %"}}) {
                list.push_back({std::string(variant) + "_per_" + unit + "_" + kind + "_ns", "ns", Better::lower,
                                std::string("Triangle-pair study: time for ") + meaning + ", " + word + ": " + span});
            }
        }
    }
    return list;
}

double ratio(double part, double whole) { return whole > 0.0 ? part / whole : not_known; }

double largest(const std::vector<double>& values) { return quantile(values, 1.0); }

double p99(const std::vector<double>& values) { return tail_quantile(values, 0.99).value_or(not_known); }

using Figures = std::map<std::string, double>;

void add_times(const std::vector<StepRow>& rows, Figures& figures) {
    std::vector<double> total;
    std::array<std::vector<double>, stage_count> stages;
    std::vector<double> allocations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const StepRow& row = rows[i];
        if (row.outcome != OutcomeKind::ok) continue;
        if (row.pairs > 0 && !figures.contains("total_cold_ns")) {
            figures["total_cold_ns"] = static_cast<double>(row.total_ns());
        }
        if (static_cast<std::int64_t>(i) < warm_up_ticks) continue;
        total.push_back(static_cast<double>(row.total_ns()));
        allocations.push_back(row.allocations < 0 ? not_known : static_cast<double>(row.allocations));
        for (std::size_t stage = 0; stage < stage_count; ++stage) {
            const std::int64_t ns = row.stage_ns.at(stage);
            if (ns >= 0) stages.at(stage).push_back(static_cast<double>(ns));
        }
    }
    figures.emplace("total_cold_ns", not_known);
    figures["total_median_ns"] = median(total);
    figures["total_p99_ns"] = p99(total);
    figures["total_max_ns"] = largest(total);
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        const std::string name = stage_names.at(stage);
        figures[name + "_median_ns"] = median(stages.at(stage));
        figures[name + "_p99_ns"] = p99(stages.at(stage));
    }
    figures["allocations_median"] = median(allocations);
    figures["allocations_max"] = largest(allocations);
}

void add_pairs(const std::vector<StepRow>& rows, Figures& figures) {
    std::vector<double> work;
    std::vector<double> pairs;
    double judged = 0;
    double reported = 0;
    double truth = 0;
    double touch = 0;
    double missing = 0;
    double missing_touch = 0;
    double extra = 0;
    for (const StepRow& row : rows) {
        work.push_back(static_cast<double>(row.work.work()));
        if (row.pairs > 0) pairs.push_back(static_cast<double>(row.pairs));
        if (row.true_pairs < 0) continue;
        judged += 1;
        reported += static_cast<double>(row.pairs);
        truth += static_cast<double>(row.true_pairs);
        touch += static_cast<double>(row.true_touch);
        missing += static_cast<double>(row.missing);
        missing_touch += static_cast<double>(row.missing_touch);
        extra += static_cast<double>(row.extra);
    }
    figures["work_median"] = median(work);
    figures["work_max"] = largest(work);
    figures["pairs_median"] = median(pairs);
    figures["pairs_max"] = pairs.empty() ? 0.0 : largest(pairs);
    figures["judged_ticks"] = judged;
    const bool known = judged > 0;
    const double precision = ratio(reported - extra, reported);
    const double recall = ratio(truth - missing, truth);
    figures["true_pairs"] = known ? truth : not_known;
    figures["missing"] = known ? missing : not_known;
    figures["missing_touch"] = known ? missing_touch : not_known;
    figures["extra"] = known ? extra : not_known;
    figures["precision"] = precision;
    figures["recall"] = recall;
    figures["recall_without_touches"] = ratio((truth - touch) - (missing - missing_touch), truth - touch);
    figures["f1"] = ratio(2.0 * (truth - missing), 2.0 * (truth - missing) + missing + extra);
}

void add_swept(const std::vector<StepRow>& rows, Figures& figures) {
    double truth = 0;
    double missing = 0;
    double extra = 0;
    double error = not_known;
    bool known = false;
    for (const StepRow& row : rows) {
        if (row.true_swept < 0) continue;
        known = true;
        truth += static_cast<double>(row.true_swept);
        missing += static_cast<double>(row.missing_swept);
        extra += static_cast<double>(row.extra_swept);
        error = std::fmax(error, row.swept_time_error);
    }
    if (!known) return;
    figures["true_swept"] = truth;
    figures["missing_swept"] = missing;
    figures["extra_swept"] = extra;
    figures["swept_time_error_max"] = error;
}

void add_geometry(const std::vector<StepRow>& rows, Figures& figures) {
    std::vector<double> errors;
    std::vector<double> native_errors;
    std::vector<double> residual;
    std::vector<double> wrong_side;
    std::vector<double> strain;
    double residual_max = not_known;
    double residual_last = not_known;
    for (const StepRow& row : rows) {
        errors.push_back(row.depth_error);
        native_errors.push_back(row.native_depth_error);
        strain.push_back(row.max_strain);
        if (row.wrong_side >= 0) wrong_side.push_back(static_cast<double>(row.wrong_side));
        if (std::isnan(row.max_depth)) continue;
        residual_last = row.max_depth;
        residual_max = std::fmax(residual_max, row.max_depth);
        if (row.pairs > 0 || row.max_depth > 0.0) residual.push_back(row.max_depth);
    }
    figures["depth_error_median_m"] = median(errors);
    figures["depth_error_max_m"] = largest(errors);
    figures["native_depth_error_median_m"] = median(native_errors);
    figures["native_depth_error_max_m"] = largest(native_errors);
    // A run without any contact has left nothing, which is an answer; a run without truth has none.
    figures["residual_median_m"] = residual.empty() && !std::isnan(residual_max) ? 0.0 : median(residual);
    figures["residual_max_m"] = residual_max;
    figures["residual_last_m"] = residual_last;
    figures["wrong_side_max"] = largest(wrong_side);
    figures["wrong_side_last"] = wrong_side.empty() ? not_known : wrong_side.back();
    figures["max_strain"] = largest(strain);
}

/// Largest size of a vector over the rows, and its largest change from one to the next.
struct Extremes {
    double size = not_known;
    double jump = not_known;
    template <typename Of>
    Extremes(const std::vector<StepRow>& rows, Of&& of) {
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const Vector3 now = of(rows[i]);
            if (!now.allFinite()) continue;
            size = std::fmax(size, now.norm());
            if (i > 0 && of(rows[i - 1]).allFinite()) jump = std::fmax(jump, (now - of(rows[i - 1])).norm());
        }
    }
};

void add_tip(const std::vector<StepRow>& rows, Figures& figures) {
    const Extremes tip(rows, [](const StepRow& row) { return row.tip_force; });
    const Extremes device(rows, [](const StepRow& row) { return row.device_force; });
    figures["tip_force_max_n"] = tip.size;
    figures["tip_force_jump_max_n"] = tip.jump;
    figures["device_force_max_n"] = device.size;
    figures["device_force_jump_max_n"] = device.jump;
    figures["tool_moment_max_nm"] = Extremes(rows, [](const StepRow& row) { return row.tool_moment; }).size;
    double torque = not_known;
    double saturated = 0.0;
    double grasped = 0.0;
    double detached = 0.0;
    for (const StepRow& row : rows) {
        torque = std::fmax(torque, std::abs(row.roll_torque));
        saturated += row.saturated ? 1.0 : 0.0;
        grasped = std::max(grasped, static_cast<double>(row.grasped));
        detached += static_cast<double>(row.detached);
    }
    figures["roll_torque_max_nm"] = torque;
    figures["saturated_ticks"] = saturated;
    figures["grasped_max"] = grasped;
    figures["detached"] = detached;
}

void add_forces(const std::vector<StepRow>& rows, Figures& figures) {
    double squares = 0.0;
    double count = 0.0;
    double ruptures = 0.0;
    double skipped = 0.0;
    double no_hit = 0.0;
    double limited = 0.0;
    for (const StepRow& row : rows) {
        ruptures += static_cast<double>(row.ruptures);
        skipped += static_cast<double>(row.skipped);
        no_hit += static_cast<double>(row.no_hit);
        limited += static_cast<double>(row.limited_edges);
        if (!row.tool_force.allFinite()) continue;
        squares += row.tool_force.squaredNorm();
        count += 1.0;
    }
    const Extremes tool(rows, [](const StepRow& row) { return row.tool_force; });
    figures["force_rms_n"] = std::sqrt(ratio(squares, count));
    figures["force_max_n"] = tool.size;
    figures["force_error_rms_n"] = not_known;
    figures["force_jump_max_n"] = tool.jump;
    figures["ruptures"] = ruptures;
    figures["skipped"] = skipped;
    figures["no_hit"] = no_hit;
    figures["limited_edges"] = limited;
}

}  // namespace

const std::vector<SummaryFigure>& summary_figures() {
    static const std::vector<SummaryFigure> list = make_figures();
    return list;
}

const SummaryFigure& summary_figure(std::string_view name) {
    for (const SummaryFigure& figure : summary_figures()) {
        if (figure.name == name) return figure;
    }
    throw std::logic_error("no figure is named " + std::string(name));
}

std::map<std::string, double> summarize(const std::vector<StepRow>& rows) {
    Figures figures;
    figures["ticks"] = static_cast<double>(rows.size());
    double failed = 0;
    double truncated = 0;
    for (const StepRow& row : rows) {
        failed += row.outcome == OutcomeKind::ok ? 0.0 : 1.0;
        truncated += row.truncated ? 1.0 : 0.0;
    }
    figures["failed_ticks"] = failed;
    figures["truncated_ticks"] = truncated;
    add_times(rows, figures);
    add_pairs(rows, figures);
    add_swept(rows, figures);
    add_geometry(rows, figures);
    add_forces(rows, figures);
    add_tip(rows, figures);
    return figures;
}

std::map<std::string, double> summarize(const std::vector<ContactEvent>& events) {
    Figures figures;
    std::vector<double> latency;
    double missed = 0;
    for (const ContactEvent& event : events) {
        missed += event.missed() ? 1.0 : 0.0;
        if (!event.missed()) latency.push_back(event.seen - event.begin);
    }
    figures["contact_events"] = static_cast<double>(events.size());
    figures["contact_events_missed"] = missed;
    figures["onset_latency_median_s"] = median(latency);
    figures["onset_latency_max_s"] = largest(latency);
    return figures;
}

}  // namespace trocar
