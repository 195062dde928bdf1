#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "report/verdict.hpp"

namespace trocar {

std::string common_fact(const std::vector<Record>& records, const std::string& key, bool* mixed) {
    std::set<std::string> values;
    for (const Record& record : records) {
        if (record.environment.contains(key)) values.insert(fact_of(record, key));
    }
    if (values.size() > 1 && mixed != nullptr) *mixed = true;
    constexpr std::size_t most = 8;
    if (values.size() <= most) return fmt::format("{}", fmt::join(values, " | "));
    return fmt::format("{} | and {} more", fmt::join(values.begin(), std::next(values.begin(), most), " | "),
                       values.size() - most);
}

bool are_of_several_machines(const std::vector<Record>& records) {
    bool several = false;
    (void)common_fact(records, "machine", &several);
    return several;
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
    if (table.rows.size() > most_table_rows) {
        paragraph(table.caption + ": " + std::to_string(table.rows.size()) + " rows, which results.csv has.",
                  Paragraph::Style::small);
        return;
    }
    document.blocks.emplace_back(std::move(table));
}

void Draft::drawing(const std::string& name, const std::string& svg, const std::string& caption) {
    document.blocks.emplace_back(Figure{"charts/" + name + ".svg", svg, caption});
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

std::int64_t Draft::widest_stride(const std::string& of_mode, std::int64_t RunSpec::*stride) const {
    std::int64_t widest = 1;
    for (const Record& record : records) {
        if (record.spec.mode == of_mode) widest = std::max(widest, record.spec.*stride);
    }
    return widest;
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
