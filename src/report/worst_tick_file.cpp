// worst_tick.json, written and read.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/input_error.hpp"
#include "geometry/json_depth.hpp"
#include "report/worst_tick.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* format_name = "trocar-worst-tick-1";

Json rounded(double value) { return std::isfinite(value) ? Json(std::round(value * 1000.0) / 1000.0) : Json(nullptr); }

double number(const Json& value) {
    return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

Json json_of(const WorstTick::State& state) {
    Json bodies = Json::array();
    for (const WorstTick::Body& body : state.bodies) {
        Json segments = Json::array();
        for (const WorstTick::Segment& one : body.segments) {
            segments.push_back({rounded(one.ends[0]), rounded(one.ends[1]), rounded(one.ends[2]), rounded(one.ends[3]),
                                rounded(one.depth)});
        }
        bodies.push_back({{"name", body.name}, {"kind", body.kind}, {"segments", std::move(segments)}});
    }
    Json points = Json::array();
    for (const auto& point : state.points) points.push_back({rounded(point[0]), rounded(point[1])});
    return {{"name", state.name},
            {"state_hash", state.state_hash},
            {"depth_mm", rounded(state.depth)},
            {"bodies", bodies},
            {"points", points},
            {"note", state.note}};
}

WorstTick::State state_of(const Json& json) {
    WorstTick::State state;
    state.name = json.at("name");
    state.state_hash = json.at("state_hash");
    state.depth = number(json.at("depth_mm"));
    state.note = json.at("note");
    for (const Json& body : json.at("bodies")) {
        state.bodies.push_back({.name = body.at("name"), .kind = body.at("kind"), .segments = {}});
        for (const Json& one : body.at("segments")) {
            state.bodies.back().segments.push_back(
                {.ends = {number(one.at(0)), number(one.at(1)), number(one.at(2)), number(one.at(3))},
                 .depth = number(one.at(4))});
        }
    }
    for (const Json& point : json.at("points")) state.points.push_back({number(point.at(0)), number(point.at(1))});
    return state;
}

}  // namespace

std::string to_json(const WorstTick& seen) {
    Json states = Json::array();
    for (const WorstTick::State& state : seen.states) states.push_back(json_of(state));
    Json force = Json::array();
    for (const WorstTick::Curve& curve : seen.force) {
        Json points = Json::array();
        for (const auto& [time, value] : curve.points) points.push_back({rounded(time), rounded(value)});
        force.push_back({{"name", curve.name}, {"points", std::move(points)}});
    }
    return Json{{"format", format_name},      {"scene", seen.scene},         {"tick", seen.tick},
                {"time", rounded(seen.time)}, {"states", std::move(states)}, {"force", std::move(force)}}
               .dump() +
           "\n";
}

WorstTick worst_tick_from_json(const std::string& text, const std::string& file) {
    if (is_nested_too_deep(text)) {
        throw InputError(file, "", fmt::format("at most {} levels of lists and objects", deepest_json), "more");
    }
    try {
        const Json json = Json::parse(text);
        if (json.at("format") != format_name) {
            throw InputError(file, "/format", format_name, json.at("format").dump());
        }
        WorstTick seen;
        seen.scene = json.at("scene");
        seen.tick = json.at("tick");
        seen.time = json.at("time");
        for (const Json& state : json.at("states")) seen.states.push_back(state_of(state));
        for (const Json& curve : json.at("force")) {
            seen.force.push_back({.name = curve.at("name"), .points = {}});
            for (const Json& point : curve.at("points")) {
                seen.force.back().points.emplace_back(number(point.at(0)), number(point.at(1)));
            }
        }
        return seen;
    } catch (const Json::exception& error) {
        throw InputError(file, "", "a picture of the worst tick as `trocar report DIR --picture` writes it",
                         error.what());
    }
}

}  // namespace trocar
