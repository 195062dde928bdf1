// Page 1 in words: its sentence and its two tables.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/page_one.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

constexpr double ms = 1.0e-6;  // ns to ms

std::string count_failed(int failed, int runs, int not_run) {
    std::string text = fmt::format("{} of {}", failed, runs);
    if (not_run > 0) text += fmt::format(", {} not run", not_run);
    return text;
}

/// What is next to nothing is reported as such, without an exponent.
std::string small_text(double value) {
    constexpr double next_to_nothing = 1.0e-4;
    return value > 0.0 && value < next_to_nothing ? std::string("< 0.0001") : scaled(value);
}

std::string in_code(const std::vector<Method>& list, std::string Method::*part) {
    std::vector<std::string> names;
    for (const Method& one : list) {
        std::string name = code(one.*part);
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
    }
    return joined(names);
}

/// The detector of most rows; the caption names it once.
std::string common_detector(const std::vector<ResponseRow>& rows) {
    std::map<std::string, int> count;
    for (const ResponseRow& row : rows) ++count[row.who.front().detector];
    const auto most =
        std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == count.end() ? std::string() : most->first;
}

std::vector<std::string> closed_loop_scenes(const Draft& draft) {
    std::vector<std::string> scenes = draft.results.scenes("closed_loop");
    std::erase(scenes, "");
    return scenes;
}

/// "7 tissue scenes", or of a study without one "2 rigid scenes": those that response_rows() are over.
std::string judged_text(const Draft& draft, bool tissue) {
    const std::vector<std::string> scenes = judged_scenes(draft.results, closed_loop_scenes(draft), tissue);
    const bool soft = !scenes.empty() && meets_tissue(draft.results.class_of(scenes.front()));
    return fmt::format("{} {} scene{}", scenes.size(), soft ? "tissue" : "rigid", scenes.size() == 1 ? "" : "s");
}

std::string scenes_text(std::size_t count) { return fmt::format("{} scene{}", count, count == 1 ? "" : "s"); }

std::int64_t widest_stride(const Draft& draft, const std::string& mode) {
    std::int64_t stride = 1;
    for (const Record& record : draft.records) {
        if (record.spec.mode == mode) stride = std::max(stride, record.spec.truth_stride);
    }
    return stride;
}

/// Where the rows stand that page 1 has no room for.
std::string others_text(const std::vector<ResponseRow>& rows, const std::vector<std::size_t>& shown,
                        const std::string& detector) {
    std::vector<std::string> others;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (std::find(shown.begin(), shown.end(), i) != shown.end()) continue;
        const ResponseRow& row = rows[i];
        others.push_back(name_of_row(row, detector) + " " + scaled(row.residual_penetration_max, mm) + " mm" +
                         (row.failed > 0 ? fmt::format(", {} failed", row.failed) : ""));
    }
    return others.empty() ? std::string() : fmt::format(" Not shown, at worst: {}.", fmt::join(others, "; "));
}

/// Replayed scenes that no response was run on, for whoever reads "every response on every scene".
std::string replayed_only(const Draft& draft) {
    const std::vector<std::string> closed = closed_loop_scenes(draft);
    std::vector<std::string> names;
    for (const std::string& scene : draft.results.scenes("replay")) {
        if (!scene.empty() && std::find(closed.begin(), closed.end(), scene) == closed.end()) names.push_back(scene);
    }
    return names.empty() ? std::string() : fmt::format(" Not run with responses, detectors only: {}.", joined(names));
}

/// The scenes of a row that was not run on all, or their number where there are many.
std::string only_text(const std::vector<std::string>& scenes) {
    constexpr std::size_t most_named = 3;
    return scenes.size() > most_named ? scenes_text(scenes.size()) : joined(scenes);
}

constexpr const char* failed_help =
    "Runs of the row that ended other than ok (failed, unstable, timed out, crashed) of all that it has";

std::string ratio_header(const Draft& draft) {
    const int processes = draft.most_processes("replay");
    const std::string interval = processes >= processes_for_interval ? " [95 %]"
                                 : processes > 1                     ? fmt::format(" [min–max of {}]", processes)
                                                                     : "";
    return "time / " + code(draft.reference) + interval;
}

}  // namespace

std::string response_name(const Method& who) {
    std::string text = code(who.response) + " (" + who.contacts + ")";
    if (!who.stepper.empty()) text += " by " + code(who.stepper);
    return text;
}

std::string name_of_row(const ResponseRow& row, const std::string& detector) {
    std::vector<Method> first;  // those of the same response as the first, which differ by detector alone
    std::vector<std::string> others;
    for (const Method& who : row.who) {
        if (response_name(who) == response_name(row.who.front())) {
            first.push_back(who);
        } else if (std::find(others.begin(), others.end(), response_name(who)) == others.end()) {
            others.push_back(response_name(who));
        }
    }
    std::string text = response_name(row.who.front());
    if (row.setting != "default" && !row.setting.empty()) text += ", " + row.setting;
    if (first.size() > 1 || first.front().detector != detector) {
        text += " with " + in_code(first, &Method::detector);
    }
    if (!others.empty()) text += " = " + joined(others);
    return text;
}

std::string response_sentence(const Draft& draft, const std::vector<ResponseRow>& rows) {
    const auto [first, other, named] = headline_of(rows);
    if (first == nullptr) return {};
    const std::string detector = common_detector(rows);
    const auto name = [&](const ResponseRow& row) {
        const bool alone = std::none_of(rows.begin(), rows.end(), [&row](const ResponseRow& some) {
            return &some != &row && some.method() == row.method();
        });
        return alone ? code(row.who.front().response) : name_of_row(row, detector);
    };
    std::string text = fmt::format("Over {} {} left {} mm at worst", judged_text(draft, true), name(*first),
                                   scaled(first->residual_penetration_max, mm));
    if (first->tears > 0.0)
        text += fmt::format(" (on {}; {:.0f} tear{} in all)", first->worst_on, first->tears,
                            first->tears == 1.0 ? "" : "s");
    if (other != nullptr) {
        text += fmt::format(", {}, {}, {} mm", named ? "the best other response" : "the next", name(*other),
                            scaled(other->residual_penetration_max, mm));
        const double ratio = other->total_p99_ns / first->total_p99_ns;
        if (!std::isnan(ratio)) text += fmt::format(" at {} times the time", format_number(ratio));
    }
    int failed = 0;
    int runs = 0;
    for (const ResponseRow& row : rows) {
        failed += row.failed;
        runs += row.runs;
    }
    return text + fmt::format("; {} of {} runs failed.", failed, runs);
}

std::string detector_sentence(const Verdict& verdict, const Draft& draft) {
    const VerdictRow* first = nullptr;
    const VerdictRow* other = nullptr;
    int failed = 0;
    int runs = 0;
    for (const VerdictRow& row : verdict.rows) {
        if (row.control) continue;
        failed += row.failed_runs;
        runs += row.runs;
        if (row.failed_runs > 0 || std::isnan(row.p50.value) || std::isnan(row.wrong())) continue;
        if (first == nullptr) {
            first = &row;
        } else if (other == nullptr) {
            other = &row;
        }
    }
    if (first == nullptr) return {};
    const auto report = [](const VerdictRow& row) {
        std::string reported =
            fmt::format("{} missed {:.0f} and added {:.0f} of {:.0f} pairs", code(row.method.detector),
                        row.false_negatives, row.false_positives, row.true_pairs);
        if (!std::isnan(row.contact_events)) {
            reported += fmt::format(" and missed {:.0f} of {:.0f} contacts between frames", row.contact_events_missed,
                                    row.contact_events);
        }
        return reported;
    };
    std::string text = fmt::format("Over {} {}", scenes_text(draft.results.scenes("replay").size()), report(*first));
    if (other != nullptr) {
        text += fmt::format(", the next, {}, at {} times the time", report(*other),
                            format_number(other->p50.value / first->p50.value));
    }
    return text + fmt::format("; {} of {} runs failed.", failed, runs);
}

Table detectors_table(const Draft& draft) {
    Table table;
    const std::vector<std::string> scenes = draft.results.scenes("replay");
    if (scenes.empty()) return table;
    const Verdict verdict = make_verdict(draft.results, draft.reference, "replay", scenes);
    std::vector<const VerdictRow*> rows;
    for (const VerdictRow& row : verdict.rows) rows.push_back(&row);
    for (const VerdictRow& row : verdict.partial) rows.push_back(&row);
    std::erase_if(rows, [](const VerdictRow* row) { return row->control; });
    const bool between =
        std::any_of(rows.begin(), rows.end(), [](const VerdictRow* row) { return !std::isnan(row->contact_events); });
    const bool ratio = !draft.reference.empty();
    table.caption = fmt::format("Detectors on the same frames, {}", scenes_text(verdict.scenes.size()));
    table.columns = {{.header = "detector", .wide = true},
                     {"false negatives of N", true, Metric::false_negatives},
                     {"false positives", true, Metric::false_positives}};
    if (between) table.columns.push_back({"missed between frames, of N", true, Metric::contact_events_missed});
    table.columns.insert(table.columns.end(),
                         {{"µs p50", true, Metric::total_median_ns}, {"µs p99", true, Metric::total_p99_ns}});
    if (ratio) table.columns.push_back({ratio_header(draft), true, Metric::total_median_ns});
    table.columns.push_back({"failed", true, {}, failed_help});
    std::vector<std::string> left_out;
    for (const VerdictRow* row : rows) {
        const std::string name = code(row->method.detector);
        if (table.rows.size() == page_one_rows) {
            left_out.push_back(name);
            continue;
        }
        const bool everywhere = row->scenes == static_cast<int>(verdict.scenes.size());
        const bool timed = everywhere && row->failed_runs == 0;
        const auto time = [timed](const Estimate& estimate) {
            return timed ? scaled(estimate.value, us) : std::string("n/a");
        };
        TableRow line;
        line.cells = {
            everywhere ? name : name + " (" + only_text(row->scene_names) + " only)",
            std::isnan(row->true_pairs)
                ? "n/a"
                : fmt::format(
                      "{:.0f} of {:.0f}{}", row->false_negatives, row->true_pairs,
                      row->truncated_ticks > 0.0 ? fmt::format(", cut in {:.0f} ticks", row->truncated_ticks) : ""),
            count_text(row->false_positives)};
        if (between) {
            line.cells.push_back(
                std::isnan(row->contact_events)
                    ? "n/a"
                    : fmt::format("{:.0f} of {:.0f}", row->contact_events_missed, row->contact_events));
        }
        line.cells.push_back(time(row->p50));
        line.cells.push_back(time(row->p99));
        if (ratio) line.cells.push_back(row->failed_runs > 0 ? "n/a" : estimate_text(row->ratio, 1.0));
        line.cells.push_back(
            count_failed(row->failed_runs, row->runs, static_cast<int>(verdict.scenes.size()) - row->scenes));
        if (row->failed_runs > 0) line.style = TableRow::Style::failed;
        table.rows.push_back(std::move(line));
    }
    table.note = std::string(detector_order_text) + " Times over scenes are geometric means.";
    if (const std::int64_t stride = widest_stride(draft, "replay"); stride > 1) {
        table.note += fmt::format(" Pairs were judged on every {}th tick only.", stride);
    }
    if (!left_out.empty()) table.note += " Behind these: " + joined(left_out) + ".";
    return table;
}

Table responses_table(const Draft& draft, const std::vector<ResponseRow>& rows, bool tissue) {
    Table table;
    if (rows.empty()) return table;
    const std::string detector = common_detector(rows);
    const std::vector<std::size_t> shown = rows_that_matter(rows);
    table.caption = fmt::format("Responses, {}, with {}", judged_text(draft, tissue), code(detector));
    table.columns = {{.header = "response", .wide = true},
                     {"residual penetration, median (mm)", true, Metric::residual_penetration_median_m},
                     {"residual penetration, max (mm)", true, Metric::residual_penetration_max_m},
                     {"tears", true, Metric::ruptures},
                     {"force without touch (mm)", true, Metric::force_without_touch_m},
                     {"force error median (N)", true, Metric::force_error_rms_hard},
                     {"force jump worst (N)", true, Metric::force_jump_max_n},
                     {"tick p99 (ms)", true, Metric::total_p99_ns},
                     {"failed of N", true, {}, failed_help}};
    for (const std::size_t i : shown) {
        const ResponseRow& row = rows[i];
        TableRow line;
        line.cells = {name_of_row(row, detector),
                      scaled(row.depth_median, mm),
                      scaled(row.residual_penetration_max, mm),
                      count_text(row.tears),
                      scaled(row.force_without_touch_m, mm),
                      scaled(row.force_error),
                      small_text(row.force_jump),
                      scaled(row.total_p99_ns, ms),
                      count_failed(row.failed, row.runs, row.not_run)};
        line.command = run_command(draft, row.who.front());
        if (row.failed > 0) {
            line.style = TableRow::Style::failed;
        } else if (row.ours) {
            line.style = TableRow::Style::own;
        }
        table.rows.push_back(std::move(line));
    }
    const std::int64_t stride = widest_stride(draft, "closed_loop");
    table.note =
        std::string(response_order_text) +
        " A failed row is of the scenes that it finished. Force errors are against hard contact, median over scenes; "
        "p99 is of the slowest scene. Force without touch: the largest clearance in a tick with contact force; n/a "
        "where a method's forces are not known by pair. " +
        (stride > 1 ? fmt::format("Depths were judged on every {}th tick only.", stride)
                    : std::string("Depths are of every tick.")) +
        others_text(rows, shown, detector) + replayed_only(draft);
    return table;
}

}  // namespace trocar
