#include "geometry/pair_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

/// Most words of a line: two triangles, truth and class.
constexpr std::size_t most_words = 20;

/// Returns at most one word more than a line may have.
std::vector<std::string_view> words_of(std::string_view line) {
    constexpr std::string_view blanks = " \t\r\v\f";
    std::vector<std::string_view> words;
    for (std::size_t begin = line.find_first_not_of(blanks);
         begin != std::string_view::npos && words.size() <= most_words;) {
        const std::size_t end = std::min(line.find_first_of(blanks, begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        begin = line.find_first_not_of(blanks, end);
    }
    return words;
}

/// The double nearest to the decimal number `word`; empty if it is not a number or not finite.
std::optional<double> finite_number(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || word.empty()) return std::nullopt;
    // Out of range means too large, or so small that it rounds to 0 or to a subnormal number.
    if (error == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
    if ((error != std::errc{} && error != std::errc::result_out_of_range) || !std::isfinite(value)) return std::nullopt;
    return value;
}

std::string in_quotes(std::string_view word) { return "'" + std::string(word.substr(0, 40)) + "'"; }

PairLine parse_line(const std::string& file, std::size_t number, const std::vector<std::string_view>& words) {
    const std::string where = "line " + std::to_string(number);
    if (words.size() < 18 || words.size() > most_words) {
        const std::string counted =
            words.size() > most_words ? "more than " + std::to_string(most_words) : std::to_string(words.size());
        throw InputError(file, where, "18 numbers, then optionally truth and class",
                         counted + (words.size() == 1 ? " word" : " words"));
    }
    PairLine line;
    line.number = number;
    for (std::size_t i = 0; i < 18; ++i) {
        const std::optional<double> value = finite_number(words[i]);
        if (!value)
            throw InputError(file, where, "a finite number as word " + std::to_string(i + 1), in_quotes(words[i]));
        (i < 9 ? line.first : line.second)[i % 9 / 3][static_cast<Eigen::Index>(i % 3)] = *value;
    }
    if (words.size() > 18) {
        if (words[18] != "0" && words[18] != "1")
            throw InputError(file, where, "0 or 1 as truth", in_quotes(words[18]));
        line.truth = words[18] == "1";
    }
    if (words.size() > 19) {
        const auto found = std::find_if(all_pair_classes.begin(), all_pair_classes.end(),
                                        [&](PairClass pair_class) { return name_of(pair_class) == words[19]; });
        if (found == all_pair_classes.end()) {
            throw InputError(file, where,
                             "one of disjoint, touch-vertex, touch-edge, coplanar-overlap, transversal, degenerate",
                             in_quotes(words[19]));
        }
        line.pair_class = *found;
    }
    return line;
}

}  // namespace

std::vector<PairLine> read_pair_file(const std::filesystem::path& path) {
    const std::string file = path.string();
    std::ifstream stream = open_input(path, "a text file of pairs");
    std::vector<PairLine> lines;
    std::string text;
    for (std::size_t number = 1; read_line(stream, text, file); ++number) {
        const std::vector<std::string_view> words = words_of(text);
        if (!words.empty()) lines.push_back(parse_line(file, number, words));
    }
    if (stream.bad()) throw InputError(file, "", "a text file of pairs", "a read error");
    return lines;
}

}  // namespace trocar
