// The vocabulary of docs/vocabulary.md: retired words stay out of code and texts, and comments of public headers keep
// the rules that a program can check.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "support/program.hpp"

namespace {

const std::filesystem::path root(TROCAR_SOURCE_DIR);

enum class Part { code, comment, text };

/// One word of a file: identifiers count hump by hump, in lower case.
struct Word {
    std::string text;
    Part part;
    std::size_t line;
};

bool is_source(const std::filesystem::path& file) { return file.extension() == ".cpp" || file.extension() == ".hpp"; }

/// Marks every byte of C++ as code, comment or text of a literal.
std::vector<Part> parts_of(std::string_view code) {
    std::vector<Part> parts(code.size(), Part::code);
    std::size_t i = 0;
    const auto mark = [&](std::size_t end, Part part) {
        end = std::min(end, code.size());
        std::fill(parts.begin() + static_cast<std::ptrdiff_t>(i), parts.begin() + static_cast<std::ptrdiff_t>(end),
                  part);
        i = end;
    };
    const auto end_after = [&](std::string_view close, std::size_t from) {
        const std::size_t found = code.find(close, from);
        return found == std::string_view::npos ? code.size() : found + close.size();
    };
    while (i < code.size()) {
        const std::string_view rest = code.substr(i);
        if (rest.starts_with("//")) {
            mark(std::min(code.find('\n', i), code.size()), Part::comment);
        } else if (rest.starts_with("R\"")) {
            const std::size_t open = code.find('(', i);
            const std::string close = ")" + std::string(code.substr(i + 2, open - i - 2)) + "\"";
            mark(end_after(close, open), Part::text);
        } else if (code[i] == '"' || (code[i] == '\'' && (i == 0 || std::isalnum(code[i - 1]) == 0))) {
            std::size_t end = i + 1;
            while (end < code.size() && code[end] != code[i] && code[end] != '\n') end += code[end] == '\\' ? 2 : 1;
            mark(end + 1, Part::text);
        } else {
            ++i;
        }
    }
    return parts;
}

std::vector<Word> words_of(const std::string& content, bool source) {
    const std::vector<Part> parts = source ? parts_of(content) : std::vector<Part>(content.size(), Part::text);
    std::vector<Word> words;
    std::size_t line = 1;
    for (std::size_t i = 0; i < content.size(); ++i) {
        const auto letter = [&content](std::size_t at) {
            return std::isalpha(static_cast<unsigned char>(content[at])) != 0;
        };
        const auto upper = [&content](std::size_t at) {
            return std::isupper(static_cast<unsigned char>(content[at])) != 0;
        };
        if (content[i] == '\n') ++line;
        if (!letter(i)) continue;
        const std::size_t first = i;
        while (i + 1 < content.size() && letter(i + 1) && !(upper(i + 1) && !upper(i))) ++i;
        std::string text = content.substr(first, i - first + 1);
        std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
        words.push_back({std::move(text), parts[first], line});
    }
    return words;
}

/// Retired in code and in prose alike.
const std::set<std::string, std::less<>> retired_words{
    "told",      "tells",     "tell",       "telling", "untold",      "contestant",   "contestants", "rival",
    "rivals",    "retelling", "retellings", "retold",  "certificate", "certificates", "books",       "booked",
    "canonical", "regional",  "firmest",    "rubs",    "placement",   "placements"};
/// Ordinary words in prose, retired as parts of identifiers.
const std::set<std::string, std::less<>> retired_in_code{"reach",  "hand",    "hands", "led",   "leading", "awake",
                                                         "asleep", "sleeps",  "hair",  "skin",  "way",     "ways",
                                                         "effect", "effects", "grip",  "grips", "looks",   "looked"};

/// Where a retired word may stand, and why. An empty word: all of them.
struct Allowed {
    std::string_view file;  ///< beginning of the path below the root
    std::string_view word;
    std::string_view reason;
};
constexpr std::array allowed{
    Allowed{"tests/house/vocabulary_test.cpp", "", "this list"},
    Allowed{"docs/vocabulary.md", "", "the table of retired words"},
    Allowed{"docs/migrating_0.3", "", "the way from the old names"},
    Allowed{"docs/CHANGES.md", "", "what earlier versions were called"},
    Allowed{"docs/notes/", "", "dated notes keep the words of their day"},
    Allowed{"src/scene/retired_names.cpp", "", "the table that answers retired names"},
    Allowed{"src/study/contact_baseline.cpp", "told", "a key of the second baseline format"},
    Allowed{"tests/study/contact_baseline_test.cpp", "told", "a key of the second baseline format"},
    Allowed{"tests/method/registry_test.cpp", "regional", "a retired name that is answered"},
    Allowed{"tests/study/study_file_test.cpp", "canonical", "a retired name that is answered"},
    Allowed{"tests/study/study_file_test.cpp", "regional", "a retired name that is answered"},
    Allowed{"src/scene/recording.cpp", "canonical", "std::filesystem::weakly_canonical"},
    Allowed{"docs/BASELINES.md", "canonical", "an upstream project's word"},
    Allowed{"docs/methods/adaptive_multires.md", "regional", "the name of a dated note"},
};

bool is_allowed(const std::string& file, const std::string& word) {
    return std::any_of(allowed.begin(), allowed.end(), [&](const Allowed& one) {
        return file.starts_with(one.file) && (one.word.empty() || one.word == word);
    });
}

std::vector<std::filesystem::path> files_to_check() {
    std::vector<std::filesystem::path> files{root / "README.md", root / "reports" / "README.md"};
    for (const char* folder : {"src", "bench", "baselines", "tests", "docs", "scenes"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
            const std::filesystem::path& file = entry.path();
            if (file.string().find("node_modules") != std::string::npos) continue;               // not the project's
            const bool reference = file.string().find("scenes/reference") != std::string::npos;  // stored numbers
            const bool is_text = file.extension() == ".md" || (file.extension() == ".json" && !reference);
            if (entry.is_regular_file() && (is_source(file) || is_text)) files.push_back(file);
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// Calls use(path below the root, word) for every word that is retired, in code at least.
template <typename Use>
void each_retired_word(const Use& use) {
    for (const std::filesystem::path& file : files_to_check()) {
        const std::string name = std::filesystem::relative(file, root).generic_string();
        for (const Word& word : words_of(trocar::test::read_file(file), is_source(file))) {
            if (retired_words.contains(word.text) || retired_in_code.contains(word.text)) use(name, word);
        }
    }
}

TEST(Vocabulary, RetiredWordsStayOutOfCodeAndTexts) {
    std::string found;
    each_retired_word([&found](const std::string& name, const Word& word) {
        const bool ordinary_prose = !retired_words.contains(word.text) && (word.part != Part::code || !is_source(name));
        if (ordinary_prose || is_allowed(name, word.text)) return;
        found += name + ":" + std::to_string(word.line) + ": " + word.text + "\n";
    });
    EXPECT_EQ(found, "") << "docs/vocabulary.md says which word is used instead";
}

TEST(Vocabulary, EveryAllowedPlaceIsNeeded) {
    std::set<std::string_view> needed;
    each_retired_word([&needed](const std::string& name, const Word& word) {
        for (const Allowed& one : allowed) {
            if (name.starts_with(one.file) && (one.word.empty() || one.word == word.text)) needed.insert(one.file);
        }
    });
    for (const Allowed& one : allowed) EXPECT_TRUE(needed.contains(one.file)) << one.file << " needs no exception";
}

TEST(Vocabulary, WordsAreTakenFromIdentifiersCommentsAndLiterals) {
    const std::vector<Word> words = words_of("int IsTold_again = 1;  // hands, 'x\nconst char* a = \"way\";", true);
    const auto part_of = [&words](std::string_view text) {
        const auto at =
            std::find_if(words.begin(), words.end(), [text](const Word& word) { return word.text == text; });
        return at == words.end() ? -1 : static_cast<int>(at->part);
    };
    EXPECT_EQ(part_of("told"), static_cast<int>(Part::code));
    EXPECT_EQ(part_of("hands"), static_cast<int>(Part::comment));
    EXPECT_EQ(part_of("way"), static_cast<int>(Part::text));
    EXPECT_EQ(words.back().line, 2U);
}

/// Whether the dot at the end of `text` belongs to an abbreviation or to an initial.
bool is_abbreviation(const std::string& text) {
    const std::size_t space = text.find_last_of(" (\"");
    const std::string word = text.substr(space == std::string::npos ? 0 : space + 1);
    static const std::set<std::string, std::less<>> abbreviations{"e.g.", "i.e.", "al.",  "eq.", "p.",  "pp.",
                                                                  "cf.",  "vs.",  "vol.", "no.", "ch.", "sec."};
    return abbreviations.contains(word) || (word.size() == 2 && std::isupper(static_cast<unsigned char>(word[0])) != 0);
}

/// Sentences of the comments of a header. A block is a run of comment lines; an empty line, a list item and a comment
/// behind code begin a new one.
std::vector<std::pair<std::size_t, std::string>> sentences_of(const std::string& content) {
    const std::vector<Part> parts = parts_of(content);
    std::vector<std::pair<std::size_t, std::string>> blocks;
    std::size_t begin = 0;
    bool open = false;
    bool last_behind_code = false;
    for (std::size_t line = 1; begin < content.size(); ++line) {
        const std::size_t end = std::min(content.find('\n', begin), content.size());
        std::size_t at = begin;
        while (at < end && parts[at] != Part::comment) ++at;
        const bool whole_line = content.find_first_not_of(' ', begin) == at;
        std::string text = content.substr(at, end - at);
        text.erase(0, std::min(text.find_first_not_of("/<!"), text.size()));
        text.erase(0, std::min(text.find_first_not_of(' '), text.size()));
        const bool behind_code = content.compare(at, 4, "///<") == 0;
        const bool item = text.starts_with("- ") || text.starts_with("* ");
        if (at == end || text.empty()) {
            open = false;
        } else if (!open || !whole_line || item || behind_code != last_behind_code) {
            blocks.emplace_back(line, text);
            open = true;
        } else {
            blocks.back().second += " " + text;
        }
        last_behind_code = behind_code;
        begin = end + 1;
    }
    std::vector<std::pair<std::size_t, std::string>> sentences;
    for (const auto& [line, block] : blocks) {
        std::string sentence;
        bool quoted = false;
        for (std::size_t i = 0; i < block.size(); ++i) {
            quoted = quoted != (block[i] == '`');
            sentence += block[i];
            const bool last = i + 1 == block.size();
            const bool stop = block[i] == '.' || block[i] == ';' || block[i] == '?' || block[i] == '!';
            const bool abbreviation = block[i] == '.' && is_abbreviation(sentence);
            if (last || (!quoted && stop && block[i + 1] == ' ' && !abbreviation)) {
                sentences.emplace_back(line,
                                       sentence.substr(std::min(sentence.find_first_not_of(' '), sentence.size())));
                sentence.clear();
            }
        }
    }
    return sentences;
}

/// Words of a sentence: runs without a space that hold a letter or a digit; a quoted piece of code is one.
std::size_t count_words(const std::string& sentence) {
    std::size_t count = 0;
    bool quoted = false;
    bool inside = false;
    bool counted = false;
    for (const char c : sentence) {
        if (c == '`') quoted = !quoted;
        if (c == ' ' && !quoted) {
            inside = false;
            continue;
        }
        if (!inside) counted = false;
        inside = true;
        if (!counted && std::isalnum(static_cast<unsigned char>(c)) != 0) {
            ++count;
            counted = true;
        }
    }
    return count;
}

TEST(Vocabulary, CommentsOfPublicHeadersAreShortSentencesWithTheirSubjectFirst) {
    constexpr std::size_t most_words = 25;
    std::string found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / "src")) {
        if (entry.path().extension() != ".hpp") continue;
        for (const auto& [line, sentence] : sentences_of(trocar::test::read_file(entry.path()))) {
            if (sentence.find("NOLINT") != std::string::npos || sentence.starts_with("clang-format")) continue;
            const std::string where =
                std::filesystem::relative(entry.path(), root).generic_string() + ":" + std::to_string(line);
            if (const std::size_t words = count_words(sentence); words > most_words) {
                found += where + ": " + std::to_string(words) + " words: " + sentence + "\n";
            }
            for (const char* first : {"What ", "Who ", "Whose ", "Of "}) {
                if (sentence.starts_with(first)) found += where + ": begins with " + first + ": " + sentence + "\n";
            }
        }
    }
    EXPECT_EQ(found, "") << "rules: docs/vocabulary.md";
}

TEST(Vocabulary, SentencesAreFoundAndCounted) {
    const auto sentences =
        sentences_of("// One fact. Two `a. b` facts, e.g. this;\n// three.\nint x;  ///< m, of it\n//\n// - item\n");
    ASSERT_EQ(sentences.size(), 5U);
    EXPECT_EQ(sentences[1].second, "Two `a. b` facts, e.g. this;");
    EXPECT_EQ(sentences[2].second, "three.");
    EXPECT_EQ(sentences[3].second, "m, of it");
    EXPECT_EQ(count_words(sentences[1].second), 5U);
    EXPECT_EQ(count_words(sentences[4].second), 1U);
}

}  // namespace
