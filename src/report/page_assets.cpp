#include "report/page_assets.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "geometry/whole_file.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

std::array<std::pair<const char*, std::string_view>, 2> scripts() {
    return {{{web::charts_name, web::charts_script()}, {web::viewer_name, web::viewer_script()}}};
}

}  // namespace

std::string assets_of(const std::filesystem::path& report) {
    const auto all = scripts();
    const bool shared = std::all_of(all.begin(), all.end(), [&report](const auto& script) {
        const std::filesystem::path file = report / shared_assets / script.first;
        return std::filesystem::is_regular_file(file) && read_whole(file, "a script") == script.second;
    });
    return shared ? shared_assets : own_assets;
}

void write_shared_assets(const std::filesystem::path& reports) {
    std::filesystem::create_directories(reports / own_assets);
    for (const auto& [name, content] : scripts()) write_whole(reports / own_assets / name, std::string(content));
}

}  // namespace trocar
