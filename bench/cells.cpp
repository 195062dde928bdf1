#include "cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

#include "broad_phases.hpp"
#include "measure/environment.hpp"
#include "micro.hpp"
#include "study/runner.hpp"

namespace trocar::bench {
namespace {

constexpr Index million = 1000000;
constexpr const char* long_run_scene = "i2t_drag";  // group bounded: the one that rivals take part in

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
    void add_micro() {
        CellSpec cell;
        cell.id = fmt::format("{}", name_of(Group::micro));
        cell.group = Group::micro;
        finish(cell, 1.0, 0);
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

bool takes_part(const CellSpec& spec, const Contestant& contestant, std::int64_t triangles) {
    if (contestant.part == Part::settings_cell && spec.group != Group::settings) return false;
    // What takes seconds per step at 10^6 triangles is shown once over size, not again in every other group.
    const bool every_size = !spec.quick && spec.group == Group::size;
    const std::int64_t most = every_size ? contestant.most_triangles_full : contestant.most_triangles_quick;
    return most == 0 || triangles <= most;
}

/// The A/A floor: the anchor and the first of ours take part twice.
void add_copies(std::vector<Contestant>& list) {
    std::vector<Contestant> copies;
    bool anchored = false;
    bool own = false;
    for (const Contestant& contestant : list) {
        const bool anchor = !anchored && (contestant.method == embree_anchor || contestant.method == fcl_anchor);
        const bool first = !own && contestant.own;
        if (!anchor && !first) continue;
        anchored = anchored || anchor;
        own = own || contestant.own;
        copies.push_back(contestant);
        copies.back().label += " (again)";
    }
    list.insert(list.end(), copies.begin(), copies.end());
}

std::vector<Contestant> contestants_of(const CellSpec& spec, std::int64_t triangles, double tissue_edge,
                                       std::vector<Missing>& missing) {
    std::vector<Contestant> all = contestants(registry(), missing);
    std::vector<Contestant> list;
    if (spec.group == Group::bounded) {
        // Ours, and in the long run the two that ratios are taken to; a full run has every default setting that does
        // not look at every pair.
        const bool with_rivals = spec.bounded_scene == long_run_scene;
        for (Contestant& contestant : all) {
            const bool anchor = contestant.method == embree_anchor || contestant.method == fcl_anchor;
            const bool is_default = contestant.method.find(':') == std::string::npos;
            const bool quadratic = contestant.most_triangles_full > 0;
            if (is_default && !quadratic && (contestant.own || (with_rivals && (anchor || !spec.quick)))) {
                list.push_back(std::move(contestant));
            }
        }
        return list;
    }
    if (spec.group == Group::cell_size) {
        for (const std::string method : {"ohc", "spatial_tessellation", "spatial_tessellation:storage=dense"}) {
            const auto found =
                std::find_if(all.begin(), all.end(), [&method](const Contestant& c) { return c.method == method; });
            if (found == all.end()) continue;
            list.push_back(*found);
            for (const double factor : {0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0}) {
                const char* const separator = method.find(':') == std::string::npos ? ":" : ",";
                Contestant sized = *found;
                sized.method = fmt::format("{}{}cell={:.6g}", method, separator, factor * tissue_edge);
                sized.make = contestant_of(sized.method).make;
                sized.label = fmt::format("{}, cell = {:g} edges", method, factor);
                list.push_back(std::move(sized));
            }
        }
        return list;
    }
    if (spec.group == Group::tuning) {
        for (const Search& search : searches(tissue_edge)) {
            const auto found = std::find_if(all.begin(), all.end(),
                                            [&search](const Contestant& c) { return c.method == search.name; });
            if (found == all.end()) continue;  // told as missing
            for (const std::string& method : search.tried) {
                Contestant tried = *found;
                tried.method = method;
                tried.label = method;
                tried.make = contestant_of(method).make;
                list.push_back(std::move(tried));
            }
        }
        return list;
    }
    for (Contestant& contestant : all) {
        if (!takes_part(spec, contestant, triangles)) continue;
        if (spec.group == Group::reach) {
            list.push_back(contestant);
            contestant.label += within_reach;
            contestant.within_reach = true;
        }
        list.push_back(std::move(contestant));
    }
    if (spec.group == Group::bodies) {
        for (Contestant& contestant : broad_phases(missing)) list.push_back(std::move(contestant));
    }
    if (spec.group == Group::size || spec.group == Group::settings) add_copies(list);
    return list;
}

/// The reach that a closed loop would tell on these frames (CONTACT §2): a tenth of the smallest mean
/// edge of the moving bodies, and what a vertex goes in a step, rounded up to the tenth times a power of two.
double closed_loop_reach(const ContactScene& scene) {
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
    double way = 0.0;
    constexpr std::int64_t period = 64;
    for (std::int64_t step = 1; step <= period; ++step) {
        scene.write(step, frame);
        way = std::max(way, std::sqrt((frame.position - frame.previous).colwise().squaredNorm().maxCoeff()));
    }
    double reach = margin;
    while (reach < margin + way) reach *= 2.0;
    return reach;
}

double load_now() {
    std::ifstream stream("/proc/loadavg");
    double load = -1.0;
    stream >> load;
    return load;
}

}  // namespace

std::string_view name_of(Group group) {
    constexpr std::array<std::string_view, 12> names{"size",     "motion",    "multi",  "reach",  "local",   "order",
                                                     "settings", "cell size", "tuning", "bodies", "bounded", "micro"};
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
            plan.add(Group::reach, scene(variant, n, 2000));
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
            // Told beside the renumbered cell of that size, and therefore measured as long.
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
    plan.add_micro();
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
    if (spec.group == Group::micro) {
        record.micro = run_micro(spec.quick, record.missing);
        record.load_after = load_now();
        return record;
    }
    const auto contestants_on = [&](const Topology& topology, double edge) {
        record.vertices = topology.vertex_count;
        record.triangles = topology.triangle_count();
        record.tissue_edge = edge;
        std::vector<Contestant> list = contestants_of(spec, record.triangles, edge, record.missing);
        std::erase_if(list, [&without](const Contestant& contestant) {
            return std::find(without.begin(), without.end(), contestant.label) != without.end();
        });
        return list;
    };
    if (spec.group == Group::bounded) {
        // More than enough cycles: it ends with the last tick asked for.
        const Scene scene = repeated(std::filesystem::path(TROCAR_BENCH_SCENES) / (spec.bounded_scene + ".json"),
                                     10 + 3 * spec.most_steps / 1000);
        record.bounded = measure_bounded(scene, contestants_on(scene.topology, 0.0), spec.most_steps, now);
        record.load_after = load_now();
        return record;
    }
    const auto measure_on = [&](const auto& scene, double edge) {
        const std::vector<Contestant> list = contestants_on(scene.topology(), edge);
        const FrameMaker frames{&scene.topology(),
                                [&scene](std::int64_t step, Frame& frame) { scene.write(step, frame); }};
        record.measurement = measure(frames, list,
                                     {.budget_s = spec.budget_s,
                                      .most_steps = spec.most_steps,
                                      .reach = record.reach,
                                      .seed = spec.scene.seed,
                                      .now = now});
    };
    if (spec.group == Group::bodies) {
        constexpr Index triangles_per_body = 320;
        measure_on(ManyBodies(spec.bodies, triangles_per_body, spec.scene.seed), 0.0);
    } else {
        const ContactScene scene(spec.scene);
        if (spec.group == Group::reach) record.reach = closed_loop_reach(scene);
        measure_on(scene, scene.tissue_edge());
    }
    record.load_after = load_now();
    return record;
}

}  // namespace trocar::bench
