// Replay pages in Chromium, opened as files, used with mouse and keys by drive_page.py.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "report/page_assets.hpp"
#include "report/view_links.hpp"
#include "support/commands.hpp"
#include "web/web.hpp"

namespace trocar::test {
namespace {

bool has_browser() {
    return std::system(
               "command -v chromium >/dev/null && command -v chromedriver >/dev/null && "
               "command -v python3 >/dev/null") == 0;
}

/// What drive_page.py reports of a page; null when it fails.
nlohmann::json driven(const std::filesystem::path& page) {
    const TemporaryFolder folder;
    const std::string out = (folder.path() / "out").string();
    const std::string command =
        "python3 " + std::string(TROCAR_SOURCE_DIR) + "/tests/view/drive_page.py " + page.string() + " >" + out;
    if (std::system(command.c_str()) != 0) return nullptr;
    return nlohmann::json::parse(read_file(out), nullptr, false);
}

class PageInBrowser : public ::testing::Test {
protected:
    void SetUp() override {
        if (!has_browser()) GTEST_SKIP() << "no chromium, chromedriver or python3";
    }
    [[nodiscard]] std::filesystem::path made(const std::string& arguments) const {
        std::filesystem::path page = folder_.path() / "page.html";
        run_successfully("view " + arguments + " --output " + page.string());
        return page;
    }
    TemporaryFolder folder_;
};

/// Free of what a reader must never meet, and loaded from this folder alone.
void expect_quiet(const nlohmann::json& reported, const std::filesystem::path& folder) {
    EXPECT_EQ(reported["errors"], nlohmann::json::array()) << reported["errors"];
    for (const nlohmann::json& url : reported["requests"]) {
        EXPECT_EQ(url.get<std::string>().rfind("file://" + folder.string() + "/", 0), 0U) << url;
    }
}

TEST_F(PageInBrowser, TwoMethodsFollowMouseAndKeys) {
    const std::filesystem::path page = made(
        std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_poke.json --response unilateral --response thesis --ticks 640");
    const nlohmann::json reported = driven(page);
    ASSERT_TRUE(reported.is_object());
    ASSERT_EQ(reported["ready"], true) << reported;
    expect_quiet(reported, page.parent_path());
    EXPECT_EQ(reported["requests"].size(), 1U) << "one file holds all: " << reported["requests"];
    EXPECT_EQ(reported["alerts"].size(), 0U) << reported["alerts"];
    EXPECT_EQ(reported["panels"], 2);
    EXPECT_GT(reported["variance"], 100.0) << "an empty picture has none";
    EXPECT_GT(reported["changed_by_tick"], 0.02);
    EXPECT_GT(reported["changed_by_field"], 0.02);
    EXPECT_GT(reported["changed_by_turning"], 0.2);
    EXPECT_EQ(reported["tick_after_home"], 0);
    EXPECT_EQ(reported["tick_after_right"], 1);
    EXPECT_NEAR(reported["tick_after_slider"].get<double>(), 320.0, 6.0);
    EXPECT_NE(reported["slider_shows"].get<std::string>().find("of 640"), std::string::npos)
        << reported["slider_shows"];
    EXPECT_EQ(reported["tick_after_worst"], 0) << "hold leaves nothing: its first tick is as bad as any";
    EXPECT_EQ(reported["tick_after_w"], reported["first_tick"]) << "a page opens where it is worst";
    EXPECT_GT(reported["first_tick"], 360) << "before that nothing touches";
    EXPECT_EQ(reported["pressed"], "true");
    EXPECT_NE(reported["legend"].get<std::string>().find("mm"), std::string::npos);
    EXPECT_GT(reported["tick_after_chart"], 320);
    EXPECT_GT(reported["tick_while_playing"], 0);
    EXPECT_EQ(reported["stays_when_stopped"], true);
    EXPECT_EQ(reported["panels_after_click"], 1);
    EXPECT_EQ(reported["curves"].size(), 2U);
}

TEST_F(PageInBrowser, AScriptInTheAssetsOfAReportWorksAsWell) {
    const std::filesystem::path whole =
        made(std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_poke.json --ticks 500 --response penalty");
    // As a study writes it: the same page in view/, its script in assets/.
    std::string html = read_file(whole);
    const std::size_t from = html.rfind("<script>");
    ASSERT_NE(from, std::string::npos);
    html.replace(from, html.rfind("</script>") - from, "<script src=\"" + viewer_link(own_assets) + "\">");
    std::filesystem::create_directories(folder_.path() / view_folder);
    std::filesystem::create_directories(folder_.path() / own_assets);
    const std::filesystem::path page = folder_.path() / view_folder / "page.html";
    std::ofstream(page) << html;
    std::ofstream(folder_.path() / own_assets / web::viewer_name) << web::viewer_script();
    const nlohmann::json reported = driven(page);
    ASSERT_TRUE(reported.is_object());
    ASSERT_EQ(reported["ready"], true) << reported;
    expect_quiet(reported, folder_.path());
    EXPECT_EQ(reported["requests"].size(), 2U) << reported["requests"];
    EXPECT_GT(reported["variance"], 100.0);
    EXPECT_GT(reported["changed_by_tick"], 0.02);
}

TEST_F(PageInBrowser, APageThatWasCutSaysSo) {
    const std::filesystem::path page =
        made(std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_poke.json --ticks 20 --response penalty");
    std::string html = read_file(page);
    const std::string key = "\"positions\":\"";
    const std::size_t at = html.find(key);
    ASSERT_NE(at, std::string::npos);
    html.replace(at + key.size(), 40, 40, 'A');
    std::ofstream(page) << html;
    const nlohmann::json reported = driven(page);
    ASSERT_TRUE(reported.is_object());
    EXPECT_EQ(reported["ready"], false);
    EXPECT_FALSE(reported["errors"].empty()) << "the test sees what a console shows";
    ASSERT_FALSE(reported["alerts"].empty());
    EXPECT_NE(reported["alerts"][0].get<std::string>().find("cannot be shown"), std::string::npos);
}

}  // namespace
}  // namespace trocar::test
