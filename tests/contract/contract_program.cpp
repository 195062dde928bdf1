#include "contract/contract_program.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <exception>
#include <string>

#include "contract/contract_support.hpp"
#include "contract/shipped_folder.hpp"
#include "geometry/input_error.hpp"
#include "method/outside.hpp"

namespace trocar::test {

int run_contract_tests(int argc, char** argv, const std::filesystem::path& share, const std::filesystem::path& gaps) {
    try {
        shipped_folder() = share;
        if (!gaps.empty()) {
            add_gap_file(gaps);
            // A file that cannot be read ends here, not in every test.
            for (const char* list : {"detectors", "response_contract"}) static_cast<void>(known_gaps(list));
        }
        // A test of a method is called by its name, or by it and what is asked of it.
        std::string filter;
        for (const std::string& name : outside_methods()) filter += fmt::format("*/{0}:*/{0}_*:", name);
        testing::GTEST_FLAG(filter) = filter.empty() ? "-*" : filter;
        testing::InitGoogleTest(&argc, argv);
        const int status = RUN_ALL_TESTS();
        if (testing::GTEST_FLAG(list_tests)) return status;
        if (testing::UnitTest::GetInstance()->test_to_run_count() == 0) {
            std::fprintf(stderr, "contract tests: expected one for a method of this program, got none (methods: %s)\n",
                         fmt::format("{}", fmt::join(outside_methods(), ", ")).c_str());
            return 2;
        }
        return status == 0 ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "contract tests: %s\n", printable_line(error.what()).c_str());
        return 2;
    }
}

}  // namespace trocar::test
