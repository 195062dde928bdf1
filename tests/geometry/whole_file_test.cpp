// Files read and written as a whole: what is wrong is reported, and nothing half-written stays.
#include "geometry/whole_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdint>
#include <string>

#include "geometry/input_error.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

class WholeFile : public testing::Test {
protected:
    void SetUp() override { std::filesystem::create_directories(folder_ / "inner"); }

    const test::TemporaryFolder place_;
    const std::filesystem::path folder_ = place_.path();
};

TEST_F(WholeFile, ComesBackByteForByteAndOverAnOlderOne) {
    const std::string bytes("a\r\n\0b", 5);
    for (const std::string& content : {bytes, std::string()}) {
        write_whole(folder_ / "file", content);
        EXPECT_EQ(read_whole(folder_ / "file", "bytes"), content);
    }
}

TEST_F(WholeFile, IsReadLineByLineAsTheStandardLibraryDoes) {
    std::string text = "\n\nshort\r\n" + std::string("a\0b", 3) + "\n";
    // Around once and twice the size of what is taken at a time.
    for (const std::size_t size : {4094, 4095, 4096, 4097, 8189, 8190, 8191, 8192}) {
        text += std::string(size, 'x') + "\n";
        for (const std::string& end : {std::string(), std::string("end"), std::string(size, 'y')}) {
            write_whole(folder_ / "lines", text + end);
            std::ifstream expected_stream = open_input(folder_ / "lines", "lines");
            std::ifstream stream = open_input(folder_ / "lines", "lines");
            std::string expected;
            std::string line;
            while (std::getline(expected_stream, expected)) {
                ASSERT_TRUE(read_line(stream, line, "lines"));
                EXPECT_EQ(line, expected);
                EXPECT_EQ(stream.eof(), expected_stream.eof());
            }
            EXPECT_FALSE(read_line(stream, line, "lines")) << line;
        }
    }
}

TEST_F(WholeFile, ALineThatDoesNotEndIsRefusedBeforeItTakesAllMemory) {
    write_whole(folder_ / "endless", "");
    std::filesystem::resize_file(folder_ / "endless", 20'000'000'000);  // takes no room on the disk
    std::ifstream stream = open_input(folder_ / "endless", "lines");
    std::string line;
    EXPECT_EQ(test::complaint_of([&] { (void)read_line(stream, line, "endless, line 1"); }),
              "endless, line 1: expected at most 24 MB of a line (--large lifts this), got more");
    EXPECT_LT(line.size(), 25'000'000U);
}

TEST_F(WholeFile, AFolderOrNothingIsNoFile) {
    EXPECT_EQ(test::complaint_of([this] { (void)read_whole(folder_ / "inner", "a study file"); }),
              (folder_ / "inner").string() + ": expected a study file, got a folder");
    EXPECT_EQ(test::complaint_of([this] { (void)read_whole(folder_ / "none", "a study file"); }),
              (folder_ / "none").string() + ": expected a study file, got no such file");
}

TEST_F(WholeFile, WhatMayNeverEndIsNotOpened) {
    const std::filesystem::path pipe = folder_ / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(test::complaint_of([&] { (void)open_input(pipe, "a mesh file"); }),
              pipe.string() + ": expected a mesh file, got a pipe");
    EXPECT_EQ(test::complaint_of([&] { (void)open_input("/dev/zero", "a mesh file"); }),
              "/dev/zero: expected a mesh file, got a device");
}

TEST(FileWord, LeadsToNoOtherFolder) {
    EXPECT_EQ(file_word("i2t_poke-2"), "i2t_poke-2");
    EXPECT_EQ(file_word("../../etc/x.y"), "______etc_x_y");
    EXPECT_EQ(file_word("a b\n\xc3\xbc\\"), "a_b____");
    EXPECT_EQ(file_word(""), "_");
    EXPECT_EQ(file_word(std::string(300, 'a')), std::string(100, 'a'));
}

TEST(InputErrorText, IsOnePrintableLineOfAtMost400Bytes) {
    const auto reported = [](const std::string& found) { return std::string(InputError("f", "", "x", found).what()); };
    EXPECT_EQ(reported("\x1b[31m\a\r\nü"), "f: expected x, got \\x1b[31m\\x07\\x0d\\x0aü");
    EXPECT_EQ(reported("\x7f\xc2\x9b\xe2\x80\xae"), "f: expected x, got \\x7f\\xc2\\x9b\\xe2\\x80\\xae");
    EXPECT_EQ(reported("\xff\xc0\xaf\xed\xa0\x80"), "f: expected x, got \\xff\\xc0\\xaf\\xed\\xa0\\x80");
    const std::string long_one = reported(std::string(3000, 'a') + "ü" + std::string(3000, '\xbc') + "end");
    EXPECT_LE(long_one.size(), 400U);
    EXPECT_TRUE(long_one.starts_with("f: expected x, got aaa") && long_one.ends_with("\\xbcend")) << long_one;
    // Wherever the middle begins and ends, no character is cut.
    for (std::size_t n = 380; n < 420; ++n) {
        std::string text(n % 2, 'a');
        while (text.size() < n) text += "ü";
        const std::string line = printable_line(text, 400);
        EXPECT_EQ(printable_line(line, 4000), line) << n;
        EXPECT_LE(line.size(), 400U);
    }
}

TEST(PrintableLine, EscapesControlsSeparatorsAndTurnsOfDirectionAndNoNeighbourOfThem) {
    // Ends of the ranges in Unicode's tables: C0 and DEL, C1, marks and overrides and isolates of direction,
    // separators.
    const auto utf8 = [](std::uint32_t code) {
        const auto tail = [code](unsigned shift) { return static_cast<char>(0x80U | ((code >> shift) & 0x3fU)); };
        if (code < 0x80U) return std::string{static_cast<char>(code)};
        if (code < 0x800U) return std::string{static_cast<char>(0xc0U | (code >> 6U)), tail(0)};
        if (code < 0x10000U) return std::string{static_cast<char>(0xe0U | (code >> 12U)), tail(6), tail(0)};
        return std::string{static_cast<char>(0xf0U | (code >> 18U)), tail(12), tail(6), tail(0)};
    };
    for (const std::uint32_t code : {0x01U, 0x1fU, 0x7fU, 0x80U, 0x9fU, 0x61cU, 0x200eU, 0x200fU, 0x2028U, 0x2029U,
                                     0x202aU, 0x202eU, 0x2066U, 0x2069U}) {
        std::string escaped;
        for (const char c : utf8(code)) escaped += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        EXPECT_EQ(printable_line("a" + utf8(code) + "b"), "a" + escaped + "b") << code;
    }
    for (const std::uint32_t code :
         {0x20U, 0x7eU, 0xa0U, 0x61bU, 0x61dU, 0x7ffU, 0x800U, 0x200dU, 0x2010U, 0x2026U, 0x2027U, 0x202fU, 0x2065U,
          0x206aU, 0xd7ffU, 0xe000U, 0xfffdU, 0x10000U, 0x10ffffU}) {
        EXPECT_EQ(printable_line("a" + utf8(code) + "b"), "a" + utf8(code) + "b") << code;
    }
}

TEST_F(WholeFile, DevicesAndPipesAreNotReplacedAndLinksStay) {
    const std::filesystem::path pipe = folder_ / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const std::filesystem::path device = folder_ / "device";
    std::filesystem::create_symlink("/dev/null", device);
    const std::filesystem::path link = folder_ / "link";
    std::filesystem::create_symlink("target", link);
    for (const std::filesystem::path& file : {pipe, device}) {
        EXPECT_EQ(test::complaint_of([&] { write_whole(file, "text"); }),
                  file.string() + ": expected a file that can be written, got a device, pipe or socket");
    }
    EXPECT_TRUE(std::filesystem::is_fifo(pipe));
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
    write_whole(link, "text");
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_EQ(read_whole(folder_ / "target", "text"), "text");
}

TEST_F(WholeFile, WhatCannotBeWrittenLeavesNothingBehind) {
    const std::filesystem::path taken = folder_ / "inner";  // a folder cannot be replaced by a file
    EXPECT_EQ(test::complaint_of([&] { write_whole(taken, "text"); }),
              taken.string() + ": expected a file that can be written, got a folder");
    const std::filesystem::path nowhere = folder_ / "none" / "file";
    EXPECT_EQ(test::complaint_of([&] { write_whole(nowhere, "text"); }),
              nowhere.string() + ": expected a file that can be written, got No such file or directory");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator()), 1);
}

}  // namespace
}  // namespace trocar
