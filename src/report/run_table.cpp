#include "report/run_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/metrics.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"

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
    const char* meaning;  ///< of the column with the method's name; null: settings without one
    const char* setting;  ///< meaning of a column KEY.VALUE with {} for the value's name
};

const std::vector<Choice>& choices() {
    static const std::vector<Choice> list{
        {"detector", &RunSpec::detector, "Detector; empty: none",
         "Parameter {} of the detector, as in `trocar list`; empty: its default, or a detector without it"},
        {"response", &RunSpec::response, "Response; empty: none, frames from the scene's own stream",
         "Parameter {} of the response, as in `trocar list`; empty: its default, or a response without it"},
        {"contacts", &RunSpec::contacts, "Contact generator; empty: none",
         "Parameter {} of the contact generator, as in `trocar list`; empty: its default, or a generator without it"},
        {"stepper", &RunSpec::stepper, "Stepper, which moves the tissue; empty: the default one",
         "Parameter {} of the stepper, as in `trocar list`; empty: its default, or a stepper without it"},
        {"against", &RunSpec::against, "Second stepper, which runs the scene in step; empty: none",
         "Parameter {} of the second stepper, as in `trocar list`; empty: its default, or none"},
        {"device", &RunSpec::device, nullptr,
         "Setting {} of the device, which shows the force on the tool; empty: a run without a response"},
        {"overrides", &RunSpec::overrides, nullptr,
         "Value of {} that the study sets in the scene; empty: as the scene's file says"},
    };
    return list;
}

/// A word or a number of the specification that stands as it is.
struct PlainColumn {
    RunColumn column;
    std::string (*text)(const Record&);
};

RunColumn word(const char* name, const char* meaning, const char* source = "specification") {
    return {name, "text", "neither", meaning, source, false};
}

RunColumn whole(const char* name, const char* meaning) {
    return {name, "1", "neither", meaning, "specification", true};
}

const std::vector<PlainColumn>& plain_before() {
    static const std::vector<PlainColumn> list{
        {word("run_id", "Name of the run, unique in the study: hash over its specification, hexadecimal; never empty"),
         [](const Record& r) { return run_id(r.spec); }},
        {word("study", "Name of the study; empty: it has none"), [](const Record& r) { return r.spec.study; }},
        {word("mode", "Kind of run, such as replay or closed_loop; never empty"),
         [](const Record& r) { return r.spec.mode; }},
        {word("scene", "Name of the scene; empty: all scenes, for methods that cannot run together"),
         [](const Record& r) { return r.spec.scene; }},
        {word(
             "pair_class",
             "Kinds of the bodies that meet: I instrument, R rigid, T tissue; empty: two meshes, or no scene was read"),
         [](const Record& r) { return r.spec.pair_class; }},
        {word("method",
              "Method as reports print it: detector + response (contact generator) by stepper; empty: no detector and "
              "no response"),
         [](const Record& r) { return method_of(r.spec).label(); }},
    };
    return list;
}

const std::vector<PlainColumn>& plain_after() {
    static const std::vector<PlainColumn> list{
        {word("setting",
              "Settings of the methods: default, recommended, tuned, or a reading of what the author leaves open; "
              "empty: not stated"),
         [](const Record& r) { return r.spec.setting; }},
        {word("knob", "Name of what a sweep varies; empty: no sweep"), [](const Record& r) { return r.spec.knob; }},
        {word("point", "Value of what a sweep varies; empty: no sweep"), [](const Record& r) { return r.spec.point; }},
        {whole("repetition", "Number of the process, from 0; never empty"),
         [](const Record& r) { return fmt::format("{}", r.spec.repetition); }},
        {whole("seed", "Seed of the scene; never empty"),
         [](const Record& r) { return fmt::format("{}", r.spec.seed); }},
        {whole("ticks_planned", "Ticks that were asked for; never empty"),
         [](const Record& r) { return fmt::format("{}", r.spec.ticks); }},
        {whole("truth_stride", "Every n-th tick is judged by truth, 0: none; never empty"),
         [](const Record& r) { return fmt::format("{}", r.spec.truth_stride); }},
        {word("outcome", "Outcome of the run: ok, or how it failed; never empty", "run"),
         [](const Record& r) { return std::string(name_of(r.outcome.kind)); }},
        {word("message", "One sentence on the outcome; empty: nothing to say, as where it is ok", "run"),
         [](const Record& r) { return r.outcome.message; }},
        {word("machine", "Machine of the run: hash over host name and machine-id, hexadecimal; empty: not stated",
              "run"),
         [](const Record& r) { return fact_of(r, "machine"); }},
        {word("scene_hash", "Hash over the content of the scene and its meshes, hexadecimal; empty: no scene was read"),
         [](const Record& r) { return r.spec.scene_hash; }},
        {word("frames_hash", "Hash over all frames of a replay, hexadecimal; empty: no replay, or a failed one", "run"),
         [](const Record& r) { return r.frames_hash; }},
        {word("state_hash",
              "Hash over the last frame of a closed loop, hexadecimal; empty: no closed loop, or a failed one", "run"),
         [](const Record& r) { return r.state_hash; }},
    };
    return list;
}

/// A metric's meaning with that of an empty cell, and the modes whose cells all are.
std::string meaning_in_table(const MetricInfo& info, std::span<const Record> records) {
    std::map<std::string, bool> known;
    for (const Record& record : records) {
        known[record.spec.mode] |= !std::isnan(value_of(record.summary, info.metric));
    }
    std::string unknown;
    for (const auto& [mode, any] : known) {
        if (!any) unknown += (unknown.empty() ? "" : ", ") + mode;
    }
    return fmt::format("{}; empty: n/a, or the run failed{}", info.meaning,
                       unknown.empty() ? "" : fmt::format(" (all runs of mode {})", unknown));
}

double number_of(const std::string& text) { return text.empty() ? std::nan("") : std::strtod(text.c_str(), nullptr); }

}  // namespace

RunTable::RunTable(std::span<const Record> records) : records_(records), words_(records.size()) {
    const auto add_plain = [this](const std::vector<PlainColumn>& list) {
        for (const PlainColumn& plain : list) {
            columns_.push_back(plain.column);
            for (std::size_t row = 0; row < records_.size(); ++row) {
                words_[row][plain.column.name] = plain.text(records_[row]);
            }
        }
    };
    add_plain(plain_before());
    for (const Choice& choice : choices()) {
        const bool has_name = choice.meaning != nullptr;
        if (has_name) columns_.push_back({choice.column, "text", "neither", choice.meaning, "specification", false});
        std::set<std::string> keys;
        for (std::size_t row = 0; row < records_.size(); ++row) {
            const NamedValues parts = taken_apart(records_[row].spec.*choice.text, has_name);
            if (has_name) words_[row][choice.column] = parts.name;
            for (const auto& [key, value] : parts.values) {
                keys.insert(key);
                words_[row][fmt::format("{}.{}", choice.column, key)] = value;
            }
        }
        for (const std::string& key : keys) {
            columns_.push_back({fmt::format("{}.{}", choice.column, key), "text", "neither",
                                fmt::format(fmt::runtime(choice.setting), key), "specification", false});
        }
    }
    add_plain(plain_after());
    for (const Metric metric : used_metrics(records_)) {
        const MetricInfo& info = info_of(metric);
        columns_.push_back({std::string(info.name), std::string(info.unit), std::string(name_of(info.better)),
                            meaning_in_table(info, records_), std::string(text_of(info.source)), true, metric});
    }
}

RunValue RunTable::value(std::size_t row, std::size_t column) const {
    const RunColumn& wanted = columns_[column];
    if (wanted.metric) return {.word = {}, .number = value_of(records_[row].summary, *wanted.metric)};
    const auto found = words_[row].find(wanted.name);  // a parameter of other methods has no entry
    const std::string word = found == words_[row].end() ? "" : found->second;
    return {.word = word, .number = wanted.number ? number_of(word) : std::nan("")};
}

std::string RunTable::text(std::size_t row, std::size_t column) const {
    const RunValue cell = value(row, column);
    return columns_[column].number && cell.word.empty() ? format_exact(cell.number) : cell.word;
}

std::vector<std::size_t> RunTable::filled_columns() const {
    std::vector<std::size_t> filled;
    for (std::size_t column = 0; column < columns_.size(); ++column) {
        bool any = false;
        for (std::size_t row = 0; row < row_count() && !any; ++row) any = !text(row, column).empty();
        if (any) filled.push_back(column);
    }
    return filled;
}

std::int64_t RunTable::find(const std::string& name) const {
    const auto found =
        std::find_if(columns_.begin(), columns_.end(), [&](const RunColumn& column) { return column.name == name; });
    return found == columns_.end() ? -1 : found - columns_.begin();
}

std::set<Metric> used_metrics(std::span<const Record> records) {
    std::set<Metric> used;
    for (const Record& record : records) {
        for (const auto& [metric, value] : record.summary) used.insert(metric);
    }
    return used;
}

std::map<std::string, std::string> results_files(const std::vector<Record>& records) {
    const RunTable table(records);
    const std::vector<std::size_t> filled = table.filled_columns();
    std::vector<std::string> fields;
    std::string figures = "name,unit,better,meaning,source\n";
    for (const std::size_t index : filled) {
        const RunColumn& column = table.columns()[index];
        fields.push_back(column.name);
        figures += csv_line({column.name, column.unit, column.better, column.meaning, column.source});
    }
    std::string results = csv_line(fields);
    for (std::size_t row = 0; row < table.row_count(); ++row) {
        for (std::size_t c = 0; c < filled.size(); ++c) fields[c] = table.text(row, filled[c]);
        results += csv_line(fields);
    }
    return {{"results.csv", std::move(results)}, {"figures.csv", std::move(figures)}};
}

}  // namespace trocar
