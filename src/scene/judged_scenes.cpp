#include "scene/judged_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "scene/rotation.hpp"

namespace trocar {
namespace {

using Document = nlohmann::ordered_json;
using drawn::Key;
using drawn::rounded;
using drawn::Tool;

constexpr int draws_of_a_kind = 5;
constexpr double clearance = 0.003;    // m, along the path to the surface at tick 0
constexpr double tail = 0.05;          // s, after the tool has left
constexpr double largest_lean = 15.0;  // degrees

/// A place on a surface, and its outward normal.
struct Spot {
    Vector3 at;
    Vector3 normal;
};

struct Organ {
    Document body;
    Vector3 radii;
    Vector3 middle;
    double turn;  ///< degrees about z
};

/// Straight stretches of a path, each at its own speed.
class Path {
public:
    explicit Path(const Vector3& start) : keys_{{0.0, start}} {}
    void move(const Vector3& to, double speed) {
        keys_.push_back({end() + (to - keys_.back().translation).norm() / speed, to});
    }
    void wait(double time) {
        if (time > 1e-5) keys_.push_back({end() + time, keys_.back().translation});
    }
    [[nodiscard]] double end() const { return keys_.back().time; }
    [[nodiscard]] const std::vector<Key>& keys() const { return keys_; }

private:
    std::vector<Key> keys_;
};

/// Rotation vector in degrees that takes +z to the unit vector `axis`, after a turn about z.
Vector3 rotation_of(const Vector3& axis, double turn) {
    const Quaternion whole =
        Quaternion::FromTwoVectors(Vector3::UnitZ(), axis) * rotation_from_degrees({0.0, 0.0, turn});
    const double sine = whole.vec().norm();
    if (sine == 0.0) return Vector3::Zero();
    return 2.0 * std::atan2(sine, whole.w()) * 180.0 / std::numbers::pi / sine * whole.vec();
}

class JudgedDraw {
public:
    explicit JudgedDraw(std::uint64_t seed) : numbers_(seed) {}

    std::vector<DrawnScene> all() {
        for (draw_ = 1; draw_ <= draws_of_a_kind; ++draw_) {
            press_sheet("press_sheet", "prescribed", blunt(), 0.003, 0.008);
            press_sheet("point_sheet", "prescribed", pointed(), 0.002, 0.005);
            stab_sheet();
            drag_sheet();
            press_organ("press_organ", "prescribed", blunt());
            drag_organ();
            side_organ();
            two_sheets();
            sheet_on_organ();
            press_sheet("held_sheet", "operator", numbers_.coin() ? blunt() : pointed(), 0.003, 0.008);
            press_organ("held_organ", "operator", numbers_.coin() ? blunt() : pointed());
            over_bone();
        }
        return std::move(scenes_);
    }

private:
    double within(double low, double high) { return numbers_.within(low, high); }
    double speed() { return within(0.04, 0.1); }
    double edge() { return rounded(within(0.005, 0.0065)); }
    double turn() { return within(0.0, 360.0); }
    Tool blunt() { return drawn::blunt(rounded(within(0.003, 0.005))); }
    Tool pointed() { return drawn::pointed(rounded(within(0.0015, 0.0025))); }
    /// Unit vector, horizontal.
    Vector3 heading() {
        const SineCosine angle = sine_cosine_of_degrees(turn());
        return {angle.cosine, angle.sine, 0.0};
    }
    /// Unit vector at most so many degrees from another one.
    Vector3 near(const Vector3& direction, double largest) {
        const SineCosine lean = sine_cosine_of_degrees(within(0.0, largest));
        const Vector3 aside = direction.unitOrthogonal();
        const Vector3 heading_now = heading();
        return lean.cosine * direction +
               lean.sine * (heading_now.x() * aside + heading_now.y() * direction.cross(aside));
    }

    Document sheet(const std::string& name, double z) {
        const double width = rounded(within(0.09, 0.11));
        const double length = rounded(within(0.09, 0.11));
        Document body = drawn::sheet(name, {width, length}, edge());
        body["pose"] = {0, 0, rounded(z), 0, 0, rounded(turn())};
        return body;
    }
    /// On a sheet in the plane z = 0, well inside its rim.
    Spot on_sheet() {
        const double x = within(-0.018, 0.018);
        const double y = within(-0.018, 0.018);
        return {{x, y, 0.0}, Vector3::UnitZ()};
    }

    /// Its top is at height z.
    Organ organ(double z) {
        Organ one;
        const double x = rounded(within(0.034, 0.042));
        const double y = rounded(within(0.034, 0.042));
        one.radii = {x, y, rounded(within(0.03, 0.038))};
        one.turn = rounded(turn());
        one.middle = {0.0, 0.0, rounded(z - one.radii.z())};
        one.body = drawn::organ(one.radii, edge());
        one.body["pose"] = {0, 0, one.middle.z(), 0, 0, one.turn};
        return one;
    }
    /// At a polar angle in degrees: 0 is the top, 90 the widest ring.
    Spot on_organ(const Organ& organ, double low, double high) {
        const SineCosine polar = sine_cosine_of_degrees(within(low, high));
        const Vector3 unit = polar.sine * heading() + polar.cosine * Vector3::UnitZ();
        const Quaternion turned = rotation_from_degrees({0.0, 0.0, organ.turn});
        return {organ.middle + turned * organ.radii.cwiseProduct(unit),
                turned * unit.cwiseQuotient(organ.radii).normalized()};
    }

    /// The tool's axis leans from the normal of the spot.
    void add(const std::string& kind, const std::string& description, Document bodies, const Tool& tool,
             const std::string& drive, const Spot& spot, const Path& path, double lean = largest_lean) {
        const Vector3 axis = near(spot.normal, lean);
        const auto k = static_cast<int>(std::lround(100.0 * std::pow(10.0, within(0.0, 1.0))));
        bodies.push_back(drawn::tool_body(tool, drive, path.keys(), rotation_of(axis, turn())));
        Document contact = Document::array();
        for (std::size_t a = 0; a < bodies.size(); ++a) {
            for (std::size_t b = a + 1; b < bodies.size(); ++b) {
                contact.push_back(drawn::contact_law(bodies[a]["name"], bodies[b]["name"], k));
            }
        }
        scenes_.push_back(drawn::finished(fmt::format("{}_{}", kind, draw_), kind, description, path.end() + tail,
                                          std::nullopt, bodies, contact));
    }

    /// In along a direction near the inward normal, hold, and back. A scene is at least 500 ticks.
    Path in_and_out(const Spot& spot, double depth, double at_speed, double lean = largest_lean) {
        const Vector3 inward = near(-spot.normal, lean);
        Path path(spot.at - clearance * inward);
        path.move(spot.at + depth * inward, at_speed);
        path.wait(std::max(0.1, 0.5 - tail - 2.0 * path.end()));
        path.move(spot.at - clearance * inward, at_speed);
        return path;
    }
    /// In, `length` across the normal with the spot in the middle, and out.
    Path along(const Spot& spot, double depth, double length) {
        const Vector3 heading_now = heading();
        const Vector3 across = (heading_now - heading_now.dot(spot.normal) * spot.normal).normalized();
        const Vector3 from = spot.at - 0.5 * length * across;
        const Vector3 to = spot.at + 0.5 * length * across;
        const double at_speed = within(0.06, 0.1);
        Path path(from + clearance * spot.normal);
        path.move(from - depth * spot.normal, at_speed);
        path.move(to - depth * spot.normal, at_speed);
        path.wait(std::max(0.0, 0.5 - tail - path.end() - (depth + clearance) / at_speed));
        path.move(to + clearance * spot.normal, at_speed);
        return path;
    }

    void press_sheet(const std::string& kind, const std::string& drive, const Tool& tool, double least, double most) {
        const Spot spot = on_sheet();
        const double depth = within(least, most);
        const Path path = in_and_out(spot, depth, speed());
        add(kind,
            fmt::format("A {} tool{} is pressed {:.1f} mm into a pinned sheet, holds and leaves.", tool.name,
                        drive == "operator" ? " held by an operator" : "", 1e3 * depth),
            Document::array({sheet("sheet", 0.0)}), tool, drive, spot, path);
    }

    void stab_sheet() {
        const Tool tool = pointed();
        const Spot spot = on_sheet();
        const double depth = within(0.005, 0.012);
        const double at_speed = within(0.2, 0.5);
        const Path path = in_and_out(spot, depth, at_speed);
        add("stab_sheet",
            fmt::format("A pointed tool stabs {:.1f} mm into a pinned sheet at {:.0f} mm/s and is withdrawn.",
                        1e3 * depth, 1e3 * at_speed),
            Document::array({sheet("sheet", 0.0)}), tool, "prescribed", spot, path);
    }

    void drag_sheet() {
        const Tool tool = blunt();
        const Spot spot = on_sheet();
        const double depth = within(0.002, 0.005);
        const double length = within(0.01, 0.025);
        const Path path = along(spot, depth, length);
        add("drag_sheet",
            fmt::format("A blunt tool {:.1f} mm deep is dragged {:.0f} mm along a pinned sheet.", 1e3 * depth,
                        1e3 * length),
            Document::array({sheet("sheet", 0.0)}), tool, "prescribed", spot, path);
    }

    void press_organ(const std::string& kind, const std::string& drive, const Tool& tool) {
        const Organ target = organ(0.0);
        const Spot spot = on_organ(target, 0.0, 25.0);
        const double depth = tool.name == "blunt" ? within(0.003, 0.008) : within(0.002, 0.005);
        const Path path = in_and_out(spot, depth, speed());
        add(kind,
            fmt::format("A {} tool{} is pressed {:.1f} mm into a closed organ, holds and leaves.", tool.name,
                        drive == "operator" ? " held by an operator" : "", 1e3 * depth),
            Document::array({target.body}), tool, drive, spot, path);
    }

    void drag_organ() {
        const Tool tool = blunt();
        const Organ target = organ(0.0);
        const Spot spot = on_organ(target, 0.0, 15.0);
        const double depth = within(0.003, 0.006);
        const double length = within(0.01, 0.02);
        const Path path = along(spot, depth, length);
        add("drag_organ",
            fmt::format("A blunt tool {:.1f} mm deep is dragged {:.0f} mm along a closed organ.", 1e3 * depth,
                        1e3 * length),
            Document::array({target.body}), tool, "prescribed", spot, path);
    }

    void side_organ() {
        const Tool tool = numbers_.coin() ? blunt() : pointed();
        const Organ target = organ(0.0);
        const Spot spot = on_organ(target, 75.0, 88.0);
        const double depth = within(0.002, 0.005);
        const Path path = in_and_out(spot, depth, speed());
        add("side_organ",
            fmt::format("A {} tool pokes a closed organ from the side, {:.1f} mm, above its pinned part.", tool.name,
                        1e3 * depth),
            Document::array({target.body}), tool, "prescribed", spot, path);
    }

    void two_sheets() {
        const Tool tool = blunt();
        const Spot spot = on_sheet();
        const double gap = within(0.001, 0.003);
        const double past = within(0.002, 0.005);
        const Path path = in_and_out(spot, gap + past, speed());
        const Document upper = sheet("upper", 0.0);
        const Document lower = sheet("lower", -gap);
        add("two_sheets",
            fmt::format("A blunt tool presses a sheet into a second one {:.1f} mm below it, {:.1f} mm past its plane.",
                        1e3 * gap, 1e3 * past),
            Document::array({upper, lower}), tool, "prescribed", spot, path);
    }

    void sheet_on_organ() {
        const Tool tool = blunt();
        const double gap = within(0.0005, 0.002);
        const double past = within(0.002, 0.005);
        const double x = within(-0.006, 0.006);
        const double y = within(-0.006, 0.006);
        const Spot spot{{x, y, 0.0}, Vector3::UnitZ()};
        const Path path = in_and_out(spot, gap + past, speed());
        const Organ below = organ(-gap);
        add("sheet_on_organ",
            fmt::format("A blunt tool presses a sheet onto a closed organ whose top is {:.1f} mm below it, {:.1f} mm "
                        "past that.",
                        1e3 * gap, 1e3 * past),
            Document::array({sheet("sheet", 0.0), below.body}), tool, "prescribed", spot, path);
    }

    /// Beside the bone, so that the tool passes it.
    void over_bone() {
        constexpr double small_lean = 6.0;  // degrees
        const double tool_radius = rounded(within(0.003, 0.005));
        const double head = rounded(within(0.007, 0.01));
        const double radius = rounded(0.9 * head);
        const double length = rounded(within(0.06, 0.08));
        const double gap = within(0.0005, 0.0015);
        const double aside = radius + tool_radius + within(0.0025, 0.004);
        const double place = within(-0.008, 0.008);
        const double lies = rounded(turn());
        const Quaternion turned = rotation_from_degrees({0.0, 0.0, lies});
        const Spot spot{turned * Vector3(place, aside, 0.0), Vector3::UnitZ()};
        const double depth = gap + within(0.004, 0.007);
        const Path path = in_and_out(spot, depth, speed(), small_lean);
        const Vector3 lying = rotation_of(turned * Vector3::UnitX(), 0.0);  // the shape lies along z
        const Document bone{
            {"name", "bone"},
            {"kind", "rigid"},
            {"closed", true},
            {"parts",
             {{{"shape", "bone"}, {"radius", radius}, {"head_radius", head}, {"length", length}, {"edge", 0.004}}}},
            {"pose", {0, 0, rounded(-gap - head), rounded(lying.x()), rounded(lying.y()), rounded(lying.z())}}};
        add("over_bone",
            fmt::format("A blunt tool presses a sheet {:.1f} mm down beside a bone that lies {:.1f} mm below it.",
                        1e3 * depth, 1e3 * gap),
            Document::array({sheet("sheet", 0.0), bone}), drawn::blunt(tool_radius), "prescribed", spot, path,
            small_lean);
    }

    drawn::Numbers numbers_;
    int draw_ = 1;
    std::vector<DrawnScene> scenes_;
};

}  // namespace

std::vector<DrawnScene> draw_judged_scenes(std::uint64_t seed) { return JudgedDraw(seed).all(); }

}  // namespace trocar
