#include "geometry/number_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

namespace trocar {
namespace {

TEST(NumberOfText, TheWholeTextIsTheNumber) {
    EXPECT_EQ(number_of_text<double>("-2.5e-3"), -0.0025);
    EXPECT_EQ(number_of_text<double>("1e-310"), 1e-310);
    EXPECT_EQ(number_of_text<double>("inf"), std::numeric_limits<double>::infinity());
    EXPECT_TRUE(std::isnan(number_of_text<double>("nan").value()));
    EXPECT_EQ(number_of_text<std::int64_t>("-9223372036854775808"), std::numeric_limits<std::int64_t>::min());
}

TEST(NumberOfText, OtherTextsAreNone) {
    for (const char* text : {"", " 1", "1 ", "+1", "1e400", "1e-400", "0x10", "1,5", "one"}) {
        EXPECT_FALSE(number_of_text<double>(text).has_value()) << text;
    }
    for (const char* text : {"", "1.0", "9223372036854775808", "-"}) {
        EXPECT_FALSE(number_of_text<std::int64_t>(text).has_value()) << text;
    }
}

}  // namespace
}  // namespace trocar
