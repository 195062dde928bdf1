#include "report/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "report/inline_text.hpp"

namespace trocar {

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

namespace {

std::string markdown_cell(const std::string& text) { return replace_each(text, {{"|", "\\|"}, {"\n", " "}}); }

struct Markdown {
    std::string out;
    void operator()(const Heading& heading) {
        out += std::string(static_cast<std::size_t>(heading.level), '#') + " " + heading.text + "\n\n";
    }
    void operator()(const Paragraph& paragraph) {
        static constexpr std::array<std::pair<const char*, const char*>, 4> marks{
            {{"", ""}, {"> ", ""}, {"<sub>", "</sub>"}, {"> **Note.** ", ""}}};  // by style
        const auto& [before, behind] = marks.at(static_cast<std::size_t>(paragraph.style));
        out += before + paragraph.text + behind + "\n\n";
    }
    void operator()(const CodeBlock& code) { out += "```\n" + code.text + "\n```\n\n"; }
    void operator()(const Table& table) {
        if (!table.caption.empty()) out += "**" + table.caption + "**\n\n";
        out += to_markdown(table) + "\n";
        if (!table.note.empty()) out += "<sub>" + table.note + "</sub>\n\n";
    }
    void operator()(const Figure& figure) {
        out += fmt::format("![{}]({})\n\n<sub>{}</sub>\n\n", replace_each(figure.caption, {{"`", ""}}), figure.file,
                           figure.caption);
    }
};

}  // namespace

std::string to_markdown(const Table& table) {
    std::string out;
    for (const Column& column : table.columns) out += "| " + markdown_cell(column.header) + " ";
    out += "|\n";
    for (const Column& column : table.columns) out += column.number ? "|---:" : "|---";
    out += "|\n";
    for (const TableRow& row : table.rows) {
        for (const std::string& cell : row.cells) out += "| " + markdown_cell(cell) + " ";
        out += "|\n";
    }
    return out;
}

std::string to_markdown(const Document& document) {
    Markdown writer{.out = "# " + document.title + "\n\n"};
    for (const Block& block : document.blocks) std::visit(writer, block);
    while (writer.out.ends_with("\n\n")) writer.out.pop_back();
    return writer.out;
}

std::string page_one_to_markdown(const Document& document, const std::string& rest) {
    Document first{.title = document.title, .blocks = document.blocks};
    const std::size_t most = document.page_one == 0 ? first.blocks.size() : document.page_one;
    first.blocks.erase(first.blocks.begin() + static_cast<std::ptrdiff_t>(most), first.blocks.end());
    std::string text = to_markdown(first);
    std::string links;
    for (std::size_t i = most; i < document.blocks.size(); ++i) {
        const auto* heading = std::get_if<Heading>(&document.blocks[i]);
        if (heading == nullptr || heading->level != 2) continue;
        links += fmt::format("* [{}]({}#{})\n", heading->text, rest, anchor(heading->text));
    }
    if (!links.empty()) text += "\n## Behind this page\n\n" + links;
    return text;
}

std::string csv_line(const std::vector<std::string>& fields) {
    std::string line;
    for (const std::string& field : fields) {
        const bool plain = field.find_first_of(",\"\n\r") == std::string::npos;
        line += plain ? field : "\"" + replace_each(field, {{"\"", "\"\""}}) + "\"";
        line += &field == &fields.back() ? "\n" : ",";
    }
    return line;
}

std::string format_number(double value) {
    if (std::isnan(value)) return "n/a";
    if (std::isinf(value)) return value > 0 ? "∞" : "-∞";
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

// std::stod throws at numbers below 2.2e-308.
double rounded(double value, int digits) { return std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr); }

}  // namespace trocar
