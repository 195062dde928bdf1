#include "report/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace trocar {
namespace {

/// Calls plain(text) and code(text) for the parts outside and inside of `…`.
template <typename Plain, typename Code>
std::string inline_parts(const std::string& text, Plain plain, Code code) {
    std::string result;
    std::size_t from = 0;
    bool in_code = false;
    while (true) {
        const std::size_t tick = text.find('`', from);
        const std::string part = text.substr(from, tick == std::string::npos ? tick : tick - from);
        result += in_code ? code(part) : plain(part);
        if (tick == std::string::npos) return result;
        in_code = !in_code;
        from = tick + 1;
    }
}

std::string replace_each(const std::string& text,
                         const std::vector<std::pair<std::string_view, std::string_view>>& by) {
    std::string result;
    for (std::size_t i = 0; i < text.size();) {
        const auto hit = std::find_if(by.begin(), by.end(), [&text, i](const auto& entry) {
            return text.compare(i, entry.first.size(), entry.first) == 0;
        });
        if (hit == by.end()) {
            result += text[i++];
        } else {
            result += hit->second;
            i += hit->first.size();
        }
    }
    return result;
}

std::string html_inline(const std::string& text) {
    return inline_parts(text, escape_xml,
                        [](const std::string& code) { return "<code>" + escape_xml(code) + "</code>"; });
}

std::string markdown_cell(const std::string& text) { return replace_each(text, {{"|", "\\|"}, {"\n", " "}}); }

std::string anchor(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
            result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        } else if (!result.empty() && result.back() != '-') {
            result += '-';
        }
    }
    return result;
}

struct Markdown {
    std::string out;
    void operator()(const Heading& heading) {
        out += std::string(static_cast<std::size_t>(heading.level), '#') + " " + heading.text + "\n\n";
    }
    void operator()(const Paragraph& paragraph) {
        switch (paragraph.style) {
            case Paragraph::Style::quote:
                out += "> " + paragraph.text;
                break;
            case Paragraph::Style::small:
                out += "<sub>" + paragraph.text + "</sub>";
                break;
            case Paragraph::Style::warning:
                out += "> **Note.** " + paragraph.text;
                break;
            case Paragraph::Style::normal:
                out += paragraph.text;
                break;
        }
        out += "\n\n";
    }
    void operator()(const CodeBlock& code) { out += "```\n" + code.text + "\n```\n\n"; }
    void operator()(const Table& table) {
        if (!table.caption.empty()) out += "**" + table.caption + "**\n\n";
        for (const Column& column : table.columns) out += "| " + markdown_cell(column.header) + " ";
        out += "|\n";
        for (const Column& column : table.columns) out += column.number ? "|---:" : "|---";
        out += "|\n";
        for (const TableRow& row : table.rows) {
            for (const std::string& cell : row.cells) out += "| " + markdown_cell(cell) + " ";
            out += "|\n";
        }
        out += "\n";
        if (!table.note.empty()) out += "<sub>" + table.note + "</sub>\n\n";
    }
    void operator()(const Figure& figure) {
        out += fmt::format("![{}]({})\n\n<sub>{}</sub>\n\n", replace_each(figure.caption, {{"`", ""}}), figure.file,
                           figure.caption);
    }
};

constexpr const char* html_style = R"(
:root { --ink: #1b2027; --soft: #5c6672; --line: #d8dde3; --band: #f5f7f9; --own: #0b5cad; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1760px; padding: 28px 24px 64px; color: var(--ink); background: #fff;
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", "Noto Sans", "DejaVu Sans", Arial, sans-serif; }
h1 { font-size: 26px; line-height: 1.25; margin: 0 0 8px; }
h2 { font-size: 20px; margin: 40px 0 10px; padding-top: 10px; border-top: 2px solid var(--ink); }
h3 { font-size: 16px; margin: 24px 0 6px; }
p { margin: 8px 0; max-width: 90ch; }
code { font: 0.92em "SF Mono", "DejaVu Sans Mono", Menlo, Consolas, monospace; }
pre { background: var(--band); border: 1px solid var(--line); border-radius: 4px; padding: 10px 14px; overflow-x: auto; }
blockquote { margin: 14px 0; max-width: 1400px; padding: 10px 18px; border-left: 4px solid var(--own); background: #f1f6fb; font-size: 17px; }
blockquote p { max-width: none; margin: 0; }
.warning { border-left: 4px solid #b3541e; background: #fdf4ee; padding: 8px 14px; max-width: none; }
.small, .note { color: var(--soft); font-size: 13px; max-width: 120ch; }
.scroll { overflow-x: auto; margin: 10px 0 4px; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; width: 100%; }
caption { text-align: left; font-weight: 600; font-size: 14px; padding: 4px 0 6px; }
thead th { border-top: 2px solid var(--ink); border-bottom: 1px solid var(--ink); text-align: left; vertical-align: bottom;
  padding: 5px 8px 5px 4px; font-weight: 600; line-height: 1.3; }
tbody td { padding: 4px 8px 4px 4px; border-bottom: 1px solid var(--line); vertical-align: top; }
tbody tr:last-child td { border-bottom: 2px solid var(--ink); }
th.number, td.number { text-align: right; padding-right: 6px; }
td.number { white-space: nowrap; }
th.wide { width: 32%; }
.range { display: block; color: var(--soft); font-size: 11.5px; }
tr.dominated .range { color: inherit; }
tr.own td:first-child, tr.own td:nth-child(2), tr.own td:nth-child(3) { color: var(--own); font-weight: 600; }
tr.dominated td { color: #8b939c; }
tr.failed td { color: #a32020; }
details { margin: 10px 0; } summary { cursor: pointer; font-weight: 600; font-size: 14px; }
figure { margin: 16px 0; max-width: 1180px; } figure svg { width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: 13px; max-width: 120ch; }
nav { columns: 2; font-size: 13.5px; margin: 14px 0 0; } nav a { color: var(--own); text-decoration: none; display: block; }
@media print {
  body { max-width: none; padding: 0; font-size: 9.5pt; } h2 { break-after: avoid; } table { font-size: 7.5pt; }
  tr, figure, blockquote { break-inside: avoid; } thead { display: table-header-group; } .scroll { overflow: visible; }
  td.number { white-space: normal; } nav { display: none; } @page { size: A4 landscape; margin: 12mm; }
}
)";

/// An interval goes under its value, so that wide tables stay on the page.
std::string with_range(const std::string& cell) {
    const std::size_t open = cell.find(" [");
    const std::size_t close = cell.find(']', open == std::string::npos ? 0 : open);
    if (open == std::string::npos || close == std::string::npos) return cell;
    return cell.substr(0, open) + "<span class=\"range\">" + cell.substr(open + 1, close - open) + "</span>" +
           cell.substr(close + 1);
}

struct Html {
    std::string out;
    void operator()(const Heading& heading) {
        out += fmt::format("<h{0} id=\"{1}\">{2}</h{0}>\n", heading.level, anchor(heading.text),
                           html_inline(heading.text));
    }
    void operator()(const Paragraph& paragraph) {
        const std::string text = html_inline(paragraph.text);
        switch (paragraph.style) {
            case Paragraph::Style::quote:
                out += "<blockquote><p>" + text + "</p></blockquote>\n";
                break;
            case Paragraph::Style::small:
                out += "<p class=\"small\">" + text + "</p>\n";
                break;
            case Paragraph::Style::warning:
                out += "<p class=\"warning\">" + text + "</p>\n";
                break;
            case Paragraph::Style::normal:
                out += "<p>" + text + "</p>\n";
                break;
        }
    }
    void operator()(const CodeBlock& code) { out += "<pre><code>" + escape_xml(code.text) + "</code></pre>\n"; }
    void operator()(const Table& table) {
        if (table.folded) {
            out += fmt::format("<details><summary>{} ({} rows)</summary>\n", html_inline(table.caption),
                               table.rows.size());
        }
        out += "<div class=\"scroll\"><table>\n";
        if (!table.folded && !table.caption.empty()) out += "<caption>" + html_inline(table.caption) + "</caption>\n";
        out += "<thead><tr>";
        for (const Column& column : table.columns) {
            const char* const kind = column.number ? " class=\"number\"" : column.wide ? " class=\"wide\"" : "";
            out += fmt::format("<th{}>{}</th>", kind, html_inline(column.header));
        }
        out += "</tr></thead>\n<tbody>\n";
        for (const TableRow& row : table.rows) {
            static constexpr std::array<const char*, 4> classes{"", " class=\"own\"", " class=\"dominated\"",
                                                                " class=\"failed\""};
            out += fmt::format("<tr{}>", classes.at(static_cast<std::size_t>(row.style)));
            for (std::size_t i = 0; i < row.cells.size(); ++i) {
                const bool number = i < table.columns.size() && table.columns[i].number;
                const std::string cell = html_inline(row.cells[i]);
                out +=
                    fmt::format("<td{}>{}</td>", number ? " class=\"number\"" : "", number ? with_range(cell) : cell);
            }
            out += "</tr>\n";
        }
        out += "</tbody></table></div>\n";
        if (!table.note.empty()) out += "<p class=\"note\">" + html_inline(table.note) + "</p>\n";
        if (table.folded) out += "</details>\n";
    }
    void operator()(const Figure& figure) {
        out += "<figure>\n" + figure.svg + "<figcaption>" + html_inline(figure.caption) + "</figcaption></figure>\n";
    }
};

}  // namespace

std::string to_markdown(const Document& document) {
    Markdown writer{.out = "# " + document.title + "\n\n"};
    for (const Block& block : document.blocks) std::visit(writer, block);
    while (writer.out.ends_with("\n\n")) writer.out.pop_back();
    return writer.out;
}

std::string to_html(const Document& document) {
    Html writer;
    bool contents_done = false;
    for (const Block& block : document.blocks) {
        const auto* heading = std::get_if<Heading>(&block);
        if (heading != nullptr && heading->level == 2 && !contents_done) {
            contents_done = true;
            writer.out += "<nav>\n";
            for (const Block& other : document.blocks) {
                const auto* entry = std::get_if<Heading>(&other);
                if (entry == nullptr || entry->level != 2) continue;
                writer.out += fmt::format("<a href=\"#{}\">{}</a>\n", anchor(entry->text), html_inline(entry->text));
            }
            writer.out += "</nav>\n";
        }
        std::visit(writer, block);
    }
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
        "content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n"
        "<h1>{}</h1>\n{}</body>\n</html>\n",
        escape_xml(document.title), html_style, html_inline(document.title), writer.out);
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    return "\"" + replace_each(text, {{"\"", "\"\""}}) + "\"";
}

std::string escape_xml(const std::string& text) {
    return replace_each(text, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}, {"'", "&#39;"}});
}

std::string format_number(double value) {
    if (std::isnan(value)) return "n/a";
    if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
    if (value == 0.0) return "0";
    const double magnitude = std::abs(value);
    if (magnitude < 1e-4 || magnitude >= 1e9) return fmt::format("{:.2e}", value);
    const int exponent = static_cast<int>(std::floor(std::log10(magnitude)));
    std::string text = fmt::format("{:.{}f}", value, std::max(0, 2 - exponent));
    return text;
}

std::string format_exact(double value) {
    if (std::isnan(value)) return {};
    return fmt::format("{}", value);
}

}  // namespace trocar
