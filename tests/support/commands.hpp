// Calls of the program with known ends.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "support/program.hpp"

namespace trocar::test {

inline ProgramResult run_successfully(const std::string& arguments, const std::string& program = TROCAR_PROGRAM) {
    ProgramResult result = run_program(arguments, program);
    EXPECT_EQ(result.status, 0) << arguments << ": " << result.err;
    return result;
}

/// What a call prints that must succeed.
inline nlohmann::json json_of(const std::string& arguments) {
    return nlohmann::json::parse(run_successfully(arguments).out, nullptr, false);
}

/// Holds a call of bad input to status 2, nothing on stdout and one line on stderr, which has `part`; returns that
/// line.
inline std::string expect_refused(const std::string& arguments, const std::string& part = "") {
    const ProgramResult result = run_program(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    EXPECT_EQ(result.out, "") << arguments;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << arguments << ": " << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << arguments << ": " << result.err;
    return result.err;
}

}  // namespace trocar::test
