// A page in a headless browser.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/program.hpp"

namespace trocar::test {

inline bool no_browser() { return std::system("command -v chromium > /dev/null 2>&1") != 0; }

/// Runs `probe` in the folder's copy of a page, after its own script, in a window of 1400 px. Gives back what it put
/// into the page's title.
inline std::string title_of(std::string page, const std::string& probe, const std::filesystem::path& folder) {
    page.insert(page.find("</body>"), "<script>" + probe + "</script>");
    std::ofstream(folder / "probe.html") << page;
    const std::string command =
        "chromium --headless=new --no-sandbox --disable-gpu --user-data-dir=" + (folder / "browser").string() +
        " --window-size=1400,3000 --virtual-time-budget=2000 --dump-dom file://" + (folder / "probe.html").string() +
        " > " + (folder / "dom").string() + " 2> /dev/null";
    if (std::system(command.c_str()) != 0) return "the browser failed";
    const std::string dom = read_file(folder / "dom");
    const std::size_t from = dom.find("<title>") + 7;
    return dom.substr(from, dom.find("</title>") - from);
}

}  // namespace trocar::test
