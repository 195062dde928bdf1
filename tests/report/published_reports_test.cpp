// Every published report is what the present code makes of its records, byte for byte; all share the scripts of their
// pages.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "measure/record.hpp"
#include "report/page_assets.hpp"
#include "support/commands.hpp"
#include "support/page_links.hpp"
#include "support/test_name.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

const std::filesystem::path published = std::filesystem::path(TROCAR_SOURCE_DIR) / "reports";

/// Folders of reports/ with records. The others hold results alone.
std::vector<std::string> reports_with_records() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(published)) {
        if (std::filesystem::exists(records_file(entry.path()))) names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

class PublishedReport : public testing::TestWithParam<std::string> {};

TEST_P(PublishedReport, EqualsItsRebuild) {
    const test::TemporaryFolder folder;
    const std::filesystem::path copy = folder.path() / GetParam();
    for (const std::string& part : {GetParam(), std::string(own_assets)}) {
        std::filesystem::copy(published / part, folder.path() / part, std::filesystem::copy_options::recursive);
    }
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

TEST(PublishedReports, ShareTheScriptsOfThisProgram) {
    EXPECT_EQ(test::files_below(published / own_assets),
              (std::map<std::string, std::string>{{web::charts_name, std::string(web::charts_script())},
                                                  {web::viewer_name, std::string(web::viewer_script())}}))
        << "remedy: copy src/web/*.js";
    EXPECT_EQ(test::broken_links(published), std::vector<std::string>());
    for (const std::string& name : reports_with_records()) {
        if (name == "detection") continue;
        for (const auto& [file, content] : test::files_below(published / name)) {
            EXPECT_NE(std::filesystem::path(file).extension(), ".js") << name << "/" << file;
        }
    }
}

TEST(PublishedReports, TakeAtMost28MB) {
    std::uintmax_t bytes = 0;
    for (const auto& [name, content] : test::files_below(published)) bytes += content.size();
    EXPECT_LE(bytes, 28'000'000U);
}

}  // namespace
}  // namespace trocar
