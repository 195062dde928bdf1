#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "cells.hpp"
#include "geometry/input_error.hpp"

namespace trocar::bench {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* format = "trocar-bench-2";

Json outcome_json(const Outcome& outcome) { return {name_of(outcome.kind), outcome.message}; }
Outcome outcome_from(const Json& json) {
    return {outcome_kind_from(json.at(0).get<std::string>()), json.at(1).get<std::string>()};
}

template <typename Enum, std::size_t count>
Enum enum_from(const std::string& text) {
    for (std::size_t i = 0; i < count; ++i) {
        if (name_of(static_cast<Enum>(i)) == text) return static_cast<Enum>(i);
    }
    throw InputError("unknown word '" + text + "'");
}

Json method_json(const MethodResult& result) {
    Json json{
        {"label", result.label},
        {"method", result.method},
        {"library", result.library},
        {"family", result.family},
        {"narrow", result.narrow},
        {"own", result.own},
        {"claims_exact", result.claims_exact},
        {"outcome", outcome_json(result.outcome)},
        {"prepare_ns", std::llround(result.prepare_ns)},
        {"heap_bytes", result.heap_bytes},
        {"resident_bytes", result.resident_bytes},
        {"work",
         {result.work.vertices_read, result.work.cells_visited, result.work.box_tests, result.work.triangle_tests}},
        {"work_max", result.work_max},
        {"allocations", result.allocations},
        {"pairs", result.pairs},
        {"differing_steps", result.differing_steps},
        {"truth_steps", result.truth_steps},
        {"false_negatives", result.false_negatives},
        {"false_positives", result.false_positives},
        {"true_pairs", result.true_pairs},
        {"cold_ns", result.cold_ns},
        {"step", result.step},
        {"update_ns", result.update_ns},
        {"detect_ns", result.detect_ns},
        {"wall_ns", result.wall_ns}};
    if (result.within_query_distance) json["near_pairs"] = result.near_pairs;
    return json;
}

MethodResult method_from(const Json& json) {
    MethodResult result;
    result.label = json.at("label");
    result.method = json.at("method");
    result.library = json.at("library");
    result.family = json.at("family");
    result.narrow = json.at("narrow");
    result.own = json.at("own");
    result.claims_exact = json.at("claims_exact");
    result.outcome = outcome_from(json.at("outcome"));
    result.prepare_ns = json.at("prepare_ns");
    result.heap_bytes = json.at("heap_bytes");
    result.resident_bytes = json.at("resident_bytes");
    const Json& work = json.at("work");
    result.work = {work.at(0), work.at(1), work.at(2), work.at(3)};
    result.work_max = json.at("work_max");
    result.allocations = json.at("allocations");
    result.pairs = json.at("pairs");
    result.differing_steps = json.at("differing_steps");
    result.truth_steps = json.at("truth_steps");
    result.false_negatives = json.at("false_negatives");
    result.false_positives = json.at("false_positives");
    result.true_pairs = json.at("true_pairs");
    result.within_query_distance = json.contains("near_pairs");
    if (result.within_query_distance) result.near_pairs = json.at("near_pairs");
    json.at("cold_ns").get_to(result.cold_ns);
    json.at("step").get_to(result.step);
    json.at("update_ns").get_to(result.update_ns);
    json.at("detect_ns").get_to(result.detect_ns);
    json.at("wall_ns").get_to(result.wall_ns);
    if (result.update_ns.size() != result.step.size() || result.detect_ns.size() != result.step.size() ||
        result.wall_ns.size() != result.step.size()) {
        throw InputError("steps and times differ in number");
    }
    return result;
}

Json spread_json(const Spread& spread) { return {spread.median, spread.p99, spread.p999, spread.max}; }
Spread spread_from(const Json& json) { return {json.at(0), json.at(1), json.at(2), json.at(3)}; }

Json bounded_json(const BoundedMeasurement& bounded) {
    Json methods = Json::array();
    for (const BoundedResult& result : bounded.methods) {
        methods.push_back({{"label", result.label},
                           {"library", result.library},
                           {"own", result.own},
                           {"claims_exact", result.claims_exact},
                           {"outcome", outcome_json(result.outcome)},
                           {"work", spread_json(result.work)},
                           {"worst_tick", result.worst_tick},
                           {"wall_ns", spread_json(result.wall)},
                           {"empty_ns", spread_json(result.empty)},
                           {"allocations", result.allocations},
                           {"truncated", result.truncated},
                           {"truth_ticks", result.truth_ticks},
                           {"wrong_ticks", result.wrong_ticks}});
    }
    return {{"scene", bounded.scene},
            {"ticks", bounded.ticks},
            {"driven_ticks", bounded.driven_ticks},
            {"box_pairs", bounded.box_pairs},
            {"true_pairs", bounded.true_pairs},
            {"frames_hash", bounded.frames_hash},
            {"methods", methods}};
}

BoundedMeasurement bounded_from(const Json& json) {
    BoundedMeasurement bounded;
    bounded.scene = json.at("scene");
    bounded.ticks = json.at("ticks");
    bounded.driven_ticks = json.at("driven_ticks");
    bounded.box_pairs = json.at("box_pairs");
    bounded.true_pairs = json.at("true_pairs");
    bounded.frames_hash = json.at("frames_hash");
    for (const Json& entry : json.at("methods")) {
        BoundedResult result;
        result.label = entry.at("label");
        result.library = entry.at("library");
        result.own = entry.at("own");
        result.claims_exact = entry.at("claims_exact");
        result.outcome = outcome_from(entry.at("outcome"));
        result.work = spread_from(entry.at("work"));
        result.worst_tick = entry.at("worst_tick");
        result.wall = spread_from(entry.at("wall_ns"));
        result.empty = spread_from(entry.at("empty_ns"));
        result.allocations = entry.at("allocations");
        result.truncated = entry.at("truncated");
        result.truth_ticks = entry.at("truth_ticks");
        result.wrong_ticks = entry.at("wrong_ticks");
        bounded.methods.push_back(std::move(result));
    }
    return bounded;
}

Json missing_json(const std::vector<Missing>& missing) {
    Json json = Json::array();
    for (const Missing& entry : missing) json.push_back({entry.name, entry.reason});
    return json;
}

CellRecord record_from(const Json& json) {
    if (json.at("format") != format) throw InputError("format " + json.at("format").dump());
    CellRecord record;
    CellSpec& spec = record.spec;
    spec.id = json.at("cell");
    spec.group = enum_from<Group, 11>(json.at("group"));
    const Json& scene = json.at("scene");
    spec.scene.variant = enum_from<Variant, 7>(scene.at("variant"));
    spec.scene.tissue_triangles = scene.at("tissue_triangles");
    spec.scene.instrument_triangles = scene.at("instrument_triangles");
    spec.scene.tissues = scene.at("tissues");
    spec.scene.instruments = scene.at("instruments");
    spec.scene.order = enum_from<VertexOrder, 3>(scene.at("order"));
    spec.scene.seed = scene.at("seed");
    spec.bodies = scene.at("bodies");
    spec.quick = json.at("quick");
    spec.budget_s = json.at("budget_s");
    spec.most_steps = json.at("most_steps");
    record.binary = json.at("binary");
    json.at("environment").get_to(record.environment);
    record.outcome = outcome_from(json.at("outcome"));
    json.at("set_aside").get_to(record.set_aside);
    for (const Json& entry : json.at("missing")) record.missing.push_back({entry.at(0), entry.at(1)});
    record.vertices = json.at("vertices");
    record.triangles = json.at("triangles");
    record.tissue_edge = json.at("tissue_edge");
    record.load_after = json.at("load_after");
    record.measurement.true_pairs = json.at("true_pairs");
    record.measurement.frames_hash = json.at("frames_hash");
    if (json.contains("query_distance")) {
        record.query_distance = json.at("query_distance");
        record.measurement.true_near_pairs = json.at("true_near_pairs");
    }
    if (const auto bounded = json.find("bounded"); bounded != json.end()) record.bounded = bounded_from(*bounded);
    for (const Json& entry : json.at("methods")) record.measurement.methods.push_back(method_from(entry));
    return record;
}

}  // namespace

std::string to_json_line(const CellRecord& record) {
    const SceneSpec& scene = record.spec.scene;
    Json json{{"format", format},
              {"cell", record.spec.id},
              {"group", name_of(record.spec.group)},
              {"scene",
               {{"variant", name_of(scene.variant)},
                {"tissue_triangles", scene.tissue_triangles},
                {"instrument_triangles", scene.instrument_triangles},
                {"tissues", scene.tissues},
                {"instruments", scene.instruments},
                {"order", name_of(scene.order)},
                {"seed", scene.seed},
                {"bodies", record.spec.bodies}}},
              {"quick", record.spec.quick},
              {"budget_s", record.spec.budget_s},
              {"most_steps", record.spec.most_steps},
              {"binary", record.binary},
              {"environment", record.environment},
              {"outcome", outcome_json(record.outcome)},
              {"set_aside", record.set_aside},
              {"missing", missing_json(record.missing)},
              {"vertices", record.vertices},
              {"triangles", record.triangles},
              {"tissue_edge", record.tissue_edge},
              {"load_after", record.load_after},
              {"true_pairs", record.measurement.true_pairs},
              {"frames_hash", record.measurement.frames_hash},
              {"methods", Json::array()}};
    if (record.spec.group == Group::query_distance) {
        json["query_distance"] = record.query_distance;
        json["true_near_pairs"] = record.measurement.true_near_pairs;
    }
    if (record.spec.group == Group::bounded) json["bounded"] = bounded_json(record.bounded);
    for (const MethodResult& result : record.measurement.methods) json["methods"].push_back(method_json(result));
    return json.dump();
}

CellRecord cell_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number) {
    try {
        return record_from(Json::parse(line));
    } catch (const std::exception& error) {
        throw InputError(file, "line " + std::to_string(line_number), "a cell of the benchmark", error.what());
    }
}

}  // namespace trocar::bench
