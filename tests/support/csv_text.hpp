// A reader of CSV as RFC 4180 has it, written for tests and without any code of src/report.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace trocar::test {

/// Rows of fields, the header first. Throws std::runtime_error for quotes out of place and for rows of unequal length.
inline std::vector<std::vector<std::string>> csv_rows(const std::string& text) {
    std::vector<std::vector<std::string>> rows;
    std::vector<std::string> row(1);
    bool quoted = false;
    bool was_quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char letter = text[i];
        if (quoted) {
            if (letter != '"') {
                row.back() += letter;
            } else if (i + 1 < text.size() && text[i + 1] == '"') {
                row.back() += text[++i];
            } else {
                quoted = false;
                was_quoted = true;
            }
        } else if (letter == '"') {
            if (!row.back().empty() || was_quoted) throw std::runtime_error("a quote inside a field");
            quoted = true;
        } else if (letter == ',' || letter == '\n') {
            was_quoted = false;
            if (letter == ',') {
                row.emplace_back();
                continue;
            }
            if (!rows.empty() && row.size() != rows.front().size()) throw std::runtime_error("a row of another length");
            rows.push_back(row);
            row.assign(1, "");
        } else {
            if (was_quoted) throw std::runtime_error("text behind a quoted field");
            row.back() += letter;
        }
    }
    if (quoted || row.size() != 1 || !row[0].empty()) throw std::runtime_error("the last row has no end");
    return rows;
}

}  // namespace trocar::test
