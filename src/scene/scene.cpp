#include "scene/scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <numeric>
#include <set>
#include <utility>

#include "geometry/enclosed_volume.hpp"
#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/mesh_report.hpp"
#include "geometry/orientation.hpp"
#include "geometry/rigid_motion.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/triangle_sides.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"
#include "scene/rotation.hpp"
#include "scene/scene_settings.hpp"
#include "scene/shapes.hpp"
#include "scene/tissue_materials.hpp"

namespace trocar {
namespace {

constexpr const char* scene_format = "trocar-scene-2";
constexpr std::string_view data_prefix = "data:";
constexpr std::int64_t most_ticks = 1'000'000'000;

/// Where files of a scene lie.
struct Places {
    std::filesystem::path scene_folder;
    std::optional<std::filesystem::path> data;
    double metres = 1.0;  ///< per unit of the scene
};

/// A body as the file describes it: lengths in m.
struct BodyPlan {
    Body body;
    SceneBody scene_body;  // ranges of jaws are local to the body
    Pose fixed;
    std::optional<Vector3> trocar;
    Vector3 tip = Vector3::Zero();
    std::optional<TissueSettings> tissue;
    std::vector<std::string> notes;  ///< what was made otherwise than the file has it
    std::string pinned_place;        ///< where the file says that the rim is pinned, or leaves it unsaid
};

struct PoseNumbers {
    Vector3 translation;
    Vector3 rotation_degrees;
};

PoseNumbers read_pose(const JsonNode& node) {
    const std::vector<double> n = node.numbers(6);
    return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
}

template <typename Settings, std::size_t count>
void read_numbers(const JsonNode& node, const std::array<NumberSetting<Settings>, count>& table, double metres,
                  Settings& settings) {
    for (const NumberSetting<Settings>& entry : table) {
        const auto value = node.find(entry.key);
        if (!value) continue;
        const double number = entry.bounds == ValueBound::positive ? value->positive() : value->non_negative();
        settings.*entry.member = std::string_view(entry.unit) == "m" ? number * metres : number;
    }
}

// ---- parts ----

ShapeValues read_shape_values(const JsonNode& node, const Shape& shape) {
    using Type = ShapeParameter::Type;
    ShapeValues values;
    for (const ShapeParameter& parameter : shape.parameters) {
        std::vector<double>& numbers = values.numbers[parameter.name];
        if (parameter.type == Type::choice) {
            const auto given = node.find(parameter.name);
            values.words[parameter.name] = given ? given->word(parameter.choices) : parameter.choices.front();
            continue;
        }
        if (parameter.default_number && !node.has(parameter.name)) {
            numbers = {*parameter.default_number};
            continue;
        }
        const JsonNode given = node.at(parameter.name);
        const auto read_lengths = [&](std::size_t count) {
            if (!given.is_list() || given.list().size() != count)
                given.fail(fmt::format("a list of {} lengths", count));
            for (const JsonNode& item : given.list()) numbers.push_back(item.positive());
        };
        switch (parameter.type) {
            case Type::length:
                numbers = {given.positive()};
                break;
            case Type::lengths2:
                read_lengths(2);
                break;
            case Type::lengths3:
                read_lengths(3);
                break;
            case Type::points3:
                if (!given.is_list() || given.list().size() != 3) given.fail("a list of 3 points");
                for (const JsonNode& point : given.list()) {
                    for (const double x : point.numbers(3)) numbers.push_back(x);
                }
                break;
            case Type::degrees:
            case Type::ratio:
                numbers = {given.number(parameter.minimum, parameter.maximum)};
                break;
            case Type::choice:
                break;
        }
    }
    return values;
}

Surface read_shape(const JsonNode& node, const Shape& shape) {
    const ShapeValues values = read_shape_values(node, shape);
    if (shape.check != nullptr) {
        if (const auto fault = shape.check(values)) node.at(fault->parameter).fail(fault->expected);
    }
    const double estimate = shape.triangle_estimate(values);
    if (are_sizes_limited() && !(estimate <= static_cast<double>(most_triangles))) {
        node.at("edge").fail("an edge that gives " + limit_text(most_triangles, "triangles"));
    }
    constexpr auto index_end = std::numeric_limits<Index>::max();
    if (!(estimate <= static_cast<double>(index_end))) {
        node.at("edge").fail(fmt::format("an edge that gives at most {} triangles", index_end));
    }
    return shape.make(values);
}

/// The file that a mesh text names; empty when it names data and there is no data folder.
std::filesystem::path mesh_path(const std::string& text, const Places& places) {
    if (!text.starts_with(data_prefix)) return places.scene_folder / text;
    if (!places.data) return {};
    return *places.data / text.substr(data_prefix.size());
}

Surface read_part_mesh(const JsonNode& node, const Places& places) {
    const std::string text = node.text();
    const std::filesystem::path path = mesh_path(text, places);
    std::error_code error;
    if (path.empty() || !std::filesystem::exists(path, error)) {
        if (!text.starts_with(data_prefix))
            node.fail("a mesh file beside the scene", fmt::format("no file '{}'", path.string()));
        node.fail(fmt::format("the file {} in the data folder (name it with --data DIR or TROCAR_DATA)",
                              text.substr(data_prefix.size())),
                  places.data ? fmt::format("no file '{}'", path.string()) : "no data folder");
    }
    Mesh mesh = read_mesh(path);
    return {std::move(mesh.vertices), std::move(mesh.triangles)};
}

/// Every edge belongs to exactly two triangles that run it in opposite directions.
bool is_watertight(const Triangles& triangles) {
    bool paired = true;
    for_each_edge(sorted_sides(triangles), [&paired](std::span<const TriangleSide> edge) {
        paired = paired && edge.size() == 2 && edge[0].forward != edge[1].forward;
    });
    return paired;
}

struct Part {
    Surface surface;                   ///< m, body frame
    std::vector<Index> file_triangle;  ///< number in the file of every triangle
    Index file_triangles = 0;          ///< in the file, those left out included
    std::vector<Index> file_vertex;    ///< number in the file of every vertex
    Index file_vertices = 0;           ///< in the file, those left out included
    std::optional<JsonNode> mesh;      ///< where the file is named; absent: a shape
    bool open_shape = false;
    bool watertight = true;
    Index hole_edges = 0;  ///< edges of the mesh with one triangle, vertices at the same place taken as one
    std::string jaw;
};

void number_as_in_file(Part& part) {
    part.file_triangles = static_cast<Index>(part.surface.triangles.cols());
    part.file_triangle.resize(at(part.file_triangles));
    std::iota(part.file_triangle.begin(), part.file_triangle.end(), 0);
    part.file_vertices = static_cast<Index>(part.surface.vertices.cols());
    part.file_vertex.resize(at(part.file_vertices));
    std::iota(part.file_vertex.begin(), part.file_vertex.end(), 0);
}

/// What `before` alone had as corners would touch others as points without a surface. Vertices that no triangle had
/// stay as the file has them.
void leave_out_vertices_of(const Triangles& before, Part& part) {
    std::vector<std::uint8_t> kept(at(part.file_vertices), 1);
    for (Eigen::Index k = 0; k < before.size(); ++k) kept[at(before.data()[k])] = 0;
    Triangles& triangles = part.surface.triangles;
    for (Eigen::Index k = 0; k < triangles.size(); ++k) kept[at(triangles.data()[k])] = 1;
    Matrix3X& vertices = part.surface.vertices;
    std::vector<Index> new_number(kept.size(), -1);
    Index count = 0;
    for (Index v = 0; v < part.file_vertices; ++v) {
        if (kept[at(v)] == 0) continue;
        vertices.col(count) = vertices.col(v).eval();
        part.file_vertex[at(count)] = v;
        new_number[at(v)] = count++;
    }
    vertices.conservativeResize(Eigen::NoChange, count);
    part.file_vertex.resize(at(count));
    for (Eigen::Index k = 0; k < triangles.size(); ++k) triangles.data()[k] = new_number[at(triangles.data()[k])];
}

/// A triangle that is there twice doubles what the surface does and hides which triangles are neighbours: it is taken
/// once, and a note says so.
void leave_out_repeated(const JsonNode& mesh, bool same_place, Part& part, std::vector<std::string>& notes) {
    Triangles& triangles = part.surface.triangles;
    const auto repeated = repeated_triangles(part.surface.vertices, triangles, same_place);
    if (repeated.empty()) return;
    const Triangles before = triangles;
    auto next = repeated.begin();
    Index kept = 0;
    for (Index t = 0; t < part.file_triangles; ++t) {
        if (next != repeated.end() && (*next)[0] == t) {
            ++next;
            continue;
        }
        triangles.col(kept) = triangles.col(t).eval();
        part.file_triangle[at(kept)] = t;
        ++kept;
    }
    triangles.conservativeResize(Eigen::NoChange, kept);
    part.file_triangle.resize(at(kept));
    leave_out_vertices_of(before, part);
    notes.push_back(fmt::format("{}: {} of {} triangles repeat an earlier one and are left out (first: {} is {} again)",
                                mesh.place(), repeated.size(), part.file_triangles, repeated.front()[0],
                                repeated.front()[1]));
}

/// Neighbours whose triangles have opposite orientations have no side in common: one of them draws tools in.
void expect_neighbours_agree(const JsonNode& mesh, const OrientationReport& orientation) {
    if (orientation.disagreeing_edges == 0) return;
    const auto& [first, second] = orientation.first_disagreeing;
    std::string found = fmt::format("{} edges where they do not, first between triangles {} and {}",
                                    orientation.disagreeing_edges, first, second);
    found += orientation.to_turn.empty()
                 ? std::string("; turning triangles round does not mend it")
                 : fmt::format("; turn round triangle{} {} (trocar mesh FILE --mend OUT.obj)",
                               orientation.to_turn.size() > 1 ? "s" : "", first_of(orientation.to_turn));
    mesh.fail("neighbouring triangles that run round the same way", found);
}

Part read_part(const JsonNode& node, const Places& places, BodyKind kind, std::vector<std::string>& notes) {
    Part part;
    std::vector<std::string> keys{"scale", "pose", "jaw"};
    if (node.find("mesh")) {
        keys.insert(keys.begin(), "mesh");
        node.expect_keys(keys);
        part.mesh = node.at("mesh");
        part.surface = read_part_mesh(*part.mesh, places);
        number_as_in_file(part);
        // Vertices of tissue have a mass each: two at one place are two.
        leave_out_repeated(*part.mesh, kind != BodyKind::tissue, part, notes);
        part.watertight = is_watertight(part.surface.triangles);
        // A seam of vertices stored twice is no hole.
        if (!part.watertight) part.hole_edges = boundary_edges(part.surface.vertices, part.surface.triangles);
    } else if (node.find("shape")) {
        std::vector<std::string> names;
        for (const Shape& shape : shapes()) names.push_back(shape.name);
        const Shape& shape = *find_shape(node.at("shape").word(names));
        std::vector<std::string> own{"shape"};
        for (const ShapeParameter& parameter : shape.parameters) own.push_back(parameter.name);
        keys.insert(keys.begin(), own.begin(), own.end());
        node.expect_keys(keys);
        part.surface = read_shape(node, shape);
        number_as_in_file(part);
        part.open_shape = !shape.closed;
        part.watertight = shape.closed;
    } else {
        node.fail("the key 'shape' or 'mesh'", "none");
    }
    if (const auto scale = node.find("scale")) part.surface.vertices *= scale->positive();
    if (const auto pose = node.find("pose")) {
        const PoseNumbers numbers = read_pose(*pose);
        transform_points(rotation_from_degrees(numbers.rotation_degrees).toRotationMatrix(), numbers.translation,
                         part.surface.vertices);
    }
    part.surface.vertices *= places.metres;
    if (const auto jaw = node.find("jaw")) part.jaw = jaw->word({"left", "right"});
    if (!part.surface.vertices.allFinite()) node.fail("finite coordinates after scale and pose", "an overflow");
    return part;
}

// ---- bodies ----

Motion read_motion(const JsonNode& node, const Places& places) {
    node.expect_keys({"drive", "keys", "operator"});
    Motion motion;
    if (node.at("drive").word(drive_words) == "operator") motion.drive = Drive::simulated_operator;
    if (const auto coupling = node.find("operator")) {
        if (motion.drive != Drive::simulated_operator) coupling->fail("no operator beside a prescribed drive", "one");
        std::vector<std::string> keys;
        keys.reserve(operator_numbers.size());
        for (const auto& entry : operator_numbers) keys.emplace_back(entry.key);
        coupling->expect_keys(keys);
        read_numbers(*coupling, operator_numbers, places.metres, motion.coupling);
    }
    double jaw = 1.0;
    for (const JsonNode& item : node.at("keys").list()) {
        item.expect_keys({"time", "pose", "jaw"});
        MotionKey key;
        key.time = item.at("time").number();
        if (!motion.keys.empty() && key.time <= motion.keys.back().time) {
            item.at("time").fail(fmt::format("a time after {}", motion.keys.back().time));
        }
        const PoseNumbers pose = read_pose(item.at("pose"));
        key.translation = places.metres * pose.translation;
        key.rotation_degrees = pose.rotation_degrees;
        if (const auto value = item.find("jaw")) jaw = value->number(0.0, 1.0);
        key.jaw = jaw;
        motion.keys.push_back(key);
    }
    if (motion.keys.empty()) node.at("keys").fail("at least one key");
    return motion;
}

TissueSettings read_tissue(const JsonNode& node, const Places& places, Index vertex_count) {
    std::vector<std::string> keys{"pinned", "substeps"};
    for (const auto& entry : tissue_numbers) keys.emplace_back(entry.key);
    node.expect_keys(keys);
    TissueSettings settings;
    read_numbers(node, tissue_numbers, places.metres, settings);
    if (const auto substeps = node.find("substeps")) {
        settings.substeps = static_cast<int>(substeps->integer(1, most_substeps));
    }
    if (const auto pinned = node.find("pinned")) {
        if (pinned->is_list()) {
            settings.rim_pinned = false;
            for (const JsonNode& number : pinned->list()) {
                if (vertex_count == 0) number.fail("no number, the body has no vertices");
                settings.pinned.push_back(static_cast<Index>(number.integer(0, vertex_count - 1)));
            }
        } else if (!pinned->is_text()) {
            pinned->fail("rim, none or a list of vertex numbers");
        } else {
            settings.rim_pinned = pinned->word({"rim", "none"}) == "rim";
        }
    }
    return settings;
}

/// A pressure needs a surface that is closed vertex by vertex and has its volume inside.
void expect_enclosure(const JsonNode& bulk_modulus, const BodyPlan& plan) {
    const Triangles& triangles = plan.body.triangles;
    if (const Index open = open_edges(triangles); open > 0) {
        bulk_modulus.fail("0, since the body is open",
                          fmt::format("{:g} on a surface with {} open edges", bulk_modulus.number(), open));
    }
    if (!plan.body.closed) bulk_modulus.fail("0, since the body is said to be open");
    const double volume = enclosed_volume(triangles, plan.scene_body.local);
    if (!(volume > 0.0)) {
        bulk_modulus.fail("0, since the body encloses nothing",
                          fmt::format("{:g} on a volume of {:.6g} m³", bulk_modulus.number(), volume));
    }
}

void read_hinge(const JsonNode& node, const Places& places, Vector3& point, Vector3& axis, double& angle) {
    node.expect_keys({"point", "axis", "angle"});
    if (const auto value = node.find("point")) point = places.metres * value->vector3();
    if (const auto value = node.find("axis")) {
        axis = value->vector3();
        if (!(axis.norm() > 0.0) || !std::isfinite(axis.norm())) value->fail("a direction");
        axis /= axis.norm();
    }
    if (const auto value = node.find("angle")) angle = value->number(0.0, 180.0);
}

/// Neighbours agree everywhere, and a closed shell is counter-clockwise seen from outside, unless it is a cavity: then
/// the rest of the body surrounds it. A closed shell of a body that is said to be open may hold the others inside.
void expect_consistent_orientation(const std::vector<Part>& parts, const Matrix3X& vertices, const Triangles& triangles,
                                   bool said_open) {
    Index first_triangle = 0;
    for (const Part& part : parts) {
        const Index begin = first_triangle;
        first_triangle += static_cast<Index>(part.surface.triangles.cols());
        if (!part.mesh) continue;
        OrientationReport orientation = orientation_of(part.surface.vertices, part.surface.triangles);
        for (Index& t : orientation.first_disagreeing) t = t < 0 ? t : part.file_triangle[at(t)];
        for (Index& t : orientation.to_turn) t = part.file_triangle[at(t)];
        expect_neighbours_agree(*part.mesh, orientation);
        if (said_open) continue;
        for (ShellInsideOut& shell : orientation.inside_out) {
            const Index first = shell.triangles.front();
            for (Index& t : shell.triangles) t += begin;
            if (is_cavity(vertices, triangles, shell)) continue;
            part.mesh->fail(
                "closed surfaces with their volume inside, triangles counter-clockwise seen from outside",
                fmt::format("a volume of {:.6g} m³ in the {} triangles connected with triangle {}: {}", shell.volume,
                            shell.triangles.size(), part.file_triangle[at(first)],
                            shell.volume < 0.0 ? "turn all of them round (trocar mesh FILE --mend OUT.obj), or say "
                                                 "\"closed\": false where others are inside it"
                                               : "it encloses nothing"));
        }
    }
}

void read_parts(const JsonNode& node, const Places& places, BodyPlan& plan) {
    Vector3 hinge = Vector3::Zero();
    Vector3 axis = Vector3::UnitX();
    double angle = default_jaw_angle;
    if (const auto value = node.find("hinge")) read_hinge(*value, places, hinge, axis, angle);

    std::vector<Part> parts;
    std::int64_t vertex_total = 0;
    std::int64_t triangle_total = 0;
    const std::vector<JsonNode> items = node.at("parts").list();
    if (are_sizes_limited() && items.size() > static_cast<std::size_t>(most_parts)) {
        node.at("parts").fail(limit_text(most_parts, "parts of a body"), std::to_string(items.size()));
    }
    for (const JsonNode& item : items) {
        parts.push_back(read_part(item, places, plan.body.kind, plan.notes));
        vertex_total += parts.back().surface.vertices.cols();
        triangle_total += parts.back().surface.triangles.cols();
        if (are_sizes_limited() && triangle_total > most_triangles) {
            item.fail(limit_text(most_triangles, "triangles in a scene"), fmt::format("{} up to here", triangle_total));
        }
        if (std::max(vertex_total, triangle_total) > std::numeric_limits<Index>::max()) {
            item.fail("at most 2147483647 vertices and triangles", "more");
        }
    }
    if (parts.empty()) node.at("parts").fail("at least one part");
    Matrix3X& local = plan.scene_body.local;
    local.resize(3, vertex_total);
    plan.body.triangles.resize(3, triangle_total);
    Index first_vertex = 0;
    Index first_triangle = 0;
    Index file_triangles = 0;
    Index file_vertices = 0;
    bool open_shape = false;
    bool watertight = true;
    Index edges_of_holes = 0;
    for (const Part& part : parts) {
        const auto vertices = static_cast<Index>(part.surface.vertices.cols());
        const auto triangles = static_cast<Index>(part.surface.triangles.cols());
        local.middleCols(first_vertex, vertices) = part.surface.vertices;
        plan.body.triangles.middleCols(first_triangle, triangles) = part.surface.triangles.array() + first_vertex;
        if (!part.jaw.empty()) {
            plan.scene_body.jaws.push_back({.vertices = {first_vertex, vertices},
                                            .hinge = hinge,
                                            .axis = axis,
                                            .angle_open_degrees = part.jaw == "left" ? angle : -angle});
        }
        for (const Index t : part.file_triangle) plan.scene_body.file_triangle.push_back(file_triangles + t);
        file_triangles += part.file_triangles;
        for (const Index v : part.file_vertex) plan.scene_body.file_vertex.push_back(file_vertices + v);
        file_vertices += part.file_vertices;
        first_vertex += vertices;
        first_triangle += triangles;
        open_shape = open_shape || part.open_shape;
        edges_of_holes += part.hole_edges;
        watertight = watertight && part.watertight;
    }
    plan.body.vertex_count = first_vertex;
    plan.body.closed = watertight;
    if (const auto closed = node.find("closed")) {
        plan.body.closed = closed->flag();
        if (plan.body.closed && open_shape) closed->fail("false, since a part is an open sheet");
        if (plan.body.closed && edges_of_holes > 0) {
            closed->fail(
                fmt::format("false, since the body's meshes have holes ({} edges with one triangle)", edges_of_holes));
        }
    }
    const bool said_open = node.has("closed") && !plan.body.closed;
    expect_consistent_orientation(parts, local, plan.body.triangles, said_open);
}

BodyPlan read_body(const JsonNode& node, const Places& places) {
    node.expect_keys({"name", "kind", "closed", "side", "instrument", "parts", "pose", "motion", "trocar", "tip",
                      "hinge", "tissue"});
    BodyPlan plan;
    plan.body.name = node.at("name").text();
    const std::string kind = node.at("kind").word(body_kind_words);
    plan.body.kind = body_kind_of(kind);
    for (const char* key : {"instrument", "motion", "trocar", "tip", "hinge"}) {
        if (plan.body.kind != BodyKind::instrument && node.has(key)) {
            node.at(key).fail(fmt::format("'{}' at an instrument only", key), fmt::format("one at a {} body", kind));
        }
    }
    if (plan.body.kind != BodyKind::tissue && node.has("tissue")) {
        node.at("tissue").fail("'tissue' at a tissue body only", fmt::format("one at a {} body", kind));
    }
    if (const auto instrument = node.find("instrument")) plan.body.instrument = instrument->text();
    read_parts(node, places, plan);
    if (const auto side = node.find("side")) {
        if (plan.body.closed) side->fail("'side' at an open body only", "one at a closed body");
        if (side->word({"front", "back"}) == "back") plan.body.start_side = SheetSide::back;
    }
    if (const auto motion = node.find("motion")) {
        if (node.has("pose")) node.at("pose").fail("no pose beside a motion, whose keys place the body", "one");
        plan.scene_body.motion = read_motion(*motion, places);
    }
    if (const auto pose = node.find("pose")) {
        const PoseNumbers numbers = read_pose(*pose);
        plan.fixed.translation = places.metres * numbers.translation;
        plan.fixed.rotation = rotation_from_degrees(numbers.rotation_degrees);
    }
    if (const auto trocar = node.find("trocar")) plan.trocar = places.metres * trocar->vector3();
    if (const auto tip = node.find("tip")) plan.tip = places.metres * tip->vector3();
    if (plan.body.kind == BodyKind::tissue) {
        const auto tissue = node.find("tissue");
        plan.tissue = tissue ? read_tissue(*tissue, places, plan.body.vertex_count) : TissueSettings{};
        if (plan.tissue->bulk_modulus > 0.0) expect_enclosure(tissue->at("bulk_modulus"), plan);
        plan.pinned_place = (tissue ? *tissue : node).place();
    }
    return plan;
}

// ---- the whole ----

/// A closed surface has no rim: pinning it holds nothing, and the tissue drifts off at the first touch.
void note_idle_rim(const std::string& place, const BodyRange& body, Scene& scene) {
    const auto first = scene.materials.pinned.begin() + body.vertices.first;
    if (std::find(first, first + body.vertices.count, 1) != first + body.vertices.count) return;
    scene.notes.push_back(
        fmt::format("{}: pinned 'rim' holds nothing, since {} has no rim: vertex numbers would, or 'none' says so",
                    place, body.name));
}

/// Mass comes from the area of a vertex' triangles: without any, no force moves it.
void note_massless(const std::string& place, const BodyRange& body, Scene& scene) {
    const auto first = scene.materials.mass.begin() + body.vertices.first;
    const auto last = first + body.vertices.count;
    const auto count = std::count(first, last, 0.0);
    if (count == 0) return;
    scene.notes.push_back(fmt::format(
        "{}: {} of {} vertices of {} have no mass and stay where they are, since no triangle with an area has "
        "them (first: {})",
        place, count, body.vertices.count, body.name, std::find(first, last, 0.0) - first));
}

void read_contact(const JsonNode& node, const Topology& topology, Materials& materials) {
    std::vector<std::string> names;
    for (const BodyRange& body : topology.bodies) names.push_back(body.name);
    std::set<Index> seen;
    for (const JsonNode& item : node.list()) {
        item.expect_keys({"bodies", "k", "mu"});
        const std::vector<JsonNode> pair = item.at("bodies").list();
        if (pair.size() != 2) item.at("bodies").fail("two names of bodies");
        std::array<Index, 2> body{};
        for (std::size_t i = 0; i < 2; ++i) {
            const std::string name = pair[i].word(names);
            body[i] = static_cast<Index>(std::find(names.begin(), names.end(), name) - names.begin());
        }
        const Index number = body[0] == body[1] ? -1 : topology.body_pair(body[0], body[1]);
        if (number < 0) {
            item.at("bodies").fail(
                "two bodies that are tested against each other (not rigid with rigid, nor parts of one instrument)");
        }
        if (!seen.insert(number).second) item.at("bodies").fail("every two bodies once");
        ContactLaw& law = materials.contact_laws[at(number)];
        if (const auto k = item.find("k")) law.k = k->non_negative();
        if (const auto mu = item.find("mu")) law.mu = mu->non_negative();
    }
}

ContactOff read_contact_off(const JsonNode& node, double dt) {
    if (!node.is_list() || node.list().size() != 2) node.fail("two times, from and to");
    const ContactOff off{node.list()[0].number(), node.list()[1].number()};
    if (off.to < 0.0) node.list()[1].fail("a time >= 0, from which on there is contact");
    if (off.to <= off.from) node.list()[1].fail(fmt::format("a time after {}", off.from));
    if (off.from < -dt * static_cast<double>(most_ticks)) {
        node.list()[0].fail(fmt::format("at most {} ticks before the first", most_ticks));
    }
    return off;
}

/// Over all that decides a run. Names are left out: they decide nothing.
class Hash {
public:
    void add(std::uint64_t bits) { hash_.add_word(bits); }
    void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
    void add(Index number) { add(static_cast<std::uint64_t>(static_cast<std::int64_t>(number))); }
    template <typename Derived>
    void add(const Eigen::MatrixBase<Derived>& matrix) {
        add(static_cast<std::uint64_t>(matrix.cols()));
        for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
            for (Eigen::Index row = 0; row < matrix.rows(); ++row) add(matrix(row, column));
        }
    }
    template <typename Number>
    void add(const std::vector<Number>& numbers) {
        add(static_cast<std::uint64_t>(numbers.size()));
        for (const Number& number : numbers) {
            if constexpr (std::is_same_v<Number, double>) {
                add(number);
            } else {
                add(static_cast<std::uint64_t>(number));
            }
        }
    }
    [[nodiscard]] std::uint64_t value() const { return hash_.value(); }

private:
    FnvHash hash_;
};

std::uint64_t hash_of(const Scene& scene) {
    Hash hash;
    hash.add(scene.dt);
    hash.add(static_cast<std::uint64_t>(scene.ticks));
    hash.add(scene.seed);
    if (scene.contact_off) {
        hash.add(scene.contact_off->from);
        hash.add(scene.contact_off->to);
    }
    hash.add(scene.topology.triangles);
    for (const BodyRange& body : scene.topology.bodies) {
        for (const Index number : {static_cast<Index>(body.kind), static_cast<Index>(body.closed),
                                   static_cast<Index>(body.start_side), body.vertices.count, body.triangles.count}) {
            hash.add(number);
        }
    }
    for (const auto& [a, b] : scene.topology.body_pairs) {
        hash.add(a);
        hash.add(b);
    }
    hash.add(scene.first.position);
    const Materials& materials = scene.materials;
    for (const Spring& spring : materials.springs) {
        hash.add(spring.i);
        hash.add(spring.j);
        for (const double number : {spring.rest, spring.k, spring.preload, spring.damping}) hash.add(number);
    }
    hash.add(materials.rest_bias);
    hash.add(materials.pinned);
    for (const std::vector<double>* numbers : {&materials.mass, &materials.area, &materials.mean_stiffness,
                                               &materials.triangle_stiffness, &materials.drag}) {
        hash.add(*numbers);
    }
    // What a scene does not name leaves its hash as it was.
    for (const Enclosure& enclosure : materials.enclosures) {
        hash.add(enclosure.triangles);
        hash.add(enclosure.volume);
        hash.add(enclosure.bulk_modulus);
    }
    hash.add(static_cast<Index>(materials.substeps));
    hash.add(materials.strain_limit);
    for (const ContactLaw& law : materials.contact_laws) {
        // Two NaNs may differ in their bits.
        hash.add(std::isnan(law.k) ? -1.0 : law.k);
        hash.add(std::isnan(law.mu) ? -1.0 : law.mu);
    }
    for (const auto& point : materials.trocar_point) {
        hash.add(static_cast<Index>(point.has_value()));
        if (point) hash.add(*point);
    }
    for (const Vector3& tip : materials.tip) hash.add(tip);
    for (const SceneBody& body : scene.bodies) {
        hash.add(body.local);
        for (const JawPart& jaw : body.jaws) {
            hash.add(jaw.vertices.first);
            hash.add(jaw.vertices.count);
            hash.add(jaw.hinge);
            hash.add(jaw.axis);
            hash.add(jaw.angle_open_degrees);
        }
        hash.add(static_cast<Index>(body.motion.has_value()));
        if (!body.motion) continue;
        hash.add(static_cast<Index>(body.motion->drive));
        const OperatorModel& coupling = body.motion->coupling;
        for (const double number :
             {coupling.mass, coupling.damping, coupling.coupling_stiffness, coupling.coupling_damping})
            hash.add(number);
        for (const MotionKey& key : body.motion->keys) {
            hash.add(key.time);
            hash.add(key.translation);
            hash.add(key.rotation_degrees);
            hash.add(key.jaw);
        }
    }
    return hash.value();
}

}  // namespace

Scene read_scene(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data) {
    const std::string name = file.string();
    const Json document = parse_json(read_whole(file, "a scene file"), name);
    const JsonNode root = JsonNode(document, name).with_key_kind(NameKind::scene_key);
    root.expect_keys(
        {"format", "name", "description", "unit", "dt", "ticks", "seed", "bodies", "contact", "contact_off"});
    root.at("format").expect_word(scene_format);
    Scene scene;
    scene.name = root.at("name").text();
    if (const auto description = root.find("description")) static_cast<void>(description->text());
    Places places{.scene_folder = file.parent_path(), .data = data};
    if (const auto unit = root.find("unit")) {
        const std::string word = unit->word(unit_words);
        places.metres = word == "m" ? 1.0 : word == "mm" ? 0.001 : 0.01;
    }
    if (const auto dt = root.find("dt")) scene.dt = dt->positive();
    scene.ticks = root.at("ticks").integer(1, most_ticks);
    if (const auto seed = root.find("seed")) scene.seed = seed->unsigned_integer();
    if (const auto off = root.find("contact_off")) scene.contact_off = read_contact_off(*off, scene.dt);

    std::vector<BodyPlan> plans;
    std::set<std::string> names;
    const std::vector<JsonNode> items = root.at("bodies").list();
    if (are_sizes_limited() && items.size() > static_cast<std::size_t>(most_bodies)) {
        root.at("bodies").fail(limit_text(most_bodies, "bodies"), std::to_string(items.size()));
    }
    std::int64_t triangles = 0;
    for (const JsonNode& item : items) {
        plans.push_back(read_body(item, places));
        triangles += plans.back().body.triangles.cols();
        if (are_sizes_limited() && triangles > most_triangles) {
            item.fail(limit_text(most_triangles, "triangles in a scene"), fmt::format("{} up to here", triangles));
        }
        if (!names.insert(plans.back().body.name).second) item.at("name").fail("a name of its own");
    }
    if (plans.empty()) root.at("bodies").fail("at least one body");
    std::stable_sort(plans.begin(), plans.end(),
                     [](const BodyPlan& a, const BodyPlan& b) { return a.body.kind < b.body.kind; });
    std::vector<Body> bodies;
    bodies.reserve(plans.size());
    for (const BodyPlan& plan : plans) bodies.push_back(plan.body);
    scene.topology = make_topology(bodies);

    const Index vertex_count = scene.topology.vertex_count;
    scene.first.position.resize(3, vertex_count);
    for (std::size_t b = 0; b < plans.size(); ++b) {
        const BodyRange& range = scene.topology.bodies[b];
        SceneBody body = std::move(plans[b].scene_body);
        for (JawPart& jaw : body.jaws) jaw.vertices.first += range.vertices.first;
        const Pose pose = body.motion ? body.motion->pose_at(0.0) : plans[b].fixed;
        place_body(body, range.vertices, pose, scene.first.position);
        scene.notes.insert(scene.notes.end(), plans[b].notes.begin(), plans[b].notes.end());
        scene.first.pose.push_back(pose);
        scene.materials.trocar_point.push_back(plans[b].trocar);
        scene.materials.tip.push_back(plans[b].tip);
        scene.bodies.push_back(std::move(body));
    }
    scene.first.previous = scene.first.position;
    scene.first.velocity = Matrix3X::Zero(3, vertex_count);

    scene.materials.contact_laws.resize(scene.topology.body_pairs.size());
    if (const auto contact = root.find("contact")) read_contact(*contact, scene.topology, scene.materials);
    if (std::any_of(plans.begin(), plans.end(), [](const BodyPlan& plan) { return plan.tissue.has_value(); })) {
        prepare_tissue_arrays(scene.topology, scene.materials);
        for (std::size_t b = 0; b < plans.size(); ++b) {
            if (!plans[b].tissue) continue;
            add_tissue_body(*plans[b].tissue, scene.topology, scene.topology.bodies[b], scene.first.position, scene.dt,
                            scene.materials);
            note_massless(plans[b].pinned_place, scene.topology.bodies[b], scene);
            if (plans[b].tissue->rim_pinned) note_idle_rim(plans[b].pinned_place, scene.topology.bodies[b], scene);
        }
    }
    scene.hash = hash_of(scene);
    scene.file = file;
    return scene;
}

bool lacks_data(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data) {
    if (!std::filesystem::is_regular_file(file)) return false;
    Json document;
    try {
        document = parse_json(read_whole(file, "a scene file"), file.string());
    } catch (const InputError&) {
        return false;  // read_scene's to report
    }
    const Json::json_pointer bodies("/bodies");
    if (!document.is_object() || !document.contains(bodies) || !document[bodies].is_array()) return false;
    const Places places{.scene_folder = file.parent_path(), .data = data};
    for (const Json& body : document[bodies]) {
        if (!body.is_object() || !body.contains("parts") || !body["parts"].is_array()) continue;
        for (const Json& part : body["parts"]) {
            if (!part.is_object() || !part.contains("mesh") || !part["mesh"].is_string()) continue;
            const std::string text = part["mesh"].get<std::string>();
            std::error_code error;
            if (text.starts_with(data_prefix)) {
                const std::filesystem::path path = mesh_path(text, places);
                if (path.empty() || !std::filesystem::exists(path, error)) return true;
            }
        }
    }
    return false;
}

bool Scene::has_contact_at(std::int64_t tick) const {
    if (!contact_off) return true;
    // Half a tick absorbs the rounding of times.
    const double middle = (static_cast<double>(tick) + 0.5) * dt;
    return middle < contact_off->from || middle >= contact_off->to;
}

std::int64_t Scene::prelude_ticks() const {
    return contact_off && contact_off->from < 0.0 ? std::llround(-contact_off->from / dt) : 0;
}

Frame scripted_frame(const Scene& scene, std::int64_t tick) {
    Frame frame = scene.first;
    frame.tick = tick;
    frame.time = static_cast<double>(tick) * scene.dt;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const SceneBody& body = scene.bodies[b];
        if (!body.motion) continue;
        frame.pose[b] = body.motion->pose_at(frame.time);
        place_body(body, scene.topology.bodies[b].vertices, frame.pose[b], frame.position);
    }
    frame.previous = frame.position;
    return frame;
}

Index shown_body(const Scene& scene) {
    Index shown = -1;
    for (Index b = 0; at(b) < std::min(scene.topology.bodies.size(), scene.bodies.size()); ++b) {
        if (scene.topology.bodies[at(b)].kind != BodyKind::instrument) continue;
        if (shown < 0 || (scene.bodies[at(b)].motion && !scene.bodies[at(shown)].motion)) shown = b;
    }
    return shown;
}

std::vector<Index> operators_of_bodies(const Scene& scene) {
    const std::vector<BodyRange>& bodies = scene.topology.bodies;
    std::vector<Index> number(bodies.size(), -1);
    Index count = 0;
    for (std::size_t b = 0; b < std::min(bodies.size(), scene.bodies.size()); ++b) {
        const std::optional<Motion>& motion = scene.bodies[b].motion;
        if (!motion || motion->drive != Drive::simulated_operator) continue;
        for (std::size_t other = 0; other < b && !bodies[b].instrument.empty(); ++other) {
            if (bodies[other].instrument == bodies[b].instrument) number[b] = std::max(number[b], number[other]);
        }
        if (number[b] < 0) number[b] = count++;
    }
    return number;
}

void place_body(const SceneBody& body, Range vertices, const Pose& pose, Matrix3X& position) {
    auto points = position.middleCols(vertices.first, vertices.count);
    points = body.local;
    for (const JawPart& jaw : body.jaws) {
        const double angle = jaw.angle_open_degrees * pose.jaw;
        if (angle == 0.0) continue;
        const Matrix3 turn = rotation_from_degrees(angle * jaw.axis).toRotationMatrix();
        auto part = position.middleCols(jaw.vertices.first, jaw.vertices.count);
        part.colwise() -= jaw.hinge;
        transform_points(turn, jaw.hinge, part);
    }
    transform_points(pose.rotation.toRotationMatrix(), pose.translation, points);
}

}  // namespace trocar
