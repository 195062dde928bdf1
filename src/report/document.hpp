// A report as data: headings, paragraphs, tables and figures. Markdown and HTML are written from the same document.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "geometry/text.hpp"
#include "measure/metric.hpp"

namespace trocar {

/// Texts below are plain UTF-8 in which `…` marks code.
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

/// One column; numbers are right-aligned.
struct Column {
    std::string header;  ///< with the unit: "tick p50 (µs)"
    bool number = false;
    std::optional<Metric> metric = {};  ///< what it prints; its meaning is the tooltip of the header
    std::string help = {};              ///< tooltip of a column that prints no metric; empty: none
    bool wide = false;                  ///< text kept on one line while space allows
};

struct TableRow {
    enum class Style { normal, own, dominated, failed };
    std::vector<std::string> cells = {};
    Style style = Style::normal;
    std::string command = {};  ///< command that reproduces the row; empty: Document::command
};

struct Table {
    std::string caption = {};
    std::vector<Column> columns = {};
    std::vector<TableRow> rows = {};
    std::string note = {};  ///< small print under the table
    bool folded = false;    ///< HTML shows the table collapsed
};

struct Figure {
    std::string file;  ///< "charts/name.svg", relative to the report
    std::string svg;
    std::string caption;
    /// Data for window.trocarCharts.draw (src/web/README.md), JSON; empty: static drawing only.
    std::string chart = {};
};

using Block = std::variant<Heading, Paragraph, CodeBlock, Table, Figure>;

struct Document {
    std::string title;
    std::vector<Block> blocks;
    std::size_t page_one = 0;  ///< number of blocks on page 1, from the start; 0: no other page
    std::string command = {};  ///< command that reproduces any row; empty: unknown
    /// Headers of columns: a select for each at the top of the page shows the rows of all tables with one value.
    std::vector<std::string> page_filters = {};
    std::string charts_js = {};  ///< path of the script for Figure::chart, relative to the page; empty: none
};

std::string to_markdown(const Document& document);
/// Header and rows alone.
std::string to_markdown(const Table& table);
/// Page 1 with links into `rest`, the file of the other pages.
std::string page_one_to_markdown(const Document& document, const std::string& rest);
/// One self-contained file: sidebar contents, sortable and filterable tables, static drawings. Interactive charts need
/// charts_js beside it.
std::string to_html(const Document& document);

/// CSV line with quotes where needed (RFC 4180).
std::string csv_line(const std::vector<std::string>& fields);

/// Three significant digits, with an exponent below 1e-4 and from 1e9 on. "n/a" for NaN, "inf" for infinity, "0" only
/// for exact zero.
std::string format_number(double value);
/// Shortest text that reads back as the same double; empty for NaN.
std::string format_exact(double value);
/// Rounds to `digits` significant digits; valid for subnormal numbers.
double rounded(double value, int digits);

}  // namespace trocar
