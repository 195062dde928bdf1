#include "app/shipped.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "geometry/input_error.hpp"
#include "geometry/text.hpp"

namespace trocar::app {
namespace {

namespace fs = std::filesystem;

/// Below a root: folders of scenes and of studies, in the order in which a name is looked up.
constexpr const char* scene_folders[] = {"scenes", "bench/studies/scenes", "bench/studies/scenes/size"};
constexpr const char* study_folders[] = {"bench/studies"};

fs::path& added_root() {
    static fs::path root;
    return root;
}

bool is_root(const fs::path& folder) {
    std::error_code ignored;
    return fs::is_directory(folder / "scenes", ignored) && fs::is_directory(folder / "bench" / "studies", ignored);
}

template <std::size_t count>
std::vector<fs::path> files_in(const char* const (&folders)[count]) {
    std::vector<fs::path> files;
    std::set<std::string> seen;
    for (const fs::path& root : shipped_roots()) {
        for (const char* const folder : folders) {
            std::vector<fs::path> here;
            std::error_code ignored;
            for (const auto& entry : fs::directory_iterator(root / folder, ignored)) {
                if (entry.path().extension() == ".json") here.push_back(entry.path());
            }
            std::sort(here.begin(), here.end());
            for (fs::path& file : here) {
                if (seen.insert(file.stem().string()).second) files.push_back(std::move(file));
            }
        }
    }
    return files;
}

fs::path find(const fs::path& given, const std::vector<fs::path>& files, const std::string& expected) {
    std::error_code ignored;
    if (fs::exists(given, ignored) && !fs::is_directory(given, ignored)) return given;
    const bool bare = !given.has_parent_path() && (!given.has_extension() || given.extension() == ".json");
    if (!bare) {
        if (given.is_absolute()) return given;
        for (const fs::path& root : shipped_roots()) {
            if (fs::is_regular_file(root / given, ignored)) return root / given;
        }
        return given;
    }
    const std::string word = given.stem().string();
    std::vector<std::string> names;
    for (const fs::path& file : files) {
        names.push_back(file.stem().string());
        if (names.back() == word) return file;
    }
    const std::vector<std::string> near = near_names(word, names, 3, 1.0 / 3.0);
    throw InputError(given.string(), "", expected,
                     near.empty() ? "neither" : fmt::format("neither (near: {})", fmt::join(near, ", ")));
}

}  // namespace

std::vector<fs::path> shipped_roots() {
    std::vector<fs::path> candidates;
    if (const char* share = std::getenv("TROCAR_SHARE"); share != nullptr && *share != '\0') {
        candidates.emplace_back(share);
    }
    std::error_code ignored;
    const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
    // build/PRESET/bin in a clone
    constexpr int levels = 3;
    fs::path above = folder;
    for (int level = 0; level < levels; ++level) {
        above = above.parent_path();
        if (fs::is_regular_file(above / "CMakeLists.txt", ignored)) candidates.push_back(above);
    }
    candidates.push_back(folder.parent_path() / "share" / "trocar");
    if (!added_root().empty()) candidates.push_back(added_root());
    std::erase_if(candidates, [](const fs::path& candidate) { return !is_root(candidate); });
    return candidates;
}

std::vector<fs::path> shipped_reports() {
    std::vector<fs::path> folders = shipped_roots();
    for (fs::path& folder : folders) folder /= "reports";
    return folders;
}

void add_shipped_root(const fs::path& root) { added_root() = root; }

std::vector<fs::path> shipped_scenes() { return files_in(scene_folders); }

std::vector<fs::path> listed_scenes() {
    std::vector<fs::path> files = shipped_scenes();
    std::erase_if(files, [](const fs::path& file) {
        return file.generic_string().find("bench/studies/scenes/") != std::string::npos;
    });
    return files;
}

fs::path find_scene(const fs::path& given) {
    return find(given, shipped_scenes(), "a scene file, or a name that `trocar scenes` lists");
}

fs::path find_study(const fs::path& given) {
    return find(given, files_in(study_folders), "a study file, or the name of a study that comes with trocar");
}

}  // namespace trocar::app
