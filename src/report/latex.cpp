#include "report/latex.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <vector>

namespace trocar {
namespace {

// Widths in pt at \footnotesize of a 10 pt paper (Computer Modern 8 pt), rounded up.
constexpr double column_width = 229.0;
constexpr double between_columns = 5.0;
constexpr int most_letters_together = 18;
constexpr int most_lines = 46;  ///< of a tabular: less than a page has

struct Letter {
    std::string_view text;
    std::string_view tex;
    double width;
    bool breaks = false;  ///< a line may end after it
};

/// What LaTeX would take as a command or not know.
constexpr std::array special{Letter{"\\", "\\textbackslash{}", 4.3},
                             Letter{"&", "\\&", 6.7},
                             Letter{"%", "\\%", 7.2},
                             Letter{"$", "\\$", 4.3},
                             Letter{"#", "\\#", 7.2},
                             Letter{"_", "\\_", 4.3, true},
                             Letter{"{", "\\{", 4.3},
                             Letter{"}", "\\}", 4.3},
                             Letter{"~", "\\textasciitilde{}", 4.3},
                             Letter{"^", "\\textasciicircum{}", 4.3},
                             Letter{"<", "\\textless{}", 6.7},
                             Letter{">", "\\textgreater{}", 6.7},
                             Letter{"|", "\\textbar{}", 4.3},
                             Letter{"\"", "\\char34{}", 4.3},
                             Letter{"/", "/", 4.3, true},
                             Letter{":", ":", 4.3, true},
                             Letter{",", ",", 4.3, true},
                             Letter{"=", "=", 6.7, true},
                             Letter{"µ", "\\textmu{}", 4.9},
                             Letter{"×", "$\\times$", 6.7},
                             Letter{"÷", "$\\div$", 6.7},
                             Letter{"±", "$\\pm$", 6.7},
                             Letter{"≈", "$\\approx$", 6.7},
                             Letter{"≤", "$\\le$", 6.7},
                             Letter{"≥", "$\\ge$", 6.7},
                             Letter{"≠", "$\\ne$", 6.7},
                             Letter{"−", "$-$", 6.7},
                             Letter{"→", "$\\rightarrow$", 8.6},
                             Letter{"↔", "$\\leftrightarrow$", 8.6},
                             Letter{"∞", "$\\infty$", 8.6},
                             Letter{"†", "\\dag{}", 4.0},
                             Letter{"§", "\\S{}", 4.3},
                             Letter{"–", "--", 4.3, true},
                             Letter{"—", "---", 8.6, true},
                             Letter{"…", "\\dots{}", 10.0},
                             Letter{"·", "\\textperiodcentered{}", 2.6},
                             Letter{"°", "\\textdegree{}", 6.4},
                             Letter{"²", "\\textsuperscript{2}", 3.6},
                             Letter{"³", "\\textsuperscript{3}", 3.6},
                             Letter{"⁶", "\\textsuperscript{6}", 3.6},
                             Letter{"“", "``", 4.3},
                             Letter{"”", "''", 4.3}};

/// Bytes of the UTF-8 letter that begins here.
std::size_t letter_size(unsigned char first) { return first < 0xC0U ? 1 : first < 0xE0U ? 2 : first < 0xF0U ? 3 : 4; }

double plain_width(char letter) {
    if (std::string_view("mwMW").find(letter) != std::string_view::npos) return letter == 'W' ? 8.8 : 7.9;
    if (std::isupper(static_cast<unsigned char>(letter)) != 0) return 6.6;
    return std::string_view("ijl.;!()[]'").find(letter) != std::string_view::npos ? 3.4 : 4.8;
}

/// Inline text as LaTeX, and how wide it is.
struct Set {
    std::string tex;
    double width = 0.0;        ///< on one line
    double longest_run = 0.0;  ///< the widest piece that cannot be broken

    /// Lines that it takes where a line is so wide, pt.
    [[nodiscard]] int lines_in(double line) const {
        int lines = 1;
        double filled = 0.0;
        for (const Run& run : runs_) {
            const double blank = run.after_blank && filled > 0.0 ? blank_width : 0.0;
            if (filled > 0.0 && filled + blank + run.width > line) {
                ++lines;
                filled = run.width;
            } else {
                filled += blank + run.width;
            }
        }
        return lines;
    }

    explicit Set(const std::string& text) {
        bool code = false;
        Run run;
        int together = 0;
        const auto end_run = [&](bool at_blank) {
            longest_run = std::max(longest_run, run.width);
            if (run.width > 0.0) runs_.push_back(run);
            run = {.after_blank = at_blank};
            together = 0;
        };
        for (std::size_t at = 0; at < text.size();) {
            if (text[at] == '`') {
                tex += code ? "}" : "\\texttt{";
                code = !code;
                ++at;
                continue;
            }
            if (text[at] == ' ' || text[at] == '\n') {
                tex += ' ';
                width += blank_width;
                end_run(true);
                ++at;
                continue;
            }
            const Letter letter = letter_at(text, at, code);
            if (together >= most_letters_together) {
                tex += "\\allowbreak{}";
                end_run(false);
            }
            tex += letter.tex;
            run.width += letter.width;
            width += letter.width;
            ++together;
            at += letter.text.size();
            if (letter.breaks && at < text.size() && text[at] != ' ') {
                tex += "\\allowbreak{}";
                end_run(false);
            }
        }
        if (code) tex += "}";
        end_run(false);
    }

private:
    /// A piece that is not broken.
    struct Run {
        double width = 0.0;
        bool after_blank = false;
    };
    static constexpr double blank_width = 2.9;
    std::vector<Run> runs_;

    static Letter letter_at(const std::string& text, std::size_t at, bool code) {
        constexpr double typewriter = 4.3;
        for (const Letter& one : special) {
            if (text.compare(at, one.text.size(), one.text) == 0) {
                Letter letter = one;
                if (code) letter.width = std::max(letter.width, typewriter);
                return letter;
            }
        }
        const std::size_t size = letter_size(static_cast<unsigned char>(text[at]));
        const std::string_view itself(text.data() + at, std::min(size, text.size() - at));
        return {itself, itself, code ? typewriter : size > 1 ? 6.0 : plain_width(text[at])};
    }
};

struct ColumnWidth {
    double least;    ///< pt, so that nothing unbreakable sticks out
    double natural;  ///< pt, so that nothing breaks, at most a third of the line for text
};

std::vector<ColumnWidth> widths_of(const Table& table) {
    std::vector<ColumnWidth> widths;
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
        const Set header(table.columns[c].header);
        ColumnWidth width{header.longest_run, header.longest_run};
        for (const TableRow& row : table.rows) {
            if (c >= row.cells.size()) continue;
            const Set cell(row.cells[c]);
            width.least = std::max(width.least, cell.longest_run);
            width.natural = std::max(width.natural, std::min(cell.width, column_width / 3.0));
        }
        width.natural = std::max(width.natural, width.least);
        widths.push_back(width);
    }
    return widths;
}

/// Columns that stand side by side; the first `keys` of all are in every panel.
struct Panel {
    std::vector<std::size_t> columns;
    std::vector<double> width;  ///< pt
};

double least_of(const std::vector<ColumnWidth>& widths, const std::vector<std::size_t>& columns) {
    double sum = 0.0;
    for (const std::size_t c : columns) sum += widths[c].least + between_columns;
    return sum;
}

std::vector<Panel> panels_of(const Table& table, const std::vector<ColumnWidth>& widths) {
    std::vector<std::size_t> keys;
    for (std::size_t c = 0; c < widths.size() && !table.columns[c].number; ++c) {
        keys.push_back(c);
        if (keys.size() > 1 && least_of(widths, keys) > 0.5 * column_width) {
            keys.pop_back();
            break;
        }
    }
    std::vector<Panel> panels{{keys, {}}};
    for (std::size_t c = keys.size(); c < widths.size(); ++c) {
        std::vector<std::size_t>& columns = panels.back().columns;
        columns.push_back(c);
        if (columns.size() > keys.size() + 1 && least_of(widths, columns) > column_width) {
            columns.pop_back();
            panels.push_back({keys, {}});
            panels.back().columns.push_back(c);
        }
    }
    for (Panel& panel : panels) {
        double wanted = 0.0;
        for (const std::size_t c : panel.columns) wanted += widths[c].natural - widths[c].least;
        const double room = column_width - least_of(widths, panel.columns);
        const double share = wanted > 0.0 ? std::clamp(room / wanted, 0.0, 1.0) : 0.0;
        for (const std::size_t c : panel.columns) {
            panel.width.push_back(widths[c].least + share * (widths[c].natural - widths[c].least));
        }
    }
    return panels;
}

struct SetRow {
    std::string text;
    int lines = 1;
};

SetRow set_row(const Panel& panel, const std::vector<std::string>& cells) {
    SetRow row;
    for (std::size_t i = 0; i < panel.columns.size(); ++i) {
        const std::size_t c = panel.columns[i];
        const Set cell(c < cells.size() ? cells[c] : "");
        row.lines = std::max(row.lines, cell.lines_in(panel.width[i]));
        // Behind the end of a row LaTeX would take a bracket or a star as its own.
        const bool taken = i == 0 && (cell.tex.starts_with('[') || cell.tex.starts_with('*'));
        row.text += (i == 0 ? taken ? "{}" : "" : " & ") + cell.tex;
    }
    row.text += " \\\\\n";
    return row;
}

std::string panel_text(const Table& table, const Panel& panel) {
    std::string head = "\\noindent\\begin{tabular}{@{}";
    std::vector<std::string> names;
    for (const Column& column : table.columns) names.push_back(column.header);
    for (std::size_t i = 0; i < panel.columns.size(); ++i) {
        head += fmt::format(">{{{}\\arraybackslash}}p{{{:.4f}\\linewidth}}",
                            table.columns[panel.columns[i]].number ? "\\raggedleft" : "\\raggedright",
                            panel.width[i] / column_width);
    }
    const SetRow header = set_row(panel, names);
    head += "@{}}\n\\toprule\n" + header.text + "\\midrule\n";
    constexpr const char* foot = "\\bottomrule\n\\end{tabular}\\par\\medskip\n";
    std::string text = head;
    int lines = header.lines;
    for (const TableRow& given : table.rows) {
        const SetRow row = set_row(panel, given.cells);
        if (lines + row.lines > most_lines && lines > header.lines) {
            text += foot + head;
            lines = header.lines;
        }
        text += row.text;
        lines += row.lines;
    }
    return text + foot;
}

}  // namespace

std::string latex_table(const Table& table) {
    std::string caption = table.caption;
    std::replace(caption.begin(), caption.end(), '\n', ' ');
    std::string text =
        fmt::format("% {}\n% Read by \\input; wants \\usepackage{{{}}}.\n", caption, latex_table_packages);
    if (table.columns.empty()) return text;
    text += "{\\footnotesize\\setlength{\\tabcolsep}{2.5pt}\n";
    for (const Panel& panel : panels_of(table, widths_of(table))) text += panel_text(table, panel);
    if (!table.note.empty())
        text += "\\noindent\\parbox{\\linewidth}{\\raggedright " + Set(table.note).tex + "}\\par\n";
    return text + "}\n";
}

}  // namespace trocar
