#include "scene/resolution_scenes.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "geometry/random.hpp"
#include "scene/shapes.hpp"

namespace trocar {
namespace {

using Document = nlohmann::ordered_json;

constexpr double tissue_edge = 0.005;             // m, of tissue
constexpr double lead_speed = 0.05;               // m/s
constexpr double lead_clearance = 0.003;          // m, above the surface in the clean state
constexpr double window = 0.2;                    // s, in which a response resolves
constexpr double tool_radius = 0.004;             // m
constexpr std::array depths{0.5, 1.0, 2.0, 4.0};  // edges
constexpr std::array radius_parts{0.125, 0.25, 0.5, 0.75};
const Vector3 organ_radii(0.05, 0.045, 0.04);

/// To the micrometre and the microsecond, so that files are short.
double rounded(double value) { return std::round(value * 1e6) / 1e6; }

struct Key {
    double time;  ///< s
    Vector3 translation;
};

/// A tool whose lowest point is the origin of its frame.
struct Tool {
    std::string name;
    Document part;
};

Tool blunt() { return {"blunt", {{"shape", "shaft"}, {"radius", tool_radius}, {"length", 0.12}, {"edge", 0.003}}}; }

Tool pointed() {
    return {"pointed",
            {{"shape", "needle"}, {"radius", 0.002}, {"length", 0.12}, {"tip_length", 0.008}, {"edge", 0.003}}};
}

Tool blade() {
    return {"blade",
            {{"shape", "box"}, {"size", {0.012, 0.008, 0.0004}}, {"edge", 0.003}, {"pose", {0, 0, 0.0002, 0, 0, 0}}}};
}

Document sheet(const std::string& name, double z) {
    Document body{{"name", name},
                  {"kind", "tissue"},
                  {"closed", false},
                  {"side", "front"},
                  {"parts", {{{"shape", "sheet"}, {"size", {0.1, 0.1}}, {"edge", tissue_edge}}}},
                  {"tissue", {{"pinned", "rim"}}}};
    if (z != 0.0) body["pose"] = {0, 0, z, 0, 0, 0};
    return body;
}

/// Its top is at z = 0; its lower third is pinned.
Document organ() {
    ShapeValues values;
    values.numbers["radii"] = {organ_radii.x(), organ_radii.y(), organ_radii.z()};
    values.numbers["edge"] = {tissue_edge};
    const Surface surface = find_shape("ellipsoid")->make(values);
    Document pinned = Document::array();
    for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
        if (surface.vertices(2, v) < -organ_radii.z() / 3.0) pinned.push_back(v);
    }
    return {{"name", "organ"},
            {"kind", "tissue"},
            {"closed", true},
            {"parts", {{{"shape", "ellipsoid"}, {"radii", values.numbers["radii"]}, {"edge", tissue_edge}}}},
            {"tissue", {{"pinned", pinned}}},
            {"pose", {0, 0, -organ_radii.z(), 0, 0, 0}}};
}

/// m, height of a target's surface at a place.
double surface_height(const std::string& target, double x, double y) {
    if (target != "organ") return 0.0;
    const double u = x / organ_radii.x();
    const double v = y / organ_radii.y();
    return organ_radii.z() * (std::sqrt(1.0 - u * u - v * v) - 1.0);
}

Document target_bodies(const std::string& target) {
    if (target == "organ") return Document::array({organ()});
    if (target == "two_sheets") return Document::array({sheet("upper", 0.0), sheet("lower", -0.001)});
    return Document::array({sheet("sheet", 0.0)});
}

class Draw {
public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}

    std::vector<DrawnScene> all() {
        at_rest_and_moving();
        silent_detector();
        through_in_one_tick();
        held_by_operator();
        return std::move(scenes_);
    }

private:
    double within(double low, double high) { return low + 0.5 * (random_.signed_unit() + 1.0) * (high - low); }

    /// Where a tool meets a target, about its middle.
    Vector3 place_on(const std::string& target) {
        Vector3 at(within(-0.01, 0.01), within(-0.01, 0.01), 0.0);
        at.z() = surface_height(target, at.x(), at.y());
        return at;
    }
    /// Rotation vector in degrees: a tilt of up to 15 about a horizontal axis.
    Vector3 tilt() { return {within(-10.0, 10.0), within(-10.0, 10.0), 0.0}; }
    /// Unit vector, horizontal.
    Vector3 sideways() {
        const double angle = within(0.0, 2.0);
        return Vector3(1.0 - angle, std::sqrt(std::max(0.0, 1.0 - (1.0 - angle) * (1.0 - angle))), 0.0);
    }

    void add(const std::string& group, const std::string& name, const std::string& description, Document bodies,
             const Tool& tool, const std::string& drive, const std::vector<Key>& keys, const Vector3& rotation,
             std::array<double, 2> contact_off, double end) {
        Document poses = Document::array();
        for (const Key& key : keys) {
            Document pose = Document::array();
            for (const double number : {key.translation.x(), key.translation.y(), key.translation.z(), rotation.x(),
                                        rotation.y(), rotation.z()}) {
                pose.push_back(rounded(number));
            }
            poses.push_back({{"time", rounded(key.time)}, {"pose", pose}});
        }
        Document contact = Document::array();
        for (const Document& body : bodies) {
            const bool rigid = body["kind"] != "tissue";
            contact.push_back({{"bodies", {"tool", body["name"]}}, {"k", rigid ? 1000 : 100}, {"mu", 2}});
        }
        bodies.push_back({{"name", "tool"},
                          {"kind", "instrument"},
                          {"closed", true},
                          {"parts", {tool.part}},
                          {"motion", {{"drive", drive}, {"keys", poses}}}});
        const Document scene{{"format", "trocar-scene-2"},
                             {"name", name},
                             {"description", description},
                             {"dt", 0.001},
                             {"ticks", std::llround(end * 1000.0)},
                             {"contact_off", {rounded(contact_off[0]), rounded(contact_off[1])}},
                             {"bodies", bodies},
                             {"contact", contact}};
        scenes_.push_back({name, group, scene.dump() + "\n"});
    }

    /// s, whole ticks that the path from the clean state down to a depth takes.
    static double lead_time(double depth, double speed = lead_speed) {
        return std::ceil(1000.0 * (depth + lead_clearance) / speed) / 1000.0;
    }

    void at_rest_and_moving() {
        for (const char* target : {"sheet", "organ", "two_sheets"}) {
            for (const double edges : depths) {
                for (const Tool& tool : {blunt(), pointed()}) {
                    const double depth = edges * tissue_edge;
                    const Vector3 top = place_on(target);
                    const double lead = lead_time(depth);
                    add("at rest", fmt::format("rest_{}_{}_{}", target, edges, tool.name),
                        fmt::format("A {} tool that has been moved {:.1f} mm into tissue without contact, and stays.",
                                    tool.name, 1e3 * depth),
                        target_bodies(target), tool, "prescribed",
                        {{-lead, top + Vector3(0, 0, lead_clearance)}, {0.0, top - Vector3(0, 0, depth)}}, tilt(),
                        {-lead, 0.0}, window);
                }
            }
        }
        for (const char* target : {"sheet", "organ"}) {
            for (const double edges : depths) {
                for (const std::string direction : {"onward", "sideways", "outward"}) {
                    const Tool tool = random_.below(2) == 0 ? blunt() : pointed();
                    const double depth = edges * tissue_edge;
                    const Vector3 top = place_on(target);
                    const double lead = lead_time(depth);
                    const double path = 0.05 * lead_speed;
                    const Vector3 shift = direction == "onward"     ? Vector3(0, 0, -path)
                                          : direction == "sideways" ? Vector3(path * sideways())
                                                                    : Vector3(0, 0, std::min(path, 0.5 * depth));
                    const Vector3 deep = top - Vector3(0, 0, depth);
                    add("moving", fmt::format("moving_{}_{}_{}", target, edges, direction),
                        fmt::format(
                            "A {} tool that has been moved {:.1f} mm into tissue without contact, moves {} at 50 "
                            "mm/s for at most 50 ms, and stays.",
                            tool.name, 1e3 * depth, direction),
                        target_bodies(target), tool, "prescribed",
                        {{-lead, top + Vector3(0, 0, lead_clearance)},
                         {0.0, deep},
                         {shift.norm() / lead_speed, deep + shift}},
                        tilt(), {-lead, 0.0}, window);
                }
            }
        }
    }

    void silent_detector() {
        struct Motion {
            const char* name;
            double speed;   ///< m/s
            double before;  ///< m, depth at which contact goes off
            bool sideways;
        };
        for (const char* target : {"sheet", "organ"}) {
            for (const Motion& motion :
                 {Motion{"press", 0.02, 0.5 * tissue_edge, false}, Motion{"stab", 0.2, 0.2 * tissue_edge, false},
                  Motion{"drag", 0.05, tissue_edge, true}}) {
                for (const int silent : {1, 5, 20, 100}) {
                    const Tool tool = motion.sideways || random_.below(2) == 0 ? blunt() : pointed();
                    const Vector3 top = place_on(target);
                    const Vector3 shift = motion.sideways ? sideways() : Vector3(-Vector3::UnitZ());
                    const double speed_down = motion.sideways ? lead_speed : motion.speed;
                    const double off = lead_time(motion.before, speed_down) + (motion.sideways ? 0.02 : 0.0);
                    const double on = off + 0.001 * silent;
                    std::vector<Key> keys{{0.0, top + Vector3(0, 0, lead_clearance)}};
                    Vector3 at = top - Vector3(0, 0, motion.before);
                    if (motion.sideways) {
                        keys.push_back({off - 0.02, at});
                        at += 0.02 * motion.speed * shift;
                    }
                    keys.push_back({off, at});
                    keys.push_back({on + 0.02, at + (on + 0.02 - off) * motion.speed * shift});
                    add("silent detector", fmt::format("silent_{}_{}_{}", target, motion.name, silent),
                        fmt::format("A {} tool in tissue whose detector is silent for {} ticks of a {} at {:g} mm/s.",
                                    tool.name, silent, motion.name, 1e3 * motion.speed),
                        target_bodies(target), tool, "prescribed", keys, tilt(), {off, on}, on + window);
                }
            }
        }
    }

    void through_in_one_tick() {
        for (const Tool& tool : {pointed(), blade()}) {
            for (const char* target : {"sheet", "two_sheets", "organ"}) {
                for (const double edges : depths) {
                    const bool is_blade = tool.name == "blade";
                    const Vector3 top = place_on(target);
                    // Behind both sheets: the blade as a whole, the needle by its point.
                    const double layers = std::string(target) == "two_sheets" ? 0.001 : 0.0;
                    // A blade is level, and the organ falls off beneath it.
                    const double apart = !is_blade ? 0.0 : std::string(target) == "organ" ? 0.0025 : 0.0006;
                    const double depth = edges * tissue_edge + layers + apart;
                    const Vector3 rotation = is_blade ? Vector3(0, 0, within(0.0, 90.0)) : tilt();
                    const double above = is_blade ? apart : 0.0002;
                    const double before = 0.02;
                    const Vector3 start = top + Vector3(0, 0, above);
                    const Vector3 deep = top - Vector3(0, 0, depth);
                    const double stay = before + 0.001 + window;
                    const double back = lead_time(depth);
                    add("through in one tick", fmt::format("through_{}_{}_{}", target, edges, tool.name),
                        fmt::format("A {} that passes {:.1f} mm through tissue in one tick, stays for 200 ms and is "
                                    "withdrawn at 50 mm/s.",
                                    is_blade ? "blade" : "needle", 1e3 * depth),
                        target_bodies(target), tool, "prescribed",
                        {{before - 0.001, start},
                         {before, deep},
                         {stay, deep},
                         {stay + back, top + Vector3(0, 0, lead_clearance)}},
                        rotation, {before, before + 0.001}, stay + back + 0.1);
                }
            }
        }
    }

    void held_by_operator() {
        for (const std::string target : {"tool", "bone", "tissue"}) {
            for (std::size_t d = 0; d < depths.size(); ++d) {
                for (const bool rests : {true, false}) {
                    const double depth = target == "tissue" ? depths[d] * tissue_edge : radius_parts[d] * tool_radius;
                    Vector3 top = place_on(target == "tissue" ? "sheet" : target);
                    Document bodies = target_bodies("sheet");
                    if (target == "tool") {
                        // The lower tool lies along x with its highest line at z = 0.
                        bodies = Document::array({{{"name", "lower"},
                                                   {"kind", "rigid"},
                                                   {"closed", true},
                                                   {"parts", {blunt().part}},
                                                   {"pose", {-0.06, 0, -tool_radius, 0, 90, 0}}}});
                        top.y() *= 0.1;
                        top.z() = std::sqrt(tool_radius * tool_radius - top.y() * top.y()) - tool_radius;
                    }
                    if (target == "bone") {
                        constexpr double bone_radius = 0.01;
                        bodies = Document::array({{{"name", "bone"},
                                                   {"kind", "rigid"},
                                                   {"closed", true},
                                                   {"parts",
                                                    {{{"shape", "bone"},
                                                      {"radius", bone_radius},
                                                      {"head_radius", 0.015},
                                                      {"length", 0.12},
                                                      {"edge", 0.004}}}},
                                                   {"pose", {0, 0, -bone_radius, 0, 90, 0}}}});
                        top.y() *= 0.2;
                        top.z() = std::sqrt(bone_radius * bone_radius - top.y() * top.y()) - bone_radius;
                    }
                    const double lead = lead_time(depth);
                    const Vector3 clean = top + Vector3(0, 0, lead_clearance);
                    const Vector3 deep = top - Vector3(0, 0, depth);
                    // Else the operator is on its shift, and 20 ticks without contact take it from touch to the depth.
                    const double off = rests ? -lead : 0.03;
                    const double on = rests ? 0.0 : 0.05;
                    const std::vector<Key> keys = rests ? std::vector<Key>{{-lead, clean}, {0.0, deep}}
                                                        : std::vector<Key>{{0.0, clean}, {off, top}, {on, deep}};
                    add("hand-held", fmt::format("held_{}_{}_{}", target, d + 1, rests ? "rest" : "silent"),
                        fmt::format("A blunt tool held by an operator, {} into {} without contact.",
                                    rests ? "moved" : "moved within 20 ticks", target),
                        bodies, blunt(), "operator", keys, rests && target == "tissue" ? tilt() : Vector3(0, 0, 0),
                        {off, on}, on + window);
                }
            }
        }
    }

    Random random_;
    std::vector<DrawnScene> scenes_;
};

}  // namespace

std::vector<DrawnScene> draw_resolution_scenes(std::uint64_t seed) { return Draw(seed).all(); }

}  // namespace trocar
