// A report as data: headings, paragraphs, tables and figures in order. The same document is written as Markdown and
// HTML, so that no two of them can report different numbers.
#pragma once

#include <string>
#include <variant>
#include <vector>

namespace trocar {

/// Inline text everywhere below: plain UTF-8 in which `…` marks code.
struct Heading {
    int level = 1;
    std::string text;
};

struct Paragraph {
    enum class Style { normal, quote, small, warning };
    std::string text;
    Style style = Style::normal;
};

struct CodeBlock {
    std::string text;
};

/// One column; numbers are aligned to the right.
struct Column {
    std::string header;  ///< with the unit: "tick p50 (µs)"
    bool number = false;
    bool wide = false;      ///< text that should not be broken as long as there is room
    std::string help = {};  ///< what the header means, shown when it is touched; empty: it says so itself
};

struct TableRow {
    enum class Style { normal, own, dominated, failed };
    std::vector<std::string> cells;
    Style style = Style::normal;
    std::string command = {};  ///< what makes the row's numbers again, to be copied; empty: Document::command
};

struct Table {
    std::string caption;
    std::vector<Column> columns;
    std::vector<TableRow> rows;
    std::string note;     ///< small print under the table
    bool folded = false;  ///< long: HTML shows it on demand
};

struct Figure {
    std::string file;  ///< "charts/name.svg", relative to the report
    std::string svg;   ///< the whole drawing
    std::string caption;
    /// The same for window.trocarCharts.draw (src/web/README.md), JSON; empty: the drawing alone.
    std::string chart = {};
};

using Block = std::variant<Heading, Paragraph, CodeBlock, Table, Figure>;

struct Document {
    std::string title;
    std::vector<Block> blocks;
    std::size_t page_one = 0;    ///< this many blocks are page 1; 0: there is no other page
    std::string command = {};    ///< makes the numbers of any row again; empty: not known
    std::string charts_js = {};  ///< where the script that draws Figure::chart lies, relative to the page; empty: none
};

std::string to_markdown(const Document& document);
/// Page 1, and links into `rest`, the file that holds the other pages.
std::string page_one_to_markdown(const Document& document, const std::string& rest);
/// One file whose styles and drawings are inside: contents at the side, tables that sort and filter. Only charts that
/// answer to the pointer need charts_js beside it; without it, and on paper, the drawings stand.
std::string to_html(const Document& document);

/// RFC 4180: quotes where needed.
std::string csv_field(const std::string& text);
/// The five XML entities.
std::string escape_xml(const std::string& text);

/// Three significant digits without exponent where a person would not use one; "n/a" for NaN, "inf" for infinity,
/// "0" only for exactly zero.
std::string format_number(double value);
/// All digits of a double that matter (shortest text that reads back as the same number); empty for NaN.
std::string format_exact(double value);
/// To so many significant digits; for any double, the smallest too.
double rounded(double value, int digits);

}  // namespace trocar
