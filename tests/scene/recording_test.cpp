#include "scene/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "geometry/input_error.hpp"
#include "support/program.hpp"
#include "support/recordings.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::RecordingText;

class RecordingFile : public testing::Test {
protected:
    [[nodiscard]] std::filesystem::path file() const { return folder.path() / "frames.trocrec"; }
    RecordingReader read(const std::string& bytes) { return RecordingReader(folder.write("frames.trocrec", bytes)); }
    std::string complaint_about(const std::string& bytes) {
        return test::complaint_about(file(), [&] { read(bytes); });
    }
    test::TemporaryFolder folder;
};

TEST_F(RecordingFile, BytesPutTogetherByteByByteAreRead) {
    RecordingReader reader = read(RecordingText().bytes());
    EXPECT_EQ(reader.dt(), 0.5);
    ASSERT_EQ(reader.frame_count(), 3);
    const Topology& topology = reader.topology();
    ASSERT_EQ(topology.body_count(), 2);
    EXPECT_EQ(topology.bodies[0].kind, BodyKind::tissue) << "the file's order is kept";
    EXPECT_EQ(topology.bodies[1].name, "b");
    EXPECT_EQ(topology.triangles.col(1), (Eigen::Matrix<Index, 3, 1>(3, 4, 5)));
    Frame frame;
    reader.read(0, frame);
    EXPECT_EQ(frame.previous, frame.position);
    EXPECT_EQ(frame.velocity, Matrix3X::Zero(3, 6));
    reader.read(2, frame);
    EXPECT_EQ(frame.tick, 2);
    EXPECT_EQ(frame.time, 1.0);
    EXPECT_EQ(frame.position(1, 4), RecordingText::coordinate(2, 4, 1));
    EXPECT_EQ(frame.previous(1, 4), RecordingText::coordinate(1, 4, 1));
    EXPECT_EQ(frame.velocity(1, 4), (RecordingText::coordinate(2, 4, 1) - RecordingText::coordinate(1, 4, 1)) / 0.5);
    EXPECT_FALSE(frame.moved.has_value());
    Frame again;
    reader.read(1, again);
    reader.read(2, again);
    EXPECT_EQ(again.previous, frame.previous);
}

TEST_F(RecordingFile, RangesInAnyOrderKeepTheFilesTriangleNumbers) {
    RecordingText text;
    std::swap(text.header["bodies"][0], text.header["bodies"][1]);
    RecordingReader reader = read(text.bytes());
    EXPECT_EQ(reader.topology().bodies[0].name, "b");
    EXPECT_EQ(reader.file_triangle(0), 1);
    EXPECT_EQ(reader.file_triangle(1), 0);
    Frame frame;
    reader.read(1, frame);
    EXPECT_EQ(frame.position(0, 0), RecordingText::coordinate(1, 3, 0)) << "vertex 0 of b is vertex 3 of the file";
}

TEST_F(RecordingFile, EveryTriangleOfABodyHasItsOwnCornersAndItsPlaceInTheFile) {
    RecordingText text;
    text.header["triangles"] = 5;
    text.header["bodies"][0]["triangles"] = {0, 2};
    text.header["bodies"][1]["triangles"] = {2, 3};
    text.triangles = {0, 1, 2, 2, 1, 0, 3, 4, 5, 5, 4, 3, 4, 3, 5};
    const Topology topology = read(text.bytes()).topology();
    EXPECT_EQ(topology.bodies[1].triangles, (Range{2, 3}));
    ASSERT_EQ(topology.triangle_count(), 5);
    for (Index t = 0; t < 5; ++t) {
        for (Index corner = 0; corner < 3; ++corner) {
            const auto reported = static_cast<Index>(text.triangles[static_cast<std::size_t>(3 * t + corner)]);
            EXPECT_EQ(topology.triangles(corner, t), reported) << t;
        }
    }
    // 16 bytes of beginning, the header as text, 4 bytes a corner.
    const std::size_t header = (text.header.dump().size() + 7) / 8 * 8;
    for (const std::size_t number : {4U, 11U, 14U}) {
        RecordingText spoiled = text;
        spoiled.triangles[number] = number < 6 ? 3 : 2;
        EXPECT_EQ(complaint_about(spoiled.bytes()), "byte " + std::to_string(16 + header + 4 * number) +
                                                        ": expected a vertex of body '" +
                                                        (number < 6 ? "a' (0 to 2), got 3" : "b' (3 to 5), got 2"));
    }
}

TEST_F(RecordingFile, WhatIsWrittenComesBackBitForBit) {
    const RecordingText text;
    Topology topology;
    Frame frame;
    {
        RecordingReader reader = read(text.bytes());
        topology = reader.topology();
        reader.read(1, frame);
    }
    frame.position(0, 0) = std::nextafter(0.1, 1.0);
    frame.position(2, 5) = std::numeric_limits<double>::quiet_NaN();
    const std::filesystem::path copy = folder.path() / "copy.trocrec";
    RecordingWriter writer(copy, topology, 1e-3);
    for (int i = 0; i < 12; ++i) writer.write(frame);
    EXPECT_FALSE(std::filesystem::exists(copy)) << "nothing half-written";
    writer.finish();
    RecordingReader reader(copy);
    EXPECT_EQ(reader.frame_count(), 12);
    EXPECT_EQ(reader.dt(), 1e-3);
    EXPECT_EQ(reader.topology().triangles, topology.triangles);
    EXPECT_EQ(reader.topology().body_pairs, topology.body_pairs);
    EXPECT_EQ(reader.topology().bodies[0].closed, topology.bodies[0].closed);
    Frame back;
    reader.read(11, back);
    EXPECT_EQ(std::memcmp(back.position.data(), frame.position.data(), sizeof(double) * 18), 0);
}

TEST_F(RecordingFile, BadHeadersAreNamed) {
    const std::vector<std::pair<std::function<void(RecordingText&)>, const char*>> cases{
        {[](RecordingText& t) { t.header["format"] = "x"; },
         "header: /format: expected one of trocar-recording-1, trocar-recording-2"},
        {[](RecordingText& t) { t.header["unit"] = "mm"; }, "header: /unit: expected m"},
        {[](RecordingText& t) { t.header["dt"] = 0; }, "header: /dt: expected a number > 0"},
        {[](RecordingText& t) { t.header["frames"] = -1; }, "header: /frames: expected an integer"},
        {[](RecordingText& t) { t.header["frames"] = 4; }, "expected 792 bytes"},
        {[](RecordingText& t) { t.header["vertices"] = 7; },
         "header: /bodies: expected every one of the 7 vertices in one body, got vertices 6 in none"},
        {[](RecordingText& t) { t.header["triangles"] = 3; }, "header: /bodies: expected every one of the 3 triangles"},
        {[](RecordingText& t) { t.header["extra"] = 1; }, "header: /extra: expected one of format"},
        {[](RecordingText& t) { t.header.erase("dt"); }, "header: /: expected the key 'dt', got none"},
        {[](RecordingText& t) { t.header["bodies"][0]["kind"] = "fluid"; },
         "header: /bodies/0/kind: expected one of instrument, rigid, tissue"},
        {[](RecordingText& t) { t.header["bodies"][1]["name"] = "a"; },
         "header: /bodies/1/name: expected a name of its own"},
        {[](RecordingText& t) { t.header["bodies"][0].erase("closed"); },
         "header: /bodies/0: expected the key 'closed'"},
        {[](RecordingText& t) {
             t.header["bodies"][0]["vertices"] = {0, 2};
         },
         "header: /bodies: expected every one of the 6 vertices in one body, got vertices 2 in none"},
        {[](RecordingText& t) {
             t.header["bodies"][0]["vertices"] = {0, 4};
         },
         "header: /bodies: expected every one of the 6 vertices in one body, got vertices 3 in two bodies"},
        {[](RecordingText& t) {
             t.header["bodies"][0]["vertices"] = {5, 4};
         },
         "header: /bodies/0/vertices: expected a range within the 6 vertices"},
        {[](RecordingText& t) { t.header["bodies"][0]["vertices"] = {0}; },
         "header: /bodies/0/vertices: expected [first, count]"},
        {[](RecordingText& t) {
             t.header["body_pairs"] = {{0, 2}};
         },
         "header: /body_pairs/0/1: expected an integer from 0 to 1"},
        {[](RecordingText& t) {
             t.header["body_pairs"] = {{1, 1}};
         },
         "header: /body_pairs/0: expected two different body numbers"},
        {[](RecordingText& t) { t.triangles[4] = 99; }, "byte "},
        {[](RecordingText& t) { t.triangles[4] = 0; }, "byte "},
        {[](RecordingText& t) { t.magic = "TROCREC2"; }, "byte 0: expected a recording that starts with TROCREC1"},
        {[](RecordingText& t) { t.tail = "x"; }, "expected "},
    };
    for (const auto& [spoil, start] : cases) {
        RecordingText text;
        spoil(text);
        const std::string complaint = complaint_about(text.bytes());
        EXPECT_EQ(complaint.rfind(std::string(start).substr(0, 11) == "expected 79" ? "expected " : start, 0), 0U)
            << "said:     " << complaint << "\nexpected: " << start;
    }
}

TEST_F(RecordingFile, TruncationAnywhereIsBadInputAndNeverACrash) {
    const std::string bytes = RecordingText().bytes();
    for (std::size_t length = 0; length < bytes.size(); length += length < 24 || length > 780 ? 1 : 5) {
        EXPECT_NE(complaint_about(bytes.substr(0, length)), "") << length;
    }
}

/// Of most flips no second source says whether the file is still one: there the test holds that nothing crashes. Two
/// kinds are known: another magic number or length of the header is none, and the very same bytes are.
TEST_F(RecordingFile, FlippedBytesNeverCrashAndAnotherBeginningIsRefused) {
    const std::string bytes = RecordingText().bytes();
    constexpr std::size_t beginning = 16;
    std::mt19937_64 random(7);
    int refused = 0;
    for (int trial = 0; trial < 400; ++trial) {
        std::string spoiled = bytes;
        for (int i = 0; i < 2; ++i) spoiled[random() % (i == 0 ? 420 : 60)] = static_cast<char>(random());
        const bool complains = !complaint_about(spoiled).empty();
        if (spoiled.compare(0, beginning, bytes, 0, beginning) != 0) {
            EXPECT_TRUE(complains) << trial;
            ++refused;
        }
        if (spoiled == bytes) {
            EXPECT_FALSE(complains) << trial;
        }
    }
    EXPECT_GT(refused, 50);
}

TEST_F(RecordingFile, ListedBodyPairsReplaceTheDefault) {
    RecordingText text;
    text.header["bodies"][0]["kind"] = "rigid";
    text.header["bodies"][1]["kind"] = "rigid";
    EXPECT_TRUE(read(text.bytes()).topology().body_pairs.empty());
    text.header["body_pairs"] = {{1, 0}};
    EXPECT_EQ(read(text.bytes()).topology().body_pairs.size(), 1U);
}

TEST(RecordingSchema, IsJsonThatNamesTheHeadersKeys) {
    const nlohmann::json schema = nlohmann::json::parse(recording_schema());
    const RecordingText text;
    for (const auto& [key, value] : text.header.items()) {
        EXPECT_TRUE(schema["properties"].contains(key)) << key;
    }
}

}  // namespace
}  // namespace trocar
