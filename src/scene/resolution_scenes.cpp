#include "scene/resolution_scenes.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

namespace trocar {
namespace {

using Document = nlohmann::ordered_json;
using drawn::Key;
using drawn::Tool;

constexpr double tissue_edge = 0.005;             // m, of tissue
constexpr double lead_speed = 0.05;               // m/s
constexpr double lead_clearance = 0.003;          // m, above the surface in the clean state
constexpr double window = 0.2;                    // s, in which a response resolves
constexpr double tool_radius = 0.004;             // m
constexpr std::array depths{0.5, 1.0, 2.0, 4.0};  // edges
constexpr std::array radius_parts{0.125, 0.25, 0.5, 0.75};
const Vector3 organ_radii(0.05, 0.045, 0.04);

Tool blade() {
    return {"blade",
            {{"shape", "box"}, {"size", {0.012, 0.008, 0.0004}}, {"edge", 0.003}, {"pose", {0, 0, 0.0002, 0, 0, 0}}}};
}

Document sheet(const std::string& name, double z) {
    Document body = drawn::sheet(name, {0.1, 0.1}, tissue_edge);
    if (z != 0.0) body["pose"] = {0, 0, z, 0, 0, 0};
    return body;
}

/// m, height of a target's surface at a place.
double surface_height(const std::string& target, double x, double y) {
    return target == "organ" ? drawn::organ_height(organ_radii, x, y) : 0.0;
}

Document target_bodies(const std::string& target) {
    if (target == "organ") return Document::array({drawn::organ(organ_radii, tissue_edge)});
    if (target == "two_sheets") return Document::array({sheet("upper", 0.0), sheet("lower", -0.001)});
    return Document::array({sheet("sheet", 0.0)});
}

class Draw {
public:
    explicit Draw(std::uint64_t seed) : numbers_(seed) {}

    std::vector<DrawnScene> all() {
        at_rest_and_moving();
        silent_detector();
        through_in_one_tick();
        held_by_operator();
        return std::move(scenes_);
    }

private:
    double within(double low, double high) { return numbers_.within(low, high); }

    /// Where a tool meets a target, about its middle.
    Vector3 place_on(const std::string& target) {
        const double y = within(-0.01, 0.01);
        const double x = within(-0.01, 0.01);
        return {x, y, surface_height(target, x, y)};
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
        Document contact = Document::array();
        for (const Document& body : bodies) {
            const bool rigid = body["kind"] != "tissue";
            contact.push_back(drawn::contact_law("tool", body["name"], rigid ? 1000 : 100));
        }
        bodies.push_back(drawn::tool_body(tool, drive, keys, rotation));
        scenes_.push_back(drawn::finished(name, group, description, end, contact_off, bodies, contact));
    }

    /// s, whole ticks that the path from the clean state down to a depth takes.
    static double lead_time(double depth, double speed = lead_speed) {
        return std::ceil(1000.0 * (depth + lead_clearance) / speed) / 1000.0;
    }

    void at_rest_and_moving() {
        for (const char* target : {"sheet", "organ", "two_sheets"}) {
            for (const double edges : depths) {
                for (const Tool& tool : {drawn::blunt(tool_radius), drawn::pointed()}) {
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
                    const Tool tool = numbers_.coin() ? drawn::blunt(tool_radius) : drawn::pointed();
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
                    const Tool tool = motion.sideways || numbers_.coin() ? drawn::blunt(tool_radius) : drawn::pointed();
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
        for (const Tool& tool : {drawn::pointed(), blade()}) {
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
                                                   {"parts", {drawn::blunt(tool_radius).part}},
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
                        bodies, drawn::blunt(tool_radius), "operator", keys,
                        rests && target == "tissue" ? tilt() : Vector3(0, 0, 0), {off, on}, on + window);
                }
            }
        }
    }

    drawn::Numbers numbers_;
    std::vector<DrawnScene> scenes_;
};

}  // namespace

std::vector<DrawnScene> draw_resolution_scenes(std::uint64_t seed) { return Draw(seed).all(); }

}  // namespace trocar
