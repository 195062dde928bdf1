// What each switch of a response changes, in the figures of the runs: which one, on which scene, from what to what. A
// figure counts as changed beyond a factor or a floor below which nobody would care; time stands apart, as a ratio.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "measure/metrics.hpp"
#include "measure/statistics.hpp"
#include "report/chart.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

/// A figure that is compared, in the unit that is printed. Values below the floor count as the floor, so that a change
/// from nothing to next to nothing is none.
struct Watched {
    const char* key;
    const char* name;
    const char* unit;
    double scale;
    double floor;  ///< in the figure's own unit
    bool first;    ///< one of those that a switch is judged by before all others: what is left behind, and the force
};

constexpr std::array watched{
    Watched{"residual_penetration_max_m", "residual penetration, max", "mm", 1e3, 1e-5, true},
    Watched{"residual_penetration_median_m", "residual penetration, median", "mm", 1e3, 1e-5, true},
    Watched{"residual_penetration_settled_m", "residual penetration 200 ms after the last key", "mm", 1e3, 1e-5, true},
    Watched{"ticks_to_clear_max", "ticks to clear, worst", "", 1.0, 20.0, true},
    Watched{"re_penetrations", "re-penetrations", "", 1.0, 1.0, true},
    Watched{"overshoot_max_m", "overshoot, worst", "mm", 1e3, 1e-4, false},
    Watched{"wrong_side_vertices_max", "wrong-side vertices, most", "", 1.0, 1.0, true},
    Watched{"overlap_volume_max_m3", "overlap volume, largest", "mm³", 1e9, 1e-10, false},
    Watched{"strain_over_max", "strain over the limit, worst", "", 1.0, 0.01, true},
    Watched{"momentum_residual_share", "momentum error, share", "", 1.0, 0.01, false},
    Watched{"energy_residual_share", "energy error, share", "", 1.0, 0.01, false},
    Watched{"force_error_rms_equal_k", "force error to equal k, RMS", "N", 1.0, 5e-3, true},
    Watched{"force_error_rms_hard", "force error to hard contact, RMS", "N", 1.0, 5e-3, true},
    Watched{"position_error_rms_hard", "position error to hard contact, RMS", "mm", 1e3, 1e-5, false},
    Watched{"force_max_n", "tool force, largest", "N", 1.0, 0.01, true},
    Watched{"force_jump_max_n", "force jump in a tick, largest", "N", 1.0, 0.01, false},
    Watched{"force_above_30hz_rms_n", "force above 30 Hz, RMS", "N", 1.0, 5e-3, false},
    Watched{"tip_force_max_n", "tip force, largest", "N", 1.0, 0.01, false},
    Watched{"tip_force_jump_max_n", "tip force jump in a tick, largest", "N", 1.0, 0.01, false},
    Watched{"device_force_jump_max_n", "device force jump in a tick, largest", "N", 1.0, 0.01, false},
    Watched{"grasped_max", "vertices grasped, most", "", 1.0, 1.0, false},
    Watched{"detached", "grasped vertices that slipped", "", 1.0, 1.0, false},
    Watched{"ruptures", "ruptures", "", 1.0, 1.0, false}};

constexpr double significant_factor = 1.02;

struct Change {
    std::string scene;
    std::string figure;  ///< with its unit; "outcome" when one of the two runs failed
    std::string without;
    std::string with;
    double factor = 1.0;  ///< of the larger to the smaller value, at least 1; infinite when one of the two failed
    bool first = false;   ///< see Watched; an outcome is
    bool better = false;  ///< with the switch, where the figure has a better side
    bool worse = false;
};

/// A switch in one surrounding: all its runs beside those without it.
struct Turned {
    std::string parameter;
    std::string value;  ///< what is turned
    std::string with;   ///< what else is set in both; empty: nothing
    bool in_from = true;
    bool option = false;  ///< turned on in both surroundings
    std::string silent;   ///< why it cannot act here, as the study says; empty: it says nothing
    std::map<std::string, std::vector<std::string>> acts;  ///< by class: scenes on which any bit changes
    std::vector<Change> changes;                           ///< significant ones, largest first
    std::vector<std::string> same;  ///< scenes on which every figure and the last state are the same, bit by bit
    std::size_t scenes = 0;
    double time_ratio = not_known;  ///< with over without, geometric mean
};

std::string value_text(double value, const Watched& figure) {
    if (std::isnan(value)) return "n/a";
    return format_number(value * figure.scale);
}

double factor_between(double a, double b, double floor) {
    const double low = std::max(std::min(std::abs(a), std::abs(b)), floor);
    const double high = std::max(std::max(std::abs(a), std::abs(b)), floor);
    return high / low;
}

bool same_to_the_bit(const Record& a, const Record& b) {
    if (a.state_hash != b.state_hash || a.outcome.kind != b.outcome.kind) return false;
    return std::all_of(watched.begin(), watched.end(), [&](const Watched& figure) {
        const double x = summary_of(a, figure.key);
        const double y = summary_of(b, figure.key);
        return x == y || (std::isnan(x) && std::isnan(y));
    });
}

/// All significant changes on one scene.
void compare(const Record& without, const Record& with, std::vector<Change>& changes) {
    const std::string& scene = with.spec.scene;
    if (!without.outcome.ok() || !with.outcome.ok()) {
        if (without.outcome.kind == with.outcome.kind) return;
        changes.push_back({.scene = scene,
                           .figure = "outcome",
                           .without = std::string(name_of(without.outcome.kind)),
                           .with = std::string(name_of(with.outcome.kind)),
                           .factor = HUGE_VAL,
                           .first = true,
                           .better = with.outcome.ok(),
                           .worse = without.outcome.ok()});
        return;
    }
    for (const Watched& figure : watched) {
        const double before = summary_of(without, figure.key);
        const double after = summary_of(with, figure.key);
        if (std::isnan(before) || std::isnan(after)) continue;
        const double factor = factor_between(before, after, figure.floor);
        if (factor < significant_factor) continue;
        const Better side = summary_figure(figure.key).better;
        const bool less = std::abs(after) < std::abs(before);
        const std::string unit = figure.unit[0] == '\0' ? std::string() : fmt::format(" ({})", figure.unit);
        changes.push_back({.scene = scene,
                           .figure = std::string(figure.name) + unit,
                           .without = value_text(before, figure),
                           .with = value_text(after, figure),
                           .factor = factor,
                           .first = figure.first,
                           .better = side != Better::neither && less == (side == Better::lower),
                           .worse = side != Better::neither && less != (side == Better::lower)});
    }
}

bool larger(const Change& a, const Change& b) { return a.first != b.first ? a.first : a.factor > b.factor; }

struct Ablation {
    std::string from;
    std::string to;
    std::vector<Turned> turned;  ///< largest effect first

    /// "thesis:profile=faithful", and what else is set.
    [[nodiscard]] std::string rest(const Turned& one) const {
        return code(one.in_from ? from : to) + (one.with.empty() ? std::string() : " with " + code(one.with));
    }
};

using ByScene = std::map<std::string, const Record*>;

std::optional<Ablation> gather(const std::vector<Record>& records) {
    std::map<std::pair<std::string, std::string>, ByScene> runs;  // by parameter and point
    Ablation ablation;
    for (const Record& record : records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "ablation" || spec.repetition != 0 || record.outcome.kind == OutcomeKind::absent ||
            record.outcome.kind == OutcomeKind::unsupported) {
            continue;
        }
        runs[{spec.knob, spec.point}][spec.scene] = &record;
        if (spec.point == "from") ablation.from = spec.response;
        if (spec.point == "to") ablation.to = spec.response;
    }
    if (runs.empty()) return std::nullopt;
    for (const auto& [key, by_scene] : runs) {
        const auto& [parameter, point] = key;
        if (parameter.empty()) continue;
        Turned one;
        one.parameter = parameter;
        // "from with VALUE", or "from; KEY=VALUE,… with VALUE".
        const std::string head = point.substr(0, point.find(" with "));
        one.in_from = head.rfind("from", 0) == 0;
        one.value = point.substr(head.size() + 6);
        const std::size_t more = head.find("; ");
        if (more != std::string::npos) one.with = head.substr(more + 2);
        const std::string other_side = (one.in_from ? "to" : "from") + head.substr(one.in_from ? 4 : 2);
        one.option = ablation.to.empty() || runs.contains({parameter, other_side + " with " + one.value});
        const ByScene& base = runs[{"", head}];
        std::vector<double> ratios;
        for (const auto& [scene, record] : by_scene) {
            const auto other = base.find(scene);
            if (other == base.end()) continue;
            ++one.scenes;
            // In `to` the run with the value of `from` is the one without the correction.
            const bool base_is_without = one.in_from || one.option;
            const Record& without = base_is_without ? *other->second : *record;
            const Record& with = base_is_without ? *record : *other->second;
            if (same_to_the_bit(without, with)) {
                one.same.push_back(scene);
            } else {
                one.acts[with.spec.pair_class].push_back(scene);
            }
            const auto silent = record->environment.find("ablation.silent");
            if (silent != record->environment.end()) one.silent = silent->second;
            compare(without, with, one.changes);
            const double ratio = summary_of(with, "total_median_ns") / summary_of(without, "total_median_ns");
            if (std::isfinite(ratio)) ratios.push_back(ratio);
        }
        one.time_ratio = geometric_mean(ratios);
        std::stable_sort(one.changes.begin(), one.changes.end(), larger);
        ablation.turned.push_back(std::move(one));
    }
    std::stable_sort(ablation.turned.begin(), ablation.turned.end(), [](const Turned& a, const Turned& b) {
        if (a.changes.empty() || b.changes.empty()) return !a.changes.empty() && b.changes.empty();
        return larger(a.changes.front(), b.changes.front());
    });
    return ablation;
}

/// "clamp: off → on"; the value that the switch has without it is found in its other surrounding.
std::string switch_text(const Ablation& ablation, const Turned& one) {
    std::string other;
    for (const Turned& twin : ablation.turned) {
        if (twin.parameter == one.parameter && twin.in_from != one.in_from && twin.with == one.with && !twin.option) {
            other = twin.value;
        }
    }
    if (one.option) return code(one.parameter + "=" + one.value) + " (option)";
    return code(one.parameter) + ": " + (one.in_from ? other : one.value) + " → " + (one.in_from ? one.value : other);
}

std::string factor_text(const Change& change) {
    const std::string side = change.better ? ", better" : change.worse ? ", worse" : "";
    return (std::isinf(change.factor) ? "fails" : "× " + format_number(change.factor)) + side;
}

/// Switches without any significant change, in both surroundings where it was turned in both.
std::vector<std::string> silent_switches(const Ablation& ablation, bool to_the_bit) {
    std::map<std::string, std::array<bool, 2>> significant;  // any change, any change of a bit
    for (const Turned& one : ablation.turned) {
        auto& found = significant[one.parameter];
        found[0] = found[0] || !one.changes.empty();
        found[1] = found[1] || one.same.size() < one.scenes;
    }
    std::vector<std::string> names;
    for (const auto& [parameter, found] : significant) {
        if (!found[0] && found[1] != to_the_bit) names.push_back(code(parameter));
    }
    return names;
}

/// The switches by their largest change, at most one change per switch and scene in the sentence.
std::string sentence_of(const Ablation& ablation) {
    std::set<std::string> all;
    for (const Turned& one : ablation.turned) all.insert(one.parameter);
    std::string text = fmt::format("Of {} switches ", all.size());
    text += ablation.to.empty() ? fmt::format("of {}, ", code(ablation.from))
                                : fmt::format("between {} and {}, ", code(ablation.from), code(ablation.to));
    std::set<std::string> reported;
    std::vector<std::string> parts;
    constexpr std::size_t most = 3;
    for (const Turned& one : ablation.turned) {
        if (one.changes.empty() || parts.size() == most || !reported.insert(one.parameter).second) continue;
        const Change& change = one.changes.front();
        parts.push_back(fmt::format("{} ({} on {}: {} to {}, rest as in {})", code(one.parameter), change.figure,
                                    change.scene, change.without, change.with, ablation.rest(one)));
    }
    text += parts.empty() ? "none changes a figure" : fmt::format("the largest effects are {}", fmt::join(parts, ", "));
    std::vector<std::string> silent = silent_switches(ablation, true);
    for (const std::string& name : silent_switches(ablation, false)) silent.push_back(name);
    text += silent.empty() ? "; every switch changes some figure on some scene."
                           : fmt::format("; without effect on these scenes: {}.", fmt::join(silent, ", "));
    return text;
}

std::string outputs_chart(const Ablation& ablation) {
    BarChart chart;
    chart.x_title = "largest factor between without and with the switch, decades (log10)";
    chart.parts = {"rest as in " + ablation.from};
    if (!ablation.to.empty()) chart.parts.push_back("rest as in " + ablation.to);
    constexpr double failed = 4.0;  // decades; a bar that leaves all others behind
    std::vector<std::string> order;
    for (const Turned& one : ablation.turned) {
        if (std::find(order.begin(), order.end(), one.parameter) == order.end()) order.push_back(one.parameter);
    }
    for (const std::string& parameter : order) {
        BarChart::Bar bar{.name = parameter, .parts = std::vector<double>(chart.parts.size(), not_known)};
        for (const Turned& one : ablation.turned) {
            if (one.parameter != parameter || one.changes.empty()) continue;
            bar.parts[one.in_from ? 0 : 1] = std::min(failed, std::log10(one.changes.front().factor));
        }
        chart.bars.push_back(std::move(bar));
    }
    return draw(chart);
}

std::string no_output_text(const Turned& one) {
    return one.silent.empty() ? std::string("no effect") : "without effect, because " + one.silent;
}

/// "I2T: i2t_poke, i2t_drag; R2T: r2t_bone".
std::string places_text(const std::map<std::string, std::vector<std::string>>& places) {
    std::vector<std::string> parts;
    parts.reserve(places.size());
    for (const auto& [pair_class, scenes] : places) parts.push_back(pair_class + ": " + joined(scenes));
    return fmt::format("{}", fmt::join(parts, "; "));
}

/// Every switch in the settings' order of names: on which classes and scenes a bit of motion or force changes, that is,
/// where the code behind it is reached, and how much.
Table where_table(const Ablation& ablation) {
    Table table;
    table.caption = "Where each switch acts";
    table.columns = {{"switch", false},
                     {"rest as in", false},
                     {"acts on (class: scenes)", false},
                     {"largest effect there", false},
                     {"same bit by bit on", true}};
    std::vector<const Turned*> order;
    for (const Turned& one : ablation.turned) order.push_back(&one);
    std::stable_sort(order.begin(), order.end(), [](const Turned* a, const Turned* b) {
        return std::tie(a->parameter, a->option, a->with) < std::tie(b->parameter, b->option, b->with);
    });
    for (const Turned* one : order) {
        std::string output = "below the floors";
        TableRow row;
        if (!one->changes.empty()) {
            const Change& top = one->changes.front();
            output =
                fmt::format("{} on {}: {} → {} ({})", top.figure, top.scene, top.without, top.with, factor_text(top));
        }
        if (one->acts.empty()) {
            output = no_output_text(*one);
            row.style = TableRow::Style::dominated;
        } else if (!one->silent.empty()) {
            output += "; the study says that it has none, because " + one->silent;
            row.style = TableRow::Style::failed;
        }
        row.cells = {switch_text(ablation, *one), ablation.rest(*one),
                     one->acts.empty() ? "nowhere" : places_text(one->acts), output,
                     fmt::format("{} of {}", one->same.size(), one->scenes)};
        table.rows.push_back(std::move(row));
    }
    table.note =
        "Acts: the last state, or any watched figure, differs in at least one bit between the run with and the run "
        "without the switch. A reason for no effect is the study's and is reported only where the runs bear it out; "
        "where they do not, the row says so.";
    return table;
}

Table main_table(const Ablation& ablation) {
    Table table;
    table.caption = "Every switch by its largest effect";
    table.columns = {{"switch", false},
                     {"rest as in", false},
                     {"figure that changes most", false},
                     {"scene", false},
                     {"without", true},
                     {"with", true},
                     {"change", true},
                     {"scenes with a change", true},
                     {"the same bit by bit on", true},
                     {"time, ratio", true}};
    for (const Turned& one : ablation.turned) {
        std::set<std::string> changed;
        for (const Change& change : one.changes) changed.insert(change.scene);
        std::vector<std::string> cells{switch_text(ablation, one), ablation.rest(one)};
        if (one.changes.empty()) {
            cells.insert(
                cells.end(),
                {one.same.size() == one.scenes ? no_output_text(one) : "nothing beyond the floors", "", "", "", ""});
        } else {
            const Change& top = one.changes.front();
            cells.insert(cells.end(), {top.figure, top.scene, top.without, top.with, factor_text(top)});
        }
        cells.insert(cells.end(),
                     {fmt::format("{} of {}", changed.size(), one.scenes),
                      fmt::format("{} of {}", one.same.size(), one.scenes), format_number(one.time_ratio)});
        table.rows.push_back({.cells = std::move(cells)});
        if (one.changes.empty()) table.rows.back().style = TableRow::Style::dominated;
    }
    table.note = fmt::format(
        "Without, with: the run without and with the switch, all else as in the setting named; an option is off in "
        "both. Change: the larger over the smaller value, from a factor of {:g} on; values below a floor count as the "
        "floor (0.01 mm, 0.01 N and so on: the floors are in {}). Residual penetration, forces and their errors come "
        "before the audit and signal figures, a failed run before all. Time: median tick with over without, geometric "
        "mean over the scenes, one process each: ratios near 1 mean nothing. A switch without effect alone may matter "
        "together with others or on a scene that reaches it.",
        significant_factor, code("src/report/ablation_section.cpp"));
    return table;
}

Table all_changes(const Ablation& ablation) {
    Table table;
    table.caption = "Every change of every switch, scene by scene";
    table.columns = {
        {"switch", false}, {"rest as in", false}, {"scene", false}, {"without → with, largest first", false}};
    table.folded = true;
    for (const Turned& one : ablation.turned) {
        std::vector<std::string> scenes;  // in order of their largest change
        std::map<std::string, std::vector<std::string>> lines;
        for (const Change& change : one.changes) {
            auto& line = lines[change.scene];
            if (line.empty()) scenes.push_back(change.scene);
            line.push_back(fmt::format("{}: {} → {}", change.figure, change.without, change.with));
        }
        for (const std::string& scene : scenes) {
            table.rows.push_back({.cells = {switch_text(ablation, one), ablation.rest(one), scene,
                                            fmt::format("{}", fmt::join(lines.at(scene), "; "))}});
        }
    }
    return table;
}

/// How the two settings themselves differ on every scene.
Table end_points(const Ablation& ablation, const std::vector<Record>& records) {
    Table table;
    table.caption = fmt::format("{} against {}, all switches at once", code(ablation.from), code(ablation.to));
    table.columns = {{"scene", false}, {"class", false}, {"from → to, largest first", false}};
    std::map<std::string, std::array<const Record*, 2>> ends;
    for (const Record& record : records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "ablation" || !spec.knob.empty() || spec.repetition != 0) continue;
        if (spec.point != "from" && spec.point != "to") continue;  // the ends with something else set
        ends[spec.scene].at(spec.point == "from" ? 0 : 1) = &record;
    }
    for (const auto& [scene, pair] : ends) {
        if (pair[0] == nullptr || pair[1] == nullptr) continue;
        std::vector<Change> changes;
        compare(*pair[0], *pair[1], changes);
        std::stable_sort(changes.begin(), changes.end(), larger);
        std::vector<std::string> parts;
        parts.reserve(changes.size());
        for (const Change& change : changes) {
            parts.push_back(fmt::format("{}: {} → {}", change.figure, change.without, change.with));
        }
        table.rows.push_back(
            {.cells = {scene, pair[0]->spec.pair_class, parts.empty() ? "nothing beyond the floors" : joined(parts)}});
    }
    return table;
}

}  // namespace

std::string ablation_sentence(const Draft& draft) {
    const std::optional<Ablation> ablation = gather(draft.records);
    return ablation && !ablation->turned.empty() ? sentence_of(*ablation) : std::string();
}

Table ablation_table(const Draft& draft) {
    const std::optional<Ablation> ablation = gather(draft.records);
    return ablation ? main_table(*ablation) : Table{};
}

void add_ablation(Draft& draft) {
    const std::optional<Ablation> ablation = gather(draft.records);
    if (!ablation) return;
    draft.heading(2, "What each switch changes");
    const std::string sentence = ablation->turned.empty() ? std::string() : sentence_of(*ablation);
    if (!sentence.empty() && sentence != draft.sentence) draft.paragraph(sentence);  // page 1 may have it
    draft.add(main_table(*ablation));
    draft.add(where_table(*ablation));
    draft.figure("switches", outputs_chart(*ablation),
                 "Largest effect of each switch over all scenes and figures, in decades; both surroundings stacked. A "
                 "run that fails counts as four decades.");
    draft.add(end_points(*ablation, draft.records));
    draft.add(all_changes(*ablation));
}

}  // namespace trocar
