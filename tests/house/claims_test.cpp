// Sentences with figures are held against the published results: the tables of README against the page that they are
// from, the sentences of claims.json against results.csv, and no other figure stands on the first screen of README.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <regex>
#include <string>
#include <vector>

#include "measure/statistics.hpp"
#include "report/cell.hpp"
#include "support/csv_text.hpp"
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

TEST(Readme, FirstFiguresAreThoseOfThePublishedReports) {
    const Rows reported = method_rows("README.md", "## Two commands");
    Rows published = method_rows("reports/default/report.md", "## Behind this page");
    for (const auto& row : method_rows("reports/verdict/report.md", "## Behind this page")) published.push_back(row);
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
    for (const char* sentence : {"312 runs", "90 % interval 0.91 to 0.98"}) {
        EXPECT_NE(whole("README.md").find(sentence), std::string::npos) << sentence;
        EXPECT_NE(published.find(sentence), std::string::npos) << sentence;
    }
}

nlohmann::json claims_file() { return nlohmann::json::parse(whole("tests/house/claims.json")); }

/// A condition on a column: a value, "*part" for what holds that part, "!" before either for all others, or a list of
/// conditions that all hold.
bool fits(const std::string& value, const nlohmann::json& given) {
    if (given.is_array()) {
        return std::all_of(given.begin(), given.end(), [&](const auto& one) { return fits(value, one); });
    }
    const std::string condition = given;
    if (condition.starts_with("!")) return !fits(value, condition.substr(1));
    if (condition.starts_with("*")) return value.find(condition.substr(1)) != std::string::npos;
    return value == condition;
}

/// The claim's sentence with the figures of the published results.
std::string sentence_of(const nlohmann::json& claim) {
    std::string sentence = claim.at("says");
    for (const nlohmann::json& figure : claim.at("figures")) {
        const auto rows = test::csv_rows(test::read_file(std::filesystem::path(TROCAR_SOURCE_DIR) / "reports" /
                                                         figure.at("report") / "results.csv"));
        std::map<std::string, std::size_t> column;
        for (std::size_t i = 0; i < rows.front().size(); ++i) column[rows.front()[i]] = i;
        std::vector<double> values;
        for (std::size_t i = 1; i < rows.size(); ++i) {
            const auto& where = figure.at("where").items();
            const bool taken = std::all_of(where.begin(), where.end(), [&](const auto& one) {
                return fits(rows[i].at(column.at(one.key())), one.value());
            });
            const std::string& value = rows[i].at(column.at(figure.at("metric")));
            if (taken && !value.empty()) values.push_back(std::stod(value));
        }
        EXPECT_FALSE(values.empty()) << claim.at("says") << ": no run fits " << figure.dump();
        if (values.empty()) return {};
        double value = 0.0;
        const std::string take = figure.at("take");
        if (take == "max") value = *std::max_element(values.begin(), values.end());
        if (take == "median") value = median(values);
        if (take == "sum") value = std::accumulate(values.begin(), values.end(), 0.0);
        if (take == "runs") value = static_cast<double>(values.size());
        const std::size_t place = sentence.find("{}");
        if (place == std::string::npos) return "a {} for every figure";
        const double scale = figure.value("scale", 1.0);
        const bool count = take == "sum" || take == "runs";
        sentence.replace(place, 2, count ? count_text(value) : scaled(value, scale));
    }
    return sentence;
}

TEST(Claims, SentencesHaveTheFiguresOfThePublishedResults) {
    const nlohmann::json file = claims_file();
    ASSERT_GE(file.at("claims").size(), 3U);
    for (const nlohmann::json& claim : file.at("claims")) {
        const std::string sentence = sentence_of(claim);
        EXPECT_EQ(sentence.find("{}"), std::string::npos) << sentence;
        EXPECT_NE(whole(claim.at("text")).find(sentence), std::string::npos)
            << claim.at("text") << " shall say: " << sentence;
    }
}

TEST(Claims, NoOtherFigureStandsOnTheFirstScreenOfReadme) {
    const nlohmann::json file = claims_file();
    std::ifstream stream(std::string(TROCAR_SOURCE_DIR) + "/README.md");
    std::string prose;
    for (std::string line; std::getline(stream, line) && line != "## Two commands";) {
        if (!line.starts_with("|")) prose += line + " ";
    }
    prose = std::regex_replace(prose, std::regex(" +"), " ");
    std::vector<std::string> held = file.at("no_result");  // settings, sizes, years
    for (const std::string& sentence : std::vector<std::string>(file.at("held_elsewhere")))
        held.push_back(sentence);  // by the test on the ablation
    for (const nlohmann::json& claim : file.at("claims")) {
        if (claim.at("text") == "README.md") held.push_back(sentence_of(claim));
    }
    for (const std::string& sentence : held) {
        const std::size_t place = prose.find(sentence);
        ASSERT_NE(place, std::string::npos) << sentence;
        prose.erase(place, sentence.size());
    }
    prose = std::regex_replace(prose, std::regex(R"(\]\([^)]*\)|`[^`]*`|section \d)"), "");
    std::smatch figure;
    EXPECT_FALSE(std::regex_search(prose, figure, std::regex(R"(.{0,40}\b\d+(\.\d+)?.{0,30})")))
        << "no claim and no test holds: " << figure.str();
}

}  // namespace
}  // namespace trocar
