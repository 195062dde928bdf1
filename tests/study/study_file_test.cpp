#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "scene/retired_names.hpp"
#include "study/study.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

class StudyFile : public ::testing::Test {
protected:
    StudyFile() {
        for (const char* name : {"a.json", "b.json"}) std::ofstream(folder_.path() / name) << "{}\n";
    }
    [[nodiscard]] Study read(const std::string& text) const {
        const std::filesystem::path file = folder_.path() / "study.json";
        std::ofstream(file) << text;
        return read_study(file);
    }
    /// The complaint about a bad study.
    [[nodiscard]] std::string complaint(const std::string& text) const {
        try {
            (void)read(text);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    }
    test::TemporaryFolder folder_;
};

constexpr const char* good = R"({"format":"trocar-study-2","name":"s","seed":5,"repetitions":3,"time_limit_s":2.5,
 "replay":{"scenes":["a.json","b.json"],"detectors":["ohc",{"method":"brute_force"}],"ticks":20,"repetitions":2},
 "closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"truth_stride":4,
   "responses":[{"method":"thesis:profile=faithful"},{"method":"penalty","setting":"tuned","basis":"five values of k"}],
   "contacts":["intersection","native"]}})";

TEST_F(StudyFile, AllStandsForEveryMethodAndAPatternForWhatFitsIt) {
    std::ofstream(folder_.path() / "i2t_c.json") << "{}\n";
    const Study study = read(R"({"format":"trocar-study-2","name":"s",
 "replay":{"scenes":["[ab].json"],"detectors":"all"},
 "closed_loop":{"scenes":["*_c.json","a.json"],"detectors":["ohc"],"responses":"all"}})");
    EXPECT_EQ(study.replay->scenes, (std::vector<std::string>{"a.json", "b.json"}));
    EXPECT_EQ(study.closed_loop->scenes, (std::vector<std::string>{"i2t_c.json", "a.json"}));
    std::set<std::string> detectors;
    for (const StudyMethod& method : study.replay->detectors) EXPECT_TRUE(detectors.insert(method.text).second);
    for (const DetectorEntry& entry : registry().detectors()) EXPECT_EQ(detectors.contains(entry.name), !entry.control);
    for (const AbsentMethod& absent : registry().absent_detectors()) EXPECT_TRUE(detectors.contains(absent.name));
    std::set<std::string> responses;
    for (const StudyMethod& method : study.closed_loop->responses) responses.insert(method.text);
    for (const ResponseEntry& entry : registry().responses()) EXPECT_EQ(responses.contains(entry.name), !entry.control);
    EXPECT_NE(
        complaint(R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["x*.json"],"detectors":"all"}})")
            .find("/replay/scenes/0: expected a pattern of scene files, relative to the study file, or of names that "
                  "`trocar scenes` lists, got 'x*.json'"),
        std::string::npos);
}

TEST_F(StudyFile, AResponseThatTheContactsDoNotServeRunsOnItsOwnUnlessTheyAreNamed) {
    const auto sources = [](const Study& study) {
        std::map<std::string, std::set<std::string>> found;
        for (const PlannedRun& run : make_plan(study)) {
            found[run.spec.response].insert(run.settled ? "settled" : run.spec.contacts);
        }
        return found;
    };
    const std::string before = R"({"format":"trocar-study-2","name":"s","closed_loop":{"scenes":["a.json"],)";
    using Found = std::map<std::string, std::set<std::string>>;
    EXPECT_EQ(
        sources(read(before + R"("detectors":["ohc"],"responses":["penalty","unilateral","thesis"]}})")),
        (Found{
            {"penalty", {"tracked_proximity"}}, {"unilateral", {"tracked_proximity"}}, {"thesis", {"intersection"}}}));
    EXPECT_EQ(
        sources(
            read(before + R"("detectors":["ohc"],"contacts":["intersection"],"responses":["penalty","unilateral"]}})")),
        (Found{{"penalty", {"intersection"}}, {"unilateral", {"settled"}}}));
    (void)read(before + R"("detectors":["ohc"],"contacts":["intersection"],"responses":["penalty"]}})");
    EXPECT_EQ(sources(read_study(folder_.path() / "study.json", {"unilateral"})),
              (Found{{"penalty", {"intersection"}}, {"unilateral", {"tracked_proximity"}}}));
}

TEST_F(StudyFile, ANameThatNothingBesideItHasIsThatOfAShippedScene) {
    const test::TemporaryFolder elsewhere;
    std::vector<std::filesystem::path> shipped;
    for (const char* name : {"a.json", "far_1.json", "far_2.json", "lone.json"}) {
        shipped.push_back(elsewhere.path() / name);
        std::ofstream(shipped.back()) << "{}\n";
    }
    const std::filesystem::path file = folder_.path() / "study.json";
    std::ofstream(file) << R"({"format":"trocar-study-2","name":"s",
 "replay":{"scenes":["a","lone","far_*.json"],"detectors":["ohc",{"method":"ohc_clustered","scenes":["lone"]}]}})";
    const Study study = read_study(file, {}, shipped);
    ASSERT_EQ(study.replay->scenes.size(), 4U);
    const auto leads_to = [&](std::size_t scene, const std::filesystem::path& wanted) {
        return std::filesystem::equivalent(folder_.path() / study.replay->scenes[scene], wanted);
    };
    EXPECT_TRUE(leads_to(0, shipped[0])) << "'a' without .json is no file";
    EXPECT_TRUE(leads_to(1, shipped[3]));
    EXPECT_TRUE(leads_to(2, shipped[1]));
    EXPECT_TRUE(leads_to(3, shipped[2]));
    EXPECT_EQ(study.replay->detectors[1].scenes, (std::vector<std::string>{study.replay->scenes[1]}));

    std::ofstream(file) << R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["a.json"],"detectors":"all"}})";
    EXPECT_EQ(read_study(file, {}, shipped).replay->scenes, (std::vector<std::string>{"a.json"})) << "beside it first";
    std::ofstream(file) << R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["x/lone"],"detectors":"all"}})";
    EXPECT_THROW((void)read_study(file, {}, shipped), InputError) << "a folder is meant as it stands";
}

TEST_F(StudyFile, APatternFitsWhereTheStudyIsNamedWithoutAFolder) {
    std::ofstream(folder_.path() / "study.json")
        << R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["?.json"],"detectors":"all"}})";
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder_.path());
    const std::vector<std::string> scenes = read_study("study.json").replay->scenes;
    std::filesystem::current_path(before);
    EXPECT_EQ(scenes, (std::vector<std::string>{"a.json", "b.json"}));
}

TEST_F(StudyFile, AMethodOfTheCommandLineTakesPartOnceWhereItsKindDoes) {
    const std::filesystem::path file = folder_.path() / "study.json";
    std::ofstream(file) << good;
    const auto texts = [](const std::vector<StudyMethod>& methods) {
        std::vector<std::string> list;
        for (const StudyMethod& method : methods) list.push_back(method.text);
        return list;
    };
    const Study study = read_study(file, {"ohc_clustered", "unilateral", "ohc"});
    EXPECT_EQ(texts(study.replay->detectors), (std::vector<std::string>{"ohc", "brute_force", "ohc_clustered"}));
    EXPECT_EQ(texts(study.closed_loop->detectors), (std::vector<std::string>{"ohc", "ohc_clustered"}));
    EXPECT_EQ(texts(study.closed_loop->responses),
              (std::vector<std::string>{"thesis:profile=faithful", "penalty", "unilateral"}));
    for (const char* wrong : {"holt", "unilateral:nothing=1", ""}) {
        EXPECT_THROW((void)read_study(file, {wrong}), InputError) << wrong;
    }
}

TEST_F(StudyFile, WhereTheReferenceDoesNotRunIsReported) {
    const std::string start =
        R"({"format":"trocar-study-2","name":"s","reference":"ohc","replay":{"scenes":["a.json","b.json"],)";
    const std::string loop = R"(,"closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"]}})";
    EXPECT_TRUE(reference_notes(read(start + R"("detectors":["ohc"]})" + loop)).empty());
    EXPECT_TRUE(reference_notes(read(good)).empty());  // none asked for
    const auto elsewhere = reference_notes(read(start + R"("detectors":["brute_force"]})" + loop));
    ASSERT_EQ(elsewhere.size(), 1U);
    EXPECT_NE(elsewhere[0].find("replay: ohc, which times are set against, is not among the detectors"),
              std::string::npos);
    const auto some = reference_notes(read(start + R"("detectors":[{"method":"ohc","scenes":["a.json"]}]})" + loop));
    ASSERT_EQ(some.size(), 1U);
    EXPECT_NE(some[0].find("on some scenes only"), std::string::npos);
}

TEST_F(StudyFile, IsReadAsWritten) {
    const Study study = read(good);
    EXPECT_EQ(study.name, "s");
    EXPECT_EQ(study.seed, 5U);
    EXPECT_EQ(study.time_limit_s, 2.5);
    EXPECT_EQ(study.replay->repetitions, 2);
    EXPECT_EQ(study.replay->ticks, 20);
    EXPECT_EQ(study.replay->truth_stride, 1);
    EXPECT_EQ(study.closed_loop->repetitions, 3);
    EXPECT_EQ(study.closed_loop->truth_stride, 4);
    EXPECT_EQ(study.closed_loop->responses[1].setting, "tuned");
    EXPECT_EQ(study.closed_loop->responses[1].basis, "five values of k");
}

TEST_F(StudyFile, CostBySizeTimesEveryStepperOnEverySceneAndJudgesNone) {
    const Study study = read(R"({"format":"trocar-study-2","name":"s","cost_by_size":{"scenes":["a.json","b.json"],
        "detectors":["ohc"],"responses":["penalty"],"steppers":["semi_implicit","implicit"],"ticks":20}})");
    std::set<std::string> runs;
    for (const PlannedRun& run : make_plan(study)) {
        const RunSpec& spec = run.spec;
        EXPECT_EQ(spec.truth_stride, 0);
        EXPECT_EQ(spec.ticks, 20);
        runs.insert(spec.mode + "|" + spec.scene + "|" + spec.detector + "|" + spec.response + "|" +
                    run.facts.at("run.stepper"));
    }
    const std::set<std::string> expected{
        "cost_by_size|a|ohc|penalty|semi_implicit", "cost_by_size|a|ohc|penalty|implicit",
        "cost_by_size|b|ohc|penalty|semi_implicit", "cost_by_size|b|ohc|penalty|implicit"};
    EXPECT_EQ(runs, expected);
}

constexpr const char* knobs = R"({"format":"trocar-study-2","name":"s",
 "work_precision":{"ticks":1000,"sweeps":[
   {"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty","thesis"],"knob":"dt","values":[0.0005,0.002]},
   {"scenes":["a.json","b.json"],"detectors":["ohc"],"knob":"detector.cell","values":[0.01,"auto"]},
   {"scenes":["a.json"],"detectors":["ohc"],"responses":["thesis:profile=corrected"],"knob":"response.n_back","values":[5]}]},
 "paced":{"scenes":["b.json"],"detectors":["ohc"],"responses":["penalty"],
   "steppers":["implicit","semi_implicit"],"ticks":50}})";

TEST_F(StudyFile, KnobsBecomeRunsOfTheirOwn) {
    std::set<std::string> runs;
    for (const PlannedRun& run : make_plan(read(knobs))) {
        const RunSpec& spec = run.spec;
        EXPECT_TRUE(runs.insert(spec.mode + "|" + spec.scene + "|" + spec.detector + "|" + spec.response + "|" +
                                spec.overrides + "|" + spec.knob + "|" + spec.point +
                                (spec.stepper.empty() ? "" : "|" + spec.stepper))
                        .second);
    }
    const std::set<std::string> expected{"work_precision|a|ohc|penalty|dt=0.0005|dt|0.0005",
                                         "work_precision|a|ohc|penalty|dt=0.002|dt|0.002",
                                         "work_precision|a|ohc|thesis|dt=0.0005|dt|0.0005",
                                         "work_precision|a|ohc|thesis|dt=0.002|dt|0.002",
                                         "work_precision|a|ohc:cell=0.01|||detector.cell|0.01",
                                         "work_precision|a|ohc:cell=auto|||detector.cell|auto",
                                         "work_precision|b|ohc:cell=0.01|||detector.cell|0.01",
                                         "work_precision|b|ohc:cell=auto|||detector.cell|auto",
                                         "work_precision|a|ohc|thesis:n_back=5,profile=corrected||response.n_back|5",
                                         "paced|b|ohc|penalty||||implicit",
                                         "paced|b|ohc|penalty|||"};
    EXPECT_EQ(runs, expected);
}

TEST_F(StudyFile, ASweepRunsAMethodOnItsScenesAndReportsWhatHasNoContactsOfItsOwn) {
    const Study study = read(R"({"format":"trocar-study-2","name":"s","work_precision":{"sweeps":[
       {"scenes":["a.json","b.json"],"detectors":["ohc"],
        "responses":["thesis",{"method":"penalty","scenes":["b.json"]}],"knob":"k","values":[5]},
       {"scenes":["a.json"],"detectors":["ohc","fcl_bvh"],"responses":["penalty","thesis"],"contacts":"native",
        "knob":"k","values":[5]}]}})");
    std::map<std::string, std::string> ends;
    for (const PlannedRun& run : make_plan(study)) {
        const RunSpec& spec = run.spec;
        ends[spec.scene + "|" + spec.detector + "|" + spec.response + "|" + spec.contacts] =
            run.settled ? std::string(name_of(run.settled->kind)) : "to do";
    }
    if (ends.at("a|fcl_bvh|penalty|native") == "absent") GTEST_SKIP() << "without FCL";
    const std::map<std::string, std::string> expected{
        {"a|ohc|thesis|intersection", "to do"},       {"b|ohc|thesis|intersection", "to do"},
        {"b|ohc|penalty|tracked_proximity", "to do"}, {"a|ohc|penalty|native", "unsupported"},
        {"a|ohc|thesis|native", "unsupported"},       {"a|fcl_bvh|penalty|native", "to do"},
        {"a|fcl_bvh|thesis|native", "unsupported"}};
    EXPECT_EQ(ends, expected);
}

TEST_F(StudyFile, ANewTickKeepsTheTimeOfTheRun) {
    for (PlannedRun& run : make_plan(read(knobs))) {
        complete_run({.name = run.spec.scene, .hash = "0", .pair_class = "I2T", .ticks = 300, .dt = 0.001}, run);
        if (run.spec.overrides == "dt=0.0005") {
            EXPECT_EQ(run.spec.ticks, 2000);
        } else if (run.spec.overrides == "dt=0.002") {
            EXPECT_EQ(run.spec.ticks, 500);
        } else if (run.spec.mode == "work_precision") {
            EXPECT_EQ(run.spec.ticks, 1000);
        }
    }
}

TEST_F(StudyFile, BadKnobsAreNamedWithTheirPlace) {
    const std::string head =
        R"({"format":"trocar-study-2","name":"s","work_precision":{"sweeps":[{"scenes":["a.json"],)";
    const std::vector<std::pair<std::string, std::string>> faults{
        {head + R"("detectors":["ohc"],"responses":["penalty"],"knob":"mass","values":[1]}]}})", "/0/knob"},
        {head + R"("detectors":["ohc"],"knob":"dt","values":[0.001]}]}})", "responses"},
        {head + R"("detectors":["ohc"],"responses":["penalty"],"knob":"dt","values":[0.001,-1]}]}})", "/values/1"},
        {head + R"("detectors":["ohc"],"responses":["penalty"],"knob":"substeps","values":[2.5]}]}})", "/values/0"},
        {head + R"("detectors":["ohc"],"knob":"detector.cell","values":["wide"]}]}})", "/values/0"},
        {head + R"("detectors":["ohc"],"knob":"detector.colour","values":[1]}]}})", "/values/0"},
        {head + R"("detectors":["ohc"],"knob":"detector.cell","values":[]}]}})", "/values"}};
    for (const auto& [text, place] : faults) {
        EXPECT_NE(complaint(text).find(place), std::string::npos) << text << "\n" << complaint(text);
    }
}

TEST_F(StudyFile, EveryFaultIsNamedWithItsPlace) {
    const std::string head = R"({"format":"trocar-study-2","name":"s",)";
    const std::string replay = R"("replay":{"scenes":["a.json"],"detectors":["ohc"])";
    const std::vector<std::pair<std::string, std::string>> faults{
        {head + R"("replays":{}})", "/replays"},
        {head + R"("replay":{"scenes":["a.json"]}})", "detectors"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":["ohc"],"tick":3}})", "/replay/tick"},
        {head + replay + R"(,"ticks":0}})", "/replay/ticks"},
        {head + replay + R"(,"ticks":-5}})", "/replay/ticks"},
        {head + replay + R"(,"ticks":2.5}})", "/replay/ticks"},
        {head + replay + R"(,"truth_stride":0}})", "/replay/truth_stride"},
        {head + R"("repetitions":0,)" + replay + "}}", "/repetitions"},
        {head + R"("time_limit_s":-1,)" + replay + "}}", "/time_limit_s"},
        {head + R"("seed":-1,)" + replay + "}}", "/seed"},
        {head + R"("seed":"one",)" + replay + "}}", "/seed"},
        {head + R"("replay":{"scenes":[],"detectors":["ohc"]}})", "/replay/scenes"},
        {head + R"("replay":{"scenes":"a.json","detectors":["ohc"]}})", "/replay/scenes"},
        {head + R"("replay":{"scenes":["c.json"],"detectors":["ohc"]}})", "/replay/scenes/0"},
        {head + R"("replay":{"scenes":["a.json","a.json"],"detectors":["ohc"]}})", "/replay/scenes/1"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":["no_such"]}})", "/replay/detectors/0"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":["ohc:no_such=1"]}})", "/replay/detectors/0"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":["ohc:cell=-1"]}})", "/replay/detectors/0"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":["ohc","ohc"]}})", "/replay/detectors/1"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":[{"method":"ohc","setting":"best"}]}})",
         "/replay/detectors/0/setting"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":[{"method":"ohc","setting":"tuned"}]}})", "basis"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":[3]}})", "/replay/detectors/0"},
        {head +
             R"("closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"],"contacts":["both"]}})",
         "/closed_loop/contacts/0"},
        {head +
             R"("closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"],"steppers":["sleepy"]}})",
         "/closed_loop/steppers/0"},
        {head + R"("closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"],)" +
             R"("steppers":["semi_implicit","semi_implicit"]}})",
         "/closed_loop/steppers/1"},
        {head + R"("device":"tip=shaft",)" + replay + "}}", "/device"},
        {head + R"("device":"fulcrum",)" + replay + "}}", "/device"},
        {head + R"("device":3,)" + replay + "}}", "/device"},
        {head + R"("device":{"colour":"red"},)" + replay + "}}", "/device"},
        {head + R"("device":{"tip":"sum","rate":-1},)" + replay + "}}", "/device/rate"},
        {head + R"("device":{"ramp":true},)" + replay + "}}", "/device/ramp"},
        {head + R"("closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty:tip=sum"]}})",
         "got 'tip': give the run's device"},
        {head + R"("closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["ohc"]}})",
         "/closed_loop/responses/0"},
        {head + R"("reference":"brute_force",)" + replay + "}}", "/reference"},
        {R"({"format":"trocar-study-1","name":"s"})", "/format"},
        {R"({"format":"trocar-study-2","name":"../s",)" + replay + "}}", "/name"},
        {R"({"format":"trocar-study-2",)" + replay + "}}", "name"},
        {R"({"format":"trocar-study-2","name":"s"})", "replay"},
        {R"({"format":"trocar-study-2","name":)", "line 1"},
        {"[]", "object"},
    };
    for (const auto& [text, place] : faults) {
        const std::string message = complaint(text);
        EXPECT_NE(message.find("study.json"), std::string::npos) << text << "\n" << message;
        EXPECT_NE(message.find(place), std::string::npos) << text << "\n" << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

TEST_F(StudyFile, RetiredKeysAreReportedWithTheirReplacement) {
    const std::map<std::string_view, std::string> places{{"", ""},
                                                         {"closed_loop", "/closed_loop"},
                                                         {"detectors", "/replay/detectors/1"},
                                                         {"replay", "/replay"},
                                                         {"responses", "/closed_loop/responses/1"}};
    for (const RetiredName& row : retired_names()) {
        if (row.kind != NameKind::study_key) continue;
        const std::string place = fmt::format("{}/{}", places.at(row.scope), row.name);
        nlohmann::ordered_json document = nlohmann::ordered_json::parse(good);
        document[nlohmann::ordered_json::json_pointer(place)] = 1;
        const std::string message = complaint(document.dump());
        EXPECT_NE(message.find(place + ": expected one of "), std::string::npos) << message;
        EXPECT_TRUE(message.ends_with(fmt::format("got '{}': {}", row.name, row.use))) << message;
    }
}

TEST_F(StudyFile, RetiredNamesInAStudyAreReportedWithTheirReplacement) {
    const std::string head = R"({"format":"trocar-study-2","name":"s",)";
    const std::string loop = head + R"("closed_loop":{"scenes":["a.json"],"detectors":["ohc"],)";
    const std::vector<std::array<std::string, 3>> cases{
        {loop + R"("responses":["hold"]}})", "/closed_loop/responses/0: expected ",
         "got 'hold': renamed to 'unilateral'"},
        {loop + R"("responses":["thesis:contacts=hold"]}})", "/closed_loop/responses/0: expected ",
         "got 'hold': renamed to 'zero_order_hold'"},
        {loop + R"("responses":["penalty"],"contacts":["near"]}})", "/closed_loop/contacts/0: expected one of ",
         "got \"near\": renamed to 'proximity'"},
        {loop + R"("responses":[{"method":"penalty","contacts":["canonical"]}]}})",
         "/closed_loop/responses/0/contacts/0: expected ", "got \"canonical\": renamed to 'intersection'"},
        {loop + R"("responses":["penalty"],"steppers":["regional"]}})", "/closed_loop/steppers/0: expected ",
         "got 'regional': renamed to 'adaptive_multires'"},
        {head + R"("replay":{"scenes":["a.json"],"detectors":["ohc:incremental=on"]}})",
         "/replay/detectors/0: expected ", "got 'incremental': take the detector ohc_clustered"},
        {head + R"("device":{"tip_rate":500},"replay":{"scenes":["a.json"],"detectors":["ohc"]}})",
         "/device/tip_rate: expected one of ", "got 'tip_rate': give the run's device, --device rate=…"}};
    for (const auto& [text, place, end] : cases) {
        const std::string message = complaint(text);
        EXPECT_NE(message.find(place), std::string::npos) << text << "\n" << message;
        EXPECT_TRUE(message.ends_with(end)) << text << "\n" << message;
    }
    (void)read(good);
    try {
        (void)read_study(folder_.path() / "study.json", {"hold:k=100"});
        ADD_FAILURE() << "a retired response was added";
    } catch (const InputError& error) {
        EXPECT_STREQ(
            error.what(),
            "--with: expected a detector or response of trocar list, got 'hold:k=100': renamed to 'unilateral'");
    }
}

TEST_F(StudyFile, OneDeviceServesEveryRunWithAResponse) {
    const std::string head = R"({"format":"trocar-study-2","name":"s",)";
    const std::string parts = R"("replay":{"scenes":["a.json"],"detectors":["ohc"]},
        "closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty","thesis"]},
        "paced":{"scenes":["a.json"],"detectors":["ohc"],"responses":["unilateral"]},
        "metamorphic":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"]}})";
    const std::string given = "tip=sum,saturation=3,rate=0,filter=150,ramp=0";
    const std::map<std::string, std::string> devices{
        {"", "tip=fulcrum,saturation=8.5,rate=0,filter=0,ramp=0"},
        {R"("device":{"tip":"sum","filter":150,"saturation":3},)", given},
        {R"("device":{"tip":"sum","filter":"150","saturation":3.0},)", given},
        {R"("device":"filter=150,tip=sum,saturation=3",)", given}};
    for (const auto& [device, expected] : devices) {
        int shown = 0;
        for (const PlannedRun& run : make_plan(read(head + device + parts))) {
            EXPECT_EQ(run.spec.device, run.spec.response.empty() ? "" : expected) << device << run.spec.mode;
            shown += run.spec.response.empty() ? 0 : 1;
        }
        EXPECT_EQ(shown, 2 + 1 + 2) << device;
    }
}

TEST_F(StudyFile, PlanIsTheSameForTheSameSeedOnly) {
    const auto order = [](const Study& study) {
        std::string text;
        for (const PlannedRun& run : make_plan(study)) {
            text += run.spec.mode + run.spec.scene_file + run.spec.detector + run.spec.response + run.spec.contacts +
                    std::to_string(run.spec.repetition) + ";";
        }
        return text;
    };
    Study study = read(good);
    const std::string first = order(study);
    EXPECT_EQ(first, order(study));
    study.seed = 6;
    EXPECT_NE(first, order(study));
}

TEST_F(StudyFile, PlanHoldsEveryCombinationOnce) {
    const std::vector<PlannedRun> plan = make_plan(read(good));
    std::set<std::string> keys;
    std::size_t unsupported = 0;
    for (const PlannedRun& run : plan) {
        keys.insert(run.spec.mode + run.spec.scene_file + run.spec.detector + run.spec.response + run.spec.contacts +
                    std::to_string(run.spec.repetition));
        if (run.settled && run.settled->kind == OutcomeKind::unsupported) ++unsupported;
    }
    EXPECT_EQ(keys.size(), plan.size());
    // Replay 2 scenes x 2 detectors x 2; closed loop 1 x 1 x 2 responses x 3; ohc has no contacts of its own and thesis
    // cannot read such contacts, each reported once.
    EXPECT_EQ(unsupported, 2U);
    EXPECT_EQ(plan.size(), 8U + 6U + 2U);
}

TEST_F(StudyFile, EachPartIsRepeatedAsOftenAsItSays) {
    const auto repeated = [](int times) { return ",\"repetitions\":" + std::to_string(times) + "}"; };
    for (const std::array<int, 3>& times : {std::array{1, 2, 3}, std::array{2, 3, 1}, std::array{3, 1, 2}}) {
        const Study study = read(
            R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["a.json"],"detectors":["ohc"])" +
            repeated(times[0]) + R"(,"closed_loop":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"])" +
            repeated(times[1]) +
            R"(,"paced":{"scenes":["b.json"],"detectors":["ohc"],"responses":["penalty"],"ticks":5)" +
            repeated(times[2]) + "}");
        std::map<std::string, int> runs;
        for (const PlannedRun& run : make_plan(study)) ++runs[run.spec.mode];
        EXPECT_EQ(runs,
                  (std::map<std::string, int>{{"replay", times[0]}, {"closed_loop", times[1]}, {"paced", times[2]}}));
    }
}

TEST_F(StudyFile, ResponseThatCannotReadNativeContactsIsReportedOnce) {
    const auto& detectors = registry().detectors();
    const auto detector = std::find_if(detectors.begin(), detectors.end(),
                                       [](const DetectorEntry& entry) { return entry.native_contacts; });
    if (detector == detectors.end()) GTEST_SKIP() << "this build has no detector with native contacts";
    const Study study =
        read(R"({"format":"trocar-study-2","name":"s","repetitions":2,"closed_loop":{)"
             R"("scenes":["a.json","b.json"],"detectors":[")" +
             detector->name + R"("],"responses":["thesis","penalty"],"contacts":["intersection","native"]}})");
    int thesis_rows = 0;
    int penalty_runs = 0;
    for (const PlannedRun& run : make_plan(study)) {
        if (run.spec.contacts != "native") {
            EXPECT_FALSE(run.settled);
        } else if (run.spec.response == "thesis") {
            ++thesis_rows;
            ASSERT_TRUE(run.settled);
            EXPECT_EQ(run.settled->kind, OutcomeKind::unsupported);
            EXPECT_NE(run.settled->message.find(
                          "from contacts tracked_proximity, proximity, intersection, not from 'native'"),
                      std::string::npos);
        } else {
            ++penalty_runs;
            EXPECT_FALSE(run.settled);
        }
    }
    EXPECT_EQ(thesis_rows, 1);
    EXPECT_EQ(penalty_runs, 2 * 2);
}

TEST_F(StudyFile, RepetitionsAreBlocksOfInterleavedMethods) {
    std::int64_t last = 0;
    for (const PlannedRun& run : make_plan(read(good))) {
        EXPECT_GE(run.spec.repetition, last);
        last = run.spec.repetition;
    }
    EXPECT_EQ(last, 2);
}

TEST_F(StudyFile, APacedRunTakesTheTimeThatTheClockGivesItsTicks) {
    std::vector<PlannedRun> plan =
        make_plan(read(R"({"format":"trocar-study-2","name":"s","paced":{"scenes":["a.json"],"detectors":["ohc"],)"
                       R"("responses":["penalty"],"ticks":3000}})"));
    ASSERT_EQ(plan.size(), 1U);
    complete_run({.name = "a", .hash = {}, .pair_class = {}, .dt = 0.002, .triangles = 100000}, plan[0]);
    const double long_run = plan[0].rough_seconds;
    plan[0].spec.ticks = 1000;
    complete_run({.name = "a", .hash = {}, .pair_class = {}, .dt = 0.002, .triangles = 100000}, plan[0]);
    // Once with the tick at its moments and once for the empty loop beside it.
    EXPECT_NEAR(long_run - plan[0].rough_seconds, 2.0 * 2000 * 0.002, 1e-9);
}

TEST_F(StudyFile, ARunOfMoreTicksThanARecordHoldsIsRefusedBeforeItIsMade) {
    std::vector<PlannedRun> plan =
        make_plan(read(R"({"format":"trocar-study-2","name":"s","paced":{"scenes":["a.json"],"detectors":["ohc"],)"
                       R"("responses":["penalty"],"ticks":400000}})"));
    const SceneFacts facts{.name = "a", .hash = {}, .pair_class = {}, .dt = 0.002, .triangles = 1000};
    complete_run(facts, plan[0]);
    plan[0].spec.ticks = 400'001;
    try {
        complete_run(facts, plan[0]);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "study: a: expected at most 400000 ticks of a run (--large lifts this), got 400001");
    }
}

TEST_F(StudyFile, MethodRunsOnItsOwnScenesOnly) {
    const std::vector<PlannedRun> plan =
        make_plan(read(R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["a.json","b.json"],)"
                       R"("detectors":["ohc",{"method":"brute_force","scenes":["b.json"]}]}})"));
    EXPECT_EQ(plan.size(), 3U);
    for (const PlannedRun& run : plan) {
        EXPECT_TRUE(run.spec.detector == "ohc" || run.spec.scene_file == "b.json");
    }
}

TEST_F(StudyFile, AResponseMayChooseItsDetectorsAndSources) {
    const Study study = read(
        R"({"format":"trocar-study-2","name":"s","ours":"unilateral","quotes":"seen elsewhere","closed_loop":{"scenes":["a.json"],
        "detectors":["ohc",{"method":"brute_force","judged":false}],"contacts":["intersection","tracked_proximity"],
        "detail_stride":7,"responses":[{"method":"unilateral","contacts":["tracked_proximity"]},
        {"method":"penalty","detectors":["ohc"],"contacts":["intersection"]}]}})");
    std::set<std::string> runs;
    for (const PlannedRun& run : make_plan(study)) {
        EXPECT_FALSE(run.settled) << "what was not chosen is no row";
        EXPECT_EQ(run.spec.detail_stride, 7);
        EXPECT_EQ(run.spec.truth_stride, run.spec.detector == "brute_force" ? 0 : 1);
        runs.insert(run.spec.detector + " " + run.spec.response + " " + run.spec.contacts);
        EXPECT_EQ(method_facts(study, run).at("study.ours"), "unilateral");
        EXPECT_EQ(method_facts(study, run).at("study.quotes"), "seen elsewhere");
    }
    EXPECT_EQ(runs, (std::set<std::string>{"ohc unilateral tracked_proximity",
                                           "brute_force unilateral tracked_proximity", "ohc penalty intersection"}));
    const std::string head = R"({"format":"trocar-study-2","name":"s","closed_loop":{"scenes":["a.json"],)";
    EXPECT_NE(
        complaint(head + R"("detectors":["ohc"],"responses":[{"method":"penalty","detectors":["brute_force"]}]}})")
            .find("/closed_loop/responses/0/detectors/0"),
        std::string::npos);
    EXPECT_NE(complaint(head + R"("detectors":["ohc"],"responses":[{"method":"penalty","contacts":["proximity"]}]}})")
                  .find("/closed_loop/responses/0/contacts/0"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"format":"trocar-study-2","name":"s","ours":"unilateral","closed_loop":{"scenes":["a.json"],
        "detectors":["ohc"],"responses":["penalty"]}})")
                  .find("/ours"),
              std::string::npos);
}

TEST_F(StudyFile, AbsentMethodBecomesRowsWithItsReason) {
    if (registry().absent_detectors().empty()) GTEST_SKIP() << "this build has every detector";
    const AbsentMethod& absent = registry().absent_detectors().front();
    const Study study =
        read(R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["a.json"],"detectors":["ohc",")" +
             absent.name + R"("]}})");
    const std::vector<PlannedRun> plan = make_plan(study);
    ASSERT_EQ(plan.size(), 2U);
    const auto lost =
        std::find_if(plan.begin(), plan.end(), [](const PlannedRun& run) { return run.settled.has_value(); });
    ASSERT_NE(lost, plan.end());
    EXPECT_EQ(lost->settled->kind, OutcomeKind::absent);
    EXPECT_NE(lost->settled->message.find(absent.reason), std::string::npos);
}

TEST_F(StudyFile, SceneWithoutItsDataIsSettledAsUnsupported) {
    PlannedRun run;
    complete_run({.name = "liver", .hash = "", .pair_class = "", .ticks = 0, .lacks_data = true}, run);
    ASSERT_TRUE(run.settled);
    EXPECT_EQ(run.settled->kind, OutcomeKind::unsupported);
    EXPECT_EQ(run.settled->message, "no data");
}

TEST(Studies, OfTheProjectAreReadable) {
    for (const char* name : {"default.json", "full.json"}) {
        const Study study = read_study(std::filesystem::path(TROCAR_SOURCE_DIR) / "bench" / "studies" / name);
        EXPECT_FALSE(make_plan(study).empty()) << name;
        EXPECT_TRUE(study.replay && study.closed_loop) << name;
    }
}

TEST_F(StudyFile, HardCasesArePlannedByTheirKind) {
    const std::filesystem::path cases = folder_.path() / "hard";
    const auto add = [&cases](const std::string& name, const std::string& text) {
        std::filesystem::create_directories(cases / name);
        std::ofstream(cases / name / "expected.json") << text;
    };
    add("meshes", R"({"of":"m","reason":"r","pairs":[[0,1]],"touch":[0]})");
    add("refused", R"({"of":"f","reason":"r","bad_input":"line 4"})");
    add("moving",
        R"({"of":"s","reason":"r","scene":"../../a.json","at_most":{"residual_penetration_max_m":0.001},"ticks":70})");
    add("elsewhere", R"({"of":"t","reason":"r","tested":"some_test.cpp: Name"})");
    const Study study = read(R"({"format":"trocar-study-2","name":"s","repetitions":3,"hard_cases":{"folder":"hard",
        "families":["data:x/pairs.txt"],"detectors":["ohc","brute_force"],"responses":["penalty"]}})");
    const std::vector<PlannedRun> plan = make_plan(study);
    std::multiset<std::string> runs;
    for (const PlannedRun& run : plan) {
        EXPECT_EQ(run.spec.mode, "hard_case");
        EXPECT_EQ(is_mesh_case(run.spec), run.spec.response.empty());
        runs.insert(run.spec.scene + " " + run.spec.detector + " " + run.spec.response +
                    (run.settled ? "settled" : ""));
        if (run.spec.scene == "moving") {
            EXPECT_EQ(run.spec.scene_file, "a.json");
            EXPECT_EQ(run.spec.ticks, 70);
            EXPECT_EQ(run.facts.at("case.at_most.residual_penetration_max_m"), "0.001");
        }
    }
    EXPECT_EQ(runs, (std::multiset<std::string>{"meshes ohc ", "meshes brute_force ", "refused  ", "moving ohc penalty",
                                                "elsewhere  settled", "pairs ohc ", "pairs brute_force "}));
}

TEST_F(StudyFile, MetamorphicAsksEveryMethodInAtLeastTwoProcesses) {
    const std::string head = R"({"format":"trocar-study-2","name":"s","metamorphic":{"scenes":["a.json"],)";
    const Study study = read(head + R"("detectors":["ohc","brute_force"],"responses":["penalty"]}})");
    const std::vector<PlannedRun> plan = make_plan(study);
    EXPECT_EQ(plan.size(), 6U);
    for (const PlannedRun& run : plan) {
        EXPECT_TRUE(run.spec.response.empty() || run.spec.detector == "ohc");
    }
    EXPECT_NE(complaint(head + R"("detectors":["ohc"],"repetitions":1}})").find("/metamorphic/repetitions"),
              std::string::npos);
}

TEST(ShippedDefaultStudy, RunsEveryResponseOnEveryOneOfItsScenesAndJudgesEveryTick) {
    const Study study = read_study(std::filesystem::path(TROCAR_SOURCE_DIR) / "bench" / "studies" / "default.json");
    ASSERT_TRUE(study.closed_loop);
    std::map<std::string, std::set<std::string>> judged;  // by response: scenes judged with an exact detector
    for (const PlannedRun& run : make_plan(study)) {
        if (run.spec.mode != "closed_loop" || run.settled || run.spec.truth_stride != 1) continue;
        const DetectorEntry& detector = registry().detector(parse_method(run.spec.detector).name);
        if (detector.claims_exact && !detector.control) {
            judged[parse_method(run.spec.response).name].insert(run.spec.scene);
        }
    }
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.name == "example") continue;  // the file to copy is no method
        EXPECT_EQ(judged[entry.name].size(), study.closed_loop->scenes.size()) << entry.name;
    }
    // Nor has page 1 scenes of which its table of responses says nothing.
    ASSERT_TRUE(study.replay);
    for (const auto& scene : study.replay->scenes) {
        EXPECT_NE(std::find(study.closed_loop->scenes.begin(), study.closed_loop->scenes.end(), scene),
                  study.closed_loop->scenes.end());
    }
}

}  // namespace
}  // namespace trocar
