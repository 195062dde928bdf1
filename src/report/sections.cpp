#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "contact/outcome.hpp"
#include "report/verdict.hpp"

namespace trocar {

std::string code(const std::string& text) { return text.empty() ? std::string() : "`" + text + "`"; }

std::string method_name(const std::string& text) { return text.substr(0, text.find(':')); }

std::string outcome_text(const Outcome& outcome) {
    std::string text(name_of(outcome.kind));
    if (!outcome.message.empty()) text += " (" + outcome.message + ")";
    return text;
}

std::string joined(const std::vector<std::string>& items) { return fmt::format("{}", fmt::join(items, ", ")); }

std::string share_text(double part, double whole) {
    if (std::isnan(part) || std::isnan(whole) || whole <= 0.0) return "n/a";
    if (part == whole) return "1";
    const double share = part / whole;
    for (int digits = 3; digits < 9; ++digits) {
        std::string text = fmt::format("{:.{}f}", share, digits);
        if (text.front() != '1') return text;
    }
    return fmt::format("{:.10f}", share);
}

std::string count_text(double value) { return std::isnan(value) ? "n/a" : fmt::format("{:.0f}", value); }

std::string scaled(double value, double scale) {
    return std::isnan(value) ? std::string("n/a") : format_number(value * scale);
}

std::string yes_no(bool value) { return value ? "yes" : "no"; }

std::string common_fact(const std::vector<Record>& records, const std::string& key, bool* mixed) {
    std::set<std::string> values;
    for (const Record& record : records) {
        const auto found = record.environment.find(key);
        if (found != record.environment.end()) values.insert(found->second);
    }
    if (values.size() > 1 && mixed != nullptr) *mixed = true;
    return fmt::format("{}", fmt::join(values, " | "));
}

Draft::Draft(const std::vector<Record>& all) : records(all), results(all) {
    reference = common_fact(all, "study.reference");
    study = all.front().spec.study;
    mode = !results.methods("closed_loop").empty() ? "closed_loop" : "replay";
    document.title = "trocar study " + code(study);
}

void Draft::heading(int level, const std::string& text) { document.blocks.emplace_back(Heading{level, text}); }

void Draft::paragraph(const std::string& text, Paragraph::Style style) {
    document.blocks.emplace_back(Paragraph{text, style});
}

void Draft::add(Table table) {
    if (table.rows.empty()) return;
    document.blocks.emplace_back(std::move(table));
}

void Draft::figure(const std::string& name, const std::string& svg, const std::string& caption) {
    if (!svg.empty()) document.blocks.emplace_back(Figure{"charts/" + name + ".svg", svg, caption});
}

void Draft::figure(const std::string& name, const ScatterChart& chart, const std::string& caption) {
    if (chart.series.empty()) return;
    document.blocks.emplace_back(Figure{"charts/" + name + ".svg", draw(chart), caption, interactive(chart)});
}

void Draft::figure(const std::string& name, const LineChart& chart, const std::string& caption) {
    if (chart.lines.empty()) return;
    document.blocks.emplace_back(Figure{"charts/" + name + ".svg", draw(chart), caption, interactive(chart)});
}

std::map<std::string, std::vector<std::string>> Draft::scenes_by_class() const {
    std::map<std::string, std::vector<std::string>> classes;
    for (const std::string& scene : results.scenes(mode)) {
        if (!results.class_of(scene).empty()) classes[results.class_of(scene)].push_back(scene);
    }
    return classes;
}

int Draft::most_processes(const std::string& of_mode) const {
    std::int64_t most = 0;
    for (const Record& record : records) {
        if (of_mode.empty() || record.spec.mode == of_mode) most = std::max(most, record.spec.repetition + 1);
    }
    return static_cast<int>(most);
}

std::pair<std::string, std::vector<std::string>> Draft::headline_scenes() const {
    const auto classes = scenes_by_class();
    if (classes.empty()) return {};
    const auto tissue = classes.find("I2T");
    if (tissue != classes.end()) return {tissue->first, tissue->second};
    const auto most = std::max_element(classes.begin(), classes.end(),
                                       [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
    return {most->first, most->second};
}

std::string Draft::interval_note(const std::string& of_mode) const {
    const int processes = most_processes(of_mode);
    if (processes >= processes_for_interval) {
        return fmt::format(
            "Brackets: 95 % bootstrap interval over {} processes. Of a replay it is over blocks of ticks too, as long "
            "as neighbouring ticks depend on each other and drawn alike for all detectors of a scene, so that ratios "
            "are paired frame by frame; in a closed loop every method makes ticks of its own.",
            processes);
    }
    if (processes > 1) {
        return fmt::format(
            "Brackets: minimum to maximum over {} processes (95 % intervals need {}); they are no confidence "
            "intervals.",
            processes, processes_for_interval);
    }
    return "One process per method here: no interval can be given.";
}

}  // namespace trocar
