// Holds every #include "folder/…" under src and baselines against src/layers.txt, so that dependencies keep pointing
// one way.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "support/program.hpp"

namespace trocar {
namespace {

using Layers = std::map<std::string, std::set<std::string>>;

Layers read_layers(std::istream& stream) {
    Layers layers;
    std::string line;
    while (std::getline(stream, line)) {
        if (line.empty() || line.front() == '#') continue;
        const auto colon = line.find(':');
        std::istringstream allowed(line.substr(colon + 1));
        std::set<std::string>& entry = layers[line.substr(0, colon)];
        for (std::string folder; allowed >> folder;) entry.insert(folder);
        entry.insert(line.substr(0, colon));
    }
    return layers;
}

/// Project folders that the text includes and `folder` may not.
std::set<std::string> forbidden_includes(const Layers& layers, const std::string& folder, const std::string& text) {
    static const std::regex include(R"re(#include "([a-z]+)/)re");
    std::set<std::string> forbidden;
    for (auto match = std::sregex_iterator(text.begin(), text.end(), include); match != std::sregex_iterator();
         ++match) {
        if (!layers.at(folder).contains((*match)[1].str())) forbidden.insert((*match)[1].str());
    }
    return forbidden;
}

TEST(Layers, EveryIncludePointsTheAllowedPath) {
    const std::filesystem::path source(TROCAR_SOURCE_DIR);
    std::ifstream stream(source / "src/layers.txt");
    const Layers layers = read_layers(stream);
    ASSERT_FALSE(layers.empty());
    int files = 0;
    for (const char* root : {"src", "baselines"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(source / root)) {
            const auto extension = entry.path().extension();
            if (extension != ".cpp" && extension != ".hpp") continue;
            const std::string folder =
                std::string(root) == "baselines" ? "baselines" : entry.path().parent_path().filename().string();
            ASSERT_TRUE(layers.contains(folder)) << entry.path() << ": folder missing in src/layers.txt";
            for (const std::string& name : forbidden_includes(layers, folder, test::read_file(entry.path()))) {
                ADD_FAILURE() << entry.path() << " may not include " << name << "/";
            }
            ++files;
        }
    }
    EXPECT_GT(files, 20);
}

TEST(Layers, AnIncludeAgainstTheArrowIsFound) {
    std::istringstream text("geometry:\nscene: geometry\n");
    const Layers layers = read_layers(text);
    EXPECT_EQ(forbidden_includes(layers, "geometry", "#include \"scene/world.hpp\"\n"), std::set<std::string>{"scene"});
    EXPECT_TRUE(forbidden_includes(layers, "scene", "#include \"geometry/types.hpp\"\n").empty());
}

}  // namespace
}  // namespace trocar
