#include "scene/recorded_contacts.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "contact/contact.hpp"
#include "scene/recording.hpp"
#include "support/program.hpp"
#include "support/recordings.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::RecordingText;

/// The three frames of RecordingText with contacts as the format's description spells them.
RecordingText with_contacts(const std::string& lines, int ticks) {
    RecordingText text;
    text.header["format"] = "trocar-recording-2";
    text.tail = R"({"format":"trocar-contacts-1","ticks":)" + std::to_string(ticks) + "}\n" + lines;
    return text;
}

const std::string full_line =
    R"({"tick":0,"contacts":[{"bodies":["a","b"],"triangles":[0,1],"point":[0.1,0.2,0.3],"normal":[0,0.6,0.8],"depth":-0.001}]})"
    "\n";

class RecordedContacts : public testing::Test {
protected:
    [[nodiscard]] std::filesystem::path file() const { return folder.path() / "frames.trocrec"; }
    [[nodiscard]] RecordingReader read(const RecordingText& text) const {
        return RecordingReader(folder.write("frames.trocrec", text.bytes()));
    }
    /// Without the file's name in front; empty: none.
    [[nodiscard]] std::string complaint_about(const std::string& lines, int ticks = 1) const {
        return test::complaint_about(file(), [&] { static_cast<void>(read(with_contacts(lines, ticks)).contacts()); });
    }
    test::TemporaryFolder folder;
};

TEST_F(RecordedContacts, LinesPutTogetherByteByByteAreRead) {
    RecordingReader reader = read(
        with_contacts(full_line + R"({"tick":2,"contacts":[{"bodies":["b","a"],"triangles":[1,0],"normal":[1,0,0]},)"
                                  R"({"bodies":["a","b"],"triangles":[0,1]}]})"
                                  "\n",
                      2));
    ASSERT_TRUE(reader.has_contacts());
    const std::vector<RecordedTick> ticks = reader.contacts();
    ASSERT_EQ(ticks.size(), 2U) << "nothing is reported frame 1";
    EXPECT_EQ(ticks[0].tick, 0);
    const RecordedContact& first = ticks[0].contacts.at(0);
    EXPECT_EQ(first.a, 0);
    EXPECT_EQ(first.b, 1);
    EXPECT_EQ(first.point, Vector3(0.1, 0.2, 0.3));
    EXPECT_EQ(first.normal, Vector3(0.0, 0.6, 0.8));
    EXPECT_EQ(first.depth, -0.001);
    EXPECT_EQ(ticks[1].tick, 2);
    ASSERT_EQ(ticks[1].contacts.size(), 2U) << "a pair may have several";
    EXPECT_EQ(ticks[1].contacts[0].a, 0);
    EXPECT_EQ(ticks[1].contacts[0].normal, Vector3(-1.0, 0.0, 0.0)) << "reported from b to a";
    EXPECT_TRUE(ticks[1].contacts[0].point.array().isNaN().all());
    EXPECT_TRUE(std::isnan(ticks[1].contacts[1].depth));
    Frame frame;
    reader.read(2, frame);
    EXPECT_EQ(frame.position(1, 4), RecordingText::coordinate(2, 4, 1)) << "frames are read as ever";
}

TEST_F(RecordedContacts, OfARecordingWithoutThemThereAreNone) {
    RecordingReader reader = read(RecordingText());
    EXPECT_FALSE(reader.has_contacts());
    EXPECT_TRUE(reader.contacts().empty());
}

TEST_F(RecordedContacts, DoNotCountInTheHash) {
    const std::uint64_t one = read(with_contacts(full_line, 1)).hash();
    EXPECT_EQ(read(with_contacts("", 0)).hash(), one);
    RecordingText moved = with_contacts(full_line, 1);
    moved.positions[3] += 1e-9;
    EXPECT_NE(read(moved).hash(), one);
}

TEST_F(RecordedContacts, TrianglesAreNumberedAsInTheFile) {
    RecordingText text = with_contacts(full_line, 1);
    std::swap(text.header["bodies"][0], text.header["bodies"][1]);
    const RecordedContact contact = read(text).contacts().at(0).contacts.at(0);
    EXPECT_EQ(contact.a, 0) << "b comes first now, and its triangle is 1 in the file";
    EXPECT_EQ(contact.b, 1);
    EXPECT_EQ(contact.normal, Vector3(0.0, -0.6, -0.8));
}

TEST_F(RecordedContacts, WhatIsAddedComesBackBitForBit) {
    const Topology topology = read(RecordingText()).topology();
    Frame frame;
    frame.position = Matrix3X::Random(3, 6);
    RecordedContact contact{.a = 0, .b = 1};
    contact.point = {std::nextafter(0.1, 1.0), 1e-300, -3.0};
    contact.normal = {0.0, 0.0, -1.0};
    contact.depth = 1.0 / 3.0;
    Contact own;
    own.a = 1;
    own.b = 0;
    own.normal = {0.0, 0.0, 1.0};
    RecordingWriter writer(file(), topology, 1e-3);
    writer.write(frame);
    writer.add(frame, {contact, {.a = 0, .b = 1}});
    writer.add(frame, std::vector<RecordedContact>{});
    writer.add(frame, std::vector<Contact>{own});
    writer.add(frame, std::vector<TrianglePair>{{.a = 0, .b = 1}});
    writer.finish();
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
    RecordingReader reader(file());
    EXPECT_EQ(reader.frame_count(), 5);
    const std::vector<RecordedTick> ticks = reader.contacts();
    ASSERT_EQ(ticks.size(), 4U) << "write says nothing of contacts, an empty list that there are none";
    EXPECT_EQ(ticks[0].tick, 1);
    EXPECT_EQ(ticks[0].contacts.at(0).point, contact.point);
    EXPECT_EQ(ticks[0].contacts.at(0).normal, contact.normal);
    EXPECT_EQ(ticks[0].contacts.at(0).depth, contact.depth);
    EXPECT_TRUE(std::isnan(ticks[0].contacts.at(1).depth));
    EXPECT_TRUE(ticks[1].contacts.empty());
    EXPECT_EQ(ticks[2].contacts.at(0).a, 0);
    EXPECT_EQ(ticks[2].contacts.at(0).normal, Vector3(0.0, 0.0, -1.0)) << "turned with the pair";
    EXPECT_EQ(ticks[3].contacts.at(0).b, 1);
    EXPECT_TRUE(ticks[3].contacts.at(0).normal.array().isNaN().all());
    Frame back;
    reader.read(3, back);
    EXPECT_EQ(back.position, frame.position);
}

TEST_F(RecordedContacts, AWriterThatAddsNoneWritesTheFirstFormatByteForByte) {
    const Topology topology = read(RecordingText()).topology();
    Frame frame;
    frame.position = Matrix3X::Zero(3, 6);
    {
        RecordingWriter writer(file(), topology, 1e-3);
        writer.write(frame);
        writer.finish();
    }
    const std::string bytes = test::read_file(file());
    EXPECT_NE(bytes.find(R"("format":"trocar-recording-1")"), std::string::npos);
    RecordingWriter writer(file(), topology, 1e-3);
    writer.add(frame, std::vector<RecordedContact>{});
    writer.finish();
    std::string second = test::read_file(file());
    second.resize(bytes.size());
    second.replace(second.find("recording-2"), 11, "recording-1");
    EXPECT_EQ(second, bytes) << "up to the contacts the two differ by the format's number";
}

TEST_F(RecordedContacts, AnUnfinishedRecordingLeavesNothing) {
    const Topology topology = read(RecordingText()).topology();
    std::filesystem::remove(file());
    {
        RecordingWriter writer(file(), topology, 1e-3);
        Frame frame;
        frame.position = Matrix3X::Zero(3, 6);
        writer.add(frame, {{.a = 0, .b = 1}});
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    EXPECT_THROW(RecordingWriter(folder.path() / "no" / "such" / "folder.trocrec", topology, 1e-3), InputError);
}

TEST_F(RecordedContacts, TheWriterRefusesWhatTheReaderWould) {
    const Topology topology = read(RecordingText()).topology();
    Frame frame;
    frame.position = Matrix3X::Zero(3, 6);
    RecordingWriter writer(file(), topology, 1e-3);
    const auto complaint = [&](const RecordedContact& contact) {
        return test::complaint_of([&] { writer.add(frame, {{.a = 0, .b = 1}, contact}); });
    };
    const Vector3 up{0.0, 0.0, 1.0};
    const Vector3 none = Vector3::Constant(not_known);
    const double infinite = std::numeric_limits<double>::infinity();
    const std::vector<std::pair<RecordedContact, const char*>> cases{
        {{.a = 0, .b = 2}, "frame 0: contact 1: expected a triangle number below 2, got 2"},
        {{.a = -1, .b = 1}, "expected a triangle number below 2, got -1"},
        {{.a = 1, .b = 1}, "expected two bodies that are tested against each other (body_pairs), got 'b' and 'b'"},
        {{.a = 0, .b = 1, .point = {0.0, not_known, 0.0}}, "expected a point of three finite numbers"},
        {{.a = 0, .b = 1, .point = {0.0, infinite, 0.0}}, "expected a point of three finite numbers"},
        {{.a = 0, .b = 1, .point = none, .normal = 1.001 * up}, "expected a normal of length 1, to 1e-6, got 1.001"},
        {{.a = 0, .b = 1, .point = none, .normal = up, .depth = infinite}, "expected a finite depth"},
    };
    for (const auto& [contact, expected] : cases) {
        EXPECT_NE(complaint(contact).find(expected), std::string::npos) << complaint(contact) << "\n" << expected;
    }
    writer.write(frame);
    writer.finish();
    RecordingReader reader(file());
    EXPECT_EQ(reader.frame_count(), 1) << "what was refused was not written";
    EXPECT_FALSE(reader.has_contacts());
}

TEST_F(RecordedContacts, BadLinesAreNamedWithTheirNumber) {
    const auto spoiled = [](const std::string& from, const std::string& to) {
        std::string line = full_line;
        const std::size_t where = line.find(from);
        EXPECT_NE(where, std::string::npos) << from;
        return line.replace(where, from.size(), to);
    };
    const std::vector<std::pair<std::string, const char*>> cases{
        {spoiled(R"(["a","b"])", R"(["a","c"])"),
         "contacts line 2: /contacts/0/bodies/1: expected the name of a body of the recording, got \"c\""},
        {spoiled(R"(["a","b"])", R"(["a","a"])"),
         "contacts line 2: /contacts/0/bodies: expected two bodies that are tested against each other"},
        {spoiled(R"(["a","b"])", R"(["a"])"), "contacts line 2: /contacts/0/bodies: expected the names of two bodies"},
        {spoiled("[0,1]", "[0,2]"), "contacts line 2: /contacts/0/triangles/1: expected an integer from 0 to 1, got 2"},
        {spoiled("[0,1]", "[1,0]"),
         "contacts line 2: /contacts/0/triangles/0: expected a triangle of body 'a' (0 to 0), got 1"},
        {spoiled("[0,1]", "[0]"), "contacts line 2: /contacts/0/triangles: expected the numbers of two triangles"},
        {spoiled("0.3]", "NaN]"), "contacts line 2, column 78: expected JSON"},
        {spoiled("0.3]", "1e999]"), "contacts line 2: "},
        {spoiled("0.3]", "null]"), "contacts line 2: /contacts/0/point/2: expected "},
        {spoiled("[0,0.6,0.8]", "[0,0.6,0.81]"),
         "contacts line 2: /contacts/0/normal: expected a normal of length 1, to 1e-6, got 1.008"},
        {spoiled("-0.001", "\"deep\""), "contacts line 2: /contacts/0/depth: expected "},
        {spoiled("\"depth\"", "\"deep\""), "contacts line 2: /contacts/0/deep: expected one of bodies"},
        {spoiled("\"tick\":0", "\"tick\":3"), "contacts line 2: /tick: expected an integer from 0 to 2, got 3"},
        {spoiled("\n", ""), "contacts line 2: expected a line feed at its end, got the end of the file"},
        {"", "contacts line 2: expected 1 lines of ticks after the first one, got 0"},
        {full_line + full_line, "contacts line 3: expected the end of the file, got another line"},
    };
    for (const auto& [lines, start] : cases) {
        const std::string complaint = complaint_about(lines);
        EXPECT_EQ(complaint.rfind(start, 0), 0U) << "said:     " << complaint << "\nexpected: " << start;
    }
    EXPECT_EQ(complaint_about(full_line + full_line, 2)
                  .rfind("contacts line 3: /tick: expected a tick after the line before, 1 at least, got 0", 0),
              0U);
}

TEST_F(RecordedContacts, ABadHeadIsNamed) {
    RecordingText text = with_contacts("", 0);
    const auto complaint = [&](const std::string& tail) {
        text.tail = tail;
        return test::complaint_of([&] { static_cast<void>(read(text).contacts()); });
    };
    EXPECT_NE(complaint("").find("contacts line 1: expected a line with the format trocar-contacts-1, got none"),
              std::string::npos);
    EXPECT_NE(complaint("{\"format\":\"trocar-contacts-2\",\"ticks\":0}\n").find("contacts line 1: /format"),
              std::string::npos);
    EXPECT_NE(complaint("{\"format\":\"trocar-contacts-1\",\"ticks\":4}\n").find("contacts line 1: /ticks"),
              std::string::npos);
    EXPECT_EQ(complaint("{\"format\":\"trocar-contacts-1\",\"ticks\":0}\n"), "");
    text.header["frames"] = 4;
    EXPECT_NE(complaint("").find("4 frames need, and contacts after them"), std::string::npos) << complaint("");
    text.header["frames"] = 2;
    EXPECT_NE(complaint("").find("contacts line 1"), std::string::npos) << "a frame is no contact";
}

}  // namespace
}  // namespace trocar
