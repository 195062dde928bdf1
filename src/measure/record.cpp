#include "measure/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "geometry/json_depth.hpp"
#include "geometry/number_text.hpp"
#include "geometry/size_limits.hpp"
#include "measure/environment.hpp"
#include "measure/row_columns.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;

/// Members of RunSpec by name, for both directions.
template <typename Spec, typename Visit>
void visit_spec(Spec& spec, Visit&& visit) {
    visit("study", spec.study);
    visit("mode", spec.mode);
    visit("scene", spec.scene);
    visit("scene_file", spec.scene_file);
    visit("scene_hash", spec.scene_hash);
    visit("pair_class", spec.pair_class);
    visit("detector", spec.detector);
    visit("response", spec.response);
    visit("contacts", spec.contacts);
    visit("setting", spec.setting);
    visit("repetition", spec.repetition);
    visit("seed", spec.seed);
    visit("ticks", spec.ticks);
    visit("truth_stride", spec.truth_stride);
}

/// Members that are only written where they say something.
template <typename Spec, typename Visit>
void visit_optional_spec(Spec& spec, Visit&& visit) {
    visit("stepper", spec.stepper);
    visit("against", spec.against);
    visit("device", spec.device);
    visit("overrides", spec.overrides);
    visit("knob", spec.knob);
    visit("point", spec.point);
}

Json to_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json to_json(OutcomeKind kind) { return name_of(kind); }
Json to_json(const std::string& text) { return text; }
Json to_json(Index value) { return value; }
Json to_json(std::int64_t value) { return value; }
Json to_json(std::uint64_t value) { return value; }
Json to_json(bool value) { return value; }

/// Where a value was expected to be of another kind.
struct Mismatch {
    std::string expected;
};

void from_json_value(const Json& json, double& value) {
    if (json.is_null()) {
        value = std::numeric_limits<double>::quiet_NaN();
    } else if (json.is_number()) {
        value = json.get<double>();
    } else {
        throw Mismatch{"a number or null"};
    }
}
/// A body's number.
void from_json_value(const Json& json, Index& value) {
    constexpr std::int64_t most = std::numeric_limits<Index>::max();
    const bool fits = json.is_number_integer() && json.get<std::int64_t>() >= 0 && json.get<std::int64_t>() <= most;
    if (!fits) throw Mismatch{"a body number"};
    value = json.get<Index>();
}
void from_json_value(const Json& json, std::int64_t& value) {
    if (!json.is_number_integer()) throw Mismatch{"an integer"};
    value = json.get<std::int64_t>();
}
void from_json_value(const Json& json, std::uint64_t& value) {
    if (!json.is_number_unsigned()) throw Mismatch{"an integer >= 0"};
    value = json.get<std::uint64_t>();
}
void from_json_value(const Json& json, bool& value) {
    if (!json.is_boolean()) throw Mismatch{"true or false"};
    value = json.get<bool>();
}
void from_json_value(const Json& json, std::string& value) {
    if (!json.is_string()) throw Mismatch{"a text"};
    value = json.get<std::string>();
}
void from_json_value(const Json& json, OutcomeKind& value) {
    if (!json.is_string()) throw Mismatch{"an outcome"};
    value = outcome_kind_from(json.get<std::string>());
}

class Reader {
public:
    Reader(std::string file, std::int64_t line) : file_(std::move(file)), line_(line) {}

    [[noreturn]] void fail(const std::string& where, const std::string& expected, const std::string& found) const {
        throw InputError(file_, fmt::format("line {}{}{}", line_, where.empty() ? "" : ": ", where), expected, found);
    }

    template <typename Value>
    void read(const Json& json, const std::string& where, Value& value) const {
        try {
            from_json_value(json, value);
        } catch (const Mismatch& mismatch) {
            fail(where, mismatch.expected, json.dump().substr(0, 80));
        } catch (const InputError&) {
            fail(where, "an outcome", json.dump().substr(0, 80));
        }
    }

    const Json& member(const Json& object, const std::string& where, const std::string& key) const {
        if (!object.is_object()) fail(where, "an object", object.type_name());
        const auto found = object.find(key);
        if (found == object.end()) fail(where + "/" + key, "this key", "nothing");
        return *found;
    }

    /// Refuses a text that whoever reads the record takes as a number, where it is none within these bounds.
    void check_number(const std::string& where, const std::string& text, double low, double high) const {
        const std::optional<double> value = number_of_text<double>(text);
        if (value && low <= *value && *value <= high) return;
        fail(where, fmt::format("a text with a number from {:g} to {:g}", low, high), Json(text).dump().substr(0, 80));
    }

    /// Refuses keys that `known` does not hold.
    void check_keys(const Json& object, const std::string& where, const std::vector<std::string>& known) const {
        for (const auto& [key, value] : object.items()) {
            if (std::find(known.begin(), known.end(), key) == known.end()) {
                fail(where, fmt::format("one of the keys {}", fmt::join(known, ", ")), "'" + key + "'");
            }
        }
    }

private:
    std::string file_;
    std::int64_t line_;
};

/// A column in the shortest of its forms: [v, …] · {"all": v} · {"from": i} for i, i+1, … · {"every": k, "values": […],
/// "last": v} when only every k-th entry and perhaps the last are set (truth is computed on every k-th tick).
Json compact_column(const Json& values, const Json& unset) {
    const std::size_t count = values.size();
    constexpr std::size_t worth_it = 8;
    if (count < worth_it) return values;
    if (std::all_of(values.begin(), values.end(), [&values](const Json& v) { return v == values[0]; })) {
        return {{"all", values[0]}};
    }
    bool consecutive = true;
    std::size_t every = 0;
    for (std::size_t i = 0; i < count; ++i) {
        consecutive = consecutive && values[i].is_number_integer() &&
                      values[i].get<std::int64_t>() == values[0].get<std::int64_t>() + static_cast<std::int64_t>(i);
        if (i + 1 < count && values[i] != unset) every = std::gcd(every, i);
    }
    if (consecutive) return {{"from", values[0]}};
    if (every == 0) every = count;
    if (every < 2) return values;
    Json kept = Json::array();
    for (std::size_t i = 0; i + 1 < count; i += every) kept.push_back(values[i]);
    return {{"every", every}, {"values", kept}, {"last", values[count - 1]}};
}

/// Inverse of compact_column; null when the column has none of its forms or another length.
Json expanded_column(const Json& column, std::size_t count, const Json& unset) {
    if (column.is_array()) return column.size() == count ? column : Json();
    if (!column.is_object()) return {};
    Json values = Json::array();
    if (column.size() == 1 && column.contains("all")) {
        for (std::size_t i = 0; i < count; ++i) values.push_back(column["all"]);
        return values;
    }
    if (column.size() == 1 && column.contains("from") && column["from"].is_number_integer()) {
        const auto first = column["from"].get<std::int64_t>();
        for (std::size_t i = 0; i < count; ++i) values.push_back(first + static_cast<std::int64_t>(i));
        return values;
    }
    if (column.size() != 3 || !column.contains("every") || !column.contains("values") || !column.contains("last") ||
        !column["every"].is_number_unsigned() || !column["values"].is_array()) {
        return {};
    }
    const auto every = column["every"].get<std::size_t>();
    const Json& kept = column["values"];
    if (count < 2 || every < 1 || every > count || kept.size() != (count - 2) / every + 1) return {};
    for (std::size_t i = 0; i + 1 < count; ++i) values.push_back(i % every == 0 ? kept[i / every] : unset);
    values.push_back(column["last"]);
    return values;
}

/// The step s with time = tick * s for every row, to the bit; 0 when there is none.
double seconds_per_tick(const std::vector<StepRow>& rows) {
    const auto moved = std::find_if(rows.begin(), rows.end(), [](const StepRow& row) { return row.tick > 0; });
    if (moved == rows.end()) return 0.0;
    const double step = moved->time / static_cast<double>(moved->tick);
    const bool exact = std::isfinite(step) && std::all_of(rows.begin(), rows.end(), [step](const StepRow& row) {
                           return row.time == static_cast<double>(row.tick) * step;
                       });
    return exact ? step : 0.0;
}

Json rows_to_json(const std::vector<StepRow>& rows) {
    Json columns = Json::object();
    const StepRow unset_row;
    visit_row(unset_row, [&columns](const std::string& name, const char*, const auto& unset) {
        columns[name] = {{"unset", to_json(unset)}, {"values", Json::array()}};
    });
    for (const StepRow& row : rows) {
        visit_row(row, [&columns](const std::string& name, const char*, const auto& value) {
            columns[name]["values"].push_back(to_json(value));
        });
    }
    Json json{{"count", rows.size()}};
    for (const auto& [name, column] : columns.items()) {
        const Json& values = column["values"];
        const bool unset = std::all_of(values.begin(), values.end(),
                                       [&column = column](const Json& value) { return value == column["unset"]; });
        if (!unset) json[name] = compact_column(values, column["unset"]);
    }
    if (const double step = seconds_per_tick(rows); step > 0.0) json["time"] = {{"per_tick", step}};
    return json;
}

std::vector<StepRow> rows_from_json(const Reader& reader, const Json& json) {
    std::uint64_t count = 0;
    reader.read(reader.member(json, "/rows", "count"), "/rows/count", count);
    if (are_sizes_limited() && count > most_record_ticks) {
        reader.fail("/rows/count", limit_text(most_record_ticks, "ticks of a record"), fmt::format("{}", count));
    }
    std::vector<std::string> known{"count"};
    const StepRow unset_row;
    visit_row(unset_row, [&known](const std::string& name, const char*, const auto&) { known.push_back(name); });
    reader.check_keys(json, "/rows", known);
    Json unset = Json::object();
    visit_row(unset_row,
              [&unset](const std::string& name, const char*, const auto& value) { unset[name] = to_json(value); });
    Json columns = Json::object();
    std::optional<double> seconds;
    for (const auto& [name, column] : json.items()) {
        if (name == "count") continue;
        if (name == "time" && column.is_object()) {
            double step = 0.0;
            reader.check_keys(column, "/rows/time", {"per_tick"});
            reader.read(reader.member(column, "/rows/time", "per_tick"), "/rows/time/per_tick", step);
            seconds = step;
            continue;
        }
        columns[name] = expanded_column(column, count, unset[name]);
        if (columns[name].is_null()) {
            reader.fail("/rows/" + name, fmt::format("{} values", count),
                        column.is_array() ? fmt::format("{} values", column.size()) : column.type_name());
        }
    }
    std::vector<StepRow> rows;
    if (json.size() > 1) rows.resize(count);
    if (rows.size() != count) reader.fail("/rows", fmt::format("columns for {} rows", count), "none");
    for (std::size_t i = 0; i < rows.size(); ++i) {
        visit_row(rows[i], [&](const std::string& name, const char*, auto& value) {
            const auto column = columns.find(name);
            if (column != columns.end()) reader.read((*column)[i], fmt::format("/rows/{}/{}", name, i), value);
        });
        if (seconds) rows[i].time = static_cast<double>(rows[i].tick) * *seconds;
    }
    return rows;
}

/// Members of ContactEvent by column name, for both directions.
template <typename Event, typename Visit>
void visit_event(Event& event, Visit&& visit) {
    visit("body_a", event.body_a);
    visit("body_b", event.body_b);
    visit("begin", event.begin);
    visit("end", event.end);
    visit("seen", event.seen);
}

/// Columns like those of the rows.
Json events_to_json(const std::vector<ContactEvent>& events) {
    Json json = Json::object();
    const ContactEvent unset;
    visit_event(unset, [&json](const char* name, const auto&) { json[name] = Json::array(); });
    for (const ContactEvent& event : events) {
        visit_event(event, [&json](const char* name, const auto& value) { json[name].push_back(to_json(value)); });
    }
    return json;
}

std::vector<ContactEvent> events_from_json(const Reader& reader, const Json& json) {
    std::vector<std::string> names;
    const ContactEvent unset;
    visit_event(unset, [&names](const char* name, const auto&) { names.emplace_back(name); });
    reader.check_keys(json, "/events", names);
    std::vector<ContactEvent> events(reader.member(json, "/events", names.front()).size());
    for (const std::string& name : names) {
        const Json& column = reader.member(json, "/events", name);
        if (column.is_array() && column.size() == events.size()) continue;
        reader.fail("/events/" + name, fmt::format("{} values", events.size()), column.type_name());
    }
    for (std::size_t i = 0; i < events.size(); ++i) {
        visit_event(events[i], [&](const char* name, auto& value) {
            reader.read(json[name][i], fmt::format("/events/{}/{}", name, i), value);
        });
    }
    return events;
}

Json spec_to_json(const RunSpec& spec) {
    Json json = Json::object();
    visit_spec(spec, [&json](const char* name, const auto& value) { json[name] = to_json(value); });
    visit_optional_spec(spec, [&json](const char* name, const std::string& value) {
        if (!value.empty()) json[name] = value;
    });
    if (spec.detail_stride != 1) json["detail_stride"] = spec.detail_stride;
    if (spec.between_ticks) json["between_ticks"] = true;
    return json;
}

/// A method's message may hold any bytes; a record must stay readable.
std::string line_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

Record started_record(const RunSpec& spec) {
    Record record;
    record.spec = spec;
    record.environment = environment();
    return record;
}

std::string to_json_line(const Record& record) {
    Json summary = Json::object();
    for (const auto& [metric, value] : record.summary) summary[std::string(info_of(metric).name)] = to_json(value);
    Json json{{"spec", spec_to_json(record.spec)},
              {"outcome", name_of(record.outcome.kind)},
              {"message", record.outcome.message},
              {"frames_hash", record.frames_hash},
              {"state_hash", record.state_hash},
              {"environment", record.environment},
              {"summary", summary},
              {"rows", rows_to_json(record.rows)}};
    if (record.spec.between_ticks) json["events"] = events_to_json(record.events);
    return line_of(json);
}

bool is_timed(const RunSpec& spec) {
    return spec.mode != "hard_case" && spec.mode != "metamorphic" && spec.mode != "resolution";
}

std::string run_id(const RunSpec& spec) {
    FnvHash hash;
    hash.add_text(line_of(spec_to_json(spec)));
    return hash.text();
}

Record record_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number) {
    const Reader reader(file, line_number);
    if (is_nested_too_deep(line)) {
        reader.fail("", fmt::format("at most {} levels of lists and objects", deepest_json), "more");
    }
    Json json;
    try {
        json = Json::parse(line);
    } catch (const Json::parse_error& error) {
        reader.fail(fmt::format("byte {}", error.byte), "a record as one JSON object", "what is no JSON");
    } catch (const Json::out_of_range&) {
        reader.fail("", "numbers that a double can hold", "one beyond 1.8e308");
    }
    const auto text = [&](const char* key) {
        std::string value;
        reader.read(reader.member(json, "", key), std::string("/") + key, value);
        return value;
    };
    Record record;
    const Json& spec = reader.member(json, "", "spec");
    std::vector<std::string> known;
    visit_spec(record.spec, [&](const char* name, auto& value) {
        known.emplace_back(name);
        reader.read(reader.member(spec, "/spec", name), std::string("/spec/") + name, value);
    });
    known.emplace_back("between_ticks");  // written only where it is true
    if (spec.contains("between_ticks")) {
        reader.read(spec["between_ticks"], "/spec/between_ticks", record.spec.between_ticks);
    }
    known.emplace_back("detail_stride");  // written only where it is not 1
    if (spec.contains("detail_stride")) {
        reader.read(spec["detail_stride"], "/spec/detail_stride", record.spec.detail_stride);
    }
    visit_optional_spec(record.spec, [&](const char* name, std::string& value) {
        known.emplace_back(name);
        if (spec.contains(name)) reader.read(spec[name], std::string("/spec/") + name, value);
    });
    reader.check_keys(spec, "/spec", known);
    reader.check_keys(
        json, "",
        {"spec", "outcome", "message", "frames_hash", "state_hash", "environment", "summary", "rows", "events"});
    if (json.contains("events")) record.events = events_from_json(reader, json["events"]);
    reader.read(reader.member(json, "", "outcome"), "/outcome", record.outcome.kind);
    record.outcome.message = text("message");
    record.frames_hash = text("frames_hash");
    record.state_hash = text("state_hash");
    for (const auto& [key, value] : reader.member(json, "", "environment").items()) {
        std::string& fact = record.environment[key];
        reader.read(value, "/environment/" + key, fact);
        if (key == "run.tissue_triangles" || key.starts_with("case.at_most.")) {
            reader.check_number("/environment/" + key, fact, -1e300, 1e300);
        }
    }
    for (const auto& [key, value] : reader.member(json, "", "summary").items()) {
        const std::optional<Metric> metric = metric_named(key);
        if (!metric) reader.fail("/summary/" + key, "a metric of trocar schema figures", "'" + key + "'");
        reader.read(value, "/summary/" + key, record.summary[*metric]);
    }
    record.rows = rows_from_json(reader, reader.member(json, "", "rows"));
    return record;
}

std::filesystem::path records_file(const std::filesystem::path& folder) {
    const std::filesystem::path compressed = folder / records_name;
    const std::filesystem::path plain = folder / "records.jsonl";
    return !std::filesystem::exists(compressed) && std::filesystem::exists(plain) ? plain : compressed;
}

}  // namespace trocar
