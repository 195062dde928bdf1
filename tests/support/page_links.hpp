// Files that pages of a report load or link to.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/program.hpp"

namespace trocar::test {

/// Values of src="…" and href="…" in a page, without places in the page and addresses elsewhere.
inline std::vector<std::string> links_of(const std::string& html) {
    std::vector<std::string> links;
    for (const std::string key : {" src=\"", " href=\""}) {
        for (std::size_t at = html.find(key); at != std::string::npos; at = html.find(key, at)) {
            at += key.size();
            const std::string link = html.substr(at, html.find('"', at) - at);
            if (!link.starts_with('#') && link.find(':') == std::string::npos) links.push_back(link);
        }
    }
    return links;
}

/// "PAGE: LINK" for every link of the pages below a folder that leads to no file.
inline std::vector<std::string> broken_links(const std::filesystem::path& folder) {
    std::vector<std::string> broken;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.path().extension() != ".html") continue;
        for (const std::string& link : links_of(read_file(entry.path()))) {
            if (std::filesystem::is_regular_file(entry.path().parent_path() / link)) continue;
            broken.push_back(entry.path().string() + ": " + link);
        }
    }
    return broken;
}

}  // namespace trocar::test
