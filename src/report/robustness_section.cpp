// Does the winner change when a scene is left out, when another figure decides, or when the other quantile of time
// does? A verdict that hangs on one choice is reported as such.
#include <fmt/format.h>

#include <algorithm>
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

double residual_worst(const VerdictRow& row) { return as_printed(row.residual_penetration_max_m); }
double residual_median(const VerdictRow& row) { return as_printed(row.residual_penetration_median_m); }
double depth_error(const VerdictRow& row) { return as_printed(row.depth_error_max_m); }
double force_equal_k(const VerdictRow& row) { return as_printed(row.force_error_rms_equal_k); }
double force_hard(const VerdictRow& row) { return as_printed(row.force_error_rms_hard); }
double pairs_wrong(const VerdictRow& row) { return row.wrong(); }
double time_p50(const VerdictRow& row) { return row.p50.value; }
double time_p99(const VerdictRow& row) { return row.p99.value; }

/// The row with the least error, the fastest of equals, or the first of the verdict; null when no row without a failure
/// has the figure.
enum class Among { all, ours, others };
const VerdictRow* winner(const Verdict& verdict, const Rule& rule, Among among, const std::string& without = {}) {
    const VerdictRow* best = nullptr;
    for (const VerdictRow& row : verdict.rows) {
        const Method& who = row.method;
        if (!without.empty() && (method_name(who.detector) == without || method_name(who.response) == without))
            continue;
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
    const Rule main_rule = all.error_is_depth() ? Rule{"the order of the tables", nullptr}
                                                : Rule{"false negatives + false positives", pairs_wrong};
    const VerdictRow* const first = winner(all, main_rule, Among::all);
    if (first == nullptr) return;
    draft.heading(2, "Rank robustness");
    Table table;
    table.columns = {{"change", false}, {"winner", false}, {"winner as with nothing changed", false}};
    // A study that names no response as its own has nobody to set against the others.
    const std::string ours = common_fact(draft.records, "study.ours");
    if (!ours.empty()) {
        table.columns.insert(table.columns.begin() + 2,
                             {{"best of " + code(ours), false}, {"best of the others", false}});
    }
    std::set<std::string> winners;
    const auto add = [&](const std::string& what, const Verdict& verdict, const Rule& rule,
                         const std::string& without = {}) {
        const VerdictRow* const best = winner(verdict, rule, Among::all, without);
        if (best == nullptr) return;
        const Method& main = first->method;
        const bool is_gone =
            !without.empty() && (method_name(main.detector) == without || method_name(main.response) == without);
        if (!is_gone) winners.insert(best->method.label());
        TableRow row{.cells = {what, label(best)}};
        if (!ours.empty()) {
            for (const Among among : {Among::ours, Among::others}) {
                row.cells.push_back(label(winner(verdict, rule, among, without)));
            }
        }
        row.cells.push_back(is_gone ? "left out itself" : yes_no(best->method == main));
        table.rows.push_back(std::move(row));
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
    for (const Rule& rule :
         {Rule{"residual penetration, max", residual_worst}, Rule{"residual penetration, median", residual_median},
          Rule{"depth error of contacts, worst", depth_error}, Rule{"force error, equal k", force_equal_k},
          Rule{"force error, hard contact", force_hard}, Rule{"false negatives + false positives", pairs_wrong},
          Rule{"time alone, median tick", time_p50}, Rule{"time alone, p99", time_p99}}) {
        if (std::string(rule.name) != main_rule.name) add(std::string("judged by: ") + rule.name, all, rule);
    }
    table.note =
        "The winner has the least of the figure, the fastest of equals; the order of the tables is that of \"All "
        "methods\". Rows that failed on a scene cannot win. Each row has its error from its own runs alone, so that "
        "leaving a baseline out changes the winner only where it was itself the winner; in the performance profile it "
        "can change the order among those that are not best, which is reported there.";
    draft.paragraph(
        winners.size() == 1
            ? fmt::format("No: {} stays first whatever is left out or judged by.", label(first))
            : fmt::format("Yes: {} different rows come first, depending on scenes and figure.", winners.size()));
    draft.add(std::move(table));
}

}  // namespace trocar
