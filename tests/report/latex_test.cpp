#include "report/latex.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <variant>

#include "report/report.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

bool has_latex() { return std::system("pdflatex --version >/dev/null 2>&1") == 0; }
constexpr const char* no_latex = "no LaTeX: texlive-latex-base and texlive-latex-recommended are not installed";

/// What pdflatex says of these table files, each read by \input in a two-column article; fails when it stops on an
/// error.
std::string log_of(const std::map<std::string, std::string>& tables, const std::string& font_size = "10pt") {
    const test::TemporaryFolder folder;
    std::string body;
    for (const auto& [name, content] : tables) {
        std::filesystem::create_directories((folder.path() / name).parent_path());
        std::ofstream(folder.path() / name) << content;
        body += "\\input{" + name + "}\n\n";
    }
    std::ofstream(folder.path() / "paper.tex")
        << "\\documentclass[twocolumn," << font_size << "]{article}\n\\usepackage{" << latex_table_packages
        << "}\n\\begin{document}\n"
        << body << "\\end{document}\n";
    const std::string command =
        "cd " + folder.path().string() + " && pdflatex -interaction=nonstopmode paper.tex >out 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << test::read_file(folder.path() / "out").substr(0, 4000);
    return test::read_file(folder.path() / "paper.log");
}

/// Every table of a report as a file of its own.
std::map<std::string, std::string> tables_of(const Document& document) {
    std::map<std::string, std::string> files;
    for (const Block& block : document.blocks) {
        const auto* table = std::get_if<Table>(&block);
        if (table != nullptr) files[fmt::format("table_{}.tex", files.size())] = latex_table(*table);
    }
    return files;
}

int times_in(const std::string& text, const std::string& part) {
    int times = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++times;
    return times;
}

/// Too wide for the column, or too high for the page.
int overfull_boxes(const std::string& log) { return times_in(log, "Overfull"); }

TEST(LatexTables, AnOverfullBoxWouldBeSeen) {
    if (!has_latex()) GTEST_SKIP() << no_latex;
    EXPECT_EQ(overfull_boxes(log_of({{"wide.tex", "\\noindent\\rule{300pt}{1pt}\n"}})), 1);
    EXPECT_EQ(overfull_boxes(log_of({{"high.tex", "\\noindent\\rule{1pt}{800pt}\n"}})), 1);
}

TEST(LatexTables, NoneOfThePublishedReportsIsTooWide) {
    if (!has_latex()) GTEST_SKIP() << no_latex;
    const std::filesystem::path published = std::filesystem::path(TROCAR_SOURCE_DIR) / "reports";
    for (const char* study : {"steppers", "hard_cases"}) {
        const std::map<std::string, std::string> tables =
            tables_of(make_report(read_records(published / study)).document);
        ASSERT_GT(tables.size(), 5U) << study;
        EXPECT_EQ(overfull_boxes(log_of(tables)), 0) << study;
    }
}

TEST(LatexTables, NoWordsAndNoNumberOfColumnsMakeThemTooWide) {
    if (!has_latex()) GTEST_SKIP() << no_latex;
    std::mt19937 random(7);
    const auto pick = [&random](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
    const std::string letters = "abcdefgWMilt0123456789_:=,%&#$^~<>|\\{}\"/-.()[]";
    std::map<std::string, std::string> tables;
    for (int round = 0; round < 60; ++round) {
        Table table{
            .caption = "t", .columns = {}, .rows = {}, .note = "a note with `a_very_long_piece_of_code_inside`"};
        const int columns = pick(1, 16);
        const auto words = [&] {
            std::string text;
            for (int word = pick(0, 4); word >= 0; --word) {
                std::string one;
                for (int i = pick(1, 40); i > 0; --i)
                    one += letters[static_cast<std::size_t>(pick(0, static_cast<int>(letters.size()) - 1))];
                text += (text.empty() ? "" : " ") + (pick(0, 2) == 0 ? "`" + one + "`" : one);
            }
            return text;
        };
        for (int c = 0; c < columns; ++c) table.columns.push_back({.header = words(), .number = pick(0, 1) == 1});
        for (int r = pick(0, 4); r > 0; --r) {
            TableRow row;
            for (int c = 0; c < columns; ++c) row.cells.push_back(words());
            table.rows.push_back(row);
        }
        tables["table_" + std::to_string(round) + ".tex"] = latex_table(table);
    }
    EXPECT_EQ(overfull_boxes(log_of(tables)), 0);
}

TEST(LatexTables, WideOnesRepeatTheirFirstColumnAndLongOnesTheirHead) {
    Table table{.caption = "Many columns", .columns = {{"method", false}}, .rows = {}, .note = ""};
    for (int c = 0; c < 14; ++c) table.columns.push_back({"figure (mm)", true});
    TableRow row{.cells = {"unilateral"}};
    for (int c = 0; c < 14; ++c) row.cells.push_back("12.345");
    table.rows.assign(100, row);
    const std::string text = latex_table(table);
    const auto count = [&text](const std::string& what) { return times_in(text, what); };
    EXPECT_GT(count("unilateral &"), 100) << "more than one panel";
    EXPECT_EQ(count("unilateral &") % 100, 0) << "every row in every panel";
    EXPECT_EQ(count("12.345"), 1400) << "every number once";
    EXPECT_EQ(count("\\begin{tabular}"), count("method &")) << "a head for every piece";
    EXPECT_GT(count("\\begin{tabular}"), count("unilateral &") / 100) << "pages may break";
}

TEST(LatexTables, APieceEndsWhereItsLinesFillAPage) {
    // A page of a 10 pt article has 550 pt, which are 57 lines of 9.5 pt; forty of them should be made use of.
    const auto expect_pieces = [](const std::string& cell, int lines) {
        Table table{.caption = "t", .columns = {{"word", false}}, .rows = {}, .note = ""};
        table.rows.assign(120, TableRow{.cells = {cell}});
        const int pieces = times_in(latex_table(table), "\\toprule");
        EXPECT_GE(57 * pieces, 120 * lines) << cell;
        EXPECT_LE(40 * (pieces - 1), 120 * lines) << cell;
    };
    // Ten letters are some 48 pt, and a column of text takes a third of the 229 pt of the line at most.
    expect_pieces("nnnnnnnnnn", 1);
    expect_pieces("nnnnnnnnnn nnnnnnnnnn", 2);
    expect_pieces("nnnnnnnnnn nnnnnnnnnn nnnnnnnnnn", 3);
}

TEST(LatexTables, AColumnIsAsWideAsItsLongestWord) {
    // A word of sixty letters cannot break: nine such columns do not fit side by side, nine short ones do.
    const auto panels = [](const std::string& word) {
        Table table{.caption = "t", .columns = {{"key", false}}, .rows = {{.cells = {"row"}}}, .note = ""};
        for (int c = 0; c < 9; ++c) {
            table.columns.push_back({"c", false});
            table.rows[0].cells.push_back(word);
        }
        return times_in(latex_table(table), "\\begin{tabular}");
    };
    EXPECT_EQ(panels("n"), 1);
    EXPECT_GE(panels(std::string(60, 'n')), 5) << "at most two of 288 pt stand on a line of 229 pt";
}

TEST(LatexTables, SignsGetTheRoomThatComputerModernGivesThem) {
    // Of cmsy8: 14 units of 17/36 pt for relations and operations, 18 for arrows and infinity (its parameter file).
    constexpr double line = 229.0;  // pt, what latex_table sets for
    constexpr double unit = 17.0 / 36.0;
    const auto room_of = [](const std::string& cell) {
        Table table{.caption = "t", .columns = {{"", false}}, .rows = {}, .note = ""};
        table.rows.push_back({.cells = {cell}});
        const std::string text = latex_table(table);
        const std::size_t place = text.find("}p{");
        return place == std::string::npos ? std::nan("") : line * std::stod(text.substr(place + 3));
    };
    const auto expect_room = [&](const char* sign, double units) {
        constexpr int count = 8;
        std::string cell;
        for (int i = 0; i < count; ++i) cell += sign;
        constexpr double rounding = 0.05;  // pt, shares of the line have four digits
        EXPECT_GE(room_of(cell), count * units * unit - rounding) << sign << " does not fit";
        EXPECT_LE(room_of(cell), count * (units * unit + 0.1) + rounding) << sign << ": rounded up to a tenth";
    };
    for (const char* sign : {"≤", "≥", "≈", "≠", "×", "÷", "±", "−"}) expect_room(sign, 14.0);
    for (const char* sign : {"→", "↔", "∞"}) expect_room(sign, 18.0);
}

TEST(LatexTables, EscapesWhatLatexReadsAsCommands) {
    test::expect_holds(
        latex_table(
            {.caption = "", .columns = {{"Part & parcel", false}}, .rows = {{{"50 % of `x_1` <b>"}}}, .note = ""}),
        {"50 \\% of \\texttt{x\\_\\allowbreak{}1} \\textless{}b\\textgreater{}", "Part \\& parcel"});
}

}  // namespace
}  // namespace trocar
