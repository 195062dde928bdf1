// The rows of page 1, from the results of the runs; page_one_tables.cpp prints them.
#include "report/page_one.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "report/verdict_order.hpp"

namespace trocar {
namespace {

/// The detector that most methods have: the one that page 1 need not name.
std::map<std::string, int> count_by_detector(const std::vector<Method>& methods) {
    std::map<std::string, int> count;
    for (const Method& method : methods) ++count[method.detector];
    return count;
}

}  // namespace

std::vector<ResponseRow> response_rows(const Draft& draft, bool tissue) {
    const Results& results = draft.results;
    const std::vector<std::string> scenes = judged_scenes(results, results.scenes("closed_loop"), tissue);
    std::vector<Method> methods;
    for (const Method& method : results.methods("closed_loop")) {
        if (method.response.empty() || results.fact(method, "detector.control") == "yes") continue;
        methods.push_back(method);
    }
    const std::map<std::string, int> common = count_by_detector(methods);
    std::stable_sort(methods.begin(), methods.end(), [&common](const Method& a, const Method& b) {
        return common.at(a.detector) > common.at(b.detector);
    });
    std::vector<ResponseRow> rows;
    std::vector<ResponseRow> readings;
    for (const Method& method : methods) {
        ResponseRow row{make_row(results, method, {}, scenes), {method}, results.fact(method, "response.setting")};
        row.not_run = static_cast<int>(scenes.size() - row.planned.count());
        if (row.planned.count() == 0) continue;
        if (!results.fact(method, "response.reading_of").empty()) {
            readings.push_back(std::move(row));
            continue;
        }
        const auto twin = std::find_if(rows.begin(), rows.end(), [&](const ResponseRow& other) {
            return results.move_alike(other.who.front(), method, scenes);
        });
        if (twin != rows.end()) {
            twin->who.push_back(method);
        } else {
            rows.push_back(std::move(row));
        }
    }
    const auto rank = [](const ResponseRow& row) {
        return std::pair(response_order(row, row.not_run > 0), row.who.front());
    };
    std::sort(rows.begin(), rows.end(), [&rank](const auto& a, const auto& b) { return rank(a) < rank(b); });
    for (ResponseRow& reading : readings) {
        const std::string of = results.fact(reading.who.front(), "response.reading_of");
        const auto base = std::find_if(rows.begin(), rows.end(), [&of](const ResponseRow& row) {
            return std::any_of(row.who.begin(), row.who.end(), [&of](const Method& who) { return who.response == of; });
        });
        if (base != rows.end()) base->readings.push_back(std::move(reading));
    }
    return rows;
}

std::vector<std::size_t> rows_that_matter(const std::vector<ResponseRow>& rows) {
    std::set<std::size_t> shown;
    std::set<std::string> methods;
    for (std::size_t i = 0; i < rows.size() && shown.size() < page_one_rows; ++i) {
        // A row that is a range over readings stands beside the best one of its method.
        const std::string range = rows[i].readings.empty() ? "" : " as a range";
        if (methods.insert(rows[i].response() + range).second) shown.insert(i);
    }
    for (std::size_t i = 0; i < rows.size() && shown.size() < page_one_rows; ++i) shown.insert(i);
    return {shown.begin(), shown.end()};
}

Headline headline_of(const std::vector<ResponseRow>& rows) {
    const auto usable = [](const ResponseRow& row) {
        return !row.control && row.failed_runs == 0 && row.not_run == 0 && !std::isnan(row.residual_max());
    };
    Headline headline;
    for (const ResponseRow& row : rows) {
        if (headline.first == nullptr && row.ours && !std::isnan(row.residual_max())) headline.first = &row;
    }
    headline.named = headline.first != nullptr;
    for (const ResponseRow& row : rows) {
        if (headline.first == nullptr && usable(row)) headline.first = &row;
    }
    if (headline.first == nullptr) return headline;
    for (const ResponseRow& row : rows) {
        const bool same = &row == headline.first || (headline.named && row.response() == headline.first->response());
        if (headline.other == nullptr && usable(row) && !same) headline.other = &row;
    }
    return headline;
}

}  // namespace trocar
