// Expected failure: prints a known gap, and fails as soon as the gap is closed.
#pragma once

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <iostream>

namespace trocar::test {

/// Runs expectations of which at least one must fail. `why`: description of the gap.
template <typename Body>
void expect_known_gap(const char* why, const Body& body) {
    testing::TestPartResultArray results;
    {
        const testing::ScopedFakeTestPartResultReporter reporter(
            testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &results);
        body();
    }
    int failures = 0;
    for (int i = 0; i < results.size(); ++i) {
        if (!results.GetTestPartResult(i).failed()) continue;
        if (failures++ == 0)
            std::cout << "known gap: " << why << "\n" << results.GetTestPartResult(i).message() << "\n";
    }
    EXPECT_GT(failures, 0) << "the known gap is closed, make this a plain test: " << why;
}

}  // namespace trocar::test
