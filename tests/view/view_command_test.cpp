// `trocar view` from outside: a page of a scene, of a recording, of records; what it says of records that no longer
// fit; what it refuses.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/commands.hpp"
#include "support/page_links.hpp"
#include "support/scene_samples.hpp"
#include "support/unpacked.hpp"
#include "view/page.hpp"
#include "view/view_data.hpp"

namespace trocar::test {
namespace {

const std::string poke = std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_poke.json";

class ViewCommand : public ::testing::Test {
protected:
    [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
    /// A study of a few ticks with two responses; its folder is "out".
    void make_study() const {
        for (const char* scene : {"i2t_poke.json", "i2i_cross.json"}) {
            std::filesystem::copy_file(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / scene,
                                       folder_.path() / scene);
        }
        std::ofstream(folder_.path() / "study.json") << R"({"format":"trocar-study-3","name":"small","experiments":[
            {"frames":"closed_loop","scenes":["i2t_poke.json","i2i_cross.json"],"detectors":["ohc"],
             "responses":["unilateral","thesis:profile=faithful","penalty"],
             "contacts":["intersection","tracked_proximity"],"ticks":40}]})";
        run_successfully("study " + path("study.json") + " --output " + path("out"));
    }
    TemporaryFolder folder_;
};

TEST_F(ViewCommand, PageOfASceneReportsEveryTickOfEachResponse) {
    const std::string page = path("page.html");
    const ProgramResult made = run_successfully(
        "view " + poke + " --response unilateral --response thesis --ticks 420 --json --output " + page);
    EXPECT_EQ(made.err, "");
    const std::string html = read_file(page);
    EXPECT_EQ(nlohmann::json::parse(made.out)["bytes"], html.size());
    EXPECT_LE(html.size(), view_file_bound);
    const nlohmann::json data = view_data(html);
    ASSERT_EQ(data["runs"].size(), 2U);
    const nlohmann::json rows = json_of("run " + poke + " --response thesis --ticks 420 --json")["rows"];
    double deepest = 0.0;
    for (const nlohmann::json& row : rows) deepest = std::max(deepest, row["residual_penetration"].get<double>());
    ASSERT_GT(deepest, 0.0);
    EXPECT_EQ(data["runs"][1]["label"], "thesis");
    EXPECT_EQ(data["runs"][1]["worst"]["depth"]["value"].get<double>(), deepest);
    EXPECT_EQ(data["ticks"], 420);
    EXPECT_FALSE(data["references"].empty());
    for (const char* outside : {"http://", "https://"}) {
        const std::string own = html.substr(0, html.rfind("<script>"));
        EXPECT_EQ(own.find(outside), std::string::npos);
    }
}

TEST_F(ViewCommand, PageOfARecordingHasItsFramesAndNoForce) {
    ASSERT_EQ(run_program("run " + poke + " --ticks 400 --record " + path("frames.trocrec")).status, 0);
    run_successfully("view " + path("frames.trocrec") + " --output " + path("page.html"));
    const nlohmann::json data = view_data(read_file(path("page.html")));
    EXPECT_EQ(data["ticks"], 400);
    EXPECT_EQ(data["runs"][0]["worst"]["force"]["tick"], -1);
    EXPECT_EQ(data["runs"][0]["frames"].back(), 399);
}

TEST_F(ViewCommand, APageReportsHowLongATickOfItsSceneOrRecordingIs) {
    nlohmann::json scene = nlohmann::json::parse(poke_text());
    scene["dt"] = 0.002;
    std::ofstream(path("slow.json")) << scene.dump();
    ASSERT_EQ(run_program("run " + path("slow.json") + " --ticks 3 --record " + path("slow.trocrec")).status, 0);
    for (const auto& [source, words] : {std::pair{"slow.json --ticks 3", " triangles, 3 ticks of 2 ms"},
                                        {"slow.trocrec", " triangles, 3 frames 2 ms apart"}}) {
        run_successfully("view " + path(source) + " --output " + path("page.html"));
        const nlohmann::json data = view_data(read_file(path("page.html")));
        EXPECT_EQ(data.at("dt").get<double>(), 0.002) << source;
        const std::string about = data.at("about").get<std::string>();
        EXPECT_TRUE(about.find("2 bodies, ") != std::string::npos && about.ends_with(words)) << about;
    }
}

TEST_F(ViewCommand, AStudyMakesAPagePerSceneAndItsReportLinksThem) {
    ASSERT_NO_FATAL_FAILURE(make_study());
    for (const char* scene : {"i2t_poke", "i2i_cross"}) {
        const std::string html = read_file(path("out/view/" + std::string(scene) + ".html"));
        const nlohmann::json data = view_data(html);
        ASSERT_EQ(data["runs"].size(), 2U) << scene;
        EXPECT_LE(html.size(), 400'000U);
        for (const nlohmann::json& run : data["runs"]) EXPECT_EQ(run["note"], "") << run["note"];
        for (const char* report : {"out/report.md", "out/report.html"}) {
            EXPECT_NE(read_file(path(report)).find("view/" + std::string(scene) + ".html"), std::string::npos);
        }
    }
    EXPECT_TRUE(std::filesystem::exists(path("out/assets/viewer-1.js")));
    EXPECT_EQ(broken_links(path("out")), std::vector<std::string>());
    const std::string linked = read_file(path("out/report.html"));
    ASSERT_EQ(run_program("report " + path("out")).status, 0);
    EXPECT_EQ(read_file(path("out/report.html")), linked) << "rebuilt byte for byte";
    std::filesystem::remove_all(path("out/view"));
    ASSERT_EQ(run_program("report " + path("out")).status, 0);
    const std::string without = read_file(path("out/report.html"));
    EXPECT_EQ(without.find("view/i2t_poke.html"), std::string::npos) << "no link leads nowhere";
    EXPECT_NE(without.find("trocar view DIR --pages"), std::string::npos);
}

TEST_F(ViewCommand, NoNameOfASceneLeadsItsPageOutOfTheFolder) {
    std::filesystem::create_directories(path("a/b"));
    nlohmann::json scene = nlohmann::json::parse(read_file(poke));
    scene["name"] = "../evil name";
    std::ofstream(path("a/b/evil.json")) << scene.dump();
    scene["name"] = "..|evil_name";  // another name, the same file
    std::ofstream(path("a/b/twin.json")) << scene.dump();
    std::ofstream(path("a/b/study.json")) << R"({"format":"trocar-study-3","name":"small","experiments":[
        {"frames":"closed_loop","scenes":["evil.json","twin.json"],"detectors":["ohc"],"responses":["unilateral"],
         "ticks":3}]})";
    const ProgramResult made = run_successfully("study " + path("a/b/study.json") + " --output " + path("a/b/out"));
    EXPECT_TRUE(std::filesystem::exists(path("a/b/out/view/___evil_name.html")));
    EXPECT_NE(made.err.find("another scene's page is ___evil_name.html too"), std::string::npos) << made.err;
    const std::string report = read_file(path("a/b/out/report.html"));
    const std::size_t link = report.find("\"view/___evil_name.html\"");
    ASSERT_NE(link, std::string::npos);
    EXPECT_EQ(report.find("\"view/___evil_name.html\"", link + 1), std::string::npos);

    const std::string program = "cd " + path("a/b") + " && " + TROCAR_PROGRAM;
    run_successfully("view evil.json --ticks 3", program);
    EXPECT_TRUE(std::filesystem::exists(path("a/b/___evil_name.html")));
    EXPECT_FALSE(std::filesystem::exists(path("a/evil name.html")));
}

TEST_F(ViewCommand, ARecordWhoseRunEndsElsewhereIsReported) {
    ASSERT_NO_FATAL_FAILURE(make_study());
    const std::string scene =
        " --scene " + path("i2t_poke.json") + " --response unilateral --output " + path("page.html");
    const ProgramResult same = run_successfully("view " + path("out") + scene);
    EXPECT_EQ(same.err, "");
    std::string records = unpacked(path("out/records.jsonl.gz"));
    const std::string key = "\"state_hash\":\"";
    std::size_t changed = 0;
    for (std::size_t at = records.find(key); at != std::string::npos; at = records.find(key, at + 1)) {
        char& digit = records[at + key.size()];
        if (digit == '"') continue;
        digit = digit == '0' ? '1' : '0';
        ++changed;
    }
    ASSERT_GT(changed, 0U);
    std::ofstream(path("out/records.jsonl.gz")) << gzipped(records);
    const ProgramResult other = run_successfully("view " + path("out") + scene);
    EXPECT_NE(other.err.find("these frames are not those of the record"), std::string::npos) << other.err;
    const nlohmann::json data = view_data(read_file(path("page.html")));
    EXPECT_NE(data["runs"][0]["note"].get<std::string>().find("not those of the record"), std::string::npos);
}

TEST_F(ViewCommand, BadInputGetsOneLineAndLeavesNoPage) {
    const std::string page = " --output " + path("page.html");
    std::ofstream(path("text.json")) << "no scene";
    ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);  // opened, it would wait for a writer
    for (const std::string& arguments :
         {std::string("view /no/such/scene.json"), "view " + path("text.json"), "view " + path("pipe"),
          "view " + poke + " " + poke, "view " + poke + " --response nobody",
          "view " + poke + " --response thesis:profile=nobody", "view " + poke + " --ticks 0",
          "view " + poke + " --scene i2t_poke", "view " + folder_.path().string(),
          "view " + std::string(TROCAR_SOURCE_DIR) + "/reports/default",
          "view " + std::string(TROCAR_SOURCE_DIR) + "/reports/default --scene nowhere",
          "view " + std::string(TROCAR_SOURCE_DIR) + "/reports/default --scene i2t_poke --response nobody",
          "view " + poke + " --pages"}) {
        expect_refused(arguments + page);
        EXPECT_FALSE(std::filesystem::exists(path("page.html"))) << arguments;
    }
}

}  // namespace
}  // namespace trocar::test
