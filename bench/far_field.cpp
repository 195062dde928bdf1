#include "far_field.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "geometry/input_error.hpp"
#include "measure/statistics.hpp"
#include "method/registry.hpp"
#include "report/chart.hpp"
#include "report/document.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"

namespace trocar::bench {
namespace {

constexpr double edge_of_20k = 0.00215;  // m, as scenes/press_20k.json
constexpr double in_mm = 1e3;
constexpr double in_um = 1e6;
constexpr double in_percent = 1e2;

/// Where the tool goes in, m.
const Vector3 entry_point(0.0013, 0.0007, 0.0);

Scene scene_of(std::int64_t triangles) {
    const double edge = edge_of_20k * std::sqrt(20000.0 / static_cast<double>(triangles));
    const std::string text = fmt::format(
        R"({{"format": "trocar-scene-2", "name": "far_field", "unit": "m", "dt": 0.001, "ticks": 3000, "seed": 1,
 "bodies": [
  {{"name": "sheet", "kind": "tissue", "closed": false, "side": "front",
   "parts": [{{"shape": "sheet", "size": [0.2, 0.2], "edge": {}}}],
   "tissue": {{"youngs_modulus": 38000, "thickness": 0.003, "density": 1060, "preload": 0.2, "damping": 0.001,
              "drag": 20, "pinned": "rim"}}}},
  {{"name": "tool", "kind": "instrument", "closed": true,
   "parts": [{{"shape": "shaft", "radius": 0.004, "length": 0.12, "edge": 0.0028}}],
   "motion": {{"drive": "prescribed", "keys": [
     {{"time": 0.0, "pose": [{x}, {y}, 0.0002, 0, 0, 0]}}, {{"time": 0.4, "pose": [{x}, {y}, -0.003, 0, 0, 0]}},
     {{"time": 1.0, "pose": [{x}, {y}, -0.003, 0, 0, 0]}}, {{"time": 1.8, "pose": [{end}, {y}, -0.003, 0, 0, 0]}},
     {{"time": 2.1, "pose": [{end}, {y}, -0.003, 0, 0, 0]}}, {{"time": 2.4, "pose": [{end}, {y}, 0.004, 0, 0, 0]}}]}}}}],
 "contact": [{{"bodies": ["tool", "sheet"], "k": 100, "mu": 2}}]}})",
        edge, fmt::arg("x", entry_point.x()), fmt::arg("y", entry_point.y()), fmt::arg("end", entry_point.x() + 0.008));
    // The scene reader reads files.
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / fmt::format("trocar_far_field_{}.json", ::getpid());
    std::ofstream(file) << text;
    Scene scene = read_scene(file, std::nullopt);
    std::filesystem::remove(file);
    return scene;
}

std::unique_ptr<Simulation> simulation_of(const Scene& scene, const std::string& stepper) {
    SimulationSettings settings{.stepper = parse_method(stepper)};
    settings.watched = false;  // the audit examines every vertex
    return std::make_unique<Simulation>(
        scene, make_detector("ohc_clustered", {}), make_response("unilateral", {}),
        registry().contact_generator(default_contact_generator(parse_method("unilateral"))), settings);
}

std::size_t band_of(double distance) {
    std::size_t band = 0;
    while (band + 1 < band_starts.size() && distance >= band_starts[band + 1]) ++band;
    return band;
}

std::string band_name(std::size_t band) {
    return band + 1 < band_starts.size()
               ? fmt::format("{:g} to {:g} mm", in_mm * band_starts[band], in_mm * band_starts[band + 1])
               : fmt::format("from {:g} mm on", in_mm * band_starts[band]);
}

double median_of(const FarFieldRun& run, double FarFieldTick::*figure) {
    std::vector<double> values;
    for (const FarFieldTick& tick : run.ticks) values.push_back(tick.*figure);
    return median(values);
}

double largest_of(const FarFieldRun& run, double FarFieldTick::*figure) {
    double largest = 0.0;
    for (const FarFieldTick& tick : run.ticks) largest = std::max(largest, tick.*figure);
    return largest;
}

double error_rms(std::span<const FarFieldTick> ticks) {
    double sum = 0.0;
    for (const FarFieldTick& tick : ticks) sum += tick.force_error * tick.force_error;
    return std::sqrt(sum / static_cast<double>(ticks.size()));
}

/// At rest under the tool: the last tenth of a second before it is drawn along, or of a shorter run. Not one tick of
/// it: a tip that presses with all that a contact may give rocks between the faces that it is caught by.
std::span<const FarFieldTick> at_rest(const FarFieldRun& run) {
    constexpr double drawn_from = 1.0;  // s
    constexpr double watched = 0.1;     // s
    const auto at = [&run](double time) {
        return std::find_if(run.ticks.begin(), run.ticks.end(),
                            [time](const FarFieldTick& tick) { return tick.time >= time; });
    };
    const double end = std::min(drawn_from, run.ticks.back().time);
    const auto first = at(end - watched);
    return {first, std::max(first + 1, at(end))};
}

double mean_force(std::span<const FarFieldTick> ticks) {
    double sum = 0.0;
    for (const FarFieldTick& tick : ticks) sum += tick.force;
    return sum / static_cast<double>(ticks.size());
}

Table table_of(const std::vector<FarFieldRun>& runs) {
    Table table;
    table.caption = "A stepper held against one that moves the whole tissue, the same scene in step";
    table.columns = {{"triangles", true},
                     {"stepper"},
                     {"against"},
                     {"force error, RMS (% of the largest force)", true},
                     {"at rest, RMS of 0.1 s (% of the force there)", true},
                     {"largest (%)", true}};
    for (std::size_t band = 0; band < band_starts.size(); ++band) {
        table.columns.push_back({"error of places, " + band_name(band) + " (% of the largest distance there)", true});
    }
    table.columns.push_back({"advance p50 (µs)", true});
    table.columns.push_back({"whole tissue (µs)", true});
    table.columns.push_back({"ended"});
    for (const FarFieldRun& run : runs) {
        if (run.ticks.empty()) continue;
        const double peak = largest_of(run, &FarFieldTick::force);
        const std::span<const FarFieldTick> rest = at_rest(run);
        TableRow row{{fmt::format("{}", run.triangles), "`" + run.stepper + "`", "`" + run.whole + "`",
                      format_number(in_percent * error_rms(run.ticks) / peak),
                      format_number(in_percent * error_rms(rest) / mean_force(rest)),
                      format_number(in_percent * largest_of(run, &FarFieldTick::force_error) / peak)}};
        for (std::size_t band = 0; band < band_starts.size(); ++band) {
            double error = 0.0;
            double path = 0.0;
            for (const FarFieldTick& tick : run.ticks) {
                error = std::max(error, tick.position_error[band]);
                path = std::max(path, tick.path[band]);
            }
            row.cells.push_back(format_number(in_percent * error / path));
        }
        row.cells.push_back(format_number(median_of(run, &FarFieldTick::other_advance_us)));
        row.cells.push_back(format_number(median_of(run, &FarFieldTick::advance_us)));
        row.cells.push_back(run.outcome);
        if (run.outcome != "ok") row.style = TableRow::Style::failed;
        table.rows.push_back(std::move(row));
    }
    table.note =
        "One thread. Error of places: largest distance of a vertex from where it is when the whole tissue moves, over "
        "all ticks; bands by the distance at rest from where the tool goes in.";
    return table;
}

template <typename Value>
std::vector<std::pair<double, double>> over_time(const FarFieldRun& run, const Value& value) {
    std::vector<std::pair<double, double>> points;
    constexpr std::size_t points_in_a_chart = 600;
    const std::size_t stride = std::max<std::size_t>(1, run.ticks.size() / points_in_a_chart);
    for (std::size_t tick = 0; tick < run.ticks.size(); tick += stride) {
        points.emplace_back(run.ticks[tick].time, value(run.ticks[tick]));
    }
    return points;
}

std::string short_name(const FarFieldRun& run) {
    return fmt::format("{}_{}", run.triangles, parse_method(run.stepper).name);
}

std::vector<Figure> figures_of(const FarFieldRun& run) {
    const double peak = largest_of(run, &FarFieldTick::force);
    LineChart force{.x_title = "time (s)", .y_title = "force at the tool (N)", .lines = {}};
    force.lines.push_back({.name = run.whole, .colour = 0, .points = over_time(run, [](const FarFieldTick& tick) {
                                                               return tick.force;
                                                           })});
    force.lines.push_back(
        {.name = run.stepper, .colour = 1, .dash = 1, .points = over_time(run, [](const FarFieldTick& tick) {
                                                          return tick.other_force;
                                                      })});
    LineChart error{.x_title = "time (s)", .y_title = "force error (% of the largest force)", .lines = {}};
    error.lines.push_back({.name = run.stepper, .colour = 1, .points = over_time(run, [peak](const FarFieldTick& tick) {
                                                                 return in_percent * tick.force_error / peak;
                                                             })});
    LineChart places{.x_title = "time (s)", .y_title = "error of places (µm)", .lines = {}};
    LineChart paths{.x_title = "time (s)", .y_title = "furthest distance from rest (µm)", .lines = {}};
    for (std::size_t band = 0; band < band_starts.size(); ++band) {
        places.lines.push_back(
            {.name = band_name(band),
             .colour = static_cast<int>(band),
             .dash = static_cast<int>(band),
             .points = over_time(run, [band](const FarFieldTick& tick) { return in_um * tick.position_error[band]; })});
        paths.lines.push_back(
            {.name = band_name(band),
             .colour = static_cast<int>(band),
             .dash = static_cast<int>(band),
             .points = over_time(run, [band](const FarFieldTick& tick) { return in_um * tick.path[band]; })});
    }
    const std::string name = short_name(run);
    return {{"charts/" + name + "_force.svg", draw(force), "Force at the tool."},
            {"charts/" + name + "_force_error.svg", draw(error), "How far the force is from that of the whole tissue."},
            {"charts/" + name + "_places.svg", draw(places),
             "Largest error of a vertex's place, by distance from where the tool goes in."},
            {"charts/" + name + "_distances.svg", draw(paths),
             "What there is to follow: furthest distance of a vertex from rest when the whole tissue moves. A "
             "membrane sinks with the logarithm of the distance, so that it is far from still where the tool is not."}};
}

std::string csv_of(const std::vector<FarFieldRun>& runs) {
    std::string text = "triangles,stepper,whole,time_s,force_n,other_force_n,force_error_n";
    for (std::size_t band = 0; band < band_starts.size(); ++band) {
        text += fmt::format(",distance_{0:g}mm_m,error_{0:g}mm_m", in_mm * band_starts[band]);
    }
    text += ",advance_us,other_advance_us\n";
    constexpr std::size_t stride = 4;
    for (const FarFieldRun& run : runs) {
        for (std::size_t n = 0; n < run.ticks.size(); n += stride) {
            const FarFieldTick& tick = run.ticks[n];
            text += fmt::format("{},{},{},{:.4g},{:.6g},{:.6g},{:.4g}", run.triangles, csv_field(run.stepper),
                                csv_field(run.whole), tick.time, tick.force, tick.other_force, tick.force_error);
            for (std::size_t band = 0; band < band_starts.size(); ++band) {
                text += fmt::format(",{:.4g},{:.4g}", tick.path[band], tick.position_error[band]);
            }
            text += fmt::format(",{:.4g},{:.4g}\n", tick.advance_us, tick.other_advance_us);
        }
    }
    return text;
}

}  // namespace

FarFieldRun run_far_field(std::int64_t triangles, const std::string& stepper, const std::string& whole,
                          std::int64_t ticks) {
    const Scene scene = scene_of(triangles);
    const BodyRange& body = *std::find_if(scene.topology.bodies.begin(), scene.topology.bodies.end(),
                                          [](const BodyRange& one) { return one.kind == BodyKind::tissue; });
    const std::unique_ptr<Simulation> all = simulation_of(scene, whole);
    const std::unique_ptr<Simulation> other = simulation_of(scene, stepper);
    FarFieldRun run{
        .triangles = body.triangles.count, .stepper = stepper, .whole = whole, .outcome = "ok", .ticks = {}};
    const Matrix3X& rest = scene.first.position;
    const Range sheet = body.vertices;
    std::vector<std::size_t> band(static_cast<std::size_t>(sheet.count));
    for (Index v = 0; v < sheet.count; ++v) {
        band[static_cast<std::size_t>(v)] = band_of((rest.col(sheet.first + v) - entry_point).norm());
    }
    run.ticks.reserve(static_cast<std::size_t>(ticks));
    const auto advance_us = [](const StepRow& row) {
        return 1e-3 * static_cast<double>(row.stage_ns[static_cast<std::size_t>(Stage::advance)]);
    };
    for (std::int64_t number = 0; number < ticks; ++number) {
        const StepRow row = all->step();
        const StepRow other_row = other->step();
        for (const Simulation* simulation : {all.get(), other.get()}) {
            if (!simulation->outcome().ok() && run.outcome == "ok") {
                run.outcome = fmt::format("{}: {}", name_of(simulation->outcome().kind), simulation->outcome().message);
            }
        }
        if (run.outcome != "ok") break;
        FarFieldTick tick{.time = row.time,
                          .force = row.tool_force.norm(),
                          .other_force = other_row.tool_force.norm(),
                          .force_error = (row.tool_force - other_row.tool_force).norm(),
                          .advance_us = advance_us(row),
                          .other_advance_us = advance_us(other_row)};
        for (Index v = sheet.first; v < sheet.first + sheet.count; ++v) {
            const std::size_t place = band[static_cast<std::size_t>(v - sheet.first)];
            const auto now = all->frame().position.col(v);
            tick.path[place] = std::max(tick.path[place], (now - rest.col(v)).norm());
            tick.position_error[place] =
                std::max(tick.position_error[place], (now - other->frame().position.col(v)).norm());
        }
        run.ticks.push_back(tick);
    }
    return run;
}

std::map<std::string, std::string> far_field_report(const std::vector<FarFieldRun>& runs,
                                                    const std::map<std::string, std::string>& environment) {
    Document document;
    document.title = "trocar far_field: what is not moved at every tick";
    document.blocks.emplace_back(Paragraph{
        "A pinned sheet of 200 mm with the tissue of `press_20k`; a blunt shaft goes 3 mm deep, rests, is drawn 8 mm "
        "along and rises. Response `unilateral`, detector `ohc_clustered`. Both steppers run in step, each with its "
        "own contacts."});
    document.blocks.emplace_back(table_of(runs));
    std::map<std::string, std::string> files;
    for (const FarFieldRun& run : runs) {
        if (run.ticks.empty()) continue;
        document.blocks.emplace_back(Heading{2, fmt::format("{} triangles, {}", run.triangles, run.stepper)});
        for (Figure& figure : figures_of(run)) {
            files[figure.file] = figure.svg;
            document.blocks.emplace_back(std::move(figure));
        }
    }
    document.blocks.emplace_back(Heading{2, "Where these numbers come from"});
    Table origin;
    origin.columns = {{"what"}, {"value"}};
    for (const auto& [key, value] : environment) origin.rows.push_back({{key, value}});
    origin.folded = true;
    document.blocks.emplace_back(std::move(origin));
    document.blocks.emplace_back(CodeBlock{"./run.sh bench far_field"});
    files["report.md"] = to_markdown(document);
    files["report.html"] = to_html(document);
    files["far_field.csv"] = csv_of(runs);
    return files;
}

}  // namespace trocar::bench
