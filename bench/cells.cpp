#include "cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

#include "measure/environment.hpp"
#include "study/runner.hpp"

namespace trocar::bench {
namespace {

constexpr Index million = 1000000;
constexpr const char* long_run_scene = "i2t_drag";  // group bounded: the one that baselines take part in

class Plan {
public:
    explicit Plan(bool quick) : quick_(quick) {}

    void add(Group group, const SceneSpec& scene, double budget_factor = 1.0, std::int64_t most_steps = 0) {
        CellSpec cell;
        cell.id = fmt::format("{}: {}", name_of(group), scene.name());
        cell.group = group;
        cell.scene = scene;
        finish(cell, budget_factor, most_steps);
    }
    void add_bodies(Index count) {
        CellSpec cell;
        cell.id = fmt::format("{}: {} bodies", name_of(Group::bodies), count);
        cell.group = Group::bodies;
        cell.bodies = count;
        finish(cell, 0.4, 80);
    }
    void add_bounded(const std::string& scene, std::int64_t ticks) {
        CellSpec cell;
        cell.id = fmt::format("{}: {}, repeated", name_of(Group::bounded), scene);
        cell.group = Group::bounded;
        cell.bounded_scene = scene;
        finish(cell, 1.0, ticks);
    }
    [[nodiscard]] std::vector<CellSpec> cells() && { return std::move(cells_); }

private:
    void finish(CellSpec& cell, double budget_factor, std::int64_t most_steps) {
        cell.quick = quick_;
        cell.budget_s = budget_factor * (quick_ ? 0.4 : 1.2);
        cell.most_steps = most_steps > 0 ? most_steps : quick_ ? 160 : 240;
        cells_.push_back(cell);
    }
    bool quick_;
    std::vector<CellSpec> cells_;
};

bool takes_part(const CellSpec& spec, const Method& method, std::int64_t triangles) {
    if (method.part == Part::settings_cell && spec.group != Group::settings) return false;
    // What takes seconds per step at 10^6 triangles is shown once over size, not again in every other group.
    const bool every_size = !spec.quick && spec.group == Group::size;
    const std::int64_t most = every_size ? method.most_triangles_full : method.most_triangles_quick;
    return most == 0 || triangles <= most;
}

/// The A/A floor: the anchor and the first of ours take part twice.
void add_copies(std::vector<Method>& list) {
    std::vector<Method> copies;
    bool anchored = false;
    bool own = false;
    for (const Method& method : list) {
        const bool anchor = !anchored && (method.method == embree_anchor || method.method == fcl_anchor);
        const bool first = !own && method.own;
        if (!anchor && !first) continue;
        anchored = anchored || anchor;
        own = own || method.own;
        copies.push_back(method);
        copies.back().label += " (again)";
    }
    list.insert(list.end(), copies.begin(), copies.end());
}

std::vector<Method> methods_of(const CellSpec& spec, std::int64_t triangles, double tissue_edge,
                               std::vector<Missing>& missing) {
    std::vector<Method> all = methods(registry(), missing);
    std::vector<Method> list;
    if (spec.group == Group::bounded) {
        // Ours, and in the long run the two that ratios are taken to; a full run has every default setting that does
        // not examine every pair.
        const bool with_baselines = spec.bounded_scene == long_run_scene;
        for (Method& method : all) {
            const bool anchor = method.method == embree_anchor || method.method == fcl_anchor;
            const bool is_default = method.method.find(':') == std::string::npos;
            const bool quadratic = method.most_triangles_full > 0;
            if (is_default && !quadratic && (method.own || (with_baselines && (anchor || !spec.quick)))) {
                list.push_back(std::move(method));
            }
        }
        return list;
    }
    if (spec.group == Group::cell_size) {
        for (const std::string method : {"ohc", "spatial_tessellation", "spatial_tessellation:storage=dense"}) {
            const auto found =
                std::find_if(all.begin(), all.end(), [&method](const Method& c) { return c.method == method; });
            if (found == all.end()) continue;
            list.push_back(*found);
            for (const double factor : {0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0}) {
                const char* const separator = method.find(':') == std::string::npos ? ":" : ",";
                Method sized = *found;
                sized.method = fmt::format("{}{}cell={:.6g}", method, separator, factor * tissue_edge);
                sized.make = method_of(sized.method).make;
                sized.label = fmt::format("{}, cell = {:g} edges", method, factor);
                list.push_back(std::move(sized));
            }
        }
        return list;
    }
    if (spec.group == Group::tuning) {
        for (const Search& search : searches(tissue_edge)) {
            const auto found =
                std::find_if(all.begin(), all.end(), [&search](const Method& c) { return c.method == search.name; });
            if (found == all.end()) continue;  // reported as missing
            for (const std::string& method : search.tried) {
                Method tried = *found;
                tried.method = method;
                tried.label = method;
                tried.make = method_of(method).make;
                list.push_back(std::move(tried));
            }
        }
        return list;
    }
    for (Method& method : all) {
        if (!takes_part(spec, method, triangles)) continue;
        if (spec.group == Group::query_distance) {
            list.push_back(method);
            method.label += within_query_distance;
            method.within_query_distance = true;
        }
        list.push_back(std::move(method));
    }
    if (spec.group == Group::size || spec.group == Group::settings) add_copies(list);
    return list;
}

/// The query distance that a closed loop would use on these frames (CONTACT §2): a tenth of the smallest mean edge of
/// the moving bodies, and what a vertex goes in a step, rounded up to the tenth times a power of two.
double closed_loop_query_distance(const ContactScene& scene) {
    const Topology& topology = scene.topology();
    Frame frame;
    scene.write(0, frame);
    double edge = std::numeric_limits<double>::infinity();
    for (const BodyRange& body : topology.bodies) {
        if (body.kind == BodyKind::rigid || body.triangles.count == 0) continue;
        double sum = 0.0;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            const auto v = topology.triangles.col(t);
            for (int k = 0; k < 3; ++k) sum += (frame.position.col(v((k + 1) % 3)) - frame.position.col(v(k))).norm();
        }
        edge = std::min(edge, sum / (3.0 * body.triangles.count));
    }
    const double margin = 0.1 * edge;
    double path = 0.0;
    constexpr std::int64_t period = 64;
    for (std::int64_t step = 1; step <= period; ++step) {
        scene.write(step, frame);
        path = std::max(path, std::sqrt((frame.position - frame.previous).colwise().squaredNorm().maxCoeff()));
    }
    double query_distance = margin;
    while (query_distance < margin + path) query_distance *= 2.0;
    return query_distance;
}

double load_now() {
    std::ifstream stream("/proc/loadavg");
    double load = -1.0;
    stream >> load;
    return load;
}

}  // namespace

std::string_view name_of(Group group) {
    constexpr std::array<std::string_view, 11> names{"size",   "motion", "multi",    "query_distance",
                                                     "local",  "order",  "settings", "cell size",
                                                     "tuning", "bodies", "bounded"};
    return names.at(static_cast<std::size_t>(group));
}

std::vector<CellSpec> plan_cells(bool quick) {
    Plan plan(quick);
    const auto scene = [](Variant variant, Index n, Index m) {
        return SceneSpec{.variant = variant, .tissue_triangles = n, .instrument_triangles = m};
    };
    const std::vector<Index> all_n{2000, 20000, 200000, million};
    const std::vector<Index> all_m{500, 2000, 10000};
    constexpr std::int64_t enough_for_p99 = 1000;
    for (const Variant variant : {Variant::light, Variant::deep}) {
        for (const Index n : all_n) {
            for (const Index m : all_m) {
                // Quick: light along N and along M, deep twice.
                const bool chosen = variant == Variant::light
                                        ? m == 2000 || n == 20000
                                        : (n == 20000 && m == 2000) || (n == 200000 && m == 10000);
                if (quick && !chosen) continue;
                const bool long_run = variant == Variant::light && m == 2000;
                plan.add(Group::size, scene(variant, n, m), long_run ? 2.0 : 1.0, long_run ? enough_for_p99 : 0);
            }
        }
    }
    for (const Variant variant : {Variant::near, Variant::far, Variant::rotating, Variant::strain}) {
        for (const Index n : all_n) {
            for (const Index m : all_m) {
                if (quick && (n != 20000 || m != 2000)) continue;
                plan.add(Group::motion, scene(variant, n, m), 0.5);
            }
        }
    }
    for (const auto& [n, m] : {std::pair<Index, Index>{2000, 500}, {20000, 2000}}) {
        SceneSpec spec = scene(Variant::light, n, m);
        spec.tissues = 5;
        spec.instruments = 10;
        plan.add(Group::multi, spec);
    }
    for (const Variant variant : {Variant::light, Variant::deep, Variant::near}) {
        for (const Index n : {Index{20000}, Index{200000}}) {
            if (quick && (n != 20000 || variant == Variant::deep)) continue;
            plan.add(Group::query_distance, scene(variant, n, 2000));
        }
    }
    for (const Index n : {Index{20000}, Index{200000}, million}) {
        if (quick && n == 200000) continue;
        plan.add(Group::local, scene(Variant::local, n, 2000));
    }
    for (const Index n : {Index{20000}, Index{200000}, million}) {
        for (const VertexOrder order : {VertexOrder::generated, VertexOrder::shuffled}) {
            if (quick && n != 200000) continue;
            SceneSpec spec = scene(Variant::light, n, 2000);
            spec.order = order;
            // Reported beside the renumbered cell of that size, and therefore measured as long.
            plan.add(Group::order, spec, 2.0, enough_for_p99);
        }
    }
    for (const Index n : {Index{20000}, Index{200000}}) {
        if (quick && n != 20000) continue;
        plan.add(Group::settings, scene(Variant::light, n, 2000));
        plan.add(Group::cell_size, scene(Variant::light, n, 2000));
        plan.add(Group::tuning, scene(Variant::light, n, 2000), 0.5);
    }
    for (const Index count : {2, 4, 8, 16, 32, 64, 128, 256}) plan.add_bodies(count);
    plan.add_bounded(long_run_scene, 100000);
    for (const char* file : {"i2t_stab", "i2t_press_slide", "t2t_press"}) plan.add_bounded(file, 5000);
    return std::move(plan).cells();
}

CellRecord run_cell(const CellSpec& spec, const std::vector<std::string>& without,
                    const std::function<void(const std::string&)>& now) {
    CellRecord record;
    record.spec = spec;
    record.binary = binary_identity();
    record.environment = environment();
    for (const DetectorEntry& entry : registry().detectors()) {
        if (entry.library == "trocar") continue;
        record.environment["library of " + entry.name] =
            fmt::format("{} {}: {}", entry.library, entry.version, entry.configuration);
    }
    const auto methods_on = [&](const Topology& topology, double edge) {
        record.vertices = topology.vertex_count;
        record.triangles = topology.triangle_count();
        record.tissue_edge = edge;
        std::vector<Method> list = methods_of(spec, record.triangles, edge, record.missing);
        std::erase_if(list, [&without](const Method& method) {
            return std::find(without.begin(), without.end(), method.label) != without.end();
        });
        return list;
    };
    if (spec.group == Group::bounded) {
        // More than enough cycles: it ends with the last tick asked for.
        const Scene scene = repeated(std::filesystem::path(TROCAR_BENCH_SCENES) / (spec.bounded_scene + ".json"),
                                     10 + 3 * spec.most_steps / 1000);
        record.bounded = measure_bounded(scene, methods_on(scene.topology, 0.0), spec.most_steps, now);
        record.load_after = load_now();
        return record;
    }
    const auto measure_on = [&](const auto& scene, double edge) {
        const std::vector<Method> list = methods_on(scene.topology(), edge);
        const FrameMaker frames{&scene.topology(),
                                [&scene](std::int64_t step, Frame& frame) { scene.write(step, frame); }};
        record.measurement = measure(frames, list,
                                     {.budget_s = spec.budget_s,
                                      .most_steps = spec.most_steps,
                                      .query_distance = record.query_distance,
                                      .seed = spec.scene.seed,
                                      .now = now});
    };
    if (spec.group == Group::bodies) {
        constexpr Index triangles_per_body = 320;
        measure_on(ManyBodies(spec.bodies, triangles_per_body, spec.scene.seed), 0.0);
    } else {
        const ContactScene scene(spec.scene);
        if (spec.group == Group::query_distance) record.query_distance = closed_loop_query_distance(scene);
        measure_on(scene, scene.tissue_edge());
    }
    record.load_after = load_now();
    return record;
}

}  // namespace trocar::bench
