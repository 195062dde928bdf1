// Table 3.1 of the thesis answered with numbers of detectors that take turns on generated scenes.
#include <fmt/format.h>

#include <functional>
#include <map>

#include "geometry/number_text.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

constexpr const char* main_scene = "light 20k x 2k";

/// Families of the thesis' columns, by detector. One that is in none has no column.
const std::map<std::string, std::string>& thesis_families() {
    static const std::map<std::string, std::string> names{{"embree_collide", "hierarchy"},
                                                          {"fcl_bvh", "hierarchy"},
                                                          {"bullet_dbvt", "hierarchy"},
                                                          {"bullet_gimpact", "hierarchy"},
                                                          {"ode_trimesh", "hierarchy"},
                                                          {"cgal_boxes", "sorted boxes"},
                                                          {"ccd_pairs", "sorted boxes"},
                                                          {"spatial_tessellation", "tessellation"},
                                                          {"ohc", "OHC"},
                                                          {"ohc_clustered", "OHC"}};
    return names;
}

/// DetectorValues of one detector, NaN where it did not run or failed.
class DetectorValues {
public:
    DetectorValues(const Draft& draft, const Method& method) : draft_(draft), method_(method) {}
    [[nodiscard]] double of(const std::string& scene, Metric metric) const {
        const SceneResult* result = draft_.results.find(method_, scene);
        return result != nullptr && result->ok() ? result->of(metric).value : not_known;
    }
    [[nodiscard]] double time(const std::string& scene) const { return of(scene, Metric::total_median_ns); }
    [[nodiscard]] double main(Metric metric) const { return of(main_scene, metric); }
    /// Cost of a body among 128 over that among 8; NaN where nothing is counted.
    [[nodiscard]] double growth_per_body(Metric metric) const {
        const double few = of("8 balls", metric) / 8.0;
        return few > 0.0 ? of("128 balls", metric) / 128.0 / few : not_known;
    }

private:
    const Draft& draft_;
    const Method& method_;
};

struct ThesisRow {
    const char* name;   ///< as the thesis prints it; empty: a second measure of the row above
    const char* claim;  ///< hierarchy / tessellation / OHC
    const char* measured;
    std::function<double(const DetectorValues&)> value;
};

std::vector<ThesisRow> thesis_rows(double triangles) {
    return {{"Broad phase, object level", "pairwise / non-pairwise / non-pairwise",
             "time per body at 128 bodies ÷ at 8 (1: non-pairwise)",
             [](const DetectorValues& v) { return v.growth_per_body(Metric::total_median_ns); }},
            {"", "", "counted work per body at 128 bodies ÷ at 8",
             [](const DetectorValues& v) { return v.growth_per_body(Metric::work_median); }},
            {"Broad phase, sub-object level", "pairwise / pairwise / non-pairwise", "work per true pair, where counted",
             [](const DetectorValues& v) {
                 const double work = v.main(Metric::work_median);
                 return work > 1.0 ? work / v.main(Metric::pairs_median) : not_known;
             }},
            {"Hierarchy complexity", "multi-level / 1 level / 3 level", "share of the tick spent on keeping it (%)",
             [](const DetectorValues& v) {
                 return 100.0 * v.main(Metric::update_median_ns) / v.main(Metric::total_median_ns);
             }},
            {"", "", "first build (ms)", [](const DetectorValues& v) { return 1e-6 * v.main(Metric::prepare_ns); }},
            {"Data storage and access", "efficient or not / inefficient / efficient", "memory (bytes per triangle)",
             [triangles](const DetectorValues& v) { return v.main(Metric::memory_bytes) / triangles; }},
            {"Topological complexity", "dependent / independent / independent",
             "shuffled numbering ÷ renumbered, 200k (1: no matter)",
             [](const DetectorValues& v) { return v.time("light 200k x 2k shuffled") / v.time("light 200k x 2k"); }},
            {"", "", "tissue stretched by 20 % ÷ light",
             [](const DetectorValues& v) { return v.time("strain 20k x 2k") / v.time(main_scene); }},
            {"Large number of moving objects", "no / yes / yes", "time per body at 128 bodies (µs)",
             [](const DetectorValues& v) { return us * v.time("128 balls") / 128.0; }},
            {"Large scale environment", "yes / no / yes", "10⁶ triangles ÷ 20k (50: linear)",
             [](const DetectorValues& v) { return v.time("light 1M x 2k") / v.time(main_scene); }},
            {"", "", "far away ÷ light (cost without contact)",
             [](const DetectorValues& v) { return v.time("far 20k x 2k") / v.time(main_scene); }}};
}

}  // namespace

void add_table_3_1(Draft& draft) {
    std::vector<Method> columns;
    double triangles = not_known;
    for (const char* family : {"hierarchy", "sorted boxes", "tessellation", "OHC"}) {
        for (const Method& method : draft.results.methods("replay")) {
            const auto found = thesis_families().find(method.detector);
            const SceneResult* result = draft.results.find(method, main_scene);
            if (found == thesis_families().end() || found->second != family || !method.contacts.empty()) continue;
            if (result == nullptr || !result->ok() || result->first(Metric::differing_ticks) != 0.0) continue;
            columns.push_back(method);
            triangles = number_of_text<double>(fact_of(result->record(), "scene.triangles")).value_or(not_known);
        }
    }
    if (columns.empty()) return;
    draft.heading(2, "Table 3.1 of the thesis, answered with numbers");
    Table table;
    table.caption = "The thesis' rows, its words, and the measured values";
    table.columns = {
        {"row of the thesis", false}, {"hierarchy / tessellation / OHC, as claimed", false}, {"measured here", false}};
    for (const Method& method : columns) {
        table.columns.push_back({thesis_families().at(method.detector) + ": " + code(method.detector), true});
    }
    for (const ThesisRow& row : thesis_rows(triangles)) {
        TableRow line{.cells = {row.name, row.claim, row.measured}};
        for (const Method& method : columns) line.cells.push_back(scaled(row.value(DetectorValues(draft, method))));
        table.rows.push_back(std::move(line));
    }
    table.note = "Columns in the order hierarchy, sorted boxes, tessellation, OHC; only detectors that are exact on " +
                 code(main_scene) + ". An adapter counts what it can see of a library's work.";
    draft.add(std::move(table));
}

}  // namespace trocar
