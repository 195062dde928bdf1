#include "report/document.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/text.hpp"

namespace trocar {
namespace {

TEST(FormatNumber, KeepsThreeDigitsAndDistinguishesZeroFromUnknown) {
    EXPECT_EQ(format_number(0.0), "0");
    EXPECT_EQ(format_number(std::numeric_limits<double>::quiet_NaN()), "n/a");
    EXPECT_EQ(format_number(std::numeric_limits<double>::infinity()), "∞");
    EXPECT_EQ(format_number(1.23456), "1.23");
    EXPECT_EQ(format_number(-12.3456), "-12.3");
    EXPECT_EQ(format_number(123456.7), "123457");
    EXPECT_EQ(format_number(0.000123456), "0.000123");
    EXPECT_EQ(format_number(1.5e-7), "1.50e-07");
}

TEST(FormatExact, ReadsBackAsTheSameNumber) {
    for (const double value : {0.1, 1.0 / 3.0, 6.02214076e23, -5e-324}) {
        EXPECT_EQ(std::stold(format_exact(value)) == static_cast<long double>(value) ||
                      std::strtod(format_exact(value).c_str(), nullptr) == value,
                  true);
    }
    EXPECT_EQ(format_exact(std::numeric_limits<double>::quiet_NaN()), "");
}

TEST(Html, ContentsNameThePartsAndNotWhatIsWithinThem) {
    Document document{.title = "t", .blocks = {}};
    document.blocks.emplace_back(Heading{2, "A part"});
    document.blocks.emplace_back(Heading{3, "A detail"});
    const std::string html = to_html(document);
    const std::string contents = html.substr(html.find("<nav"), html.find("</nav>") - html.find("<nav"));
    EXPECT_NE(contents.find(">A part</a>"), std::string::npos);
    EXPECT_EQ(contents.find("A detail"), std::string::npos);
}

Document sample() {
    Document document{.title = "a < b", .blocks = {}};
    document.blocks.emplace_back(Heading{2, "Part & parcel"});
    document.blocks.emplace_back(Paragraph{"50 % of `x_1` <b>", Paragraph::Style::normal});
    document.blocks.emplace_back(Table{.caption = "c",
                                       .columns = {{"name", false}, {"time (µs)", true}},
                                       .rows = {{.cells = {"a|b", "1"}, .style = TableRow::Style::dominated}},
                                       .note = "n"});
    return document;
}

TEST(Markdown, PageOneLinksThePartsBehindItAndNotWhatIsWithinThem) {
    const Document document{.title = "Study",
                            .blocks = {Heading{2, "First"}, Paragraph{"One."}, Heading{2, "Second"},
                                       Heading{3, "Within"}, Paragraph{"Two."}},
                            .page_one = 2};
    const std::string text = page_one_to_markdown(document, "report.html");
    EXPECT_NE(text.find("One."), std::string::npos);
    EXPECT_EQ(text.find("Two."), std::string::npos);
    EXPECT_NE(text.find("[Second](report.html#second)"), std::string::npos) << text;
    EXPECT_EQ(text.find("Within"), std::string::npos) << text;
    EXPECT_EQ(text.find("[First]"), std::string::npos) << text;
}

TEST(Markdown, PipesInCellsDoNotBreakATable) {
    test::expect_holds(to_markdown(sample()), {"| a\\|b | 1 |", "|---|---:|"});
}

TEST(Html, EscapesEverythingThatIsNotMarkup) {
    const std::string text = to_html(sample());
    test::expect_holds(text, {"50 % of <code>x_1</code> &lt;b&gt;", "<h1>a &lt; b</h1>"});
    EXPECT_EQ(text.find("http://"), std::string::npos) << "no part of the page comes from elsewhere";
    EXPECT_EQ(text.find("src="), std::string::npos);
    EXPECT_NE(text.find("<tr class=\"dominated\">"), std::string::npos);
}

TEST(Html, LongNamesBreakInTablesAlone) {
    Document document;
    document.blocks.emplace_back(Paragraph{.text = "`one:first=1,second_of_all_values=2`"});
    document.blocks.emplace_back(
        Table{.caption = "t",
              .columns = {{"`a_b`", false}},
              .rows = {{.cells = {"`one:first=1,second_of_all_values=2` at 12:30"}}, {.cells = {"short_name"}}},
              .note = ""});
    test::expect_holds(to_html(document),
                       {"<p><code>one:first=1,second_of_all_values=2</code></p>", "<th><code>a_<wbr>b</code></th>",
                        "<td><code>one:<wbr>first=1,<wbr>second_<wbr>of_<wbr>all_<wbr>values=<wbr>2</code> at 12:30",
                        "<td>short_name</td>"});
}

TEST(Csv, QuotesFieldsThatNeedIt) {
    EXPECT_EQ(csv_line({"plain", "a,b", "say \"no\"", ""}), "plain,\"a,b\",\"say \"\"no\"\"\",\n");
}

}  // namespace
}  // namespace trocar
