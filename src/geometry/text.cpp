#include "geometry/text.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

namespace trocar {
namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (const char letter : a) {
        std::size_t before = row[0]++;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t change = before + (letter == b[j] ? 0 : 1);
            before = row[j + 1];
            row[j + 1] = std::min({change, row[j] + 1, before + 1});
        }
    }
    return row.back();
}

}  // namespace

std::string escape_xml(std::string_view text) {
    std::string safe;
    for (const char letter : text) {
        switch (letter) {
            case '&':
                safe += "&amp;";
                break;
            case '<':
                safe += "&lt;";
                break;
            case '>':
                safe += "&gt;";
                break;
            case '"':
                safe += "&quot;";
                break;
            case '\'':
                safe += "&#39;";
                break;
            default:
                safe += letter;
        }
    }
    return safe;
}

std::string shell_word(std::string_view text) {
    std::string word = "'";
    for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return word + "'";
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            three = three << 8U | (k < there ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        }
        for (std::size_t k = 0; k < 4; ++k) text += k <= there ? digits[three >> (18U - 6U * k) & 63U] : '=';
    }
    return text;
}

std::vector<std::string> near_names(const std::string& word, const std::vector<std::string>& names, std::size_t most,
                                    double part) {
    std::vector<std::pair<std::size_t, std::string>> found;
    for (const std::string& name : names) {
        constexpr std::size_t shortest_part = 3;
        const bool holds = word.size() >= shortest_part && name.find(word) != std::string::npos;
        const std::size_t away = holds ? 0 : edit_distance(word, name);
        const double allowed = std::max(2.0, part * static_cast<double>(std::max(word.size(), name.size())));
        if (static_cast<double>(away) <= allowed) found.emplace_back(away, name);
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::string> near;
    for (std::size_t i = 0; i < std::min(most, found.size()); ++i) near.push_back(std::move(found[i].second));
    return near;
}

}  // namespace trocar
