#include "scene/drawn_scenes.hpp"

#include <cmath>

#include "scene/shapes.hpp"

namespace trocar::drawn {

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

Tool blunt(double radius) {
    return {"blunt", {{"shape", "shaft"}, {"radius", radius}, {"length", 0.12}, {"edge", 0.003}}};
}

Tool pointed(double radius) {
    return {"pointed",
            {{"shape", "needle"}, {"radius", radius}, {"length", 0.12}, {"tip_length", 4.0 * radius}, {"edge", 0.003}}};
}

Document sheet(const std::string& name, std::array<double, 2> size, double edge) {
    return {{"name", name},
            {"kind", "tissue"},
            {"closed", false},
            {"side", "front"},
            {"parts", {{{"shape", "sheet"}, {"size", size}, {"edge", edge}}}},
            {"tissue", {{"pinned", "rim"}}}};
}

Document organ(const Vector3& radii, double edge) {
    ShapeValues values;
    values.numbers["radii"] = {radii.x(), radii.y(), radii.z()};
    values.numbers["edge"] = {edge};
    const Surface surface = find_shape("ellipsoid")->make(values);
    Document pinned = Document::array();
    for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
        if (surface.vertices(2, v) < -radii.z() / 3.0) pinned.push_back(v);
    }
    return {{"name", "organ"},
            {"kind", "tissue"},
            {"closed", true},
            {"parts", {{{"shape", "ellipsoid"}, {"radii", values.numbers["radii"]}, {"edge", edge}}}},
            {"tissue", {{"pinned", pinned}}},
            {"pose", {0, 0, -radii.z(), 0, 0, 0}}};
}

double organ_height(const Vector3& radii, double x, double y) {
    const double u = x / radii.x();
    const double v = y / radii.y();
    return radii.z() * (std::sqrt(1.0 - u * u - v * v) - 1.0);
}

Document tool_body(const Tool& tool, const std::string& drive, const std::vector<Key>& keys, const Vector3& rotation) {
    Document poses = Document::array();
    for (const Key& key : keys) {
        Document pose = Document::array();
        for (const double number : {key.translation.x(), key.translation.y(), key.translation.z(), rotation.x(),
                                    rotation.y(), rotation.z()}) {
            pose.push_back(rounded(number));
        }
        poses.push_back({{"time", rounded(key.time)}, {"pose", pose}});
    }
    return {{"name", "tool"},
            {"kind", "instrument"},
            {"closed", true},
            {"parts", {tool.part}},
            {"motion", {{"drive", drive}, {"keys", poses}}}};
}

Document contact_law(const std::string& body, const std::string& other, int k) {
    return {{"bodies", {body, other}}, {"k", k}, {"mu", 2}};
}

DrawnScene finished(const std::string& name, const std::string& group, const std::string& description, double end,
                    std::optional<std::array<double, 2>> contact_off, const Document& bodies, const Document& contact) {
    Document scene{{"format", "trocar-scene-2"},
                   {"name", name},
                   {"description", description},
                   {"dt", 0.001},
                   {"ticks", std::llround(end * 1000.0)}};
    if (contact_off) scene["contact_off"] = {rounded((*contact_off)[0]), rounded((*contact_off)[1])};
    scene["bodies"] = bodies;
    scene["contact"] = contact;
    return {name, group, scene.dump() + "\n"};
}

}  // namespace trocar::drawn
