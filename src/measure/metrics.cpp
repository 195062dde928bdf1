#include "measure/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

double ratio(double part, double whole) { return whole > 0.0 ? part / whole : not_known; }

double largest(const std::vector<double>& values) { return quantile(values, 1.0); }

double p99(const std::vector<double>& values) { return quantile_with_ten_above(values, 0.99); }

/// A figure of every row.
std::vector<double> column(const std::vector<StepRow>& rows, double StepRow::*figure) {
    std::vector<double> values;
    values.reserve(rows.size());
    for (const StepRow& row : rows) values.push_back(row.*figure);
    return values;
}

/// A count of the rows that have it.
std::vector<double> column(const std::vector<StepRow>& rows, std::int64_t StepRow::*count) {
    std::vector<double> values;
    for (const StepRow& row : rows) {
        if (row.*count >= 0) values.push_back(static_cast<double>(row.*count));
    }
    return values;
}

double total(const std::vector<StepRow>& rows, std::int64_t StepRow::*count) {
    double sum = 0.0;
    for (const StepRow& row : rows) sum += static_cast<double>(row.*count);
    return sum;
}

void add_times(const std::vector<StepRow>& rows, bool replay, std::int64_t warm_up, Summary& figures) {
    std::vector<double> total;
    std::array<std::vector<double>, stage_count> stages;
    std::vector<double> allocations;
    double misses = 0.0;
    double burst = 0.0;
    double longest_burst = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const StepRow& row = rows[i];
        if (row.outcome != OutcomeKind::ok) continue;
        const auto time = static_cast<double>(tick_ns(row, replay));
        if (row.pairs > 0 && !figures.contains(Metric::total_cold_ns)) figures[Metric::total_cold_ns] = time;
        if (static_cast<std::int64_t>(i) < warm_up) continue;
        total.push_back(time);
        burst = time > haptic_deadline_ns ? burst + 1.0 : 0.0;
        longest_burst = std::max(longest_burst, burst);
        misses += time > haptic_deadline_ns ? 1.0 : 0.0;
        allocations.push_back(row.allocations < 0 ? not_known : static_cast<double>(row.allocations));
        for (std::size_t stage = 0; stage < stage_count; ++stage) {
            const std::int64_t ns = row.stage_ns.at(stage);
            if (ns >= 0) stages.at(stage).push_back(static_cast<double>(ns));
        }
    }
    figures.emplace(Metric::total_cold_ns, not_known);
    figures[Metric::timed_ticks] = static_cast<double>(total.size());
    figures[Metric::total_median_ns] = median(total);
    figures[Metric::total_p90_ns] = quantile(total, 0.9);
    figures[Metric::total_p99_ns] = p99(total);
    figures[Metric::total_p999_ns] = quantile_with_ten_above(total, 0.999);
    figures[Metric::total_max_ns] = largest(total);
    figures[Metric::deadline_misses] = misses;
    figures[Metric::longest_burst] = longest_burst;
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        figures[stage_median(stage)] = median(stages.at(stage));
        figures[stage_p99(stage)] = p99(stages.at(stage));
    }
    figures[Metric::allocations_median] = median(allocations);
    figures[Metric::allocations_max] = largest(allocations);
}

void add_pairs(const std::vector<StepRow>& rows, Summary& figures) {
    std::vector<double> work;
    std::vector<double> work_in_contact;
    std::vector<double> pairs;
    double judged = 0;
    double reported = 0;
    double truth = 0;
    double touch = 0;
    double false_negatives = 0;
    double false_negatives_touch = 0;
    double false_positives = 0;
    double deepest = 0;
    double deepest_false_negatives = 0;
    double near = not_known;
    double proximity_false_negatives = not_known;
    std::vector<double> query_distances;
    for (const StepRow& row : rows) {
        if (row.query_distance > 0.0) query_distances.push_back(row.query_distance);
        if (row.true_proximity_pairs >= 0) {
            near = (std::isnan(near) ? 0.0 : near) + static_cast<double>(row.true_proximity_pairs);
            proximity_false_negatives = (std::isnan(proximity_false_negatives) ? 0.0 : proximity_false_negatives) +
                                        static_cast<double>(row.proximity_false_negatives);
        }
        work.push_back(static_cast<double>(row.work.work()));
        if (row.pairs > 0) {
            pairs.push_back(static_cast<double>(row.pairs));
            work_in_contact.push_back(work.back());
        }
        if (row.true_pairs < 0) continue;
        judged += 1;
        reported += static_cast<double>(row.pairs);
        truth += static_cast<double>(row.true_pairs);
        // NaN as soon as one judged tick has no count.
        touch += row.true_touch < 0 ? not_known : static_cast<double>(row.true_touch);
        false_negatives += static_cast<double>(row.false_negatives);
        false_negatives_touch += static_cast<double>(row.false_negatives_touch);
        false_positives += static_cast<double>(row.false_positives);
        deepest += row.deepest_pairs < 0 ? not_known : static_cast<double>(row.deepest_pairs);
        deepest_false_negatives += static_cast<double>(row.deepest_false_negatives);
    }
    figures[Metric::work_median] = median(work);
    figures[Metric::work_in_contact_median] = median(work_in_contact);
    figures[Metric::work_max] = largest(work);
    figures[Metric::pairs_mean] = ratio(total(rows, &StepRow::pairs), static_cast<double>(rows.size()));
    figures[Metric::native_contacts_mean] =
        ratio(total(rows, &StepRow::native_contacts), static_cast<double>(rows.size()));
    figures[Metric::pairs_median] = median(pairs);
    figures[Metric::pairs_max] = pairs.empty() ? 0.0 : largest(pairs);
    figures[Metric::judged_ticks] = judged;
    const bool known = judged > 0;
    const double precision = ratio(reported - false_positives, reported);
    const double recall = ratio(truth - false_negatives, truth);
    figures[Metric::true_pairs] = known ? truth : not_known;
    figures[Metric::true_touches] = known ? touch : not_known;
    figures[Metric::false_negatives] = known ? false_negatives : not_known;
    figures[Metric::false_negatives_touch] = known ? false_negatives_touch : not_known;
    figures[Metric::false_positives] = known ? false_positives : not_known;
    figures[Metric::query_distance_median_m] = median(query_distances);
    figures[Metric::query_distance_max_m] = query_distances.empty() ? not_known : largest(query_distances);
    figures[Metric::true_proximity_pairs] = near;
    figures[Metric::proximity_false_negatives] = proximity_false_negatives;
    figures[Metric::precision] = precision;
    figures[Metric::recall] = recall;
    figures[Metric::recall_without_touches] =
        ratio((truth - touch) - (false_negatives - false_negatives_touch), truth - touch);
    figures[Metric::recall_deepest] = ratio(deepest - deepest_false_negatives, deepest);
    figures[Metric::f1] =
        ratio(2.0 * (truth - false_negatives), 2.0 * (truth - false_negatives) + false_negatives + false_positives);
}

void add_swept(const std::vector<StepRow>& rows, Summary& figures) {
    double truth = 0;
    double false_negatives = 0;
    double false_positives = 0;
    double error = not_known;
    bool known = false;
    for (const StepRow& row : rows) {
        if (row.true_swept < 0) continue;
        known = true;
        truth += static_cast<double>(row.true_swept);
        false_negatives += static_cast<double>(row.swept_false_negatives);
        false_positives += static_cast<double>(row.swept_false_positives);
        error = std::fmax(error, row.swept_time_error);
    }
    if (!known) return;
    figures[Metric::true_swept] = truth;
    figures[Metric::swept_false_negatives] = false_negatives;
    figures[Metric::swept_false_positives] = false_positives;
    figures[Metric::swept_time_error_max] = error;
}

void add_geometry(const std::vector<StepRow>& rows, Summary& figures) {
    const std::vector<double> errors = column(rows, &StepRow::depth_error);
    const std::vector<double> native_errors = column(rows, &StepRow::native_depth_error);
    const std::vector<double> wrong_side = column(rows, &StepRow::wrong_side);
    const std::vector<double> wrong_vertices = column(rows, &StepRow::wrong_side_vertices);
    const std::vector<double> undecided = column(rows, &StepRow::side_undecided);
    std::vector<double> residual;
    std::vector<double> area_mean;
    double residual_max = not_known;
    double residual_last = not_known;
    for (const StepRow& row : rows) {
        if (row.residual_penetration_mean > 0.0) area_mean.push_back(row.residual_penetration_mean);
        if (std::isnan(row.residual_penetration)) continue;
        residual_last = row.residual_penetration;
        residual_max = std::fmax(residual_max, row.residual_penetration);
        if (row.pairs > 0 || row.residual_penetration > 0.0) residual.push_back(row.residual_penetration);
    }
    figures[Metric::depth_error_median_m] = median(errors);
    figures[Metric::depth_error_max_m] = largest(errors);
    figures[Metric::native_depth_error_median_m] = median(native_errors);
    figures[Metric::native_depth_error_max_m] = largest(native_errors);
    // A run without any contact has left nothing, which is an answer; a run without truth has none.
    figures[Metric::residual_penetration_median_m] =
        residual.empty() && !std::isnan(residual_max) ? 0.0 : median(residual);
    figures[Metric::residual_penetration_max_m] = residual_max;
    figures[Metric::residual_penetration_final_m] = residual_last;
    figures[Metric::residual_penetration_mean_m] =
        area_mean.empty() && !std::isnan(residual_max) ? 0.0 : median(area_mean);
    figures[Metric::overlap_volume_max_m3] = largest(column(rows, &StepRow::overlap_volume));
    figures[Metric::min_translation_max_m] = largest(column(rows, &StepRow::min_translation));
    // Nothing came free of anything: there was nothing to throw too far.
    figures[Metric::overshoot_max_m] = largest(column(rows, &StepRow::overshoot));
    figures[Metric::wrong_side_vertices_max] = largest(wrong_vertices);
    figures[Metric::wrong_side_vertices_last] = wrong_vertices.empty() ? not_known : wrong_vertices.back();
    figures[Metric::strain_over_max] = largest(column(rows, &StepRow::strain_over));
    figures[Metric::wrong_side_max] = largest(wrong_side);
    figures[Metric::wrong_side_last] = wrong_side.empty() ? not_known : wrong_side.back();
    figures[Metric::side_undecided_max] = largest(undecided);
    figures[Metric::side_undecided_ticks] =
        undecided.empty() ? not_known
                          : static_cast<double>(std::count_if(undecided.begin(), undecided.end(),
                                                              [](double samples) { return samples > 0.0; }));
    figures[Metric::max_strain] = largest(column(rows, &StepRow::max_strain));
}

/// Spells of depth: how long each lasted, and whether it came back.
void add_clearing(const std::vector<StepRow>& rows, double motion_end, Summary& figures) {
    std::vector<double> ticks;
    double spells = 0.0;
    double settled = not_known;
    bool known = false;
    std::int64_t since = -1;  // tick of the first depth of the open spell
    for (const StepRow& row : rows) {
        if (std::isnan(row.residual_penetration)) continue;
        known = true;
        if (row.time >= motion_end + settle_time) settled = std::fmax(settled, row.residual_penetration);
        const bool deep = row.residual_penetration > clear_depth;
        if (deep && since < 0) {
            since = row.tick;
            spells += 1.0;
        } else if (!deep && since >= 0) {
            ticks.push_back(static_cast<double>(row.tick - since));
            since = -1;
        }
    }
    figures[Metric::ticks_to_clear_median] = median(ticks);
    figures[Metric::ticks_to_clear_max] = largest(ticks);
    figures[Metric::uncleared] = known ? (since >= 0 ? 1.0 : 0.0) : not_known;
    figures[Metric::re_penetrations] = known ? std::max(0.0, spells - 1.0) : not_known;
    figures[Metric::residual_penetration_settled_m] = settled;
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
            // Nothing is shown before the first tick.
            if (i == 0) jump = now.norm();
            if (i > 0 && of(rows[i - 1]).allFinite()) jump = std::fmax(jump, (now - of(rows[i - 1])).norm());
        }
    }
};

void add_tip(const std::vector<StepRow>& rows, Summary& figures) {
    const Extremes tip(rows, [](const StepRow& row) { return row.tip_force; });
    const Extremes device(rows, [](const StepRow& row) { return row.device_force; });
    figures[Metric::tip_force_max_n] = tip.size;
    figures[Metric::tip_force_jump_max_n] = tip.jump;
    figures[Metric::device_force_max_n] = device.size;
    figures[Metric::device_force_jump_max_n] = device.jump;
    figures[Metric::tool_moment_max_nm] = Extremes(rows, [](const StepRow& row) { return row.tool_moment; }).size;
    double torque = not_known;
    double saturated = 0.0;
    double grasped = 0.0;
    for (const StepRow& row : rows) {
        torque = std::fmax(torque, std::abs(row.roll_torque));
        saturated += row.saturated ? 1.0 : 0.0;
        grasped = std::max(grasped, static_cast<double>(row.grasped));
    }
    figures[Metric::roll_torque_max_nm] = torque;
    figures[Metric::saturated_ticks] = saturated;
    figures[Metric::grasped_max] = grasped;
    figures[Metric::detached] = total(rows, &StepRow::detached);
}

void add_forces(const std::vector<StepRow>& rows, Summary& figures) {
    double squares = 0.0;
    double count = 0.0;
    double force_max = not_known;
    double first_jump = not_known;  // N, from zero at the first tick
    std::vector<double> jumps;
    std::vector<Vector3> forces;
    double flips = 0.0;
    std::array<double, skip_reason_count> skipped{};
    double passed_through = not_known;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const StepRow& row = rows[i];
        if (row.passed_through >= 0) {
            passed_through = std::fmax(passed_through, 0.0) + static_cast<double>(row.passed_through);
        }
        for (std::size_t reason = 0; reason < skip_reason_count; ++reason) {
            skipped.at(reason) += static_cast<double>(row.skipped.at(reason));
        }
        if (!row.tool_force.allFinite()) continue;
        squares += row.tool_force.squaredNorm();
        count += 1.0;
        force_max = std::fmax(force_max, row.tool_force.norm());
        forces.push_back(row.tool_force);
        if (i == 0) first_jump = row.tool_force.norm();
        if (i > 0 && rows[i - 1].tool_force.allFinite()) {
            jumps.push_back((row.tool_force - rows[i - 1].tool_force).norm());
            flips += row.tool_force.dot(rows[i - 1].tool_force) < 0.0 ? 1.0 : 0.0;
        }
    }
    figures[Metric::force_rms_n] = std::sqrt(ratio(squares, count));
    figures[Metric::force_max_n] = force_max;
    figures[Metric::force_jump_p99_n] = p99(jumps);
    figures[Metric::force_jump_max_n] = std::fmax(largest(jumps), first_jump);
    figures[Metric::force_flips] = jumps.empty() ? not_known : flips;
    const double dt = rows.size() > 1 ? rows[1].time - rows[0].time : 0.0;
    const FastPart fast = dt > 0.0 ? part_above(forces, dt, force_cutoff_hz) : FastPart{};
    figures[Metric::force_above_30hz_rms_n] = fast.rms;
    figures[Metric::force_above_30hz_share] = fast.share;
    figures[Metric::ruptures] = total(rows, &StepRow::ruptures);
    figures[Metric::contacts_offered] = total(rows, &StepRow::contacts_offered);
    figures[Metric::contacts_used] = total(rows, &StepRow::contacts_used);
    for (std::size_t reason = 0; reason < skip_reason_count; ++reason) {
        figures[metric_of(std::string("skipped_") + skip_reason_names.at(reason))] = skipped.at(reason);
    }
    figures[Metric::no_hit] = total(rows, &StepRow::no_hit);
    figures[Metric::passed_through] = passed_through;
    figures[Metric::limited_edges] = total(rows, &StepRow::limited_edges);
}

}  // namespace

Metric stage_median(std::size_t stage) { return metric_of(std::string(stage_names.at(stage)) + "_median_ns"); }

Metric stage_p99(std::size_t stage) { return metric_of(std::string(stage_names.at(stage)) + "_p99_ns"); }

std::int64_t tick_ns(const StepRow& row, bool replay) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < stage_count; ++i) {
        const auto stage = static_cast<Stage>(i);
        if (replay && stage != Stage::update && stage != Stage::detect) continue;
        sum += std::max<std::int64_t>(0, row.stage_ns.at(i));
    }
    return sum;
}

FastPart part_above(const std::vector<Vector3>& samples, double dt, double cutoff) {
    FastPart part;
    const std::size_t count = samples.size();
    if (count < 2) return part;
    const auto n = static_cast<double>(count);
    std::vector<Vector3> rest;
    rest.reserve(count);
    double energy = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const double at = static_cast<double>(i) / (n - 1.0);
        rest.push_back(samples[i] - (1.0 - at) * samples.front() - at * samples.back());
        energy += rest.back().squaredNorm();
    }
    // Term k of the Fourier sum has k / (n dt) Hz; terms k and n - k are one.
    const auto last = static_cast<std::size_t>(std::min(cutoff * n * dt * (1.0 + 1e-12), n / 2.0));
    double slow = 0.0;
    for (std::size_t k = 0; k <= last; ++k) {
        const double step = 2.0 * std::numbers::pi * static_cast<double>(k) / n;
        const Eigen::Vector2d turn(std::cos(step), std::sin(step));
        Eigen::Vector2d phase(1.0, 0.0);
        Vector3 real = Vector3::Zero();
        Vector3 imaginary = Vector3::Zero();
        for (const Vector3& value : rest) {
            real += phase.x() * value;
            imaginary += phase.y() * value;
            phase = {phase.x() * turn.x() - phase.y() * turn.y(), phase.x() * turn.y() + phase.y() * turn.x()};
        }
        const bool single = k == 0 || 2 * k == count;
        slow += (single ? 1.0 : 2.0) * (real.squaredNorm() + imaginary.squaredNorm()) / n;
    }
    const double fast = std::max(0.0, energy - slow);
    part.rms = std::sqrt(fast / n);
    part.share = energy > 0.0 ? fast / energy : 0.0;
    return part;
}

Summary summarize(const std::vector<StepRow>& rows, const SummaryContext& context) {
    Summary figures;
    figures[Metric::ticks] = static_cast<double>(rows.size());
    double failed = 0;
    double truncated = 0;
    for (const StepRow& row : rows) {
        failed += row.outcome == OutcomeKind::ok ? 0.0 : 1.0;
        truncated += row.truncated ? 1.0 : 0.0;
    }
    figures[Metric::failed_ticks] = failed;
    figures[Metric::truncated_ticks] = truncated;
    add_times(rows, context.mode == "replay", context.warm_up, figures);
    add_pairs(rows, figures);
    add_swept(rows, figures);
    add_geometry(rows, figures);
    add_clearing(rows, context.motion_end, figures);
    add_forces(rows, figures);
    add_tip(rows, figures);
    return figures;
}

Summary summarize(const std::vector<ContactEvent>& events) {
    Summary figures;
    std::vector<double> latency;
    double proximity_false_negatives = 0;
    for (const ContactEvent& event : events) {
        proximity_false_negatives += event.missed() ? 1.0 : 0.0;
        if (!event.missed()) latency.push_back(event.seen - event.begin);
    }
    figures[Metric::contact_events] = static_cast<double>(events.size());
    figures[Metric::contact_events_missed] = proximity_false_negatives;
    figures[Metric::onset_latency_median_s] = median(latency);
    figures[Metric::onset_latency_max_s] = largest(latency);
    return figures;
}

}  // namespace trocar
