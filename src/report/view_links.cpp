#include "report/view_links.hpp"

#include <fmt/format.h>

#include <string_view>

#include "geometry/whole_file.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

/// Behind the first line that ends the title; a file without one stays as it is.
void insert_under_title(const std::string& title_end, const std::string& line, std::string& content) {
    const std::size_t title = content.find(title_end);
    if (title == std::string::npos) return;
    content.insert(title + title_end.size(), line);
}

}  // namespace

bool can_be_viewed(const Record& record) {
    static const std::set<std::string> modes{"closed_loop", "hard_case"};
    const RunSpec& spec = record.spec;
    return modes.contains(spec.mode) && !spec.response.empty() && spec.overrides.empty() &&
           std::filesystem::path(spec.scene_file).extension() == ".json" &&
           fact_of(record, "detector.control") != "yes" && !never_ran(record);
}

std::vector<std::string> viewed_scenes(const std::vector<Record>& records) {
    std::set<std::string> scenes;
    for (const Record& record : records) {
        if (can_be_viewed(record)) scenes.insert(record.spec.scene);
    }
    return {scenes.begin(), scenes.end()};
}

std::string page_of_scene(const std::string& scene) { return file_word(scene) + ".html"; }

std::set<std::string> pages_there(const std::filesystem::path& directory) {
    std::set<std::string> pages;
    if (!std::filesystem::is_directory(directory / view_folder)) return pages;
    for (const auto& entry : std::filesystem::directory_iterator(directory / view_folder)) {
        if (entry.path().extension() == ".html") pages.insert(entry.path().filename().string());
    }
    return pages;
}

std::string viewer_link(const std::string& assets) { return fmt::format("../{}/{}", assets, web::viewer_name); }

void link_viewer(const std::filesystem::path& directory, const std::string& assets) {
    constexpr std::string_view begin = "<script src=\"";
    constexpr std::string_view end = "\"></script>\n</body>\n</html>\n";
    for (const std::string& page : pages_there(directory)) {
        const std::filesystem::path file = directory / view_folder / page;
        const std::string html = read_whole(file, "a replay page");
        const std::size_t at = html.rfind(begin);
        if (at == std::string::npos || !html.ends_with(end) ||
            html.find('"', at + begin.size()) != html.size() - end.size())
            continue;
        std::string linked = html.substr(0, at + begin.size()) + viewer_link(assets);
        linked += end;
        if (linked != html) write_whole(file, linked);
    }
}

void add_view_links(const std::vector<Record>& records, const std::set<std::string>& pages,
                    std::map<std::string, std::string>& files) {
    const std::vector<std::string> scenes = viewed_scenes(records);
    if (scenes.empty()) return;
    std::string markdown;
    std::string html;
    std::set<std::string> linked;
    for (const std::string& scene : scenes) {
        const std::string file = page_of_scene(scene);
        if (!pages.contains(file) || !linked.insert(file).second) continue;
        const std::string page = fmt::format("{}/{}", view_folder, file);
        const char* const between = markdown.empty() ? "" : " · ";
        markdown += fmt::format("{}[{}]({})", between, scene, page);
        html += fmt::format("{}<a href=\"{}\">{}</a>", between, escape_xml(page), escape_xml(scene));
    }
    constexpr const char* how = "trocar view DIR --pages";
    if (markdown.empty()) {
        markdown = fmt::format("none here; `{}` with this folder makes them", how);
        html = fmt::format("none here; <code>{}</code> with this folder makes them", how);
    }
    if (const auto file = files.find("report.md"); file != files.end()) {
        const std::size_t line = file->second.find('\n');
        const std::string title = file->second.substr(0, line == std::string::npos ? 0 : line + 1);
        if (!title.empty()) insert_under_title(title, fmt::format("\nReplays: {}\n", markdown), file->second);
    }
    if (const auto file = files.find("report.html"); file != files.end()) {
        insert_under_title("</h1>\n", fmt::format("<p class=\"views\">Replays: {}</p>\n", html), file->second);
    }
}

}  // namespace trocar
