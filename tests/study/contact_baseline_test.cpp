#include "study/contact_baseline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "geometry/input_error.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

Contact contact_at(Index a, Index b, double depth) {
    Contact contact;
    contact.a = a;
    contact.b = b;
    contact.kind = ContactCase::a_enters_b;
    contact.point = {0.25, 0.25, -depth};
    contact.normal = {0.0, 0.0, 1.0};
    contact.depth = depth;
    return contact;
}

BaselineAnswer three_contacts() {
    return {.ticks = {{.tick = 0, .contacts = {contact_at(0, 5, 1e-3), contact_at(2, 5, 2e-3)}},
                      {.tick = 40, .contacts = {contact_at(0, 6, 3e-3)}}}};
}

const BaselineTolerance nanometre;

TEST(ContactBaseline, TheSameAnswerIsTheSame) {
    const AnswerDifference found = compare_answers(three_contacts(), three_contacts(), nanometre);
    EXPECT_TRUE(found.within(nanometre));
    EXPECT_EQ(found.compared, 3);
}

TEST(ContactBaseline, OneWrongContactAmongThousandsIsTheWorstNotTheMean) {
    BaselineAnswer before;
    for (Index i = 0; i < 5000; ++i) before.ticks.push_back({.tick = i, .contacts = {contact_at(i, i + 1, 1e-3)}});
    BaselineAnswer after = before;
    after.ticks[777].contacts[0].depth += 5e-6;
    const AnswerDifference found = compare_answers(before, after, nanometre);
    EXPECT_FALSE(found.within(nanometre));
    EXPECT_NEAR(found.worst_depth, 5e-6, 1e-18);
    EXPECT_EQ(found.worst_point, 0.0);
    EXPECT_NE(found.example.find("tick 777, triangles 777 and 778"), std::string::npos) << found.example;
}

TEST(ContactBaseline, ATurnedNormalIsMeasuredAsAnAngle) {
    BaselineAnswer after = three_contacts();
    after.ticks[1].contacts[0].normal = {std::sin(0.01), 0.0, std::cos(0.01)};
    EXPECT_NEAR(compare_answers(three_contacts(), after, nanometre).worst_angle, 0.01, 1e-12);
    after.ticks[1].contacts[0].normal = {0.0, 0.0, -1.0};
    EXPECT_NEAR(compare_answers(three_contacts(), after, nanometre).worst_angle, std::acos(-1.0), 1e-12);
}

TEST(ContactBaseline, GoneAndNewContactsAreCountedApart) {
    BaselineAnswer after = three_contacts();
    after.ticks[0].contacts.erase(after.ticks[0].contacts.begin());
    after.ticks[1].contacts.push_back(contact_at(7, 9, 1e-3));
    after.ticks[1].contacts.push_back(contact_at(8, 9, 1e-3));
    const AnswerDifference found = compare_answers(three_contacts(), after, nanometre);
    EXPECT_EQ(found.missing, 1);
    EXPECT_EQ(found.extra, 2);
    EXPECT_EQ(found.compared, 2);
    EXPECT_FALSE(found.within({.length = 1.0, .angle = 10.0}));
}

TEST(ContactBaseline, ANumberThatIsLostIsInfinitelyWrong) {
    BaselineAnswer after = three_contacts();
    after.ticks[0].contacts[1].depth = Contact::unset;
    EXPECT_TRUE(std::isinf(compare_answers(three_contacts(), after, nanometre).worst_depth));
    EXPECT_TRUE(compare_answers(after, after, nanometre).within(nanometre)) << "unset on both sides is the same";
}

TEST(ContactBaseline, AnotherOutcomeOrKindIsAChange) {
    BaselineAnswer after = three_contacts();
    after.outcome = "crashed";
    EXPECT_FALSE(compare_answers(three_contacts(), after, nanometre).within(nanometre));
    after = three_contacts();
    after.ticks[0].contacts[0].kind = ContactCase::edges_cross;
    EXPECT_EQ(compare_answers(three_contacts(), after, nanometre).other_kind, 1);
}

TEST(ContactBaseline, ReadsWhatItWrote) {
    ContactBaseline baseline{.source = "made up", .source_hash = "0123456789abcdef", .frames_hash = "fedcba9876543210"};
    baseline.ticks = 100;
    baseline.every = 20;
    baseline.detectors["one"] = three_contacts();
    baseline.detectors["two:k=1"] = three_contacts();
    baseline.detectors["three"] = {.outcome = "threw", .ticks = {}};
    baseline.detectors["one"].ticks[0].contacts[0].depth = Contact::unset;
    const std::string text = to_json(baseline);
    const ContactBaseline read = contact_baseline_from_json(text, "text");
    EXPECT_EQ(to_json(read), text);
    EXPECT_EQ(read.every, 20);
    EXPECT_EQ(read.detectors.at("three").outcome, "threw");
    EXPECT_TRUE(std::isnan(read.detectors.at("one").ticks[0].contacts[0].depth));
    EXPECT_EQ(read.detectors.at("two:k=1").ticks[1].contacts[0].depth, 3e-3);
}

TEST(ContactBaseline, BadFilesAreNamedWithTheirPlace) {
    const test::TemporaryFolder folder;
    const auto complaint = [&folder](const std::string& text) {
        const std::filesystem::path file = folder.path() / "b.json";
        std::ofstream(file) << text;
        try {
            (void)read_contact_baseline(file);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string head =
        R"({"format":"trocar-baseline-1","source":"s","source_hash":"0","frames_hash":"0","ticks":1,"every":1,)";
    EXPECT_NE(complaint(head + R"("detectors":{"d":{"outcome":"ok","contacts":3}},"contacts":[{}]})")
                  .find("/detectors/d/contacts"),
              std::string::npos);
    EXPECT_NE(complaint(head + R"("detectors":{},"contacts":[{"x":[]}]})").find("/contacts/0/x"), std::string::npos);
    EXPECT_NE(complaint(head + R"("detectors":{},"contacts":[{"3":[[1,2]]}]})").find("/contacts/0/3/0"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"format":"trocar-baseline-1")").find("line 1"), std::string::npos);
    EXPECT_THROW((void)read_contact_baseline(folder.path() / "none.json"), InputError);
}

}  // namespace
}  // namespace trocar
