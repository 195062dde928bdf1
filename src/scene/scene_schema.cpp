#include "scene/json_node.hpp"
#include "scene/scene.hpp"
#include "scene/scene_settings.hpp"
#include "scene/shapes.hpp"

namespace trocar {
namespace {

using Document = nlohmann::ordered_json;

Document number(const char* unit, ValueBound bounds, const std::string& meaning) {
    Document json{{"type", "number"}};
    json[bounds == ValueBound::positive ? "exclusiveMinimum" : "minimum"] = 0;
    json["unit"] = std::string(unit) == "m" ? "unit of the scene" : unit;
    json["description"] = meaning;
    return json;
}

Document list_of(const Document& items, std::size_t count) {
    return {{"type", "array"}, {"items", items}, {"minItems", count}, {"maxItems", count}};
}

Document text(const char* meaning) { return {{"type", "string"}, {"minLength", 1}, {"description", meaning}}; }

Document point(const char* meaning) {
    Document json = list_of({{"type", "number"}}, 3);
    json["unit"] = "unit of the scene";
    json["description"] = meaning;
    return json;
}

Document object(Document properties, const std::vector<std::string>& required) {
    Document json{{"type", "object"}, {"additionalProperties", false}};
    if (!required.empty()) json["required"] = required;
    json["properties"] = std::move(properties);
    return json;
}

template <typename Settings, std::size_t count>
Document numbers_of(const std::array<NumberSetting<Settings>, count>& table) {
    Document properties = Document::object();
    for (const NumberSetting<Settings>& entry : table) {
        properties[entry.key] = number(entry.unit, entry.bounds, entry.meaning);
        // A default length is metres whatever the scene's unit.
        if (std::string(entry.unit) == "m") {
            properties[entry.key]["default_in_m"] = Settings{}.*entry.member;
        } else {
            properties[entry.key]["default"] = Settings{}.*entry.member;
        }
    }
    return properties;
}

Document parameter_of(const ShapeParameter& parameter) {
    using Type = ShapeParameter::Type;
    Document length = number("m", ValueBound::positive, parameter.meaning);
    Document json;
    switch (parameter.type) {
        case Type::length:
            return length;
        case Type::lengths2:
        case Type::lengths3:
            json = list_of({{"type", "number"}, {"exclusiveMinimum", 0}}, parameter.type == Type::lengths2 ? 2 : 3);
            json["unit"] = "unit of the scene";
            break;
        case Type::points3:
            json = list_of(list_of({{"type", "number"}}, 3), 3);
            json["unit"] = "unit of the scene";
            break;
        case Type::degrees:
        case Type::ratio:
            json = {{"type", "number"}, {"minimum", parameter.minimum}, {"maximum", parameter.maximum}};
            json["unit"] = parameter.type == Type::degrees ? "degrees" : "1";
            if (parameter.default_number) json["default"] = *parameter.default_number;
            break;
        case Type::choice:
            json = {{"enum", parameter.choices}, {"default", parameter.choices.front()}};
            break;
    }
    json["description"] = parameter.meaning;
    return json;
}

Document parts() {
    const Document common{
        {"scale",
         {{"type", "number"}, {"exclusiveMinimum", 0}, {"default", 1}, {"description", "factor on the coordinates"}}},
        {"pose", {{"$ref", "#/$defs/pose"}, {"description", "in the body frame: p' = R (scale p) + t"}}},
        {"jaw", {{"enum", {"left", "right"}}, {"description", "swings about the body's hinge with the key's jaw"}}}};
    Document kinds = Document::array();
    for (const Shape& shape : shapes()) {
        Document properties{{"shape", {{"const", shape.name}}}};
        std::vector<std::string> required{"shape"};
        for (const ShapeParameter& parameter : shape.parameters) {
            properties[parameter.name] = parameter_of(parameter);
            if (!parameter.default_number && parameter.type != ShapeParameter::Type::choice) {
                required.push_back(parameter.name);
            }
        }
        properties.update(common);
        Document kind = object(properties, required);
        kind["description"] = (shape.closed ? "closed: " : "open: ") + shape.meaning;
        kinds.push_back(kind);
    }
    Document mesh{
        {"mesh", text("OBJ, STL, PLY, OFF or VRML file relative to the scene file; data:PATH lies in the data "
                      "folder (--data DIR or TROCAR_DATA)")}};
    mesh.update(common);
    kinds.push_back(object(mesh, {"mesh"}));
    return {{"oneOf", kinds}};
}

Document body() {
    Document hinge =
        object({{"point", point("a point of the axis, body frame; default the origin")},
                {"axis",
                 {{"type", "array"},
                  {"items", {{"type", "number"}}},
                  {"minItems", 3},
                  {"maxItems", 3},
                  {"default", {1, 0, 0}},
                  {"description", "body frame, any length"}}},
                {"angle",
                 {{"type", "number"},
                  {"minimum", 0},
                  {"maximum", 180},
                  {"default", default_jaw_angle},
                  {"unit", "degrees"},
                  {"description", "turn of a left part at jaw = 1, of a right part the opposite; none at jaw = 0"}}}},
               {});
    hinge["description"] = "instruments: axis of the parts with \"jaw\"";
    Document tissue_properties{
        {"pinned",
         {{"oneOf",
           {{{"enum", {"rim", "none"}}}, {{"type", "array"}, {"items", {{"type", "integer"}, {"minimum", 0}}}}}},
          {"default", "rim"},
          {"description",
           "held vertices: those of boundary edges, none, or vertex numbers of the file (several parts: "
           "counted on)"}}},
        {"substeps",
         {{"type", "integer"},
          {"minimum", 1},
          {"maximum", most_substeps},
          {"description", "integrator steps per tick; default 4, or more where 2 sum k/m and 2 sum c/m ask for it"}}}};
    tissue_properties.update(numbers_of(tissue_numbers));
    Document key = object({{"time", {{"type", "number"}, {"unit", "s"}, {"description", "ascending"}}},
                           {"pose", {{"$ref", "#/$defs/pose"}, {"description", "of the body, world"}}},
                           {"jaw",
                            {{"type", "number"},
                             {"minimum", 0},
                             {"maximum", 1},
                             {"description", "0 closed, 1 open; default: that of the key before, 1 at first"}}}},
                          {"time", "pose"});
    Document motion =
        object({{"drive",
                 {{"enum", drive_words},
                  {"description",
                   "prescribed follows the keys exactly; operator is a mass, damping and virtual coupling "
                   "towards them, pushed back by contact"}}},
                {"keys",
                 {{"type", "array"},
                  {"minItems", 1},
                  {"items", key},
                  {"description",
                   "linear in position, shortest arc in rotation, held before the first and after the "
                   "last"}}},
                {"operator", object(numbers_of(operator_numbers), {})}},
               {"drive", "keys"});
    motion["description"] = "instruments only";
    return object(
        {{"name", text("one of its own")},
         {"kind", {{"enum", body_kind_words}}},
         {"closed",
          {{"type", "boolean"}, {"description", "has an inside; default: true where every part is watertight"}}},
         {"side",
          {{"enum", {"front", "back"}},
           {"default", "front"},
           {"description",
            "open bodies: where the other bodies start; triangles are counter-clockwise seen from "
            "the front"}}},
         {"instrument", text("instruments: bodies with the same name are parts of one, not tested against each other")},
         {"parts",
          {{"type", "array"},
           {"minItems", 1},
           {"items", {{"$ref", "#/$defs/part"}}},
           {"description", "merged into one body, numbered one after the other"}}},
         {"pose", {{"$ref", "#/$defs/pose"}, {"description", "of a body without motion, world"}}},
         {"motion", motion},
         {"trocar", point("instruments: where the shaft passes the body wall, world")},
         {"tip", point("instruments: the point whose force is shown, body frame; default the origin")},
         {"hinge", hinge},
         {"tissue", object(tissue_properties, {})}},
        {"name", "kind", "parts"});
}

}  // namespace

std::string scene_schema() {
    Document schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                    {"title", "trocar scene, format trocar-scene-2"},
                    {"description",
                     "Bodies, how they move and what they are made of. Lengths in `unit`, all else SI. Each point goes "
                     "through its part's scale and pose, then its body's pose. A scene builds only what it names."}};
    schema.update(object(
        {{"format", {{"const", "trocar-scene-2"}}},
         {"name", text("of the scene")},
         {"description", text("what it shows, for readers")},
         {"unit", {{"enum", unit_words}, {"default", "m"}, {"description", "of every length in the file"}}},
         {"dt",
          {{"type", "number"},
           {"exclusiveMinimum", 0},
           {"default", 0.001},
           {"unit", "s"},
           {"description", "time of a tick"}}},
         {"ticks", {{"type", "integer"}, {"minimum", 1}, {"description", "length of a run"}}},
         {"seed", {{"type", "integer"}, {"minimum", 0}, {"default", 1}, {"description", "of everything random"}}},
         {"bodies", {{"type", "array"}, {"minItems", 1}, {"items", {{"$ref", "#/$defs/body"}}}}},
         {"contact_off",
          {{"type", "array"},
           {"items", {{"type", "number"}}},
           {"minItems", 2},
           {"maxItems", 2},
           {"unit", "s"},
           {"description",
            "[from, to): the detector answers nothing, so that bodies pass into each other unseen; from < 0: the "
            "scripts run alone before tick 0, followed by truth"}}},
         {"contact",
          {{"type", "array"},
           {"description", "contact law of two bodies; where it is silent the response's default holds"},
           {"items", object({{"bodies", list_of({{"type", "string"}}, 2)},
                             {"k", number("N/m", ValueBound::non_negative, "stiffness")},
                             {"mu", number("N s/m", ValueBound::non_negative, "viscous damping")}},
                            {"bodies"})}}}},
        {"format", "name", "ticks", "bodies"}));
    Document pose = list_of({{"type", "number"}}, 6);
    pose["default"] = {0, 0, 0, 0, 0, 0};
    pose["description"] =
        "[x, y, z, rx, ry, rz]: translation in the scene's unit, rotation vector in degrees about the origin";
    schema["$defs"] = {{"pose", pose}, {"part", parts()}, {"body", body()}};
    return schema.dump(2) + "\n";
}

}  // namespace trocar
