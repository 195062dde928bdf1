// Holds every citation of the texts in docs (METHODS §9.2, DESIGN §10, BASELINES, ODE 10 …) to a heading there, and
// every section of the thesis that is named to one that the thesis has, so that no comment sends its reader nowhere.
// METHODS are the pages of docs/methods together.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trocar {
namespace {

/// Headings of one text. `sections`: number ("9.2") or, where a heading has none, its title -> the text below it.
struct CitedText {
    std::map<std::string, std::string> sections;
};

using Documents = std::map<std::string, CitedText>;  ///< by name without ".md"

/// Sections of the thesis, from its table of contents.
const std::set<std::string>& thesis_sections() {
    static const std::set<std::string> sections{
        "1.1",   "1.2",   "1.2.1", "1.2.2", "1.2.3", "1.3",   "1.4",   "1.4.1", "1.4.2", "1.4.3", "1.4.4", "1.5",
        "1.5.1", "1.6",   "2.1",   "2.1.1", "2.1.2", "2.1.3", "2.1.4", "2.2",   "3.1",   "3.1.1", "3.1.2", "3.2",
        "3.3",   "3.4",   "3.4.1", "3.4.2", "3.4.3", "3.4.4", "3.4.5", "4.1",   "4.2",   "4.2.1", "4.2.2", "4.3",
        "4.3.1", "4.3.2", "4.3.3", "5.1",   "5.2",   "5.2.1", "5.2.2", "5.2.3", "5.3",   "5.4"};
    return sections;
}

CitedText read_document(std::istream& stream) {
    static const std::regex heading(R"re((#+) (?:(\d+(?:\.\d+)*)\.? )?(.*))re");
    CitedText document;
    std::vector<std::pair<std::size_t, std::string>> open;  // level and key of the headings that the line is below
    bool code = false;
    for (std::string line; std::getline(stream, line);) {
        if (line.starts_with("```")) code = !code;
        std::smatch match;
        if (!code && std::regex_match(line, match, heading)) {
            const auto level = static_cast<std::size_t>(match[1].length());
            while (!open.empty() && open.back().first >= level) open.pop_back();
            open.emplace_back(level, match[2].matched ? match[2].str() : match[3].str());
            document.sections[open.back().second];
        }
        for (const auto& [level, key] : open) document.sections[key] += line + '\n';
    }
    return document;
}

/// True when the section's text has this item: a row of a table, an entry of a numbered list, or an invariant "I7".
bool has_item(const std::string& section, const std::string& item) {
    if (item.starts_with('I')) return std::regex_search(section, std::regex("\\b" + item + "\\b"));
    return std::regex_search("\n" + section, std::regex("\n(\\| ?" + item + " ?\\||" + item + "\\. )"));
}

/// One line without its indentation and comment signs.
std::string_view without_comment_sign(std::string_view line) {
    const auto skip = [&line](std::string_view characters) {
        line.remove_prefix(std::min(line.find_first_not_of(characters), line.size()));
    };
    skip(" \t");
    for (const std::string_view sign : {"///<", "///", "//", "#"}) {
        if (!line.starts_with(sign)) continue;
        line.remove_prefix(sign.size());
        skip(" ");
        break;
    }
    return line;
}

/// Lines joined by blanks, so that a citation may go on in the next comment line or in the next string literal.
struct JoinedText {
    std::string text;
    std::vector<std::size_t> line_starts;

    [[nodiscard]] std::size_t line_at(std::size_t position) const {
        return static_cast<std::size_t>(std::upper_bound(line_starts.begin(), line_starts.end(), position) -
                                        line_starts.begin());
    }
};

JoinedText joined(std::istream& stream, bool markdown) {
    JoinedText result;
    for (std::string line; std::getline(stream, line);) {
        std::string_view part = markdown ? std::string_view(line) : without_comment_sign(line);
        if (!markdown && part.starts_with('"') && result.text.ends_with("\" ")) {
            result.text.resize(result.text.size() - 2);
            part.remove_prefix(1);
        }
        result.line_starts.push_back(result.text.size());
        result.text += part;
        result.text += ' ';
    }
    return result;
}

/// What a text cites, and what is wrong with it.
class CitationCheck {
public:
    /// `own`: name of the document that the text is, in which a bare § means one of its own sections; empty for code,
    /// where a bare § is a section of METHODS or of the thesis.
    CitationCheck(const Documents& documents, const JoinedText& text, std::string own)
        : documents_(documents), text_(text), own_(std::move(own)) {
        for (std::size_t position = 0; position < text_.text.size();) position = next(position);
    }

    [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }
    [[nodiscard]] int count() const { return count_; }

private:
    /// Examines what begins at `position`; returns where to go on.
    std::size_t next(std::size_t position) {
        static const std::regex document(
            R"re((METHODS|DESIGN|STUDIES|BASELINES|CONTACT|PERFORMANCE|[A-Z]{4,}(?=\.md\b|,? §))(\.md)?'?)re");
        static const std::regex thesis(R"re((?:\[T|[Tt]hesis'?),? (?=§))re");
        static const std::regex in_brackets(R"re(\[T [^\]]*\])re");
        static const std::regex erratum(R"re(errat(?:um|a) (\d+))re");
        const bool inside_word =
            position > 0 && (std::isalnum(static_cast<unsigned char>(text_.text[position - 1])) != 0 ||
                             text_.text[position - 1] == '_');
        std::smatch match;
        if (inside_word) return position + 1;
        if (at(position, in_brackets, match)) {  // "[T §3.3, Table 3.1, §4.2]"
            const std::size_t end = position + static_cast<std::size_t>(match.length());
            while ((position = text_.text.find("§", position)) < end) {
                position = sections(position, end, [this](const std::string& section, std::size_t where) {
                    check_thesis(section, where);
                });
            }
            return end;
        }
        if (at(position, thesis, match)) {
            const std::size_t first = position + static_cast<std::size_t>(match.length());
            return sections(first, text_.text.size(),
                            [this](const std::string& section, std::size_t where) { check_thesis(section, where); });
        }
        if (at(position, erratum, match)) {
            ++count_;
            check_item("METHODS", "13", match[1].str(), position);
            return position + static_cast<std::size_t>(match.length());
        }
        if (at(position, document, match)) {
            const std::string name = match[1].str();
            const std::size_t end = position + static_cast<std::size_t>(match.length());
            return name == "README" || name == "LICENSE" ? end : cited(name, position, end);
        }
        if (text_.text.compare(position, 2, "§") == 0) {
            return sections(position, text_.text.size(),
                            [this](const std::string& section, std::size_t where) { check_bare(section, where); });
        }
        return position + 1;
    }

    /// Matches at `position`, within a window: a regular expression must not run through a whole file.
    bool at(std::size_t position, const std::regex& pattern, std::smatch& match) const {
        constexpr std::size_t longest_citation = 300;
        const auto first = text_.text.begin() + static_cast<std::ptrdiff_t>(position);
        const auto last = text_.text.size() - position > longest_citation
                              ? first + static_cast<std::ptrdiff_t>(longest_citation)
                              : text_.text.end();
        return std::regex_search(first, last, match, pattern, std::regex_constants::match_continuous);
    }

    /// A list "§4", "§5-§10", "§1, §6", "§1 and §6" from `position` on; `check` gets each number. Returns its end.
    template <typename Check>
    std::size_t sections(std::size_t position, std::size_t end, const Check& check) const {
        static const std::regex section(
            R"re((?:,? and |, | ?(?:-|–) ?)?§ ?(\d+(?:\.\d+)*)(?:(?:-|–)(\d+(?:\.\d+)*))?)re");
        std::smatch match;
        const std::size_t first = position;
        while (position < end && at(position, section, match)) {
            check(match[1].str(), position);
            if (match[2].matched) check(match[2].str(), position);
            position += static_cast<std::size_t>(match.length());
        }
        return std::max(position, first + 1);
    }

    /// The rest of a citation of the text `name`: sections, items of the last one, or a title. Returns its end.
    std::size_t cited(const std::string& name, std::size_t begin, std::size_t position) {
        static const std::regex item(R"re((?:, | )(?:(I\d+)(?:(?:-|–)(I?\d+))?\b|(\d+)(?=[);:,]|\.(?: |$))))re");
        static const std::regex title(R"re(,? "([^"]+)"|, ([A-Z][a-z]+|[A-Z]{2,3})(?: (\d+))?\b)re");
        static const std::regex section_follows(R"re((?:,? )(?=§))re");
        ++count_;
        const auto found = documents_.find(name);
        if (found == documents_.end()) {
            problem(begin, "docs/" + name + ".md does not exist");
            return position;
        }
        std::smatch match;
        std::optional<std::string> last;
        if (at(position, section_follows, match)) {
            position = sections(position + static_cast<std::size_t>(match.length()), text_.text.size(),
                                [&](const std::string& section, std::size_t where) {
                                    check_section(name, section, where);
                                    last = section;
                                });
        } else if (at(position, title, match)) {
            const std::string begins = match[1].matched ? match[1].str() : match[2].str();
            for (const auto& [key, text] : found->second.sections) {
                if (key.starts_with(begins)) last = key;
            }
            if (!last) problem(begin, name + " has no heading \"" + begins + "\"");
            if (last && match[3].matched) check_item(name, *last, match[3].str(), begin);
            return position + static_cast<std::size_t>(match.length());
        }
        while (at(position, item, match)) {
            for (const std::size_t group : {1U, 2U, 3U}) {
                if (!match[group].matched) continue;
                std::string number = match[group].str();
                if (group == 2 && !number.starts_with('I')) number.insert(0, 1, 'I');
                check_item(name, last.value_or(""), number, position);
            }
            position += static_cast<std::size_t>(match.length());
        }
        return position;
    }

    void check_section(const std::string& name, const std::string& section, std::size_t where) {
        if (!documents_.at(name).sections.contains(section)) problem(where, name + " has no §" + section);
    }

    /// `section`: empty when the citation names none; then anywhere in the text.
    void check_item(const std::string& name, const std::string& section, const std::string& item, std::size_t where) {
        bool found = false;
        for (const auto& [key, text] : documents_.at(name).sections) {
            found = found || ((section.empty() || key == section) && has_item(text, item));
        }
        if (!found) problem(where, name + (section.empty() ? "" : " §" + section) + " has no item " + item);
    }

    void check_thesis(const std::string& section, std::size_t where) {
        ++count_;
        if (!thesis_sections().contains(section)) problem(where, "the thesis has no §" + section);
    }

    void check_bare(const std::string& section, std::size_t where) {
        ++count_;
        if (!own_.empty()) {
            check_section(own_, section, where);
        } else if (!documents_.at("METHODS").sections.contains(section) && !thesis_sections().contains(section)) {
            problem(where, "neither METHODS nor the thesis has a §" + section);
        }
    }

    void problem(std::size_t position, const std::string& what) {
        problems_.push_back("line " + std::to_string(text_.line_at(position)) + ": " + what);
    }

    const Documents& documents_;
    const JoinedText& text_;
    std::string own_;
    std::vector<std::string> problems_;
    int count_ = 0;
};

std::vector<std::string> problems_in(const Documents& documents, const std::string& text, const std::string& own = "") {
    std::istringstream stream(text);
    const JoinedText lines = joined(stream, !own.empty());
    return CitationCheck(documents, lines, own).problems();
}

Documents made_up_documents() {
    std::istringstream methods(
        "# Methods\n## 4. Tissue\ntext\n## 9. Inside\n### 9.2 Sides\ntext\n## 13. Errata\n| 15 | parity |\n"
        "## 14. Invariants\nI1 and I26\n");
    std::istringstream baselines("# Baselines\n## ODE 0.16\n1. init\n2. pad\n");
    return {{"METHODS", read_document(methods)}, {"BASELINES", read_document(baselines)}};
}

TEST(Citations, EveryOneLeadsToAHeadingInDocs) {
    const std::filesystem::path source(TROCAR_SOURCE_DIR);
    Documents documents;
    for (const auto& entry : std::filesystem::directory_iterator(source / "docs")) {
        if (!entry.is_regular_file()) continue;
        std::ifstream file(entry.path());
        documents[entry.path().stem().string()] = read_document(file);
    }
    std::map<std::string, std::string>& methods = documents["METHODS"].sections;
    for (const auto& entry : std::filesystem::directory_iterator(source / "docs/methods")) {
        std::ifstream file(entry.path());
        for (auto& [number, text] : read_document(file).sections) {
            EXPECT_TRUE(methods.emplace(number, text).second) << "two sections " << number;
        }
    }
    ASSERT_TRUE(methods.contains("4"));

    const std::set<std::string> extensions{".cpp", ".hpp", ".in", ".cmake", ".txt", ".md", ".json", ".sh", ".py"};
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(source)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
    }
    for (const char* folder : {"src", "tests", "baselines", "bench", "scenes", "docs", ".ci"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(source / folder)) {
            if (entry.is_regular_file()) files.push_back(entry.path());
        }
    }
    int citations = 0;
    for (const std::filesystem::path& path : files) {
        // This file is full of citations that are wrong on purpose; references and meshes are numbers; what npm lays
        // into src/web is not ours.
        if (!extensions.contains(path.extension().string()) || path.filename() == "citations_test.cpp" ||
            path.parent_path() == source / "scenes/reference" ||
            path.string().find("/node_modules/") != std::string::npos)
            continue;
        std::ifstream file(path);
        const bool markdown = path.extension() == ".md";
        const JoinedText text = joined(file, markdown);
        std::string own;
        if (path.parent_path() == source / "docs") own = path.stem().string();
        if (path.parent_path() == source / "docs/methods") own = "METHODS";
        const CitationCheck check(documents, text, own);
        citations += check.count();
        for (const std::string& problem : check.problems()) ADD_FAILURE() << path.string() << ": " << problem;
    }
    EXPECT_GT(citations, 100);
}

TEST(Citations, WhatLeadsSomewhereIsLeftAlone) {
    const Documents documents = made_up_documents();
    for (const char* text : {
             "// (METHODS §4)",
             "// METHODS §4, §9.2 and §13",
             "// as METHODS §4-§9 says",
             "// the law (METHODS\n/// §9.2)",
             "    \"anchor (METHODS \"\n    \"§9.2; faithful)\"",
             "// METHODS §13, 15.",
             "// METHODS §14, I1–I26:",
             "// METHODS I26: z",
             "// BASELINES.md, and BASELINES, ODE 2)",
             "// BASELINES \"ODE 0.16\"",
             "// thesis §3.4.2, §3.4.5 or [T §3.3, Table 3.1, §4.2]",
             "// bare: §9.2, §3.4.5",
             "// METHODS §4, erratum 15",
             "// METHODS §12, 2.5 mm",
         }) {
        const std::vector<std::string> found = problems_in(documents, text);
        if (std::string(text).find("§12") == std::string::npos) {
            EXPECT_TRUE(found.empty()) << text << ": " << found.front();
        } else {
            EXPECT_EQ(found, std::vector<std::string>{"line 1: METHODS has no §12"});  // and no item 2
        }
    }
}

TEST(Citations, OneThatLeadsNowhereIsFoundWithItsLine) {
    const Documents documents = made_up_documents();
    const std::vector<std::pair<const char*, const char*>> wrong{
        {"// METHODS §99", "line 1: METHODS has no §99"},
        {"// METHODS §4, §9.7", "line 1: METHODS has no §9.7"},
        {"// METHODS §4-§12", "line 1: METHODS has no §12"},
        {"int i;\n// the law (METHODS\n/// §9.3)", "line 3: METHODS has no §9.3"},
        {"    \"anchor (METHODS \"\n    \"§9.1; faithful)\"", "line 2: METHODS has no §9.1"},
        {"// METHODS §13, 16.", "line 1: METHODS §13 has no item 16"},
        {"// METHODS §4, erratum 28", "line 1: METHODS §13 has no item 28"},
        {"// METHODS §14, I1–I27", "line 1: METHODS §14 has no item I27"},
        {"// METHODS I2: z", "line 1: METHODS has no item I2"},
        {"// DESIGN §4", "line 1: docs/DESIGN.md does not exist"},
        {"// see NOTES.md", "line 1: docs/NOTES.md does not exist"},
        {"// NOTES §4", "line 1: docs/NOTES.md does not exist"},
        {"// BASELINES, Bullet", "line 1: BASELINES has no heading \"Bullet\""},
        {"// BASELINES, ODE 3)", "line 1: BASELINES §ODE 0.16 has no item 3"},
        {"// BASELINES \"FCL\"", "line 1: BASELINES has no heading \"FCL\""},
        {"// thesis §3.4.6", "line 1: the thesis has no §3.4.6"},
        {"// [T §3.3, Table 3.1, §4.9]", "line 1: the thesis has no §4.9"},
        {"// bare: §9.9", "line 1: neither METHODS nor the thesis has a §9.9"},
    };
    for (const auto& [text, expected] : wrong) {
        EXPECT_EQ(problems_in(documents, text), std::vector<std::string>{expected}) << text;
    }
    EXPECT_EQ(problems_in(documents, "see §3.4.5", "METHODS"),
              std::vector<std::string>{"line 1: METHODS has no §3.4.5"});
}

/// Pages that are built of docs alone know no other folder.
TEST(Docs, LinksLeadToTextsOfDocs) {
    static const std::regex link(R"re(\]\(([^)#:]+)(?:#[^)]*)?\))re");
    const std::filesystem::path docs = std::filesystem::path(TROCAR_SOURCE_DIR) / "docs";
    std::string broken;
    int links = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(docs)) {
        if (entry.path().extension() != ".md") continue;
        std::ifstream stream(entry.path());
        const std::string text{std::istreambuf_iterator<char>(stream), {}};
        for (std::sregex_iterator one(text.begin(), text.end(), link), end; one != end; ++one) {
            ++links;
            const std::filesystem::path target = (entry.path().parent_path() / (*one)[1].str()).lexically_normal();
            const bool within = !target.lexically_relative(docs).string().starts_with("..");
            if (!within || !std::filesystem::exists(target))
                broken += entry.path().filename().string() + ": " + (*one)[1].str() + "\n";
        }
    }
    EXPECT_EQ(broken, "");
    EXPECT_GT(links, 20);
}

}  // namespace
}  // namespace trocar
