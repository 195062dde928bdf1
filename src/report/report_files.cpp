#include "report/report_files.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

/// Runs a program found on the path, its messages thrown away; false unless it ends with status 0.
bool runs(const std::vector<std::string>& words) {
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    std::vector<std::string> settings;
    for (char** one = environ; *one != nullptr; ++one) settings.emplace_back(*one);
    settings.emplace_back("SOURCE_DATE_EPOCH=0");  // else every PDF would tell the time of its making
    std::vector<char*> environment;
    environment.reserve(settings.size() + 1);
    for (std::string& setting : settings) environment.push_back(setting.data());
    environment.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int failed = posix_spawnp(&child, arguments[0], &quiet, nullptr, arguments.data(), environment.data());
    posix_spawn_file_actions_destroy(&quiet);
    if (failed != 0) return false;
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return false;
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::string content_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

void remove_what_is_left(const std::filesystem::path& directory, const std::map<std::string, std::string>& files) {
    std::vector<std::filesystem::path> left;
    const auto look = [&](const std::string& folder, const auto& is_ours) {
        std::error_code none;
        for (const auto& entry : std::filesystem::directory_iterator(directory / folder, none)) {
            std::filesystem::path name = std::filesystem::path(folder) / entry.path().filename();
            if (!is_ours(name)) continue;
            if (name.extension() == ".pdf") name.replace_extension(".svg");
            if (!files.contains(name.generic_string())) left.push_back(entry.path());
        }
    };
    look("charts", [](const auto& name) {
        return name.extension() == ".svg" || name.extension() == ".pdf" || name.extension() == ".js";
    });
    look("tables", [](const auto& name) { return name.extension() == ".tex"; });
    look("", [](const auto& name) {
        return name.extension() == ".csv" && name.filename().string().starts_with("results_");
    });
    for (const std::filesystem::path& file : left) std::filesystem::remove(file);
}

}  // namespace

void write_report_files(const std::filesystem::path& directory, const std::map<std::string, std::string>& files) {
    std::filesystem::create_directories(directory);
    remove_what_is_left(directory, files);
    std::vector<std::filesystem::path> drawings;
    for (const auto& [name, content] : files) {
        const std::filesystem::path file = directory / name;
        std::filesystem::create_directories(file.parent_path());
        if (file.extension() == ".svg") {
            std::filesystem::path pdf = file;
            pdf.replace_extension(".pdf");
            if (!std::filesystem::exists(pdf) || content_of(file) != content) {
                std::filesystem::remove(pdf);
                drawings.push_back(file);
            }
        }
        write_whole(file, content);
    }
    for (const std::filesystem::path& drawing : drawings) {
        std::filesystem::path pdf = drawing;
        pdf.replace_extension(".pdf");
        std::filesystem::path beside = pdf;
        beside += ".part";
        std::error_code ignored;
        if (runs({"rsvg-convert", "--format=pdf", "--output=" + beside.string(), drawing.string()})) {
            std::filesystem::rename(beside, pdf, ignored);
        } else {
            std::filesystem::remove(beside, ignored);
        }
    }
}

}  // namespace trocar
