// Lines of gzip files: those of the plain file, and a refusal with its place where the file is not whole.
#include "geometry/gzip.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/program.hpp"
#include "support/text.hpp"
#include "support/unpacked.hpp"

namespace trocar {
namespace {

class Gzip : public testing::Test {
protected:
    /// Everything that is read until the end or a refusal, and the refusal without the file's name.
    [[nodiscard]] std::pair<std::string, std::string> read(const std::string& bytes) const {
        const std::filesystem::path file = folder_.write("lines.gz", bytes);
        std::string text;
        const std::string complaint = test::complaint_about(file, [&] { text = test::unpacked(file); });
        return {text, complaint};
    }
    /// 3000 numbered lines: compressed to several kilobytes.
    static std::string numbers() {
        std::string text;
        for (int i = 0; i < 3000; ++i) text += std::to_string(i * 7919 % 10007) + "\n";
        return text;
    }
    test::TemporaryFolder folder_;
};

TEST_F(Gzip, GivesTheLinesOfThePlainFile) {
    // Around the sizes that are taken at a time, with and without a line feed at the end.
    for (const std::size_t size : {0, 1, 4095, 4096, 65535, 65536, 65537, 1'000'000}) {
        for (const std::string& text :
             {std::string(size, 'x'), std::string(size, '\n'), numbers() + std::string(size, 'y')}) {
            const auto plain = open_lines(folder_.write("plain", text), "lines");
            const auto packed = open_lines(folder_.write("packed.gz", gzipped(text)), "lines");
            std::string expected;
            std::string line;
            while (read_line(*plain, expected, "plain")) {
                ASSERT_TRUE(read_line(*packed, line, "packed"));
                ASSERT_EQ(line, expected);
                ASSERT_EQ(packed->eof(), plain->eof());
            }
            EXPECT_FALSE(read_line(*packed, line, "packed"));
        }
    }
}

TEST_F(Gzip, WritesWhatGzipReadsWithoutNameAndTime) {
    const std::string packed = gzipped(numbers());
    // RFC 1952, 2.3: magic, deflate, no flags, no time, slowest compression.
    EXPECT_EQ(packed.substr(0, 9), std::string("\x1f\x8b\x08\0\0\0\0\0\x02", 9));
    EXPECT_EQ(gzipped(numbers()), packed);
    if (std::system("command -v gzip >/dev/null") != 0) GTEST_SKIP() << "no gzip";
    const std::string file = folder_.write("packed.gz", packed).string();
    const test::ProgramResult other = test::run_program("-dc " + file, "gzip");
    EXPECT_EQ(other.status, 0) << other.err;
    EXPECT_EQ(other.out, numbers());
}

TEST_F(Gzip, ReadsWhatGzipWritesAndSeveralMembersInARow) {
    if (std::system("command -v gzip >/dev/null") != 0) GTEST_SKIP() << "no gzip";
    const std::string file = folder_.write("lines", numbers()).string();
    ASSERT_EQ(test::run_program("-kN1 " + file, "gzip").status, 0);
    const std::string packed = test::read_file(file + ".gz");
    ASSERT_NE(packed.find("lines"), std::string::npos) << "a header with a name";
    EXPECT_EQ(read(packed).first, numbers());
    EXPECT_EQ(read(packed + gzipped("") + gzipped("end\n")).first, numbers() + "end\n");
}

TEST_F(Gzip, CutAnywhereItIsRefusedWithThePlace) {
    const std::string packed = gzipped(numbers());
    ASSERT_GT(packed.size(), 3000U);
    for (std::size_t size = 0; size < packed.size(); size += size < 40 || size + 40 > packed.size() ? 1 : 97) {
        EXPECT_EQ(read(packed.substr(0, size)).second,
                  "byte " + std::to_string(size) + ": expected a whole gzip file, got its end");
    }
    EXPECT_EQ(read(packed).second, "");
}

TEST_F(Gzip, AChangedByteIsRefusedOrChangesNothing) {
    const std::string packed = gzipped(numbers());
    std::size_t refused = 0;
    for (std::size_t at = 0; at < packed.size(); at += at < 40 || at + 40 > packed.size() ? 1 : 97) {
        std::string broken = packed;
        broken[at] = static_cast<char>(broken[at] ^ 0x11);
        const auto [text, complaint] = read(broken);
        if (complaint.empty()) {
            EXPECT_EQ(text, numbers()) << at;
            EXPECT_TRUE(at >= 4 && at < 10) << at << " is more than a time, a level or a system";
        } else {
            EXPECT_TRUE(complaint.starts_with("byte ") && complaint.find(": expected ") != std::string::npos)
                << complaint;
            ++refused;
        }
    }
    EXPECT_GT(refused, 80U);
    EXPECT_EQ(read("plain text\n").second, "byte 2: expected gzip data, got incorrect header check");
    EXPECT_EQ(read(packed + "more").second,
              "byte " + std::to_string(packed.size() + 2) + ": expected gzip data, got incorrect header check");
}

TEST_F(Gzip, ABombIsRefusedBeforeItTakesMemory) {
    const std::string line = gzipped(std::string(999'999, 'x') + "\n");
    std::string lines;
    for (int i = 0; i < 401; ++i) lines += line;
    EXPECT_LT(lines.size(), 1'000'000U);
    const std::filesystem::path file = folder_.write("lines.gz", lines);
    const auto stream = open_lines(file, "lines");
    std::size_t count = 0;
    std::string text;
    const std::string complaint = test::complaint_of([&] {
        while (read_line(*stream, text, "lines")) ++count;
    });
    EXPECT_EQ(count, 400U);
    EXPECT_NE(complaint.find("expected at most 400 MB unpacked (--large lifts this), got more"), std::string::npos)
        << complaint;
    EXPECT_EQ(read(gzipped(std::string(30'000'000, 'x'))).second,
              "expected at most 24 MB of a line (--large lifts this), got more");
}

TEST_F(Gzip, NothingAndAFolderAreNoFile) {
    EXPECT_EQ(test::complaint_of([&] { (void)open_lines(folder_.path() / "none.gz", "records"); }),
              (folder_.path() / "none.gz").string() + ": expected records, got no such file");
    std::filesystem::create_directories(folder_.path() / "inner.gz");
    EXPECT_EQ(test::complaint_of([&] { (void)open_lines(folder_.path() / "inner.gz", "records"); }),
              (folder_.path() / "inner.gz").string() + ": expected records, got a folder");
}

}  // namespace
}  // namespace trocar
