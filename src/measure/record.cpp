#include "measure/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/input_error.hpp"

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

/// Members of StepRow by column name, for both directions.
template <typename Row, typename Visit>
void visit_row(Row& row, Visit&& visit) {
    visit("tick", row.tick);
    visit("time", row.time);
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        visit(fmt::format("{}_ns", stage_names.at(stage)), row.stage_ns.at(stage));
    }
    visit("pairs", row.pairs);
    visit("contacts", row.contacts);
    visit("native_contacts", row.native_contacts);
    visit("true_pairs", row.true_pairs);
    visit("true_touch", row.true_touch);
    visit("missing", row.missing);
    visit("extra", row.extra);
    visit("missing_touch", row.missing_touch);
    visit("max_depth", row.max_depth);
    visit("mean_depth", row.mean_depth);
    visit("depth_error", row.depth_error);
    visit("native_depth_error", row.native_depth_error);
    visit("wrong_side", row.wrong_side);
    visit("tool_force_x", row.tool_force.x());
    visit("tool_force_y", row.tool_force.y());
    visit("tool_force_z", row.tool_force.z());
    visit("max_strain", row.max_strain);
    visit("ruptures", row.ruptures);
    visit("skipped", row.skipped);
    visit("no_hit", row.no_hit);
    visit("limited_edges", row.limited_edges);
    visit("allocations", row.allocations);
    visit("vertices_read", row.work.vertices_read);
    visit("cells_visited", row.work.cells_visited);
    visit("box_tests", row.work.box_tests);
    visit("triangle_tests", row.work.triangle_tests);
    visit("truncated", row.truncated);
    visit("outcome", row.outcome);
}

Json to_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json to_json(OutcomeKind kind) { return name_of(kind); }
Json to_json(const std::string& text) { return text; }
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

Json rows_to_json(const std::vector<StepRow>& rows) {
    Json columns = Json::object();
    const StepRow unset_row;
    visit_row(unset_row, [&columns](const std::string& name, const auto& unset) {
        columns[name] = {{"unset", to_json(unset)}, {"values", Json::array()}};
    });
    for (const StepRow& row : rows) {
        visit_row(row, [&columns](const std::string& name, const auto& value) {
            columns[name]["values"].push_back(to_json(value));
        });
    }
    Json json{{"count", rows.size()}};
    for (const auto& [name, column] : columns.items()) {
        const Json& values = column["values"];
        const bool unset = std::all_of(values.begin(), values.end(),
                                       [&column = column](const Json& value) { return value == column["unset"]; });
        if (!unset) json[name] = values;
    }
    return json;
}

std::vector<StepRow> rows_from_json(const Reader& reader, const Json& json) {
    std::uint64_t count = 0;
    reader.read(reader.member(json, "/rows", "count"), "/rows/count", count);
    std::vector<std::string> known{"count"};
    const StepRow unset_row;
    visit_row(unset_row, [&known](const std::string& name, const auto&) { known.push_back(name); });
    reader.check_keys(json, "/rows", known);
    for (const auto& [name, column] : json.items()) {
        if (name == "count") continue;
        if (!column.is_array() || column.size() != count) {
            reader.fail("/rows/" + name, fmt::format("an array of {} values", count),
                        column.is_array() ? fmt::format("{} values", column.size()) : column.type_name());
        }
    }
    std::vector<StepRow> rows;
    if (json.size() > 1) rows.resize(count);
    if (rows.size() != count) reader.fail("/rows", fmt::format("columns for {} rows", count), "none");
    for (std::size_t i = 0; i < rows.size(); ++i) {
        visit_row(rows[i], [&](const std::string& name, auto& value) {
            const auto column = json.find(name);
            if (column != json.end()) reader.read((*column)[i], fmt::format("/rows/{}/{}", name, i), value);
        });
    }
    return rows;
}

}  // namespace

std::string to_json_line(const Record& record) {
    Json spec = Json::object();
    visit_spec(record.spec, [&spec](const char* name, const auto& value) { spec[name] = to_json(value); });
    Json summary = Json::object();
    for (const auto& [name, value] : record.summary) summary[name] = to_json(value);
    const Json json{{"spec", spec},
                    {"outcome", name_of(record.outcome.kind)},
                    {"message", record.outcome.message},
                    {"frames_hash", record.frames_hash},
                    {"state_hash", record.state_hash},
                    {"environment", record.environment},
                    {"summary", summary},
                    {"rows", rows_to_json(record.rows)}};
    // A method's message may hold any bytes; a record must stay readable.
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Record record_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number) {
    const Reader reader(file, line_number);
    Json json;
    try {
        json = Json::parse(line);
    } catch (const Json::parse_error& error) {
        reader.fail(fmt::format("byte {}", error.byte), "a record as one JSON object", "what is no JSON");
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
    reader.check_keys(spec, "/spec", known);
    reader.check_keys(json, "",
                      {"spec", "outcome", "message", "frames_hash", "state_hash", "environment", "summary", "rows"});
    reader.read(reader.member(json, "", "outcome"), "/outcome", record.outcome.kind);
    record.outcome.message = text("message");
    record.frames_hash = text("frames_hash");
    record.state_hash = text("state_hash");
    for (const auto& [key, value] : reader.member(json, "", "environment").items()) {
        reader.read(value, "/environment/" + key, record.environment[key]);
    }
    for (const auto& [key, value] : reader.member(json, "", "summary").items()) {
        reader.read(value, "/summary/" + key, record.summary[key]);
    }
    record.rows = rows_from_json(reader, reader.member(json, "", "rows"));
    return record;
}

}  // namespace trocar
