// `trocar mesh`: counts, defects, box and unit of one mesh file.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/mesh_report.hpp"
#include "geometry/orientation.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

Json point_json(const Vector3& p) { return Json::array({p[0], p[1], p[2]}); }

void print_json(const Mesh& mesh, const MeshReport& report, const OrientationReport& orientation) {
    Json document{{"format", mesh.format},
                  {"vertices_stored", report.vertices_stored},
                  {"vertices", report.vertices},
                  {"triangles", report.triangles},
                  {"shells", report.shells},
                  {"boundary_edges", report.boundary_edges},
                  {"holes", report.holes},
                  {"non_manifold_edges", report.non_manifold_edges},
                  {"flipped_edges", report.flipped_edges},
                  {"bow_vertices", report.bow_vertices},
                  {"degenerate_triangles", report.degenerate_triangles},
                  {"duplicate_triangles", report.duplicate_triangles},
                  {"self_intersections", report.self_intersections},
                  {"watertight", report.watertight},
                  {"signed_volume", report.signed_volume},
                  {"box", Json::array({point_json(report.box.min), point_json(report.box.max)})},
                  {"unit", {{"name", report.unit.name}, {"guessed", report.unit.guessed}}}};
    if (report.coplanar_overlaps > 0) document["coplanar_overlaps"] = report.coplanar_overlaps;
    if (!report.coplanar_overlaps_complete) document["coplanar_overlaps_complete"] = false;
    if (!report.self_intersections_complete) document["self_intersections_complete"] = false;
    if (!orientation.to_turn.empty()) document["turned_triangles"] = orientation.to_turn;
    for (const ShellInsideOut& shell : orientation.inside_out) {
        document["inside_out"].push_back(
            {{"triangle", shell.triangles.front()}, {"triangles", shell.triangles.size()}, {"volume", shell.volume}});
    }
    print_json_line(document);
}

void print_table(const MeshOptions& options, const Mesh& mesh, const MeshReport& report,
                 const OrientationReport& orientation) {
    const auto row = [](std::string_view name, const std::string& value, std::string_view note = "") {
        fmt::print("  {:<22} {}{}{}\n", name, value, note.empty() ? "" : "   ", note);
    };
    const auto count = [&row](std::string_view name, std::int64_t value, std::string_view note) {
        row(name, std::to_string(value), value == 0 ? "" : note);
    };
    fmt::print("{}\n", options.file.string());
    row("format", mesh.format);
    row("vertices", fmt::format("{} stored, {} used after welding", report.vertices_stored, report.vertices));
    row("triangles", std::to_string(report.triangles));
    count("collapsed triangles", report.collapsed, "corners coincide; left out below");
    count("shells", report.shells, "connected by edges");
    row("watertight", report.watertight ? "yes" : "no");
    count("boundary edges", report.boundary_edges, fmt::format("in {} loops", report.holes));
    count("non-manifold edges", report.non_manifold_edges, "with three or more triangles");
    count("flipped edges", report.flipped_edges, "whose two triangles disagree on orientation; a scene refuses them");
    if (!orientation.to_turn.empty()) {
        row("to turn round", fmt::format("triangles {}", first_of(orientation.to_turn)), "then neighbours agree");
    }
    for (const ShellInsideOut& shell : orientation.inside_out) {
        row("inside out",
            fmt::format("{} triangles connected with triangle {}, volume {:.6g}", shell.triangles.size(),
                        shell.triangles.front(), shell.volume),
            "a scene refuses it unless it is a cavity: turn all of them round");
    }
    count("bow vertices", report.bow_vertices, "whose triangles form more than one fan");
    count("degenerate triangles", report.degenerate_triangles, "height below 1e-7 of the longest edge");
    count("duplicate triangles", report.duplicate_triangles,
          "with the corners of an earlier one; in the same order, a scene takes them once");
    if (report.coplanar_overlaps > 0 || !report.coplanar_overlaps_complete) {
        row("coincident layers",
            fmt::format("{}{}", report.coplanar_overlaps_complete ? "" : "at least ", report.coplanar_overlaps),
            "pairs in one plane that meet, without a common vertex; no self-intersections");
    }
    if (report.self_intersections_complete) {
        count("self-intersections", report.self_intersections, "pairs without a common vertex");
    } else {
        row("self-intersections", fmt::format("at least {}", report.self_intersections),
            fmt::format("not all counted: too many overlap, stopped after {} pairs",
                        most_self_intersection_tests(report.triangles)));
    }
    if (report.vertices > 0) {
        const Vector3& low = report.box.min;
        const Vector3& high = report.box.max;
        row("box", fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})", low[0], low[1], low[2], high[0],
                               high[1], high[2]));
    }
    if (report.triangles > report.collapsed) {
        row("median longest edge", fmt::format("{:.6g}", report.median_longest_edge));
        row("signed volume", fmt::format("{:.6g}", report.signed_volume), report.watertight ? "" : "not closed");
    }
    row("unit", report.unit.name, report.unit.guessed ? "guessed from the box" : "stated in the file");
    for (const std::string& surface : mesh.ignored) row("not read", surface);
}

}  // namespace

int mesh(const CommonOptions& common, const MeshOptions& options) {
    const Mesh mesh = read_mesh(options.file);
    const MeshReport report = report_mesh(mesh);
    const OrientationReport orientation = orientation_of(mesh.vertices, mesh.triangles);
    if (common.json) {
        print_json(mesh, report, orientation);
        for (const std::string& surface : mesh.ignored) {
            fmt::print(stderr, "trocar: {}: {}: not read (only polygons are)\n", options.file.string(), surface);
        }
    } else {
        print_table(options, mesh, report, orientation);
    }
    if (options.mend) {
        const Triangles triangles = mended(mesh.vertices, mesh.triangles);
        write_obj(*options.mend, mesh.vertices, triangles);
        const OrientationReport left = orientation_of(mesh.vertices, triangles);
        if (left.disagreeing_edges > 0) {
            fmt::print(stderr, "trocar: {}: {} edges whose triangles disagree are left, turning does not mend them\n",
                       options.mend->string(), left.disagreeing_edges);
        }
    }
    return done;
}

}  // namespace trocar::app
