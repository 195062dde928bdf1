#include "report/cell.hpp"

#include <fmt/format.h>

#include <cmath>

namespace trocar {

std::string scaled(double value, double scale, const char* unknown) {
    return std::isnan(value) ? unknown : format_number(value * scale);
}

std::string count_text(double value) { return std::isnan(value) ? unknown_text : fmt::format("{:.0f}", value); }

std::string estimate_text(const Estimate& interval, double scale, const char* unknown) {
    std::string text = scaled(interval.value, scale, unknown);
    if (std::isnan(interval.value) || interval.processes < 2) return text;
    return text + fmt::format(" [{}–{}]", scaled(interval.low, scale), scaled(interval.high, scale));
}

std::string two_text(double first, double second, double scale, const char* unknown) {
    if (std::isnan(first) && std::isnan(second)) return unknown;
    return scaled(first, scale) + " / " + scaled(second, scale);
}

std::string of_text(double part, double whole) {
    return std::isnan(part) || std::isnan(whole) ? unknown_text : count_text(part) + " of " + count_text(whole);
}

std::string share_text(double part, double whole) {
    if (std::isnan(part) || std::isnan(whole) || whole <= 0.0) return unknown_text;
    if (part == whole) return "1";
    const double share = part / whole;
    for (int digits = 3; digits < 9; ++digits) {
        std::string text = fmt::format("{:.{}f}", share, digits);
        if (text.front() != '1') return text;
    }
    return fmt::format("{:.10f}", share);
}

std::string yes_no(bool value) { return value ? "yes" : "no"; }

std::string yes_no(double value, const char* unknown) { return std::isnan(value) ? unknown : yes_no(value > 0.0); }

std::string outcome_text(const Outcome& outcome) {
    std::string text(name_of(outcome.kind));
    if (!outcome.message.empty()) text += " (" + outcome.message + ")";
    return text;
}

void add_cell(Table& table, const Column& column, std::string text) {
    std::vector<std::string>& cells = table.rows.back().cells;
    cells.push_back(std::move(text));
    if (table.columns.size() < cells.size()) table.columns.push_back(column);
}

void add_number(Table& table, std::string header, std::optional<Metric> metric, std::string text) {
    add_cell(table, {std::move(header), true, metric}, std::move(text));
}

TableRow failed_row(std::vector<std::string> cells, const Outcome& outcome, const Table& table) {
    cells.push_back(outcome_text(outcome));
    cells.resize(table.columns.size());
    return {.cells = std::move(cells), .style = TableRow::Style::failed};
}

std::string undecided_text(double samples) {
    return samples > 0.0 ? fmt::format(" ({:.0f} undecided)", samples) : std::string();
}

std::string code(const std::string& text) { return text.empty() ? std::string() : "`" + text + "`"; }

std::string joined(const std::vector<std::string>& items, const char* separator) {
    return fmt::format("{}", fmt::join(items, separator));
}

std::string joined_code(const std::vector<std::string>& names, const char* separator) {
    std::vector<std::string> codes;
    codes.reserve(names.size());
    for (const std::string& name : names) codes.push_back(code(name));
    return joined(codes, separator);
}

std::string response_name(const Method& method) {
    return code(method.response) + " (" + method.contacts + ")" + by_stepper(code(method.stepper));
}

std::string method_name(const std::string& text) { return text.substr(0, text.find(':')); }

}  // namespace trocar
