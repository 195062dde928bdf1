// Holds tests/README.md to the tests: every test that its table of invariants names exists, and no invariant is left
// out.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>

#include "support/program.hpp"

namespace trocar {
namespace {

/// Every "Suite.Name" declared under tests; a check of DetectorContract counts by its own name.
std::set<std::string> declared_tests(const std::filesystem::path& tests) {
    static const std::regex declaration(R"re(TEST(?:_P|_F)?\((\w+),\s*(\w+)\))re");
    static const std::regex check(R"re(\{"(\w+)", \w+[,}])re");
    std::set<std::string> names;
    const auto collect = [&](const std::string& text, const std::regex& pattern, const auto& name_of) {
        for (auto match = std::sregex_iterator(text.begin(), text.end(), pattern); match != std::sregex_iterator();
             ++match) {
            names.insert(name_of(*match));
        }
    };
    for (const auto& entry : std::filesystem::recursive_directory_iterator(tests)) {
        if (entry.path().extension() != ".cpp") continue;
        collect(test::read_file(entry.path()), declaration,
                [](const std::smatch& match) { return match[1].str() + "." + match[2].str(); });
    }
    collect(test::read_file(tests / "contract/detector_contract_test.cpp"), check,
            [](const std::smatch& match) { return "DetectorContract." + match[1].str(); });
    return names;
}

TEST(TestsReadme, EveryInvariantNamesTestsThatExist) {
    const std::filesystem::path tests = std::filesystem::path(TROCAR_SOURCE_DIR) / "tests";
    const std::set<std::string> declared = declared_tests(tests);
    ASSERT_GT(declared.size(), 100U);
    static const std::regex invariant(R"re(\bI(\d+)\b)re");
    static const std::regex named(R"re(`(\w+\.\w+)`)re");
    std::set<int> covered;
    std::ifstream readme(tests / "README.md");
    for (std::string line; std::getline(readme, line);) {
        if (!line.starts_with("| I")) continue;
        const std::size_t bar = line.find('|', 1);
        ASSERT_NE(bar, std::string::npos) << line;
        const std::string what = line.substr(0, bar);
        const std::string by = line.substr(bar);
        const std::sregex_iterator none;
        for (std::sregex_iterator match(what.begin(), what.end(), invariant); match != none; ++match) {
            covered.insert(std::stoi((*match)[1].str()));
        }
        std::sregex_iterator match(by.begin(), by.end(), named);
        EXPECT_NE(match, none) << what << " names no test";
        for (; match != none; ++match) {
            EXPECT_TRUE(declared.contains((*match)[1].str())) << (*match)[1].str() << " does not exist";
        }
    }
    for (int i = 1; i <= 27; ++i) EXPECT_TRUE(covered.contains(i)) << "I" << i << " is not in the table";
}

}  // namespace
}  // namespace trocar
