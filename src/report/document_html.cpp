// A document as one page of HTML.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "report/document.hpp"
#include "report/html_parts.hpp"
#include "report/inline_text.hpp"

namespace trocar {
namespace {

std::string help_of(Metric metric) {
    const MetricInfo& info = info_of(metric);
    return fmt::format("{}. Figure {}{}, from: {}", info.meaning, info.name,
                       info.unit == "1" ? std::string() : fmt::format(" in {}", info.unit), text_of(info.source));
}

std::string html_inline(const std::string& text) {
    return inline_parts(text, escape_xml,
                        [](const std::string& code) { return "<code>" + escape_xml(code) + "</code>"; });
}

/// The text of a cell with places where a long name may break: behind "," and ":", and behind "_" and "=" where the
/// name has more than 17 characters or heads a column.
std::string breakable(const std::string& text, bool header) {
    const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
    const auto in_name = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '=';
    };
    std::string out;
    for (auto at = text.begin(); at != text.end();) {
        const auto end = std::find_if_not(at, text.end(), in_name);
        const bool breaks = header || end - at > 17;
        for (; at != end; ++at) {
            out += *at;
            if (breaks && (*at == '_' || *at == '=') && at + 1 != end) out += "<wbr>";
        }
        if (at == text.end()) break;
        out += *at++;
        if ((out.back() == ',' || out.back() == ':') && at != text.end() && letter(*at)) out += "<wbr>";
    }
    return out;
}

std::string html_cell(const std::string& text, bool header) {
    return inline_parts(
        text, [header](const std::string& plain) { return breakable(escape_xml(plain), header); },
        [header](const std::string& code) { return "<code>" + breakable(escape_xml(code), header) + "</code>"; });
}

/// An interval goes under its value, so that wide tables stay on the page.
std::string with_range(const std::string& cell) {
    const std::size_t open = cell.find(" [");
    const std::size_t close = cell.find(']', open == std::string::npos ? 0 : open);
    if (open == std::string::npos || close == std::string::npos) return cell;
    return cell.substr(0, open) + "<span class=\"range\">" + cell.substr(open + 1, close - open) + "</span>" +
           cell.substr(close + 1);
}

struct Html {
    std::string command;
    std::string out;
    void operator()(const Heading& heading) {
        out += fmt::format("<h{0} id=\"{1}\">{2}</h{0}>\n", heading.level, anchor(heading.text),
                           html_inline(heading.text));
    }
    void operator()(const Paragraph& paragraph) {
        static constexpr std::array<std::pair<const char*, const char*>, 4> marks{
            {{"<p>", "</p>\n"},
             {"<blockquote><p>", "</p></blockquote>\n"},
             {"<p class=\"small\">", "</p>\n"},
             {"<p class=\"warning\">", "</p>\n"}}};  // by style
        const auto& [before, behind] = marks.at(static_cast<std::size_t>(paragraph.style));
        out += before + html_inline(paragraph.text) + behind;
    }
    void operator()(const CodeBlock& code) { out += "<pre><code>" + escape_xml(code.text) + "</code></pre>\n"; }
    void operator()(const Table& table) {
        if (table.folded) {
            out += fmt::format("<details><summary>{} ({} rows)</summary>\n", html_inline(table.caption),
                               table.rows.size());
        }
        out += command.empty() ? "<div class=\"scroll\"><table>\n"
                               : "<div class=\"scroll\"><table data-command=\"" + escape_xml(command) + "\">\n";
        if (!table.folded && !table.caption.empty()) out += "<caption>" + html_inline(table.caption) + "</caption>\n";
        out += "<thead><tr>";
        for (const Column& column : table.columns) {
            const char* const kind = column.number ? " class=\"number\"" : column.wide ? " class=\"wide\"" : "";
            const std::string header = html_cell(column.header, true);
            const std::string help = column.metric ? help_of(*column.metric) : column.help;
            out +=
                fmt::format("<th{}>{}</th>", kind,
                            help.empty() ? header : "<abbr title=\"" + escape_xml(help) + "\">" + header + "</abbr>");
        }
        out += "</tr></thead>\n<tbody>\n";
        for (const TableRow& row : table.rows) {
            static constexpr std::array<const char*, 4> classes{"", " class=\"own\"", " class=\"dominated\"",
                                                                " class=\"failed\""};
            out +=
                fmt::format("<tr{}{}>", classes.at(static_cast<std::size_t>(row.style)),
                            row.command.empty() ? std::string() : " data-command=\"" + escape_xml(row.command) + "\"");
            for (std::size_t i = 0; i < row.cells.size(); ++i) {
                const bool number = i < table.columns.size() && table.columns[i].number;
                const std::string cell = html_cell(row.cells[i], false);
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
        out += figure.chart.empty() ? "<figure>\n" : "<figure data-chart=\"" + escape_xml(figure.chart) + "\">\n";
        out += figure.svg + "<figcaption>" + html_inline(figure.caption) + "</figcaption></figure>\n";
    }
};

/// Links to all parts of a document; empty without any.
std::string contents(const Document& document) {
    std::string links;
    for (const Block& block : document.blocks) {
        const auto* entry = std::get_if<Heading>(&block);
        if (entry == nullptr || entry->level != 2) continue;
        links += fmt::format("<a href=\"#{}\">{}</a>\n", anchor(entry->text), html_inline(entry->text));
    }
    if (links.empty()) return {};
    return "<nav aria-label=\"Contents\">\n<a href=\"#top\">" + std::string(document.page_one > 0 ? "Page 1" : "Top") +
           "</a>\n" + links + "</nav>\n";
}

}  // namespace

std::string to_html(const Document& document) {
    Html writer{.command = document.command, .out = {}};
    for (std::size_t i = 0; i < document.blocks.size(); ++i) {
        if (document.page_one > 0 && i == 0) writer.out += "<section class=\"page-one\">\n";
        std::visit(writer, document.blocks[i]);
        if (document.page_one > 0 && i + 1 == document.page_one) writer.out += "</section>\n";
    }
    const std::string filters =
        document.page_filters.empty()
            ? std::string()
            : fmt::format(" data-filters=\"{}\"", escape_xml(fmt::format("{}", fmt::join(document.page_filters, ","))));
    const std::string script = document.charts_js.empty()
                                   ? std::string()
                                   : "<script src=\"" + escape_xml(document.charts_js) + "\"></script>\n";
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
        "content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n"
        "{}<main id=\"top\"{}>\n<h1>{}</h1>\n{}</main>\n{}<script>{}</script>\n</body>\n</html>\n",
        escape_xml(inline_parts(
            document.title, [](const std::string& part) { return part; },
            [](const std::string& part) { return part; })),
        page_style, contents(document), filters, html_inline(document.title), writer.out, script, page_script);
}

}  // namespace trocar
