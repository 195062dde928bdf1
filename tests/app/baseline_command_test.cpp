#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/commands.hpp"
#include "support/recordings.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;

/// Apart in frame 0, `depth` below a with one corner in frame 1.
test::RecordingText two_frames(double depth) { return test::standing_at({1.0, -depth}); }

class Baseline : public testing::Test {
protected:
    Baseline() { put(two_frames(0.5)); }
    [[nodiscard]] std::string words(const std::string& what, const std::string& options) const {
        return "baseline " + what + " " + (folder.path() / "frames.trocrec").string() + " " + options;
    }
    [[nodiscard]] test::ProgramResult run(const std::string& what, const std::string& options) const {
        return test::run_program(words(what, options));
    }
    void put(const test::RecordingText& text) const { folder.write("frames.trocrec", text.bytes()); }
    [[nodiscard]] Json read_kept() const { return Json::parse(test::read_file(kept_file)); }
    void write_kept(const Json& baseline) const { std::ofstream(kept_file) << baseline; }
    [[nodiscard]] std::string state(const test::ProgramResult& result) const { return answer(result)["state"]; }
    [[nodiscard]] static Json answer(const test::ProgramResult& result) {
        return Json::parse(result.out)["sources"][0]["detectors"][0];
    }
    test::TemporaryFolder folder;
    const std::filesystem::path kept_file = folder.path() / "baseline" / "frames.json";
};

TEST_F(Baseline, StoresTheContactThatTheCoordinatesReport) {
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    const Json stored = read_kept();
    ASSERT_EQ(stored["contacts"][0].size(), 1U) << "frame 0 is free";
    const Json& contact = stored["contacts"][0]["1"][0];
    EXPECT_EQ(contact[0], 0);
    EXPECT_EQ(contact[1], 1);
    EXPECT_EQ(contact[9], 0.5) << "the corner is 0.5 below the plane";
    EXPECT_EQ(run("check", "--detector ohc").status, 0);
}

TEST_F(Baseline, WithoutKeptContactsACheckFails) {
    const test::ProgramResult result = run("check", "--detector ohc --json");
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(state(result), "missing");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "baseline"));
}

TEST_F(Baseline, ADetectorThatWasNeverWrittenIsNoFailure) {
    const test::ProgramResult written = run("write", "--detector ohc --json");
    EXPECT_EQ(written.status, 0);
    EXPECT_EQ(state(written), "new") << "not missing: this is what writing is for";
    const test::ProgramResult result = run("check", "--detector brute_force --json");
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(state(result), "new");
    EXPECT_EQ(answer(result)["truth"]["pairs"], 1) << "truth can be reported all the same";
    EXPECT_EQ(answer(result)["truth"]["false_negatives"], 0);
}

TEST_F(Baseline, WithoutDetectorItChecksWhatIsStored) {
    ASSERT_EQ(run("write", "--detector ohc --detector brute_force").status, 0);
    const Json document = Json::parse(run("check", "--json").out);
    ASSERT_EQ(document["sources"][0]["detectors"].size(), 2U);
    EXPECT_EQ(document["sources"][0]["detectors"][0]["detector"], "brute_force");
    EXPECT_EQ(document["sources"][0]["detectors"][1]["detector"], "ohc");
}

TEST_F(Baseline, OtherFramesAreJudgedByTruthAloneAndThatIsSaid) {
    ASSERT_EQ(run("write", "--detector ohc --detector ohc:work_budget=1 --every 1").status, 0);
    put(two_frames(0.25));
    test::ProgramResult result = run("check", "--detector ohc");
    EXPECT_EQ(result.status, 0);
    test::expect_holds(result.out, {"the frames are others than those whose contacts are kept: judged by truth alone"});
    EXPECT_EQ(state(run("check", "--detector ohc --json")), "no_worse");
    EXPECT_EQ(state(run("check", "--detector ohc:work_budget=1 --json")), "no_worse") << "it missed the pair before";
    // Now as if it had found all of them.
    Json stored = read_kept();
    stored["detectors"]["ohc:work_budget=1"]["truth"] = stored["detectors"]["ohc"]["truth"];
    write_kept(stored);
    result = run("check", "--detector ohc:work_budget=1 --json");
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(state(result), "worse");
    EXPECT_EQ(Json::parse(result.out)["sources"][0]["frames"], "changed");
    const Json missed = answer(result)["worst"][0];
    EXPECT_EQ(missed["what"], "missed");
    EXPECT_EQ(missed["tick"], 1);
    EXPECT_EQ(missed["bodies"], Json({"a", "b"}));
    EXPECT_EQ(missed["before"]["depth_m"], 0.25) << "what the coordinates report";
}

TEST_F(Baseline, ADetectorThatHasLeftFailsUnlessOthersWereAskedFor) {
    ASSERT_EQ(run("write", "--detector ohc").status, 0);
    Json stored = read_kept();
    stored["detectors"]["departed"] = {{"outcome", "ok"}, {"contacts", 0}};
    write_kept(stored);
    EXPECT_EQ(run("check", "--detector ohc").status, 0) << "only what was asked for";
    for (const char* options : {"", "--detector all"}) {
        const test::ProgramResult result = run("check", options);
        EXPECT_EQ(result.status, 1);
        EXPECT_NE(result.out.find("departed                         gone"), std::string::npos) << result.out;
    }
}

TEST_F(Baseline, AChangedContactIsReportedBeforeAndAfterAndOnlyWriteTakesItOver) {
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    Json stored = read_kept();
    stored["contacts"][0]["1"][0][9] = 0.5001;
    write_kept(stored);
    const std::string before = test::read_file(kept_file);
    const test::ProgramResult result = run("check", "--detector ohc");
    EXPECT_EQ(result.status, 1);
    test::expect_holds(result.out, {"depth 0.5001 m", "-> b_enters_a depth 0.5 m"});
    EXPECT_EQ(test::read_file(kept_file), before) << "a check writes nothing";
    EXPECT_EQ(run("check", "--detector ohc --tolerance 1e-3").status, 0);
    ASSERT_EQ(run("write", "--detector ohc").status, 0);
    EXPECT_EQ(run("check", "--detector ohc").status, 0);
}

TEST_F(Baseline, WritingOneAnswerLeavesTheOthersAsTheyWereWhileTheFramesAreTheSame) {
    ASSERT_EQ(run("write", "--detector ohc --detector brute_force --every 1").status, 0);
    const Json before = read_kept();
    ASSERT_EQ(run("write", "--detector ohc").status, 0);
    EXPECT_EQ(read_kept(), before);
    // One that is asked on every second frame from now on; the other one is known on both.
    ASSERT_EQ(run("write", "--detector ohc --every 2").status, 0);
    const Json after = read_kept();
    EXPECT_EQ(after.at("every"), 2);
    const Json& kept = after.at("detectors").at("brute_force");
    EXPECT_EQ(kept.at("every"), 1);
    EXPECT_EQ(kept.at("outcome"), "ok");
    EXPECT_EQ(kept.at("truth"), before.at("detectors").at("brute_force").at("truth"));
    EXPECT_EQ(after.at("contacts").at(kept.at("contacts").get<std::size_t>()), before.at("contacts").at(0));
    EXPECT_EQ(run("check", "").status, 0);
    // Of other frames it is worth nothing.
    put(two_frames(0.25));
    const test::ProgramResult other = run("write", "--detector ohc");
    EXPECT_EQ(other.status, 0);
    EXPECT_NE(other.out.find("it was not asked, and what was kept is of other frames"), std::string::npos) << other.out;
    EXPECT_FALSE(read_kept().at("detectors").contains("brute_force"));
}

TEST_F(Baseline, OnOtherFramesTruthOfBothIsReportedAsFarAsItIsKnown) {
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    put(two_frames(0.25));
    const std::string right = "0 of 1 pairs missed, 0 of 1 reported untrue, on 2 ticks";
    test::expect_holds(run("check", "--detector ohc").out, {"truth: " + right + "; kept: " + right});
    // The first format had no truth: nothing may be wrong now.
    Json stored = read_kept();
    stored["format"] = "trocar-baseline-1";
    stored["detectors"]["ohc"].erase("truth");
    write_kept(stored);
    const test::ProgramResult result = run("check", "--detector ohc");
    EXPECT_EQ(result.status, 0) << result.out << result.err;
    EXPECT_NE(result.out.find("truth: " + right), std::string::npos) << result.out;
    EXPECT_EQ(result.out.find("; kept: "), std::string::npos) << result.out;
}

TEST_F(Baseline, AParameterThatLosesPairsIsSeen) {
    ASSERT_EQ(run("write", "--detector ohc --every 1").status, 0);
    // The same stored answer, now expected of a detector that a budget of nothing keeps from looking.
    Json stored = read_kept();
    stored["detectors"]["ohc:work_budget=1"] = stored["detectors"]["ohc"];
    write_kept(stored);
    const test::ProgramResult result = run("check", "--detector ohc:work_budget=1");
    EXPECT_EQ(result.status, 1);
    test::expect_holds(result.out, {"1 missing", "outcome ok -> truncated"});
}

TEST_F(Baseline, BadInputIsNamed) {
    test::expect_refused("baseline check " + (folder.path() / "nowhere.trocrec").string());
    EXPECT_EQ(run("keep", "").status, 2);
    EXPECT_EQ(run("check", "--detector nobody").status, 2);
    EXPECT_EQ(run("check", "--every 0").status, 2);
    EXPECT_EQ(run("check", "--detector recorded").status, 2) << "it carries none";
    EXPECT_EQ(run("write", "--junit " + (folder.path() / "j.xml").string()).status, 2);
}

/// Two frames with contacts of somebody's own: the second has the pair that truly meets, the first has none.
class RecordedBaseline : public Baseline {
protected:
    RecordedBaseline() { put_with(whole); }
    static std::string contact(const std::string& rest) {
        return R"({"bodies":["a","b"],"triangles":[0,1])" + rest + "}";
    }
    void put_with(const std::string& contacts, double depth = 0.5, const std::string& first_frame = "") const {
        test::RecordingText text = two_frames(depth);
        text.header["format"] = "trocar-recording-2";
        text.tail = "{\"format\":\"trocar-contacts-1\",\"ticks\":2}\n{\"tick\":0,\"contacts\":[" + first_frame +
                    "]}\n{\"tick\":1,\"contacts\":[" + contacts + "]}\n";
        put(text);
    }
    const std::string whole = contact(R"(,"point":[0.25,0.25,0],"normal":[0,0,-1],"depth":0.5)");
};

TEST_F(RecordedBaseline, KeepsWhatTheRecordingCarriesAndNothingElse) {
    ASSERT_EQ(run("write", "").status, 0);
    const Json stored = read_kept();
    EXPECT_EQ(stored["format"], "trocar-baseline-3");
    ASSERT_EQ(stored["detectors"].size(), 1U);
    EXPECT_EQ(stored["detectors"]["recorded"]["truth"]["pairs"], 1);
    EXPECT_EQ(stored["detectors"]["recorded"]["truth"]["false_negatives"], 0);
    EXPECT_EQ(stored["contacts"][0]["1"][0], Json({0, 1, "unset", 0.25, 0.25, 0.0, 0.0, 0.0, -1.0, 0.5}));
    const test::ProgramResult result = run("check", "--json");
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(state(result), "same");
    EXPECT_EQ(answer(result)["difference"]["compared"], 1);
}

TEST_F(RecordedBaseline, ALostPairFails) {
    ASSERT_EQ(run("write", "").status, 0);
    put_with("");
    const test::ProgramResult result = run("check", "--json");
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(state(result), "changed");
    EXPECT_EQ(Json::parse(result.out)["sources"][0]["frames"], "same") << "contacts are no part of the frames";
    const Json found = answer(result);
    EXPECT_EQ(found["difference"]["missing"], 1);
    EXPECT_EQ(found["truth"]["false_negatives"], 1);
    const Json& lost = found["worst"][0];
    EXPECT_EQ(lost["what"], "lost");
    EXPECT_EQ(lost["tick"], 1);
    EXPECT_EQ(lost["bodies"], Json({"a", "b"}));
    EXPECT_EQ(lost["triangles"], Json({0, 1}));
    EXPECT_EQ(lost["before"]["depth_m"], 0.5);
    EXPECT_TRUE(lost["after"].is_null());
    test::expect_holds(run("check", "").out, {"tick 1, 'a' triangle 0, 'b' triangle 1: lost: depth 0.5 m"});
}

TEST_F(RecordedBaseline, AMovedPointIsReportedWithItsSizeAndAnExtraPairWithItsTruth) {
    ASSERT_EQ(run("write", "").status, 0);
    const auto change = [this](const std::string& contacts, const std::string& first = "") {
        put_with(contacts, 0.5, first);
        const test::ProgramResult result = run("check", "--json");
        EXPECT_EQ(result.status, 1) << contacts;
        return answer(result);
    };
    const Json moved = change(contact(R"(,"point":[0.25,0.2501,0],"normal":[0,0,-1],"depth":0.5)"));
    EXPECT_NEAR(moved["difference"]["worst_point_m"], 1e-4, 1e-12);
    EXPECT_NEAR(moved["worst"][0]["point_m"], 1e-4, 1e-12);
    EXPECT_EQ(run("check", "--tolerance 1e-3").status, 0);
    const Json silent = change(contact(R"(,"point":[0.25,0.25,0],"normal":[0,0,-1])"));
    EXPECT_TRUE(silent["difference"]["worst_depth_m"].is_null()) << "a depth that is no longer reported";
    const Json extra = change(whole, contact(""));
    EXPECT_EQ(extra["worst"][0]["what"], "added");
    EXPECT_EQ(extra["truth"]["false_positives"], 1) << "and truth knows that they are apart there";
}

TEST_F(RecordedBaseline, FramesOfWhichNothingIsReportedAnyMoreFail) {
    ASSERT_EQ(run("write", "").status, 0);
    test::RecordingText text = two_frames(0.5);
    text.header["format"] = "trocar-recording-2";
    text.tail = "{\"format\":\"trocar-contacts-1\",\"ticks\":1}\n{\"tick\":1,\"contacts\":[" + whole + "]}\n";
    put(text);
    test::ProgramResult result = run("check", "");
    EXPECT_EQ(result.status, 1) << "frame 0 had no contact, and now nobody says so";
    EXPECT_NE(result.out.find("contacts are recorded for 1 frames, before for 2"), std::string::npos) << result.out;
    put(two_frames(0.5));
    result = run("check", "");
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.out.find("the recording carries none"), std::string::npos) << result.out;
}

TEST_F(RecordedBaseline, DetectorsStandBesideWhereTheyAreAskedFor) {
    ASSERT_EQ(run("write", "--detector recorded --detector ohc").status, 0);
    EXPECT_EQ(run("check", "--detector ohc").status, 0);
    put_with("");
    EXPECT_EQ(run("check", "--detector ohc").status, 0) << "its contacts are what they were";
    EXPECT_EQ(run("check", "--detector recorded").status, 1);
    EXPECT_EQ(run("check", "").status, 1);
}

TEST_F(RecordedBaseline, OnlyEveryNthTickWhereThatIsAskedFor) {
    ASSERT_EQ(run("write", "--every 2").status, 0);
    put_with("");
    EXPECT_EQ(run("check", "").status, 0) << "tick 1 was not kept";
    put_with("", 0.5, contact(""));
    EXPECT_EQ(run("check", "").status, 1);
}

TEST_F(RecordedBaseline, MalformedContactsAreOneLineAndLeaveNothing) {
    put_with(R"({"bodies":["a","c"],"triangles":[0,1]})");
    for (const char* what : {"write", "check"}) {
        test::expect_refused(words(what, ""),
                             "frames.trocrec: contacts line 3: /contacts/0/bodies/1: expected the name of a body");
    }
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "baseline"));
}

TEST_F(RecordedBaseline, TheJunitFileReportsFailuresAndIsValidWhateverTheNames) {
    test::RecordingText text = two_frames(0.5);
    text.header["format"] = "trocar-recording-2";
    text.header["bodies"][0]["name"] = "<a> & \"b\"']]>";
    const std::string head = "{\"format\":\"trocar-contacts-1\",\"ticks\":1}\n";
    text.tail = head + R"({"tick":1,"contacts":[{"bodies":["<a> & \"b\"']]>","b"],"triangles":[0,1]}]})" + "\n";
    put(text);
    ASSERT_EQ(run("write", "").status, 0);
    text.tail = head + "{\"tick\":1,\"contacts\":[]}\n";
    put(text);
    const std::filesystem::path file = folder.path() / "contacts.xml";
    EXPECT_EQ(run("check", "--detector recorded --detector ohc --junit " + file.string()).status, 1);
    const std::string junit = test::read_file(file);
    test::expect_holds(junit, {"<testsuite name=\"frames\" tests=\"2\" failures=\"1\" errors=\"0\" skipped=\"1\">",
                               "<testcase classname=\"frames\" name=\"recorded\">",
                               "<failure type=\"changed\" message=\"0 contacts compared, 1 missing",
                               "&lt;a&gt; &amp; &quot;b&quot;&#39;]]&gt;"});
    if (std::system("python3 -c pass 2>/dev/null") == 0) {
        const std::string parse = "python3 -c 'import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])' ";
        EXPECT_EQ(std::system((parse + file.string()).c_str()), 0) << junit;
    }
}

}  // namespace
}  // namespace trocar
