// Every published report is what the present code makes of its records, byte for byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "support/commands.hpp"
#include "support/test_name.hpp"

namespace trocar {
namespace {

const std::filesystem::path published = std::filesystem::path(TROCAR_SOURCE_DIR) / "reports";

/// Folders of reports/ with records. The others hold results alone.
std::vector<std::string> reports_with_records() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(published)) {
        if (std::filesystem::exists(entry.path() / "records.jsonl")) names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

class PublishedReport : public testing::TestWithParam<std::string> {};

TEST_P(PublishedReport, EqualsItsRebuild) {
    const test::TemporaryFolder folder;
    const std::filesystem::path copy = folder.path() / GetParam();
    std::filesystem::copy(published / GetParam(), copy, std::filesystem::copy_options::recursive);
    test::run_successfully("report " + copy.string());
    const std::map<std::string, std::string> before = test::files_below(published / GetParam());
    const std::map<std::string, std::string> after = test::files_below(copy);
    EXPECT_EQ(before.size(), after.size());
    for (const auto& [name, content] : before) {
        const auto found = after.find(name);
        ASSERT_NE(found, after.end()) << name;
        EXPECT_TRUE(found->second == content) << name << " differs; remedy: rebuild reports/" << GetParam();
    }
}

INSTANTIATE_TEST_SUITE_P(Reports, PublishedReport, testing::ValuesIn(reports_with_records()),
                         [](const auto& parameter) { return test::test_name(parameter.param); });

}  // namespace
}  // namespace trocar
