#include "report/run_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/metrics.hpp"
#include "report/document.hpp"

namespace trocar {
namespace {

/// "NAME:key=value,…" or, without a name, "key=value,…".
struct NamedValues {
    std::string name;
    std::map<std::string, std::string> values;
};

NamedValues taken_apart(const std::string& text, bool has_name) {
    NamedValues parts;
    const std::size_t colon = has_name ? text.find(':') : 0;
    parts.name = has_name ? text.substr(0, colon) : "";
    if (colon == std::string::npos) return parts;
    const std::string list = has_name ? text.substr(colon + 1) : text;
    for (std::size_t start = 0; start < list.size();) {
        const std::size_t end = std::min(list.find(',', start), list.size());
        const std::string entry = list.substr(start, end - start);
        const std::size_t equals = entry.find('=');
        if (equals != std::string::npos) parts.values[entry.substr(0, equals)] = entry.substr(equals + 1);
        start = end + 1;
    }
    return parts;
}

/// A method, or a list of settings, of a specification.
struct Choice {
    const char* column;
    std::string RunSpec::*text;
    bool has_name;
    const char* meaning;
};

const std::vector<Choice>& choices() {
    static const std::vector<Choice> list{
        {"detector", &RunSpec::detector, true, "Detector"},
        {"response", &RunSpec::response, true, "Response; empty: none, frames from the scene's own stream"},
        {"contacts", &RunSpec::contacts, true, "Contact generator; empty: none"},
        {"stepper", &RunSpec::stepper, true, "What moves the tissue; empty: the default one"},
        {"device", &RunSpec::device, false, "what shows the force on the tool"},
        {"overrides", &RunSpec::overrides, false, "the scene that was turned; empty: as its file says"},
    };
    return list;
}

/// A word or a number of the specification that stands as it is.
struct PlainColumn {
    RunColumn column;
    std::string (*text)(const Record&);
};

const std::vector<PlainColumn>& plain_before() {
    const auto word = [](const char* name, const char* meaning) {
        return RunColumn{name, "text", "neither", meaning, "specification", false};
    };
    static const std::vector<PlainColumn> list{
        {word("study", "Name of the study"), [](const Record& r) { return r.spec.study; }},
        {word("mode", "Kind of run"), [](const Record& r) { return r.spec.mode; }},
        {word("scene", "Name of the scene"), [](const Record& r) { return r.spec.scene; }},
        {word("pair_class", "Kinds of the two bodies: I instrument, R rigid, T tissue"),
         [](const Record& r) { return r.spec.pair_class; }},
    };
    return list;
}

const std::vector<PlainColumn>& plain_after() {
    const auto word = [](const char* name, const char* meaning, const char* source = "specification") {
        return RunColumn{name, "text", "neither", meaning, source, false};
    };
    const auto whole = [](const char* name, const char* meaning) {
        return RunColumn{name, "1", "neither", meaning, "specification", true};
    };
    static const std::vector<PlainColumn> list{
        {word("setting", "Settings of the methods: default, recommended or tuned"),
         [](const Record& r) { return r.spec.setting; }},
        {word("knob", "What a work-precision part turns; empty: nothing"), [](const Record& r) { return r.spec.knob; }},
        {word("point", "Where the knob stands"), [](const Record& r) { return r.spec.point; }},
        {RunColumn{"query_distance_margin", "mean edges", "neither",
                   "Margin of the query distance; empty: the default one", "specification", true},
         [](const Record& r) { return r.spec.query_distance_margin; }},
        {whole("repetition", "Number of the process"),
         [](const Record& r) { return fmt::format("{}", r.spec.repetition); }},
        {whole("seed", "Seed of the scene"), [](const Record& r) { return fmt::format("{}", r.spec.seed); }},
        {whole("ticks_planned", "Ticks that were asked for"),
         [](const Record& r) { return fmt::format("{}", r.spec.ticks); }},
        {whole("truth_stride", "Every n-th tick is judged; 0: none"),
         [](const Record& r) { return fmt::format("{}", r.spec.truth_stride); }},
        {word("outcome", "ok, or how the run failed", "run"),
         [](const Record& r) { return std::string(name_of(r.outcome.kind)); }},
        {word("message", "One sentence where the outcome is not ok", "run"),
         [](const Record& r) { return r.outcome.message; }},
        {word("scene_hash", "Over the content of the scene and its meshes, hexadecimal"),
         [](const Record& r) { return r.spec.scene_hash; }},
        {word("frames_hash", "Over all frames of a replay, hexadecimal", "run"),
         [](const Record& r) { return r.frames_hash; }},
        {word("state_hash", "Over the last frame of a closed loop, hexadecimal", "run"),
         [](const Record& r) { return r.state_hash; }},
    };
    return list;
}

double number_of(const std::string& text) {
    if (text.empty()) return std::nan("");
    return std::strtod(text.c_str(), nullptr);
}

/// The columns that a file holds: a number that no run knows has none.
std::vector<std::size_t> known_columns(const RunTable& table) {
    std::vector<std::size_t> known;
    for (std::size_t column = 0; column < table.columns().size(); ++column) {
        bool any = !table.columns()[column].number;
        for (std::size_t row = 0; row < table.row_count() && !any; ++row) any = !table.text(row, column).empty();
        if (any) known.push_back(column);
    }
    return known;
}

std::string csv_of(const RunTable& table, const std::vector<std::size_t>& columns) {
    std::string csv;
    for (const std::size_t column : columns) csv += (csv.empty() ? "" : ",") + csv_field(table.columns()[column].name);
    csv += "\n";
    for (std::size_t row = 0; row < table.row_count(); ++row) {
        for (const std::size_t column : columns) {
            csv += (column == columns.front() ? "" : ",") + csv_field(table.text(row, column));
        }
        csv += "\n";
    }
    return csv;
}

}  // namespace

RunTable::RunTable(std::span<const Record* const> records)
    : records_(records.begin(), records.end()), words_(records.size()) {
    const auto add_plain = [this](const std::vector<PlainColumn>& list) {
        for (const PlainColumn& plain : list) {
            columns_.push_back(plain.column);
            for (std::size_t row = 0; row < records_.size(); ++row) {
                words_[row][plain.column.name] = plain.text(*records_[row]);
            }
        }
    };
    add_plain(plain_before());
    for (const Choice& choice : choices()) {
        if (choice.has_name) {
            columns_.push_back({choice.column, "text", "neither", choice.meaning, "specification", false});
        }
        std::set<std::string> keys;
        for (std::size_t row = 0; row < records_.size(); ++row) {
            const NamedValues parts = taken_apart(records_[row]->spec.*choice.text, choice.has_name);
            if (choice.has_name) words_[row][choice.column] = parts.name;
            for (const auto& [key, value] : parts.values) {
                keys.insert(key);
                words_[row][fmt::format("{}.{}", choice.column, key)] = value;
            }
        }
        for (const std::string& key : keys) {
            columns_.push_back({fmt::format("{}.{}", choice.column, key), "text", "neither",
                                choice.has_name
                                    ? fmt::format("Parameter {} of the {}, as in `trocar list`; empty: its default",
                                                  key, choice.column)
                                    : fmt::format("Setting {} of {}", key, choice.meaning),
                                "specification", false});
        }
    }
    add_plain(plain_after());
    std::set<Metric> known;
    for (const Record* record : records_) {
        for (const auto& [metric, value] : record->summary) known.insert(metric);
    }
    for (const Metric metric : known) {
        const MetricInfo& info = info_of(metric);
        columns_.push_back({std::string(info.name), std::string(info.unit), std::string(name_of(info.better)),
                            std::string(info.meaning), std::string(text_of(info.source)), true, metric});
    }
}

RunValue RunTable::value(std::size_t row, std::size_t column) const {
    const RunColumn& wanted = columns_[column];
    const auto word = words_[row].find(wanted.name);
    if (word != words_[row].end()) {
        return {.word = word->second, .number = wanted.number ? number_of(word->second) : std::nan("")};
    }
    return {.word = {}, .number = value_of(records_[row]->summary, wanted.metric.value())};
}

std::string RunTable::text(std::size_t row, std::size_t column) const {
    const RunValue cell = value(row, column);
    return columns_[column].number && cell.word.empty() ? format_exact(cell.number) : cell.word;
}

std::int64_t RunTable::find(const std::string& name) const {
    const auto found =
        std::find_if(columns_.begin(), columns_.end(), [&](const RunColumn& column) { return column.name == name; });
    return found == columns_.end() ? -1 : found - columns_.begin();
}

std::map<std::string, std::string> results_files(const std::vector<Record>& records, const std::string& main_mode) {
    std::map<std::string, std::vector<const Record*>> by_mode;
    for (const Record& record : records) by_mode[record.spec.mode].push_back(&record);
    std::map<std::string, std::string> files;
    if (records.empty()) return files;
    const std::string main = by_mode.contains(main_mode) ? main_mode : records.front().spec.mode;
    std::vector<RunColumn> columns;
    std::set<std::string> known;
    for (const auto& [mode, runs] : by_mode) {
        const RunTable table(runs);
        const std::vector<std::size_t> held = known_columns(table);
        files[mode == main ? "results.csv" : fmt::format("results_{}.csv", mode)] = csv_of(table, held);
        for (const std::size_t column : held) {
            if (known.insert(table.columns()[column].name).second) columns.push_back(table.columns()[column]);
        }
    }
    std::string& dictionary = files["figures.csv"];
    dictionary = "name,unit,better,meaning,source\n";
    for (const RunColumn& column : columns) {
        dictionary += fmt::format("{},{},{},{},{}\n", csv_field(column.name), csv_field(column.unit), column.better,
                                  csv_field(column.meaning), csv_field(column.source));
    }
    return files;
}

}  // namespace trocar
