#include "geometry/pair_file.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "geometry/mesh_text.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

/// Most words of a line: two triangles, truth and class.
constexpr std::size_t most_words = 20;

/// Returns at most one word more than a line may have.
std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    while (words.size() <= most_words) {
        const std::string_view word = mesh_text::next_token(line);
        if (word.empty()) break;
        words.push_back(word);
    }
    return words;
}

PairLine parse_line(const mesh_text::Source& source, std::int64_t number, const std::vector<std::string_view>& words) {
    if (words.size() < 18 || words.size() > most_words) {
        const std::string counted =
            words.size() > most_words ? "more than " + std::to_string(most_words) : std::to_string(words.size());
        mesh_text::fail_line(source, number, "18 numbers, then optionally truth and class",
                             counted + (words.size() == 1 ? " word" : " words"));
    }
    PairLine line;
    line.number = at(number);
    for (std::size_t i = 0; i < 18; ++i) {
        const std::optional<double> value = mesh_text::parse_double(words[i]);
        if (!value || !std::isfinite(*value)) {
            mesh_text::fail_line(source, number, "a finite number as word " + std::to_string(i + 1),
                                 mesh_text::quoted(words[i]));
        }
        (i < 9 ? line.first : line.second)[i % 9 / 3][static_cast<Eigen::Index>(i % 3)] = *value;
    }
    if (words.size() > 18) {
        if (words[18] != "0" && words[18] != "1")
            mesh_text::fail_line(source, number, "0 or 1 as truth", mesh_text::quoted(words[18]));
        line.truth = words[18] == "1";
    }
    if (words.size() > 19) {
        const auto found = std::find_if(all_pair_classes.begin(), all_pair_classes.end(),
                                        [&](PairClass pair_class) { return name_of(pair_class) == words[19]; });
        if (found == all_pair_classes.end()) {
            mesh_text::fail_line(source, number,
                                 "one of disjoint, touch-vertex, touch-edge, coplanar-overlap, transversal, degenerate",
                                 mesh_text::quoted(words[19]));
        }
        line.pair_class = *found;
    }
    return line;
}

}  // namespace

std::vector<PairLine> read_pair_file(const std::filesystem::path& path) {
    const std::string text = read_whole(path, "a text file of pairs");
    const mesh_text::Source source{path.string(), text};
    std::vector<PairLine> pairs;
    mesh_text::LineReader lines(source.text);
    for (std::string_view line; lines.next(line);) {
        const std::vector<std::string_view> words = words_of(line);
        if (!words.empty()) pairs.push_back(parse_line(source, lines.line_number(), words));
    }
    return pairs;
}

}  // namespace trocar
