// Who finds what is near: detectors, and nobody after them. A response or a contact generator that searched for itself
// would not notice what its detector misses (CONTACT §1). What a search is made of is known by its words.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "support/program.hpp"

namespace trocar {
namespace {

/// Structures that answer "what is near?": grids, trees, hashes, blocks of boxes, sweeps.
const std::regex& words() {
    static const std::regex pattern(
        R"re((TriangleGrid|SurfaceBlocks|triangle_grid\.hpp|surface_blocks\.hpp|box_pairs\.hpp|overlapping_boxes|cell_map|)re"
        R"re(lattice\.hpp|block_boxes|clusters\.hpp|octree|kd_?tree|\bBvh\b|\bbvh\b|unordered_(?:multi)?map|hash_?grid|)re"
        R"re(spatial_?hash|sweep_?and_?prune|class \w*(?:Tree|Grid|Cells|Hierarchy|Clusters)\b))re");
    return pattern;
}

std::set<std::string> words_in(const std::string& text) {
    std::set<std::string> found;
    for (auto match = std::sregex_iterator(text.begin(), text.end(), words()); match != std::sregex_iterator();
         ++match) {
        found.insert((*match)[1].str());
    }
    return found;
}

TEST(BroadPhase, IsInDetectorsAlone) {
    const std::filesystem::path source = std::filesystem::path(TROCAR_SOURCE_DIR) / "src";
    std::map<std::string, std::set<std::string>> found;
    int files = 0;
    for (const char* folder : {"contact", "contact_generation", "respond", "tissue"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(source / folder)) {
            const auto extension = entry.path().extension();
            if (extension != ".cpp" && extension != ".hpp") continue;
            ++files;
            const std::set<std::string> here = words_in(test::read_file(entry.path()));
            if (!here.empty()) found[std::filesystem::relative(entry.path(), source).generic_string()] = here;
        }
    }
    EXPECT_GT(files, 40);
    for (const auto& [name, here] : found) ADD_FAILURE() << name << " searches for itself: " << *here.begin();
}

TEST(BroadPhase, IsKnownByItsWords) {
    EXPECT_TRUE(words_in("class FaceGrid {").contains("class FaceGrid"));
    EXPECT_TRUE(words_in("#include \"geometry/box_pairs.hpp\"").contains("box_pairs.hpp"));
    EXPECT_TRUE(words_in("std::unordered_map<Index, int> cells_;").contains("unordered_map"));
    EXPECT_TRUE(words_in("what lies within the query distance of a tree of thought").empty());
    // The detectors are full of them.
    std::size_t detectors = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(TROCAR_SOURCE_DIR) / "src/detect")) {
        if (!words_in(test::read_file(entry.path())).empty()) ++detectors;
    }
    EXPECT_GT(detectors, 5U);
}

}  // namespace
}  // namespace trocar
