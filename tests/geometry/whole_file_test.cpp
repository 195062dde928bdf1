// Files read and written as a whole: what is wrong is told, and nothing half-written stays.
#include "geometry/whole_file.hpp"

#include <gtest/gtest.h>

#include <string>

#include "geometry/input_error.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

class WholeFile : public testing::Test {
protected:
    void SetUp() override { std::filesystem::create_directories(folder_ / "inner"); }

    const test::TemporaryFolder place_;
    const std::filesystem::path folder_ = place_.path();
};

template <typename Call>
std::string fault_of(Call call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no fault";
}

TEST_F(WholeFile, ComesBackByteForByteAndOverAnOlderOne) {
    const std::string bytes("a\r\n\0b", 5);
    for (const std::string& content : {bytes, std::string()}) {
        write_whole(folder_ / "file", content);
        EXPECT_EQ(read_whole(folder_ / "file", "bytes"), content);
    }
}

TEST_F(WholeFile, AFolderOrNothingIsNoFile) {
    EXPECT_EQ(fault_of([this] { (void)read_whole(folder_ / "inner", "a study file"); }),
              (folder_ / "inner").string() + ": expected a study file, got a folder");
    EXPECT_EQ(fault_of([this] { (void)read_whole(folder_ / "none", "a study file"); }),
              (folder_ / "none").string() + ": expected a study file, got no such file");
}

TEST_F(WholeFile, WhatCannotBeWrittenLeavesNothingBehind) {
    const std::filesystem::path taken = folder_ / "inner";  // a folder cannot be replaced by a file
    EXPECT_EQ(fault_of([&] { write_whole(taken, "text"); }),
              taken.string() + ": expected a file that can be written, got Is a directory");
    const std::filesystem::path nowhere = folder_ / "none" / "file";
    EXPECT_EQ(fault_of([&] { write_whole(nowhere, "text"); }),
              nowhere.string() + ": expected a file that can be written, got No such file or directory");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator()), 1);
}

}  // namespace
}  // namespace trocar
