#include "methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

namespace trocar::bench {
namespace {

constexpr const char* exact_test = "trocar's exact test";
constexpr std::int64_t few = 40000;      ///< triangles, for methods that examine every pair
constexpr std::int64_t medium = 300000;  ///< for trees whose refit costs a second at 10^6

/// One setting of one detector.
struct Setting {
    const char* method;
    const char* family;
    const char* narrow;
    Part part = Part::everywhere;
    std::int64_t most_quick = 0;
    std::int64_t most_full = 0;
};

const std::vector<Setting>& settings() {
    static const std::vector<Setting> table{
        {"ohc", "ohc", exact_test},
        {"ohc_clustered", "ohc", exact_test},
        {"ohc_clustered:simd=scalar", "ohc", exact_test, Part::settings_cell},
        {"ohc_clustered:order=given", "ohc", exact_test, Part::settings_cell},
        {"ohc:test=interval", "ohc", "interval test, double", Part::settings_cell},
        {"ohc:test=moller", "ohc", "Möller's test, float", Part::settings_cell},
        {"ohc:hash=teschner", "ohc", exact_test, Part::settings_cell},
        {"brute_force", "none", exact_test, Part::everywhere, few, few},
        {"embree_collide", "tree", exact_test},
        {"embree_collide:leaf=cluster", "tree", exact_test},
        {"embree_collide:update=rebuild", "tree", exact_test, Part::settings_cell},
        {"fcl_bvh", "tree", "its own"},
        {"fcl_bvh:bv=OBB", "tree", "its own", Part::everywhere, medium, 0},
        {"fcl_bvh:bv=kIOS", "tree", "its own", Part::everywhere, medium, 0},
        {"fcl_bvh:bv=OBBRSS", "tree", "its own", Part::everywhere, medium, 0},
        {"fcl_bvh:update=rebuild", "tree", "its own", Part::settings_cell},
        {"fcl_continuous", "tree", "its own", Part::settings_cell},
        {"bullet_dbvt", "tree", exact_test},
        {"bullet_gimpact", "tree", exact_test},
        {"ode_trimesh", "tree", "its own"},
        {"ode_trimesh:merge=none", "tree", "its own", Part::everywhere, medium, 0},
        {"cgal_boxes", "boxes", exact_test},
        {"spatial_tessellation", "cells", exact_test},
        {"spatial_tessellation:storage=dense", "cells", exact_test},
        {"ccd_pairs", "boxes", "libccd GJK", Part::everywhere, medium, medium},
    };
    return table;
}

bool declares(const DetectorEntry& entry, const std::map<std::string, std::string>& parameters) {
    return std::all_of(parameters.begin(), parameters.end(), [&entry](const auto& given) {
        return std::any_of(entry.parameters.begin(), entry.parameters.end(),
                           [&given](const Parameter& declared) { return declared.name == given.first; });
    });
}

Method make_method(const DetectorEntry& entry, const MethodSpec& spec) {
    Method method;
    method.method = spec.text();
    method.label = method.method;
    method.library = entry.version.empty() ? entry.library : entry.library + " " + entry.version;
    method.own = entry.own;
    method.claims_exact = entry.claims_exact;
    method.query_distance = entry.query_distance;
    method.narrow = "its own";
    method.make = [spec] { return make_detector(spec.name, spec.parameters); };
    return method;
}

}  // namespace

std::vector<Method> methods(const Registry& registry, std::vector<Missing>& missing) {
    std::vector<Method> list;
    for (const AbsentMethod& absent : registry.absent_detectors()) missing.push_back({absent.name, absent.reason});
    std::set<std::string> named;
    for (const Setting& setting : settings()) {
        const MethodSpec spec = parse_method(setting.method);
        const auto entry =
            std::find_if(registry.detectors().begin(), registry.detectors().end(),
                         [&spec](const DetectorEntry& candidate) { return candidate.name == spec.name; });
        if (entry == registry.detectors().end()) continue;  // absent methods are reported by the registry
        if (!declares(*entry, spec.parameters)) {
            missing.push_back({setting.method, "this build's detector has no such setting"});
            continue;
        }
        if (spec.parameters.empty()) named.insert(spec.name);
        Method method = make_method(*entry, spec);
        method.family = setting.family;
        method.narrow = setting.narrow;
        method.part = setting.part;
        method.most_triangles_quick = setting.most_quick;
        method.most_triangles_full = setting.most_full;
        // Inexact triangle tests are shown for their cost; what they promise is theirs, not the default's.
        if (method.narrow != exact_test && method.own) method.claims_exact = false;
        list.push_back(std::move(method));
    }
    for (const DetectorEntry& entry : registry.detectors()) {
        if (entry.control || named.contains(entry.name)) continue;
        Method method = make_method(entry, {.name = entry.name});
        method.family = entry.own ? "ohc" : "none";
        list.push_back(std::move(method));
    }
    std::stable_partition(list.begin(), list.end(), [](const Method& method) { return method.own; });
    return list;
}

std::vector<Search> searches(double edge) {
    const auto with_cells = [edge](const std::string& method, const std::vector<double>& factors) {
        std::vector<std::string> tried;
        tried.reserve(factors.size());
        const char* const separator = method.find(':') == std::string::npos ? ":" : ",";
        for (const double factor : factors) {
            tried.push_back(fmt::format("{}{}cell={:.6g}", method, separator, factor * edge));
        }
        return tried;
    };
    std::vector<Search> all{
        {"ohc", "ohc", with_cells("ohc", {0.71, 1.0, 1.41, 2.0, 2.83})},
        {"ohc_clustered", "ohc_clustered", {"ohc_clustered:order=given", "ohc_clustered:order=local"}},
        {"embree_collide", "embree_collide:update=rebuild,quality=medium", {"embree_collide:update=rebuild"}},
        {"fcl_bvh", "fcl_bvh:bv=OBBRSS", {"fcl_bvh:update=rebuild", "fcl_bvh:bv=OBB,update=rebuild"}},
        {"bullet_dbvt", "bullet_dbvt:update=reinsert", {}},
        {"bullet_gimpact", "bullet_gimpact", {"bullet_gimpact:update=rebuild"}},
        {"ode_trimesh",
         "ode_trimesh:scale=1",
         {"ode_trimesh:update=rebuild", "ode_trimesh:merge=none", "ode_trimesh:merge=none,update=rebuild"}},
        {"cgal_boxes", "cgal_boxes", {}},
        {"spatial_tessellation", "spatial_tessellation", {}},
        {"ccd_pairs", "ccd_pairs:tolerance=0.0001", {"ccd_pairs:algorithm=mpr"}},
    };
    for (Search& search : all) {
        std::vector<std::string>& tried = search.tried;
        if (search.name == "embree_collide") {
            for (const int size : {4, 8, 16, 32, 64}) {
                tried.push_back(fmt::format("embree_collide:leaf=cluster,cluster_size={}", size));
            }
            for (const char* quality : {"low", "medium"}) {
                tried.push_back(
                    fmt::format("embree_collide:leaf=cluster,cluster_size=8,update=rebuild,quality={}", quality));
            }
        }
        if (search.name == "fcl_bvh") {
            for (const char* volume : {"OBB", "RSS", "kIOS", "KDOP16", "KDOP18", "KDOP24"}) {
                tried.push_back(fmt::format("fcl_bvh:bv={}", volume));
            }
            for (const char* volume : {"AABB", "OBB", "kIOS"}) {
                for (const int period : {4, 16}) {
                    tried.push_back(fmt::format("fcl_bvh:bv={},rebuild_period={}", volume, period));
                }
            }
        }
        if (search.name == "cgal_boxes") {
            for (const int cutoff : {3, 30, 100, 300, 1000})
                tried.push_back(fmt::format("cgal_boxes:cutoff={}", cutoff));
        }
        if (search.name == "spatial_tessellation") {
            for (const char* storage : {"hashed", "dense"}) {
                const auto more =
                    with_cells(fmt::format("spatial_tessellation:storage={}", storage), {1.5, 2.0, 2.5, 3.0, 4.0, 6.0});
                tried.insert(tried.end(), more.begin(), more.end());
            }
        }
        tried.insert(tried.begin(), search.name);
        if (search.library_default != search.name) tried.insert(tried.begin() + 1, search.library_default);
        for (std::string& method : tried) method = parse_method(method).text();
        search.library_default = parse_method(search.library_default).text();
    }
    return all;
}

Method method_of(const std::string& text) {
    const MethodSpec spec = parse_method(text);
    Method method = make_method(registry().detector(spec.name), spec);
    method.family = method.own ? "ohc" : "none";
    return method;
}

}  // namespace trocar::bench
