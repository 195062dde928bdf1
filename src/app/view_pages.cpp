#include "app/view_pages.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <set>

#include "app/isolated_call.hpp"
#include "app/progress.hpp"
#include "app/view_runs.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "report/page_assets.hpp"
#include "report/view_links.hpp"
#include "view/page.hpp"
#include "web/web.hpp"

namespace trocar::app {
namespace {

constexpr std::size_t page_budget = 390'000;  ///< bytes of a page beside its script
constexpr double time_limit_s = 600.0;        ///< a page runs its scene twice, judged at every tick

std::string page_text(const std::filesystem::path& file, const std::vector<const Record*>& chosen,
                      const std::optional<std::filesystem::path>& data, const std::string& script) {
    const ViewPage page = page_of_records(read_scene(file, data), chosen, {});
    for (const ViewedRun& run : page.runs) {
        if (!run.note.empty()) fmt::print(stderr, "trocar: {}: {}: {}\n", page.scene, run.label, run.note);
    }
    return view_html(page, script, page_budget);
}

}  // namespace

std::size_t write_view_pages(const std::filesystem::path& directory, const std::vector<Record>& records,
                             const std::filesystem::path& study_folder,
                             const std::optional<std::filesystem::path>& data) {
    const std::filesystem::path folder = directory / view_folder;
    const std::string assets = assets_of(directory);
    std::filesystem::remove_all(folder);
    const std::vector<std::string> scenes = viewed_scenes(records);
    Progress progress("replay", static_cast<std::int64_t>(scenes.size()));
    std::set<std::string> taken;
    std::size_t written = 0;
    std::int64_t examined = 0;
    for (const std::string& scene : scenes) {
        progress.show(examined++, scene);
        const std::vector<const Record*> chosen = chosen_records(records, scene, {});
        if (chosen.empty()) continue;
        const std::optional<std::filesystem::path> file = scene_file_of(*chosen.front(), study_folder);
        std::string why;
        const std::string page = page_of_scene(scene);
        if (!taken.insert(page).second) {
            why = fmt::format("another scene's page is {} too", page);
        } else if (!file) {
            why = fmt::format("{} is not there", chosen.front()->spec.scene_file);
        } else if (lacks_data(*file, std::nullopt)) {
            // A report is handed on; who has the meshes may make the page for himself.
            why = fmt::format("its meshes are not the project's to pass on; `trocar view {} --scene {}` makes one",
                              directory.string(), scene);
        } else {
            const IsolatedResult result = call_isolated(
                [&]() -> std::string {
                    try {
                        return page_text(*file, chosen, data, viewer_link(assets));
                    } catch (const InputError& error) {
                        return std::string("\n") + error.what();  // no page begins with an empty line
                    }
                },
                time_limit_s);
            if (!result.outcome.ok()) {
                why = result.outcome.message;
            } else if (result.bytes.starts_with('\n')) {
                why = result.bytes.substr(1);
            } else {
                std::filesystem::create_directories(folder);
                write_whole(folder / page, result.bytes);
                ++written;
            }
        }
        if (why.empty()) continue;
        progress.end();
        fmt::print(stderr, "trocar: no replay of {}: {}\n", scene, why);
    }
    if (written > 0 && assets == own_assets) {
        std::filesystem::create_directories(directory / own_assets);
        write_whole(directory / own_assets / web::viewer_name, std::string(web::viewer_script()));
    }
    return written;
}

}  // namespace trocar::app
