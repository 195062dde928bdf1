#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"
#include "geometry/input_error.hpp"
#include "geometry/pair_file.hpp"

namespace trocar::app {
namespace {

/// Verdicts against truth for the pairs of one class.
struct Confusion {
    std::string_view name;
    std::int64_t true_positive = 0;
    std::int64_t true_negative = 0;
    std::int64_t false_positive = 0;
    std::int64_t false_negative = 0;
    [[nodiscard]] std::int64_t pairs() const { return true_positive + true_negative + false_positive + false_negative; }
    void add(bool verdict, bool truth) {
        ++(truth ? (verdict ? true_positive : false_negative) : (verdict ? false_positive : true_negative));
    }
};

/// One row per class in the order of the classes, then pairs with truth but no class; only rows that have pairs.
std::vector<Confusion> confusion_table(const std::vector<PairLine>& lines, const std::vector<bool>& verdicts) {
    std::vector<Confusion> rows;
    rows.reserve(all_pair_classes.size() + 1);
    for (const PairClass pair_class : all_pair_classes) rows.push_back({.name = name_of(pair_class)});
    rows.push_back({.name = "no-class"});
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (!lines[i].truth) continue;
        const std::size_t row =
            lines[i].pair_class ? static_cast<std::size_t>(*lines[i].pair_class) : all_pair_classes.size();
        rows[row].add(verdicts[i], *lines[i].truth);
    }
    std::erase_if(rows, [](const Confusion& row) { return row.pairs() == 0; });
    return rows;
}

void print_table(const std::vector<Confusion>& rows, std::string_view test) {
    fmt::print("\ntest {}\n{:<18}{:>8}{:>8}{:>8}{:>10}{:>10}\n", test, "class", "pairs", "meet", "apart", "false no",
               "false yes");
    Confusion all{.name = "all"};
    for (const Confusion& row : rows) {
        fmt::print("{:<18}{:>8}{:>8}{:>8}{:>10}{:>10}\n", row.name, row.pairs(), row.true_positive + row.false_negative,
                   row.true_negative + row.false_positive, row.false_negative, row.false_positive);
        all.true_positive += row.true_positive;
        all.true_negative += row.true_negative;
        all.false_positive += row.false_positive;
        all.false_negative += row.false_negative;
    }
    fmt::print("{:<18}{:>8}{:>8}{:>8}{:>10}{:>10}\n", all.name, all.pairs(), all.true_positive + all.false_negative,
               all.true_negative + all.false_positive, all.false_negative, all.false_positive);
}

}  // namespace

int tritri(const CommonOptions& common, const TritriOptions& options) {
    bool (*test)(const Corners&, const Corners&) = nullptr;
    if (options.test == "exact") test = triangles_intersect;
    if (options.test == "interval") test = interval_intersect;
    if (options.test == "moller") test = moller_intersect;
    if (test == nullptr) throw InputError("--test", "", "moller, interval or exact", "'" + options.test + "'");
    const bool claims_exactness = options.test == "exact";

    const std::vector<PairLine> lines = read_pair_file(options.file);
    std::vector<bool> verdicts;
    verdicts.reserve(lines.size());
    std::vector<std::size_t> wrong;            // lines whose verdict differs from the given truth
    std::vector<std::size_t> different_class;  // lines whose class differs; only the exact test names classes
    for (const PairLine& line : lines) {
        verdicts.push_back(test(line.first, line.second));
        if (line.truth && *line.truth != verdicts.back()) wrong.push_back(line.number);
        if (claims_exactness && line.pair_class && classify_pair(line.first, line.second) != *line.pair_class) {
            different_class.push_back(line.number);
        }
    }
    const std::vector<Confusion> rows = confusion_table(lines, verdicts);

    if (common.json) {
        nlohmann::ordered_json document;
        document["test"] = options.test;
        document["verdicts"] = nlohmann::ordered_json::array();
        for (const bool verdict : verdicts) document["verdicts"].push_back(verdict ? 1 : 0);
        document["confusion"] = nlohmann::ordered_json::object();
        for (const Confusion& row : rows) {
            document["confusion"][std::string(row.name)] = {{"pairs", row.pairs()},
                                                            {"true_positive", row.true_positive},
                                                            {"true_negative", row.true_negative},
                                                            {"false_negative", row.false_negative},
                                                            {"false_positive", row.false_positive}};
        }
        document["wrong_lines"] = wrong;
        document["different_class_lines"] = different_class;
        print_json_line(document);
    } else {
        for (const bool verdict : verdicts) fmt::print("{}\n", verdict ? 1 : 0);
        if (!rows.empty()) print_table(rows, options.test);
    }
    const auto report = [](std::string_view what, const std::vector<std::size_t>& numbers) {
        if (numbers.empty()) return;
        std::string text;
        constexpr std::size_t shown = 10;
        for (std::size_t i = 0; i < std::min(shown, numbers.size()); ++i) text += fmt::format(" {}", numbers[i]);
        fmt::print(stderr, "{} on {} line{}:{}{}\n", what, numbers.size(), numbers.size() == 1 ? "" : "s", text,
                   numbers.size() > shown ? " …" : "");
    };
    report("verdict differs from the given truth", wrong);
    report("class differs from the given one", different_class);
    return claims_exactness && !(wrong.empty() && different_class.empty()) ? comparison_failed : done;
}

}  // namespace trocar::app
