// Checks of texts.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

#include "geometry/input_error.hpp"

namespace trocar::test {

inline void expect_holds(std::string_view text, std::initializer_list<std::string_view> parts) {
    for (const std::string_view part : parts) {
        EXPECT_NE(text.find(part), std::string_view::npos) << "'" << part << "' is not in: " << text;
    }
}

/// What an input error of the call says; empty when there is none.
template <typename Call>
std::string complaint_of(const Call& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

/// The same without the file's name in front, which must stand there on one line.
template <typename Call>
std::string complaint_about(const std::filesystem::path& file, const Call& call) {
    const std::string message = complaint_of(call);
    if (message.empty()) return message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_EQ(message.rfind(file.string() + ": ", 0), 0U) << message;
    return message.substr(std::min(file.string().size() + 2, message.size()));
}

}  // namespace trocar::test
