#include <gtest/gtest.h>

#include <algorithm>

#include "support/commands.hpp"
#include "support/text.hpp"
#include "support/unpacked.hpp"

namespace trocar {
namespace {

const std::string published = std::string(TROCAR_SOURCE_DIR) + "/reports/steppers";

TEST(TableCommand, PrintsEveryFormatFromAFolderOrItsRecords) {
    const std::string words = " --columns scene,response,residual_penetration_max_m:mm --where scene=i2t_poke";
    const test::ProgramResult markdown = test::run_successfully("table " + published + words);
    EXPECT_TRUE(markdown.out.starts_with("| scene | response | residual penetration max (mm) |\n")) << markdown.out;
    EXPECT_EQ(test::run_program("table " + published + "/records.jsonl.gz" + words).out, markdown.out);
    test::expect_holds(test::run_program("table " + published + words + " --format tex").out, {"\\begin{tabular}"});
    const test::ProgramResult csv = test::run_program("table " + published + words + " --format csv");
    EXPECT_TRUE(csv.out.starts_with("scene,response,residual_penetration_max_mm\n")) << csv.out;
    EXPECT_EQ(std::count(csv.out.begin(), csv.out.end(), '\n') + 1,
              std::count(markdown.out.begin(), markdown.out.end(), '\n'));
    const auto json = test::json_of("table " + published + words + " --json");
    EXPECT_EQ(json["columns"][2]["unit"], "mm");
    EXPECT_EQ(static_cast<std::ptrdiff_t>(json["rows"].size()) + 1, std::count(csv.out.begin(), csv.out.end(), '\n'));
}

TEST(TableCommand, WritesEveryRunAsADatabase) {
    const test::TemporaryFolder folder;
    const std::string file = (folder.path() / "runs.db").string();
    EXPECT_EQ(test::run_successfully("table " + published + " --sqlite " + file).out, "");
    const std::string bytes = test::read_file(file);
    EXPECT_TRUE(bytes.starts_with("SQLite format 3")) << bytes.substr(0, 20);
    const auto json = test::json_of("table " + published + "/records.jsonl.gz --json --sqlite " + file);
    EXPECT_EQ(json["file"], file);
    const std::string records = test::unpacked(published + "/records.jsonl.gz");
    EXPECT_EQ(json["runs"], std::count(records.begin(), records.end(), '\n'));
    EXPECT_EQ(test::read_file(file), bytes) << "the same records, the same bytes";
    for (const std::string choice : {" --columns scene", " --where scene=i2t_poke", " --sort scene", " --format csv"}) {
        test::expect_refused("table " + published + " --sqlite " + file + choice,
                             choice.substr(1, choice.find(' ', 1) - 1));
    }
    test::expect_refused("table " + published + " --sqlite " + folder.path().string(), "got a folder");
    test::expect_refused("table " + published + " --sqlite " + file + "/runs.db", "Not a directory");
    for (const std::string shell : {"bash", "zsh", "fish", "man"}) {
        EXPECT_NE(test::run_successfully("completion " + shell).out.find("sqlite"), std::string::npos) << shell;
    }
}

TEST(TableCommand, BadWordsAreOneLineAndStatus2) {
    for (const std::string words : {" --columns residual_maxm", " --where scene=i2t_pok", " --format pdf"}) {
        test::expect_refused("table " + published + words);
    }
    EXPECT_EQ(test::run_program("table nowhere").status, 2);
}

}  // namespace
}  // namespace trocar
