#include "study/contact_baseline.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/input_error.hpp"
#include "study/kept_contacts.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

TEST(ContactBaseline, ReadsWhatItWrote) {
    ContactBaseline baseline{.source = "made up", .source_hash = "0123456789abcdef", .frames_hash = "fedcba9876543210"};
    baseline.ticks = 100;
    baseline.every = 20;
    baseline.detectors["one"] = three_contacts();
    baseline.detectors["two:k=1"] = three_contacts();
    baseline.detectors["three"] = {.outcome = "threw", .ticks = {}};
    baseline.detectors["one"].ticks[0].contacts[0].depth = Contact::unset;
    const TruthFigures truth{
        .ticks = 5, .pairs = 9, .reported = 8, .false_negatives = 3, .false_negatives_touch = 1, .false_positives = 2};
    baseline.detectors["recorded"] = three_contacts();
    baseline.detectors["recorded"].every = 1;
    baseline.detectors["recorded"].truth = truth;
    const std::string text = to_json(baseline);
    const ContactBaseline read = contact_baseline_from_json(text, "text");
    EXPECT_EQ(to_json(read), text);
    EXPECT_EQ(read.every, 20);
    EXPECT_EQ(read.detectors.at("three").outcome, "threw");
    EXPECT_EQ(read.detectors.at("recorded").truth, truth);
    EXPECT_EQ(read.every_of("recorded"), 1);
    EXPECT_EQ(read.every_of("three"), 20);
    EXPECT_TRUE(std::isnan(read.detectors.at("one").ticks[0].contacts[0].depth));
    EXPECT_EQ(read.detectors.at("two:k=1").ticks[1].contacts[0].depth, 3e-3);
}

TEST(ContactBaseline, TheFirstFormatIsRead) {
    const ContactBaseline read = contact_baseline_from_json(
        R"({"format":"trocar-baseline-1","source":"s","source_hash":"0","frames_hash":"0","ticks":8,"every":4,)"
        R"("detectors":{"d":{"outcome":"ok","contacts":0}},)"
        R"("contacts":[{"4":[[0,5,"touch",0.1,0.2,0.3,0,0,1,0.001]]}]})",
        "text");
    EXPECT_FALSE(read.detectors.at("d").truth.has_value());
    EXPECT_EQ(read.every_of("d"), 4);
    EXPECT_EQ(read.detectors.at("d").ticks.at(0).contacts.at(0).kind, ContactCase::touch);
    EXPECT_THROW(static_cast<void>(contact_baseline_from_json(
                     R"({"format":"trocar-baseline-1","source":"s","source_hash":"0","frames_hash":"0","ticks":8,)"
                     R"("every":4,"detectors":{"d":{"outcome":"ok","contacts":0,"every":1}},"contacts":[{}]})",
                     "text")),
                 InputError)
        << "every of an answer belongs to the second format";
}

TEST(ContactBaseline, TheSecondFormatIsReadWithItsOwnKeysOfTruth) {
    const auto baseline = [](const std::string& format, const std::string& keys) {
        return R"({"format":")" + format +
               R"(","source":"s","source_hash":"0","frames_hash":"0","ticks":8,"every":4,"detectors":{"d":{"outcome":"ok",)"
               R"("contacts":0,"truth":{"ticks":8,"pairs":7,)" +
               keys + R"(}}},"contacts":[{}]})";
    };
    const std::string old_keys = R"("told":6,"missing":3,"missing_touch":2,"extra":1)";
    const std::string new_keys = R"("reported":6,"false_negatives":3,"false_negatives_touch":2,"false_positives":1)";
    const TruthFigures expected{
        .ticks = 8, .pairs = 7, .reported = 6, .false_negatives = 3, .false_negatives_touch = 2, .false_positives = 1};
    const auto truth = [](const std::string& text) {
        return contact_baseline_from_json(text, "text").detectors.at("d").truth;
    };
    EXPECT_EQ(truth(baseline("trocar-baseline-2", old_keys)), expected);
    EXPECT_EQ(truth(baseline("trocar-baseline-3", new_keys)), expected);
    EXPECT_THROW(static_cast<void>(truth(baseline("trocar-baseline-3", old_keys))), InputError);
    EXPECT_THROW(static_cast<void>(truth(baseline("trocar-baseline-2", new_keys))), InputError);
}

TEST(ContactBaseline, BadFilesAreNamedWithTheirPlace) {
    const test::TemporaryFolder folder;
    const auto complaint = [&folder](const std::string& text) {
        return test::complaint_of([&] { (void)read_contact_baseline(folder.write("b.json", text)); });
    };
    const std::string head =
        R"({"format":"trocar-baseline-1","source":"s","source_hash":"0","frames_hash":"0","ticks":1,"every":1,)";
    test::expect_holds(complaint(head + R"("detectors":{"d":{"outcome":"ok","contacts":3}},"contacts":[{}]})"),
                       {"/detectors/d/contacts"});
    EXPECT_NE(complaint(head + R"("detectors":{},"contacts":[{"x":[]}]})").find("/contacts/0/x"), std::string::npos);
    test::expect_holds(complaint(head + R"("detectors":{},"contacts":[{"3":[[1,2]]}]})"), {"/contacts/0/3/0"});
    EXPECT_NE(complaint(R"({"format":"trocar-baseline-1")").find("line 1"), std::string::npos);
    EXPECT_THROW((void)read_contact_baseline(folder.path() / "none.json"), InputError);
}

}  // namespace
}  // namespace trocar
