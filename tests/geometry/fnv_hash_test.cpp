#include "geometry/fnv_hash.hpp"

#include <gtest/gtest.h>

namespace trocar {
namespace {

TEST(FnvHash, GivesThePublishedValues) {
    // From the test vectors of the IETF draft.
    for (const auto& [text, value] :
         {std::pair{"", 0xcbf29ce484222325ULL}, {"a", 0xaf63dc4c8601ec8cULL}, {"foobar", 0x85944171f73967e8ULL}}) {
        FnvHash hash;
        hash.add_text(text);
        EXPECT_EQ(hash.value(), value) << text;
    }
}

TEST(FnvHash, AWordIsItsEightBytesLowestFirstAndTextIsSixteenDigits) {
    FnvHash word;
    word.add_word(0x8877665544332211ULL);
    FnvHash bytes;
    bytes.add_text("\x11\x22\x33\x44\x55\x66\x77\x88");
    EXPECT_EQ(word, bytes);
    EXPECT_NE(word, FnvHash());
    EXPECT_EQ(FnvHash().text(), "cbf29ce484222325");
    FnvHash zero;
    zero.add(0xcbf29ce484222325ULL);
    EXPECT_EQ(zero.text(), "0000000000000000") << "a whole word as one unit: (v ^ v) times the prime";
}

}  // namespace
}  // namespace trocar
