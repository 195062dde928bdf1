// Does the winner change when a scene is left out, when another figure decides, or when the other quantile of time
// does? A verdict that hangs on one choice is reported as such.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include "report/sections.hpp"

namespace trocar {
namespace {

struct Rule {
    const char* name;
    double (*error)(const VerdictRow& row);  ///< null: the order of the verdict's rows
};

constexpr Rule pairs_wrong{"false negatives + false positives", [](const VerdictRow& row) { return row.wrong(); }};
constexpr std::array rules{
    Rule{"residual penetration, max", [](const VerdictRow& row) { return as_printed(row.residual_max()); }},
    Rule{"residual penetration, median", [](const VerdictRow& row) { return as_printed(row.residual_median()); }},
    Rule{"depth error of contacts, worst",
         [](const VerdictRow& row) { return as_printed(row.ok.largest(Metric::depth_error_max_m)); }},
    Rule{"force error, equal k",
         [](const VerdictRow& row) {
             return as_printed(row.force_error(Metric::force_error_rms_equal_k, Metric::force_bound_equal_k).worst);
         }},
    Rule{"force error, hard contact",
         [](const VerdictRow& row) {
             return as_printed(row.force_error(Metric::force_error_rms_hard, Metric::force_bound_hard).worst);
         }},
    pairs_wrong,
    Rule{"time alone, median tick", [](const VerdictRow& row) { return row.p50.value; }},
    Rule{"time alone, p99", [](const VerdictRow& row) { return row.p99.value; }}};

/// Whether the row has the method as its detector or response; never for an empty name.
bool includes(const Method& who, const std::string& method) {
    return !method.empty() && (method_name(who.detector) == method || method_name(who.response) == method);
}

/// The row with the least error, the fastest of equals, or the first of the verdict; null when no row without a failure
/// has the figure.
enum class Among { all, ours, others };
const VerdictRow* winner(const Verdict& verdict, const Rule& rule, Among among, const std::string& without = {}) {
    const VerdictRow* best = nullptr;
    for (const VerdictRow& row : verdict.rows) {
        if (includes(row.method, without)) continue;
        if (among != Among::all && row.ours != (among == Among::ours)) continue;
        if (row.control || row.failed_runs > 0 || std::isnan(row.p50.value)) continue;
        if (rule.error == nullptr) return &row;
        if (std::isnan(rule.error(row))) continue;
        const auto rank = [&rule](const VerdictRow& r) { return std::tuple(rule.error(r), r.p50.value); };
        if (best == nullptr || rank(row) < rank(*best)) best = &row;
    }
    return best;
}

std::string label(const VerdictRow* row) { return row == nullptr ? "none" : code(row->method.label()); }

}  // namespace

void add_rank_robustness(Draft& draft) {
    const std::vector<std::string> scenes = draft.results.scenes(draft.mode);
    const auto verdict_of = [&draft](const std::vector<std::string>& some) {
        return make_verdict(draft.results, draft.reference, draft.mode, some);
    };
    const Verdict all = verdict_of(scenes);
    if (all.rows.size() < 2) return;
    const Rule main_rule = all.error_is_depth() ? Rule{"the order of the tables", nullptr} : pairs_wrong;
    const VerdictRow* const first = winner(all, main_rule, Among::all);
    if (first == nullptr) return;
    draft.heading(2, "Rank robustness");
    Table table;
    // A study that names no response as its own has nobody to set against the others.
    const std::string ours = common_fact(draft.records, "study.ours");
    std::set<std::string> winners;
    const auto add = [&](const std::string& what, const Verdict& verdict, const Rule& rule,
                         const std::string& without = {}) {
        const VerdictRow* const best = winner(verdict, rule, Among::all, without);
        if (best == nullptr) return;
        const bool is_gone = includes(first->method, without);
        if (!is_gone) winners.insert(best->method.label());
        table.rows.push_back({});
        add_cell(table, {"change"}, what);
        add_cell(table, {"winner"}, label(best));
        if (!ours.empty()) {
            add_cell(table, {"best of " + code(ours)}, label(winner(verdict, rule, Among::ours, without)));
            add_cell(table, {"best of the others"}, label(winner(verdict, rule, Among::others, without)));
        }
        add_cell(table, {"winner as with nothing changed"},
                 is_gone ? "left out itself" : yes_no(best->method == first->method));
    };
    add(fmt::format("nothing: {}, all scenes", main_rule.name), all, main_rule);
    if (scenes.size() > 1) {
        for (const std::string& out : scenes) {
            std::vector<std::string> rest = scenes;
            rest.erase(std::find(rest.begin(), rest.end(), out));
            add("scene " + out + " left out", verdict_of(rest), main_rule);
        }
    }
    for (const auto& [name, scene_list] : draft.scenes_by_class()) {
        if (scene_list.size() < scenes.size())
            add("scenes of class " + name + " alone", verdict_of(scene_list), main_rule);
    }
    std::set<std::string> methods;
    for (const VerdictRow& row : all.rows) {
        for (const std::string& text : {row.method.detector, row.method.response}) {
            if (!text.empty()) methods.insert(method_name(text));
        }
    }
    for (const std::string& method : methods) add(code(method) + " left out", all, main_rule, method);
    for (const Rule& rule : rules) {
        if (std::string(rule.name) != main_rule.name) add(std::string("judged by: ") + rule.name, all, rule);
    }
    table.note =
        "The winner has the least of the figure, the fastest of equals; the order of the tables is that of \"All "
        "methods\". Rows that failed on a scene cannot win. Each row has its error from its own runs alone, so that "
        "leaving a baseline out changes the winner only where it was itself the winner.";
    draft.paragraph(
        winners.size() == 1
            ? fmt::format("No: {} stays first whatever is left out or judged by.", label(first))
            : fmt::format("Yes: {} different rows come first, depending on scenes and figure.", winners.size()));
    draft.add(std::move(table));
}

}  // namespace trocar
