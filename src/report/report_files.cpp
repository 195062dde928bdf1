#include "report/report_files.hpp"

#include <string>
#include <system_error>
#include <vector>

#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

void remove_what_is_left(const std::filesystem::path& directory, const std::map<std::string, std::string>& files) {
    std::vector<std::filesystem::path> left;
    const auto search = [&](const std::string& folder, const auto& is_ours) {
        std::error_code none;
        for (const auto& entry : std::filesystem::directory_iterator(directory / folder, none)) {
            const std::filesystem::path name = std::filesystem::path(folder) / entry.path().filename();
            if (is_ours(name) && !files.contains(name.generic_string())) left.push_back(entry.path());
        }
    };
    search("charts", [](const auto& name) { return name.extension() == ".svg" || name.extension() == ".js"; });
    const auto is_script = [](const auto& name) {
        const std::string file = name.filename().string();
        return name.extension() == ".js" && (file.starts_with("charts") || file.starts_with("viewer"));
    };
    search("assets", is_script);
    search("view", is_script);
    search("", [](const auto& name) {
        return name.extension() == ".csv" && name.filename().string().starts_with("results_");
    });
    for (const std::filesystem::path& file : left) std::filesystem::remove(file);
}

}  // namespace

void write_report_files(const std::filesystem::path& directory, const std::map<std::string, std::string>& files) {
    std::filesystem::create_directories(directory);
    remove_what_is_left(directory, files);
    for (const auto& [name, content] : files) {
        const std::filesystem::path file = directory / name;
        std::filesystem::create_directories(file.parent_path());
        write_whole(file, content);
    }
}

}  // namespace trocar
