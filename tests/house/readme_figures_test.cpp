// The figures on the first screen of README are those of the published default study.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string>
#include <vector>

#include "support/program.hpp"

namespace trocar {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string trimmed(const std::string& text) {
    const std::size_t first = text.find_first_not_of(' ');
    return first == std::string::npos ? std::string() : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// Rows of Markdown tables that begin with a method's name, up to the second heading of level 2 or the file's end.
Rows method_rows(const std::string& file, const std::string& end) {
    std::ifstream stream(std::string(TROCAR_SOURCE_DIR) + "/" + file);
    Rows rows;
    for (std::string line; std::getline(stream, line) && line != end;) {
        if (!line.starts_with("| `")) continue;
        std::vector<std::string> cells;
        std::size_t from = 1;
        for (std::size_t bar = line.find('|', from); bar != std::string::npos; bar = line.find('|', from)) {
            cells.push_back(trimmed(line.substr(from, bar - from)));
            from = bar + 1;
        }
        rows.push_back(std::move(cells));
    }
    return rows;
}

TEST(Readme, FirstFiguresAreThoseOfThePublishedStudy) {
    const Rows reported = method_rows("README.md", "## Two commands");
    const Rows published = method_rows("reports/default/report.md", "## Behind this page");
    ASSERT_GE(reported.size(), 8U);
    for (const std::vector<std::string>& row : reported) {
        // The report names the contact generator and the origin of settings behind the method, and intervals behind
        // ratios.
        const auto fits = [&row](const std::vector<std::string>& other) {
            if (!other.front().starts_with(row.front())) return false;
            return std::all_of(row.begin() + 1, row.end(), [&other](const std::string& cell) {
                return std::any_of(other.begin() + 1, other.end(), [&cell](const std::string& one) {
                    return one == cell || one.starts_with(cell + " [");
                });
            });
        };
        EXPECT_TRUE(std::any_of(published.begin(), published.end(), fits)) << row.front();
    }
}

std::string whole(const std::string& file) {
    std::string text = test::read_file(std::filesystem::path(TROCAR_SOURCE_DIR) / file);
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

TEST(Readme, TheQuotedAblationIsThePublishedOne) {
    const std::string published = whole("reports/ablation_contacts/README.md");
    const std::vector<std::array<std::string, 2>> factors{{"side information", "side information explains"},
                                                          {"look-ahead", "look-ahead"},
                                                          {"stiffness", "stiffness"},
                                                          {"interactions and rest", "their interactions"},
                                                          {"law", "the contact law"}};
    for (const auto& [factor, reported] : factors) {
        const std::size_t row = published.find("| " + factor + " | ");
        ASSERT_NE(row, std::string::npos) << factor;
        const std::size_t share = row + factor.size() + 5;
        const std::string sentence = reported + " " + published.substr(share, published.find(" |", share) - share);
        for (const char* file : {"README.md", "bench/studies/default.json"}) {
            EXPECT_NE(whole(file).find(sentence), std::string::npos) << file << ": " << sentence;
        }
    }
}

}  // namespace
}  // namespace trocar
