#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "scene/retired_names.hpp"
#include "study/study.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

class StudyFile : public ::testing::Test {
protected:
    StudyFile() {
        for (const char* name : {"a.json", "b.json"}) folder_.write(name, "{}\n");
    }
    [[nodiscard]] Study read(const std::string& text) const { return read_study(folder_.write("study.json", text)); }
    /// The complaint about a bad study.
    [[nodiscard]] std::string complaint(const std::string& text) const {
        return test::complaint_of([&] { (void)read(text); });
    }
    /// One line that names the file, has `part`, and ends so.
    void expect_complaint(const std::string& text, const std::string& part, const std::string& end = "") const {
        const std::string message = complaint(text);
        test::expect_holds(message, {"study.json", part});
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_TRUE(message.ends_with(end)) << text << "\n" << message;
    }
    test::TemporaryFolder folder_;
};

constexpr const char* good = R"({"format":"trocar-study-3","name":"s","seed":5,"repetitions":3,"time_limit_s":2.5,
 "experiments":[
 {"frames":"replay","scenes":["a.json","b.json"],"detectors":["ohc",{"method":"brute_force"}],"ticks":20,
  "repetitions":2},
 {"frames":"closed_loop","scenes":["a.json"],"detectors":["ohc"],"truth_stride":4,
  "responses":[{"method":"thesis:profile=faithful"},{"method":"penalty","setting":"tuned","basis":"five values of k"}],
  "contacts":["intersection","native"]}]})";

/// A study of these experiments, each without its braces.
std::string study_of(const std::vector<std::string>& experiments, const std::string& more = "") {
    return fmt::format(R"({{"format":"trocar-study-3","name":"s",{}"experiments":[{{{}}}]}})", more,
                       fmt::join(experiments, "},{"));
}
const std::string replay = R"("frames":"replay",)";
const std::string closed_loop = R"("frames":"closed_loop",)";
const std::string press = closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"])";

std::vector<std::string> files_of(const Experiment& experiment) {
    std::vector<std::string> files;
    for (const Input& input : experiment.inputs) files.push_back(input.file);
    return files;
}

TEST_F(StudyFile, AllStandsForEveryMethodAndAPatternForWhatFitsIt) {
    std::ofstream(folder_.path() / "i2t_c.json") << "{}\n";
    const Study study =
        read(study_of({replay + R"("scenes":["[ab].json"],"detectors":"all")",
                       closed_loop + R"("scenes":["*_c.json","a.json"],"detectors":["ohc"],"responses":"all")"}));
    EXPECT_EQ(files_of(study.experiments[0]), (std::vector<std::string>{"a.json", "b.json"}));
    EXPECT_EQ(files_of(study.experiments[1]), (std::vector<std::string>{"i2t_c.json", "a.json"}));
    std::set<std::string> detectors;
    for (const Level& method : study.experiments[0].detectors) EXPECT_TRUE(detectors.insert(method.text).second);
    for (const DetectorEntry& entry : registry().detectors()) EXPECT_EQ(detectors.contains(entry.name), !entry.control);
    for (const AbsentMethod& absent : registry().absent_detectors()) EXPECT_TRUE(detectors.contains(absent.name));
    std::set<std::string> responses;
    for (const Level& method : study.experiments[1].responses) responses.insert(method.text);
    for (const ResponseEntry& entry : registry().responses()) EXPECT_EQ(responses.contains(entry.name), !entry.control);
    test::expect_holds(complaint(study_of({replay + R"("scenes":["x*.json"],"detectors":"all")"})),
                       {"/experiments/0/scenes/0: expected a pattern of scene files, relative to the study file, or of "
                        "names that "
                        "`trocar scenes` lists, got 'x*.json'"});
}

TEST_F(StudyFile, GeneratedScenesAreOneGroupEachAndTheReferenceTakesPartTwice) {
    const Study study = read(study_of({replay + R"("generated":["balls:count=4","instrument_in_tissue"],"ticks":40,
        "contacts":["intersection","tracked_proximity"],
        "detectors":["ohc",{"method":"brute_force","most_triangles":2000}])"},
                                      R"("reference":"ohc",)"));
    std::map<std::string, std::multiset<std::string>> groups;
    for (PlannedRun run : make_plan(study)) {
        ASSERT_TRUE(is_generated(run.spec));
        complete_run(input_facts("", run.spec, {}), run);
        EXPECT_EQ(run.spec.mode, "replay");
        EXPECT_EQ(run.spec.ticks, 40);
        EXPECT_EQ(run.spec.truth_stride, 5) << "truth on the first tick of each of 8 blocks";
        groups[run.group + "|" + run.spec.scene].insert(
            fmt::format("{} {} {}", run.spec.detector, run.spec.contacts, run.spec.repetition));
    }
    ASSERT_EQ(groups.size(), 2U) << "one process per scene";
    const std::multiset<std::string> ohc{"ohc intersection 0", "ohc intersection 1", "ohc tracked_proximity 0",
                                         "ohc tracked_proximity 1"};
    std::multiset<std::string> both = ohc;
    both.insert("brute_force intersection 0");
    for (const auto& [group, runs] : groups) {
        const bool small = group.ends_with("4 balls");
        EXPECT_TRUE(small || group.ends_with("light 20k x 2k")) << group;
        std::multiset<std::string> expected = small ? both : ohc;
        if (small && registry().detector("brute_force").query_distance) {
            expected.insert("brute_force tracked_proximity 0");
        }
        EXPECT_EQ(runs, expected) << group;
    }
}

TEST_F(StudyFile, GeneratedScenesHaveKeysOfTheirOwn) {
    const std::string generated = replay + R"("generated":["balls"],"detectors":["ohc"])";
    EXPECT_NO_THROW((void)read(study_of({generated})));
    const auto expect = [this](const std::string& experiment, const std::string& part) {
        expect_complaint(study_of({experiment}), part);
    };
    expect(generated + R"(,"scenes":["a.json"])", "/experiments/0/generated: expected generated scenes alone");
    expect(generated + R"(,"truth_stride":4)", "/experiments/0/truth_stride: expected a key of scenes");
    expect(generated + R"(,"cycles":4)", "/experiments/0/cycles: expected a key of scenes");
    expect(replay + R"("generated":["balls:count=1"],"detectors":["ohc"])", "/experiments/0/generated/0");
    expect(replay + R"("generated":["cube"],"detectors":["ohc"])", "instrument_in_tissue or balls");
    expect(replay + R"("generated":["balls","balls:count=16"],"detectors":["ohc"])", "each scene once");
    expect(replay + R"("generated":["instrument_in_tissue:instruments=3"],"detectors":["ohc"])", "at most two");
    expect(replay + R"("scenes":["a.json"],"contacts":["native"],"detectors":["ohc"])",
           "/experiments/0/contacts: expected no contact generators in a replay");
    expect(replay + R"("scenes":["a.json"],"detectors":[{"method":"ohc","most_triangles":3}])", "most_triangles");
    expect(closed_loop + R"("generated":["balls"],"detectors":["ohc"],"responses":["penalty"])", "generated");
}

TEST_F(StudyFile, ExternalDataAreOneGroupPerInputAndSkippedWithoutTheFolder) {
    const std::string external = replay + R"("detectors":["ohc","brute_force"],"external":{"format":"triangle_pairs",
        "files":["data:a/x.txt","data:a/y.txt"],"source":"S 2023","licence":"MIT","reference":"ohc"})";
    std::map<std::string, std::multiset<std::string>> groups;
    for (PlannedRun run : make_plan(read(study_of({external})))) {
        ASSERT_TRUE(is_external(run.spec));
        EXPECT_EQ(run.spec.mode, "external");
        complete_run(input_facts("", run.spec, folder_.path()), run);
        ASSERT_TRUE(run.settled.has_value());
        EXPECT_EQ(run.settled->message, "no data");
        EXPECT_EQ(run.facts.at("case.source"), "S 2023");
        EXPECT_EQ(run.facts.at("case.licence"), "MIT");
        EXPECT_EQ(run.facts.at("case.reference"), "ohc");
        groups[run.group + "|" + run.spec.scene].insert(run.spec.detector);
    }
    ASSERT_EQ(groups.size(), 2U) << "one process per input";
    for (const auto& [group, detectors] : groups) {
        EXPECT_EQ(detectors, (std::multiset<std::string>{"brute_force", "ohc"})) << group;
    }
}

TEST_F(StudyFile, ExternalDataHaveKeysOfTheirOwn) {
    const auto expect = [this](const std::string& inside, const std::string& beside, const std::string& part) {
        expect_complaint(study_of({replay + R"("detectors":["ohc"],"external":{)" + inside + "}" + beside}), part);
    };
    const std::string good_one = R"("format":"fcl_scenario","files":["data:a.txt"],"source":"S","licence":"L")";
    EXPECT_NO_THROW((void)read(study_of({replay + R"("detectors":["ohc"],"external":{)" + good_one + "}"})));
    expect(R"("format":"fcl","files":["data:a.txt"],"source":"S","licence":"L")", "", "/external/format");
    expect(R"("format":"fcl_scenario","files":["a.txt"],"source":"S","licence":"L")", "", "/external/files/0");
    expect(R"("format":"fcl_scenario","files":["data:a.txt"],"source":"S")", "", "licence");
    expect(good_one + R"(,"reference":"brute_force")", "", "/external/reference");
    expect(good_one, R"(,"scenes":["a.json"])", "/external: expected external data alone");
    expect(good_one, R"(,"truth_stride":2)", "/truth_stride: expected no such key beside external data");
}

TEST_F(StudyFile, CyclesRepeatTheMotionOfAReplay) {
    const Study study = read(study_of({replay + R"("scenes":["a.json"],"detectors":["ohc"],"cycles":7,"ticks":500)"}));
    const std::vector<PlannedRun> plan = make_plan(study);
    ASSERT_EQ(plan.size(), 1U);
    EXPECT_EQ(plan[0].spec.mode, "repeated_motion");
    EXPECT_EQ(plan[0].spec.overrides, "cycles=7");
    EXPECT_EQ(plan[0].spec.ticks, 500);
    EXPECT_TRUE(plan[0].group.empty());
    EXPECT_NE(complaint(study_of({press + R"(,"cycles":7)"})).find("cycles"), std::string::npos);
    SceneFacts facts{};
    facts.motions = 1;
    PlannedRun run = plan[0];
    EXPECT_NO_THROW(complete_run(facts, run));
    facts.motions = 2;
    EXPECT_NE(test::complaint_of([&] {
                  complete_run(facts, run);
              }).find("a.json: expected one body with a motion, for cycles to repeat, got 2"),
              std::string::npos);
}

TEST_F(StudyFile, ASecondStepperIsThatOfEveryRun) {
    const Study study = read(study_of({press + R"(,"steppers":["xpbd"],"against":"implicit","truth_stride":0)"}));
    const std::vector<PlannedRun> plan = make_plan(study);
    ASSERT_EQ(plan.size(), 1U);
    EXPECT_EQ(plan[0].spec.mode, "against");
    EXPECT_EQ(plan[0].spec.stepper, "xpbd");
    EXPECT_EQ(plan[0].spec.against, "implicit");
    EXPECT_EQ(read(study_of({press + R"(,"against":"semi_implicit")"})).experiments[0].against, "semi_implicit");
    test::expect_holds(complaint(study_of({press + R"(,"against":"regionally")"})),
                       {"/experiments/0/against: expected a stepper"});
    test::expect_holds(
        complaint(study_of({replay + R"("scenes":["a.json"],"detectors":["ohc"],"against":"implicit")"})), {"against"});
}

TEST_F(StudyFile, ATwinIsOfScenesWithAnIntervalWithoutContactAndEveryTickIsJudged) {
    const Study study = read(study_of({press + R"(,"against":"twin")"}));
    PlannedRun run = make_plan(study).at(0);
    EXPECT_EQ(run.spec.mode, "resolution");
    EXPECT_EQ(run.spec.truth_stride, 1);
    SceneFacts facts{};
    EXPECT_NE(
        test::complaint_of([&] { complete_run(facts, run); }).find("a.json: expected contact_off and 0.2 s after"),
        std::string::npos);
    facts.has_resolution_window = true;
    EXPECT_NO_THROW(complete_run(facts, run));
    test::expect_holds(complaint(study_of({press + R"(,"against":"twin","truth_stride":2)"})),
                       {"/experiments/0/truth_stride: expected 1: against a twin"});
}

TEST_F(StudyFile, EveryResponseRunsOnItsOwnContactsUnlessTheyAreNamed) {
    const auto sources = [](const Study& study) {
        std::map<std::string, std::set<std::string>> found;
        for (const PlannedRun& run : make_plan(study)) {
            found[run.spec.response].insert(run.settled ? "settled" : run.spec.contacts);
        }
        return found;
    };
    const std::string before = closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],)";
    using Found = std::map<std::string, std::set<std::string>>;
    EXPECT_EQ(
        sources(read(study_of({before + R"("responses":["penalty","unilateral","thesis"])"}))),
        (Found{
            {"penalty", {"tracked_proximity"}}, {"unilateral", {"tracked_proximity"}}, {"thesis", {"intersection"}}}));
    EXPECT_EQ(sources(read(study_of({before + R"("contacts":["intersection"],"responses":["penalty","unilateral"])"}))),
              (Found{{"penalty", {"intersection"}}, {"unilateral", {"settled"}}}));
}

TEST_F(StudyFile, ANameThatNothingBesideItHasIsThatOfAShippedScene) {
    const test::TemporaryFolder elsewhere;
    std::vector<std::filesystem::path> shipped;
    for (const char* name : {"a.json", "far_1.json", "far_2.json", "lone.json"}) {
        shipped.push_back(elsewhere.path() / name);
        std::ofstream(shipped.back()) << "{}\n";
    }
    const std::filesystem::path file = folder_.path() / "study.json";
    std::ofstream(file) << study_of(
        {replay +
         R"("scenes":["a","lone","far_*.json"],"detectors":["ohc",{"method":"ohc_clustered","scenes":["lone"]}])"});
    const Experiment experiment = read_study(file, {}, shipped).experiments.front();
    const std::vector<std::string> scenes = files_of(experiment);
    ASSERT_EQ(scenes.size(), 4U);
    const auto leads_to = [&](std::size_t scene, const std::filesystem::path& wanted) {
        return std::filesystem::equivalent(folder_.path() / scenes[scene], wanted);
    };
    EXPECT_TRUE(leads_to(0, shipped[0])) << "'a' without .json is no file";
    EXPECT_TRUE(leads_to(1, shipped[3]));
    EXPECT_TRUE(leads_to(2, shipped[1]));
    EXPECT_TRUE(leads_to(3, shipped[2]));
    EXPECT_EQ(experiment.detectors[1].only.at("inputs"), (std::vector<std::string>{scenes[1]}));

    std::ofstream(file) << study_of({replay + R"("scenes":["a.json"],"detectors":"all")"});
    EXPECT_EQ(files_of(read_study(file, {}, shipped).experiments[0]), (std::vector<std::string>{"a.json"}))
        << "beside it first";
    std::ofstream(file) << study_of({replay + R"("scenes":["x/lone"],"detectors":"all")"});
    EXPECT_THROW((void)read_study(file, {}, shipped), InputError) << "a folder is meant as it stands";
}

TEST_F(StudyFile, APatternFitsWhereTheStudyIsNamedWithoutAFolder) {
    std::ofstream(folder_.path() / "study.json") << study_of({replay + R"("scenes":["?.json"],"detectors":"all")"});
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder_.path());
    const std::vector<std::string> scenes = files_of(read_study("study.json").experiments[0]);
    std::filesystem::current_path(before);
    EXPECT_EQ(scenes, (std::vector<std::string>{"a.json", "b.json"}));
}

TEST_F(StudyFile, AMethodOfTheCommandLineTakesPartOnceWhereItsKindDoes) {
    const std::filesystem::path file = folder_.path() / "study.json";
    // Experiments that compare what the command line adds, then those whose subject is something else.
    std::ofstream(file) << study_of(
        {replay + R"("scenes":["a.json"],"detectors":["ohc","brute_force"])", press,
         closed_loop + R"("perturbed":true,"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"])",
         press + R"(,"clock":"paced")", press + R"(,"truth_stride":0)",
         press + R"(,"sweep":{"knob":"k","values":[5]})"});
    const auto texts = [](const std::vector<Level>& methods) {
        std::vector<std::string> list;
        for (const Level& method : methods) list.push_back(method.text);
        return list;
    };
    const Study study = read_study(file, {"ohc_clustered", "unilateral", "ohc"});
    EXPECT_EQ(texts(study.experiments[0].detectors), (std::vector<std::string>{"ohc", "brute_force", "ohc_clustered"}));
    EXPECT_TRUE(study.experiments[0].responses.empty());
    EXPECT_EQ(texts(study.experiments[1].detectors), (std::vector<std::string>{"ohc", "ohc_clustered"}));
    EXPECT_EQ(texts(study.experiments[1].responses), (std::vector<std::string>{"penalty", "unilateral"}));
    EXPECT_EQ(texts(study.experiments[2].detectors), (std::vector<std::string>{"ohc"}));
    EXPECT_EQ(texts(study.experiments[2].responses), (std::vector<std::string>{"penalty", "unilateral"}));
    for (std::size_t i = 3; i < study.experiments.size(); ++i) {
        EXPECT_EQ(texts(study.experiments[i].detectors), (std::vector<std::string>{"ohc"})) << i;
        EXPECT_EQ(texts(study.experiments[i].responses), (std::vector<std::string>{"penalty"})) << i;
    }
    std::ofstream(folder_.path() / "timed.json") << study_of({press + R"(,"truth_stride":0)"});
    for (const char* untaken : {"ohc_clustered", "unilateral"}) {
        EXPECT_THROW((void)read_study(folder_.path() / "timed.json", {untaken}), InputError) << untaken;
    }
    for (const char* wrong : {"holt", "unilateral:nothing=1", ""}) {
        EXPECT_THROW((void)read_study(file, {wrong}), InputError) << wrong;
    }
}

TEST_F(StudyFile, WhereTheReferenceDoesNotRunIsReported) {
    const auto notes = [this](const std::string& detectors) {
        return reference_notes(
            read(study_of({replay + R"("scenes":["a.json","b.json"],"detectors":[)" + detectors + "]", press},
                          R"("reference":"ohc",)")));
    };
    EXPECT_TRUE(notes(R"("ohc")").empty());
    EXPECT_TRUE(reference_notes(read(good)).empty());  // none asked for
    const auto elsewhere = notes(R"("brute_force")");
    ASSERT_EQ(elsewhere.size(), 1U);
    test::expect_holds(elsewhere[0], {"/experiments/0: ohc, which times are set against, is not among the detectors"});
    const auto some = notes(R"({"method":"ohc","scenes":["a.json"]})");
    ASSERT_EQ(some.size(), 1U);
    EXPECT_NE(some[0].find("on some scenes only"), std::string::npos);
}

TEST_F(StudyFile, IsReadAsWritten) {
    const Study study = read(good);
    EXPECT_EQ(study.name, "s");
    EXPECT_EQ(study.seed, 5U);
    EXPECT_EQ(study.time_limit_s, 2.5);
    ASSERT_EQ(study.experiments.size(), 2U);
    const Experiment& detection = study.experiments[0];
    EXPECT_EQ(detection.frames, Experiment::Frames::replay);
    EXPECT_EQ(detection.repetitions, 2);
    EXPECT_EQ(detection.ticks, 20);
    EXPECT_EQ(detection.truth_stride, 1);
    const Experiment& loop = study.experiments[1];
    EXPECT_EQ(loop.frames, Experiment::Frames::closed_loop);
    EXPECT_EQ(loop.clock, Experiment::Clock::back_to_back);
    EXPECT_EQ(loop.repetitions, 3);
    EXPECT_EQ(loop.truth_stride, 4);
    EXPECT_EQ(loop.responses[1].setting, "tuned");
    EXPECT_EQ(loop.responses[1].basis, "five values of k");
}

TEST_F(StudyFile, OtherScenesStandInPlaceOfThoseOfEveryExperiment) {
    const std::filesystem::path other = folder_.path() / "other";
    std::filesystem::create_directory(other);
    for (const char* name : {"x.json", "y.json"}) std::filesystem::copy_file(folder_.path() / "a.json", other / name);
    const std::filesystem::path file = folder_.write("study.json", study_of({press, press}));
    const Study study = read_study(file, {}, {}, {(other / "*.json").string()});
    for (const Experiment& experiment : study.experiments) {
        EXPECT_EQ(files_of(experiment),
                  (std::vector<std::string>{(other / "x.json").string(), (other / "y.json").string()}));
    }
    test::expect_holds(test::complaint_of([&] { (void)read_study(file, {}, {}, {(other / "z*.json").string()}); }),
                       {"--scenes: /0: expected a pattern of scene files, relative to the working directory"});
    const std::filesystem::path without =
        folder_.write("without.json", study_of({replay + R"("generated":["balls:count=4"],"detectors":["ohc"])"}));
    test::expect_holds(test::complaint_of([&] { (void)read_study(without, {}, {}, {(other / "x.json").string()}); }),
                       {"--scenes: expected a study with scenes"});
}

TEST_F(StudyFile, OtherScenesAreNamedFromTheWorkingDirectoryAndVoidAMethodsOwnChoice) {
    const std::filesystem::path other = folder_.path() / "other";
    std::filesystem::create_directory(other);
    std::filesystem::copy_file(folder_.path() / "a.json", other / "x.json");
    const std::filesystem::path file = folder_.write(
        "study.json",
        study_of({replay + R"("scenes":["a.json","b.json"],"detectors":[{"method":"ohc","scenes":["b"]}])"}));
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(other);
    const Study study = read_study(file, {}, {}, {"*.json"});
    std::filesystem::current_path(before);
    EXPECT_EQ(files_of(study.experiments[0]), std::vector<std::string>{(other / "x.json").string()});
    EXPECT_EQ(make_plan(study).size(), 1U);
}

TEST_F(StudyFile, TunedResponsesComeFromTheFileOfTheSearchByMethodAndStepper) {
    std::ofstream(folder_.path() / "tuned.json") << R"({"format":"trocar-tuned-1","tune":"t","seed":1,
        "budget":{"first":64,"second":16,"local":32},"responses":[
        {"method":"penalty","stepper":"","setting":"penalty:k=7","contacts":"intersection"},
        {"method":"penalty","stepper":"implicit","setting":"penalty:k=9","contacts":"tracked_proximity"},
        {"method":"unilateral","stepper":"","setting":"unilateral","contacts":"tracked_proximity"}]})";
    const auto study_with = [](const std::string& responses, const std::string& key = R"("tuned":"tuned.json",)") {
        return study_of({closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],"responses":[)" + responses + "]"},
                        key);
    };
    const Study study = read(study_with(R"("unilateral",{"tuned":"unilateral"},{"tuned":"penalty"},
        {"tuned":"penalty","steppers":["implicit"],"contacts":["native"]})"));
    const std::vector<Level>& responses = study.experiments[0].responses;
    ASSERT_EQ(responses.size(), 4U);
    EXPECT_EQ(responses[1].setting, "default") << "nothing better was found for unilateral";
    EXPECT_EQ(responses[2].text, "penalty:k=7");
    EXPECT_EQ(responses[2].setting, "tuned");
    test::expect_holds(responses[2].basis, {"search t of seed 1, 64 + 16 + 32 settings", "tuned.json"});
    EXPECT_EQ(responses[2].only.at("contacts"), std::vector<std::string>{"intersection"});
    EXPECT_EQ(responses[3].text, "penalty:k=9");
    EXPECT_EQ(responses[3].only.at("contacts"), std::vector<std::string>{"native"}) << "what the study says stands";
    const std::string both = R"({"method":"unilateral","contacts":["tracked_proximity"]})";
    for (const std::string& list : {both + R"(,{"tuned":"unilateral"})", R"({"tuned":"unilateral"},)" + both}) {
        const std::vector<PlannedRun> plan = make_plan(read(study_with(list)));
        ASSERT_EQ(plan.size(), 1U) << "the same run once";
        EXPECT_NE(plan[0].response.basis.find("nothing better"), std::string::npos) << plan[0].response.basis;
    }
    const Study by_implicit = read(study_of({closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],
        "steppers":["implicit"],"responses":[{"tuned":"penalty"}])"},
                                            R"("tuned":"tuned.json",)"));
    EXPECT_EQ(by_implicit.experiments[0].responses[0].text, "penalty:k=9") << "the experiment's stepper";
    const std::string place = "/experiments/0/responses/0";
    expect_complaint(study_with(R"({"tuned":"penalty"})", ""), place + "/tuned: expected a study with the key 'tuned'");
    expect_complaint(study_with(R"({"tuned":"impulse"})"), place + "/tuned: expected a method of the file");
    for (const char* key : {"method", "setting", "basis", "reading_of"}) {
        expect_complaint(study_with(fmt::format(R"({{"tuned":"penalty","{}":"x"}})", key)),
                         fmt::format("{}/{}: expected no such key beside", place, key));
    }
    expect_complaint(study_with(R"({"tuned":"penalty","steppers":["implicit","xpbd"]})"), place + "/steppers");
    const Level moved =
        read(study_with(R"({"tuned":"penalty","searched_with":"implicit","steppers":["implicit:steps=4","xpbd"]})"))
            .experiments[0]
            .responses[0];
    EXPECT_EQ(moved.text, "penalty:k=9");
    EXPECT_EQ(moved.only.at("steppers"), (std::vector<std::string>{"implicit:steps=4", "xpbd"}));
    test::expect_holds(moved.basis, {"search t of seed 1", "searched with the stepper `implicit`"});
    expect_complaint(study_with(R"({"tuned":"penalty","searched_with":"xpbd"})"), "with the stepper xpbd");
}

TEST_F(StudyFile, ARunHasTheSettingOfWhatItCompares) {
    const std::string tuned = R"({"method":"penalty","setting":"tuned","basis":"searched"})";
    const std::string recommended = R"({"method":"ohc","setting":"recommended","basis":"its authors"})";
    const Study study = read(study_of({replay + R"("scenes":["a.json"],"detectors":[)" + recommended + "]",
                                       closed_loop + R"("scenes":["a.json"],"detectors":[)" + recommended +
                                           R"(,"brute_force"],"responses":["unilateral",)" + tuned + "]"}));
    std::map<std::string, std::string> settings;
    for (const PlannedRun& run : make_plan(study))
        settings[run.spec.detector + "+" + run.spec.response] = run.spec.setting;
    EXPECT_EQ(settings, (std::map<std::string, std::string>{{"ohc+", "recommended"},
                                                            {"ohc+unilateral", "recommended"},
                                                            {"ohc+penalty", "tuned"},
                                                            {"brute_force+unilateral", "default"},
                                                            {"brute_force+penalty", "tuned"}}));
}

TEST_F(StudyFile, AReadingNamesAResponseOfTheStudyThatIsNone) {
    const auto with = [&](const std::string& more) {
        return study_of(
            {closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],"responses":["penalty",)" + more + "]"});
    };
    const Study study = read(with(R"({"method":"penalty:k=10","reading_of":"penalty"})"));
    EXPECT_EQ(study.experiments[0].responses[1].setting, "reading");
    EXPECT_EQ(study.experiments[0].responses[1].reading_of, "penalty");
    const auto error_of = [&](const std::string& more) {
        try {
            static_cast<void>(read(with(more)));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(error_of(R"({"method":"penalty:k=10","reading_of":"unilateral"})").find("got unilateral"),
              std::string::npos);
    EXPECT_NE(error_of(R"({"method":"penalty:k=10","reading_of":"penalty"},)"
                       R"({"method":"penalty:k=20","reading_of":"penalty:k=10"})")
                  .find("got penalty:k=10"),
              std::string::npos);
    EXPECT_NE(
        error_of(R"({"method":"penalty:k=10","reading_of":"penalty","setting":"tuned","basis":"b"})").find("got tuned"),
        std::string::npos);
}

TEST_F(StudyFile, CostBySizeTimesEveryStepperOnEverySceneAndJudgesNone) {
    const Study study =
        read(study_of({closed_loop + R"("truth_stride":0,"scenes":["a.json","b.json"],"detectors":["ohc"],
        "responses":["penalty"],"steppers":["semi_implicit","implicit"],"ticks":20)"}));
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

const std::string knobs = study_of(
    {closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],"responses":["penalty","thesis"],"ticks":1000,
      "sweep":{"knob":"dt","values":[0.0005,0.002]})",
     replay + R"("scenes":["a.json","b.json"],"detectors":["ohc"],"ticks":1000,
      "sweep":{"knob":"detector.cell","values":[0.01,"auto"]})",
     closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],"responses":["thesis:profile=corrected"],"ticks":1000,
      "sweep":{"knob":"response.n_back","values":[5]})",
     closed_loop + R"("clock":"paced","scenes":["b.json"],"detectors":["ohc"],"responses":["penalty"],
      "steppers":["implicit","semi_implicit"],"ticks":50)"});

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
    const std::string sweep = R"(,"sweep":{"knob":"k","values":[5]})";
    const Study study = read(study_of({closed_loop + R"("scenes":["a.json","b.json"],"detectors":["ohc"],
                        "responses":["thesis",{"method":"penalty","scenes":["b.json"]}])" +
                                           sweep,
                                       closed_loop + R"("scenes":["a.json"],"detectors":["ohc","fcl_bvh"],
                        "responses":["penalty","thesis"],"contacts":["native"])" +
                                           sweep}));
    std::map<std::string, std::string> ends;
    for (const PlannedRun& run : make_plan(study)) {
        const RunSpec& spec = run.spec;
        ends[spec.scene + "|" + spec.detector + "|" + spec.response + "|" + spec.contacts] =
            run.settled ? std::string(name_of(run.settled->kind)) : "to do";
    }
    if (ends.at("a|fcl_bvh|penalty|native") == "absent") GTEST_SKIP() << "without FCL";
    const std::map<std::string, std::string> expected{
        {"a|ohc|thesis|intersection", "to do"},       {"b|ohc|thesis|intersection", "to do"},
        {"b|ohc|penalty|tracked_proximity", "to do"}, {"|ohc||native", "unsupported"},
        {"||thesis|native", "unsupported"},           {"a|fcl_bvh|penalty|native", "to do"}};
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
    const std::string detector = replay + R"("scenes":["a.json"],"detectors":["ohc"],"sweep":)";
    const std::vector<std::pair<std::string, std::string>> faults{
        {press + R"(,"sweep":{"knob":"mass","values":[1]})", "/0/sweep/knob"},
        {detector + R"({"knob":"dt","values":[0.001]})", "/0/sweep/knob"},
        {press + R"(,"sweep":{"knob":"dt","values":[0.001,-1]})", "/values/1"},
        {press + R"(,"sweep":{"knob":"substeps","values":[2.5]})", "/values/0"},
        {detector + R"({"knob":"detector.cell","values":["wide"]})", "/values/0"},
        {detector + R"({"knob":"detector.colour","values":[1]})", "/values/0"},
        {detector + R"({"knob":"detector.cell"})", "/sweep: "},
        {detector + R"({"knob":"detector.cell","values":[]})", "/values"}};
    for (const auto& [text, place] : faults) expect_complaint(study_of({text}), place);
}

TEST_F(StudyFile, EveryFaultIsNamedWithItsPlace) {
    const std::string scene = R"("scenes":["a.json"],)";
    const std::string detection = replay + scene + R"("detectors":["ohc"])";
    const std::string place = "/experiments/0";
    std::vector<std::pair<std::string, std::string>> faults{
        {R"([])", "object"},
        {R"({"format":"trocar-study-3","name":)", "line 1"},
        {R"({"format":"trocar-study-1","name":"s","experiments":[]})", "/format"},
        {R"({"format":"trocar-study-3","name":"s"})", "experiments"},
        {R"({"format":"trocar-study-3","name":"s","experiments":[]})", "/experiments"},
        {R"({"format":"trocar-study-3","name":"s","experiments":["a.json"]})", place},
        {R"({"format":"trocar-study-3","experiments":[]})", "name"},
        {R"({"format":"trocar-study-3","name":"../s","experiments":[]})", "/name"}};
    for (const auto& [more, where] :
         std::vector<std::pair<std::string, std::string>>{{R"("replays":{},)", "/replays"},
                                                          {R"("repetitions":0,)", "/repetitions"},
                                                          {R"("time_limit_s":-1,)", "/time_limit_s"},
                                                          {R"("seed":-1,)", "/seed"},
                                                          {R"("seed":"one",)", "/seed"},
                                                          {R"("device":"tip=shaft",)", "/device"},
                                                          {R"("device":"fulcrum",)", "/device"},
                                                          {R"("device":3,)", "/device"},
                                                          {R"("device":{"colour":"red"},)", "/device"},
                                                          {R"("device":{"tip":"sum","rate":-1},)", "/device/rate"},
                                                          {R"("device":{"ramp":true},)", "/device/ramp"},
                                                          {R"("ours":"unilateral",)", "/ours"},
                                                          {R"("reference":"brute_force",)", "/reference"}}) {
        faults.emplace_back(study_of({detection}, more), where);
    }
    for (const auto& [text, where] : std::vector<std::pair<std::string, std::string>>{
             {scene + R"("detectors":["ohc"])", "frames"},
             {R"("frames":"film",)" + scene + R"("detectors":["ohc"])", "/frames"},
             {replay + R"("scenes":["a.json"])", "detectors"},
             {replay + R"("detectors":["ohc"])", "one of the keys scenes, cases, pair_files"},
             {detection + R"(,"tick":3)", "/tick"},
             {detection + R"(,"ticks":0)", "/ticks"},
             {detection + R"(,"ticks":-5)", "/ticks"},
             {detection + R"(,"ticks":2.5)", "/ticks"},
             {detection + R"(,"truth_stride":-1)", "/truth_stride"},
             {detection + R"(,"responses":["penalty"])", "/responses"},
             {detection + R"(,"clock":"paced")", "/clock"},
             {detection + R"(,"clock":"slow")", "/clock"},
             {detection + R"(,"perturbed":1)", "/perturbed"},
             {detection + R"(,"pair_files":["x/pairs.txt"])", "/pair_files/0"},
             {detection + R"(,"cases":"nowhere")", "/cases"},
             {detection + R"(,"perturbed":true,"truth_stride":1)", "/truth_stride"},
             {detection + R"(,"perturbed":true,"repetitions":1)", "/repetitions"},
             {replay + R"("scenes":[],"detectors":["ohc"])", "/scenes"},
             {replay + R"("scenes":"a.json","detectors":["ohc"])", "/scenes"},
             {replay + R"("scenes":["c.json"],"detectors":["ohc"])", "/scenes/0"},
             {replay + R"("scenes":["a.json","a.json"],"detectors":["ohc"])", "/scenes/1"},
             {replay + scene + R"("detectors":["no_such"])", "/detectors/0"},
             {replay + scene + R"("detectors":["ohc:no_such=1"])", "/detectors/0"},
             {replay + scene + R"("detectors":["ohc:cell=-1"])", "/detectors/0"},
             {replay + scene + R"("detectors":["ohc","ohc"])", "/detectors/1"},
             {replay + scene + R"("detectors":[{"method":"ohc","setting":"best"}])", "/detectors/0/setting"},
             {replay + scene + R"("detectors":[{"method":"ohc","setting":"tuned"}])", "basis"},
             {replay + scene + R"("detectors":[{"method":"ohc","judged":false}])", "/detectors/0/judged"},
             {replay + scene + R"("detectors":[3])", "/detectors/0"},
             {closed_loop + scene + R"("detectors":["ohc"])", "responses"},
             {press + R"(,"contacts":["both"])", "/contacts/0"},
             {press + R"(,"contacts":["native","native"])", "/contacts/1"},
             {press + R"(,"steppers":["sleepy"])", "/steppers/0"},
             {press + R"(,"steppers":["semi_implicit","semi_implicit"])", "/steppers/1"},
             {press + R"(,"clock":"paced","truth_stride":1)", "/truth_stride"},
             {press + R"(,"clock":"paced","perturbed":true)", "/clock"},
             {press + R"(,"pair_files":["data:x.txt"])", "/pair_files"},
             {closed_loop + scene + R"("detectors":["ohc"],"responses":[{"method":"penalty","detectors":["blind"]}])",
              "/responses/0/detectors/0"},
             {closed_loop + scene + R"("detectors":["ohc"],"responses":[{"method":"penalty","contacts":["both"]}])",
              "/responses/0/contacts/0"},
             {closed_loop + scene + R"("detectors":["ohc"],"responses":["penalty:tip=sum"])",
              "got 'tip': give the run's device"}}) {
        faults.emplace_back(study_of({text}), where);
        if (where.front() == '/') faults.back().second = place + where;
    }
    for (const auto& [text, where] : faults) expect_complaint(text, where);
}

TEST_F(StudyFile, RetiredKeysAreReportedWithTheirReplacement) {
    for (const RetiredName& row : retired_names()) {
        if (row.kind != NameKind::study_key) continue;
        ASSERT_EQ(row.scope, "") << row.name << " has no place in this test";
        nlohmann::ordered_json document = nlohmann::ordered_json::parse(good);
        document[row.name] = 1;
        expect_complaint(document.dump(), fmt::format("/{}: expected one of ", row.name),
                         fmt::format("got '{}': {}", row.name, row.use));
    }
}

TEST_F(StudyFile, APartOfTheFormerFormatIsReportedWithTheExperimentThatItIsNow) {
    expect_complaint(R"({"format":"trocar-study-2","name":"s",
        "cost_by_size":{"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"]}})",
                     "/cost_by_size: expected one of ",
                     R"(write an experiment: "frames": "closed_loop", "truth_stride": 0)");
}

TEST_F(StudyFile, RetiredNamesInAStudyAreReportedWithTheirReplacement) {
    const std::string loop = closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],)";
    const std::string detection = replay + R"("scenes":["a.json"],"detectors":["ohc"])";
    const std::string place = "/experiments/0";
    const std::vector<std::array<std::string, 3>> cases{
        {study_of({loop + R"("responses":["hold"])"}), place + "/responses/0: expected ",
         "got 'hold': renamed to 'unilateral'"},
        {study_of({loop + R"("responses":["thesis:contacts=hold"])"}), place + "/responses/0: expected ",
         "got 'hold': renamed to 'zero_order_hold'"},
        {study_of({loop + R"("responses":["penalty"],"contacts":["near"])"}), place + "/contacts/0: expected one of ",
         "got \"near\": renamed to 'proximity'"},
        {study_of({loop + R"("responses":[{"method":"penalty","contacts":["canonical"]}])"}),
         place + "/responses/0/contacts/0: expected ", "got \"canonical\": renamed to 'intersection'"},
        {study_of({loop + R"("responses":["penalty"],"steppers":["regional"])"}), place + "/steppers/0: expected ",
         "got 'regional': renamed to 'adaptive_multires'"},
        {study_of({replay + R"("scenes":["a.json"],"detectors":["ohc:incremental=on"])"}),
         place + "/detectors/0: expected ", "got 'incremental': take the detector ohc_clustered"},
        {study_of({detection}, R"("device":{"tip_rate":500},)"), "/device/tip_rate: expected one of ",
         "got 'tip_rate': give the run's device, --device rate=…"}};
    for (const auto& [text, where, end] : cases) expect_complaint(text, where, end);
    (void)read(good);
    EXPECT_EQ(test::complaint_of([this] { (void)read_study(folder_.path() / "study.json", {"hold:k=100"}); }),
              "--with: expected a detector or response of trocar list, got 'hold:k=100': renamed to 'unilateral'");
}

TEST_F(StudyFile, OneDeviceServesEveryRunWithAResponse) {
    const std::vector<std::string> experiments{
        replay + R"("scenes":["a.json"],"detectors":["ohc"])",
        closed_loop + R"("scenes":["a.json"],"detectors":["ohc"],"responses":["penalty","thesis"])",
        closed_loop + R"("clock":"paced","scenes":["a.json"],"detectors":["ohc"],"responses":["unilateral"])",
        closed_loop + R"("perturbed":true,"scenes":["a.json"],"detectors":["ohc"],"responses":["penalty"])"};
    const std::string given = "tip=sum,saturation=3,rate=0,filter=150,ramp=0";
    const std::map<std::string, std::string> devices{
        {"", "tip=fulcrum,saturation=8.5,rate=0,filter=0,ramp=0"},
        {R"("device":{"tip":"sum","filter":150,"saturation":3},)", given},
        {R"("device":{"tip":"sum","filter":"150","saturation":3.0},)", given},
        {R"("device":"filter=150,tip=sum,saturation=3",)", given}};
    for (const auto& [device, expected] : devices) {
        int shown = 0;
        for (const PlannedRun& run : make_plan(read(study_of(experiments, device)))) {
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

TEST_F(StudyFile, RepetitionsAreBlocksOfInterleavedMethods) {
    std::int64_t last = 0;
    for (const PlannedRun& run : make_plan(read(good))) {
        EXPECT_GE(run.spec.repetition, last);
        last = run.spec.repetition;
    }
    EXPECT_EQ(last, 2);
}

TEST_F(StudyFile, APacedRunTakesTheTimeThatTheClockGivesItsTicks) {
    std::vector<PlannedRun> plan = make_plan(read(study_of({press + R"(,"clock":"paced","ticks":3000)"})));
    ASSERT_EQ(plan.size(), 1U);
    complete_run({.name = "a", .hash = {}, .pair_class = {}, .dt = 0.002, .triangles = 100000}, plan[0]);
    const double long_run = plan[0].rough_seconds;
    plan[0].spec.ticks = 1000;
    complete_run({.name = "a", .hash = {}, .pair_class = {}, .dt = 0.002, .triangles = 100000}, plan[0]);
    // Once with the tick at its moments and once for the empty loop.
    EXPECT_NEAR(long_run - plan[0].rough_seconds, 2.0 * 2000 * 0.002, 1e-9);
}

TEST_F(StudyFile, AQuotedReportIsTheNameOfAFolder) {
    expect_complaint(study_of({press}, R"("quotes":[{"report":"../secret"}],)"), "/quotes/0/report: expected a name");
}

TEST_F(StudyFile, RoughTimesGrowWithTicksTrianglesAndJudgedTicks) {
    const auto seconds = [this](const std::string& more, std::int64_t triangles) {
        std::vector<PlannedRun> plan = make_plan(read(study_of({press + more})));
        complete_run({.name = "a", .hash = {}, .pair_class = {}, .dt = 0.001, .triangles = triangles}, plan[0]);
        return plan[0].rough_seconds;
    };
    const std::string timed = R"(,"ticks":1000,"truth_stride":0)";
    EXPECT_GT(seconds(timed, 100'000), 10.0 * seconds(timed, 1'000)) << "100 ticks of 1000 triangles cost little";
    EXPECT_GT(seconds(R"(,"ticks":9000,"truth_stride":0)", 1'000), 3.0 * seconds(timed, 1'000));
    EXPECT_GT(seconds(R"(,"ticks":1000)", 100'000), 2.0 * seconds(timed, 100'000)) << "truth costs more than a method";
}

TEST_F(StudyFile, RoughTimesOfRunsThatAreMadeSeveralTimesGrowLikeThoseOfOne) {
    // Metamorphic tests make a run seven times, runs with a twin twice; both grow with ticks and triangles.
    const auto seconds = [](const std::string& mode, std::int64_t ticks, std::int64_t triangles) {
        PlannedRun run;
        run.spec.mode = mode;
        run.spec.scene_file = "a.json";
        run.spec.detector = "ohc";
        run.spec.response = "penalty";
        run.spec.ticks = ticks;
        run.spec.truth_stride = mode == "resolution" ? 1 : 0;
        complete_run({.name = "a",
                      .hash = {},
                      .pair_class = {},
                      .dt = 0.001,
                      .triangles = triangles,
                      .has_resolution_window = true},
                     run);
        return run.rough_seconds;
    };
    for (const auto& [mode, times] : {std::pair{"metamorphic", 7.0}, {"resolution", 2.0}}) {
        const double start = seconds(mode, 0, 1'000);
        for (const std::int64_t triangles : {1'000, 100'000}) {
            const double once = seconds("closed_loop", 1'000, triangles) - start;
            EXPECT_GT(seconds(mode, 1'000, triangles) - start, 0.99 * times * once) << mode << triangles;
            EXPECT_NEAR(seconds(mode, 3'000, triangles) - start, 3.0 * (seconds(mode, 1'000, triangles) - start), 1e-9)
                << mode << triangles;
        }
        EXPECT_GT(seconds(mode, 1'000, 100'000), 10.0 * seconds(mode, 1'000, 1'000)) << mode;
    }
}

TEST_F(StudyFile, PacedRunsMayDither) {
    const std::vector<PlannedRun> plan = make_plan(read(study_of({press + R"(,"clock":"paced","dither":1e-5)"})));
    ASSERT_EQ(plan.size(), 1U);
    EXPECT_EQ(plan[0].spec.overrides, "dither=1e-05");
    EXPECT_NE(complaint(study_of({press + R"(,"dither":1e-5)"})).find("dither"), std::string::npos);
    EXPECT_NE(complaint(study_of({press + R"(,"clock":"paced","dither":0)"})).find("/dither"), std::string::npos);
}

TEST_F(StudyFile, ARunOfMoreTicksThanARecordHoldsIsRefusedBeforeItIsMade) {
    std::vector<PlannedRun> plan = make_plan(read(study_of({press + R"(,"clock":"paced","ticks":400000)"})));
    const SceneFacts facts{.name = "a", .hash = {}, .pair_class = {}, .dt = 0.002, .triangles = 1000};
    complete_run(facts, plan[0]);
    plan[0].spec.ticks = 400'001;
    EXPECT_EQ(test::complaint_of([&] { complete_run(facts, plan[0]); }),
              "study: a: expected at most 400000 ticks of a run (--large lifts this), got 400001");
}

TEST_F(StudyFile, MethodRunsOnItsOwnScenesOnly) {
    const std::vector<PlannedRun> plan =
        make_plan(read(study_of({replay + R"("scenes":["a.json","b.json"],)"
                                          R"("detectors":["ohc",{"method":"brute_force","scenes":["b.json"]}])"})));
    EXPECT_EQ(plan.size(), 3U);
    for (const PlannedRun& run : plan) {
        EXPECT_TRUE(run.spec.detector == "ohc" || run.spec.scene_file == "b.json");
    }
}

TEST_F(StudyFile, AResponseMayChooseItsDetectorsAndContacts) {
    const Study study =
        read(study_of({closed_loop + R"("scenes":["a.json"],
        "detectors":["ohc",{"method":"brute_force","judged":false}],
        "detail_stride":7,"responses":[{"method":"unilateral","contacts":["tracked_proximity"]},
        {"method":"penalty","detectors":["ohc"],"contacts":["intersection"]}])"},
                      R"("ours":"unilateral","quotes":["seen elsewhere",{"report":"one"},{"report":"two"}],)"));
    std::set<std::string> runs;
    for (const PlannedRun& run : make_plan(study)) {
        EXPECT_FALSE(run.settled) << "what was not chosen is no row";
        EXPECT_EQ(run.spec.detail_stride, 7);
        EXPECT_EQ(run.spec.truth_stride, run.spec.detector == "brute_force" ? 0 : 1);
        runs.insert(run.spec.detector + " " + run.spec.response + " " + run.spec.contacts);
        EXPECT_EQ(method_facts(study, run).at("study.ours"), "unilateral");
        EXPECT_EQ(method_facts(study, run).at("study.quotes"), "seen elsewhere");
        EXPECT_EQ(method_facts(study, run).at("study.quoted_reports"), "one,two");
    }
    EXPECT_EQ(runs, (std::set<std::string>{"ohc unilateral tracked_proximity",
                                           "brute_force unilateral tracked_proximity", "ohc penalty intersection"}));
}

TEST_F(StudyFile, AbsentMethodBecomesRowsWithItsReason) {
    if (registry().absent_detectors().empty()) GTEST_SKIP() << "this build has every detector";
    const AbsentMethod& absent = registry().absent_detectors().front();
    const Study study =
        read(study_of({replay + R"("scenes":["a.json"],"detectors":["ohc",")" + absent.name + R"("])"}));
    const std::vector<PlannedRun> plan = make_plan(study);
    ASSERT_EQ(plan.size(), 2U);
    const auto lost =
        std::find_if(plan.begin(), plan.end(), [](const PlannedRun& run) { return run.settled.has_value(); });
    ASSERT_NE(lost, plan.end());
    EXPECT_EQ(lost->settled->kind, OutcomeKind::absent);
    EXPECT_NE(lost->settled->message.find(absent.reason), std::string::npos);
}

TEST(Studies, OfTheProjectAreReadable) {
    std::size_t studies = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(TROCAR_SOURCE_DIR) / "bench" / "studies")) {
        if (entry.path().extension() != ".json") continue;
        ++studies;
        EXPECT_FALSE(make_plan(read_study(entry.path())).empty()) << entry.path();
    }
    EXPECT_GT(studies, 10U);
}

TEST_F(StudyFile, HardCasesArePlannedByTheirKind) {
    const std::filesystem::path cases = folder_.path() / "hard";
    const auto add = [&cases](const std::string& name, const std::string& text) {
        std::filesystem::create_directories(cases / name);
        std::ofstream(cases / name / "expected.json") << text;
    };
    add("meshes", R"({"of":"m","reason":"r","pairs":[[0,1]],"touch":[0]})");
    add("moving",
        R"({"of":"s","reason":"r","scene":"../../a.json","at_most":{"residual_penetration_max_m":0.001},"ticks":70})");
    const std::string before = R"("repetitions":3,"cases":"hard","detectors":["ohc","brute_force"])";
    const Study study = read(study_of({replay + before + R"(,"pair_files":["data:x/pairs.txt"])",
                                       closed_loop + R"("cases":"hard","detectors":["ohc"],"responses":["penalty"])"}));
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
    EXPECT_EQ(runs, (std::multiset<std::string>{"meshes ohc ", "meshes brute_force ", "moving ohc penalty",
                                                "pairs ohc ", "pairs brute_force "}));
}

TEST_F(StudyFile, PerturbedRunsAreMadeInAtLeastTwoProcesses) {
    const Study study =
        read(study_of({replay + R"("perturbed":true,"scenes":["a.json"],"detectors":["ohc","brute_force"])",
                       press + R"(,"perturbed":true,"repetitions":3)"}));
    std::map<std::string, int> runs;
    for (const PlannedRun& run : make_plan(study)) {
        EXPECT_EQ(run.spec.mode, "metamorphic");
        EXPECT_EQ(run.spec.truth_stride, 0);
        ++runs[run.spec.detector + "+" + run.spec.response];
    }
    EXPECT_EQ(runs, (std::map<std::string, int>{{"ohc+", 2}, {"brute_force+", 2}, {"ohc+penalty", 3}}));
}

TEST(ShippedDefaultStudy, RunsEveryResponseOnEveryOneOfItsScenesAndJudgesEveryTick) {
    const Study study = read_study(std::filesystem::path(TROCAR_SOURCE_DIR) / "bench" / "studies" / "default.json");
    std::set<std::string> replayed;
    std::set<std::string> looped;
    std::map<std::string, std::set<std::string>> judged;  // by response: scenes judged with an exact detector
    for (const PlannedRun& run : make_plan(study)) {
        if (run.spec.mode == "replay") replayed.insert(run.spec.scene);
        if (run.spec.mode == "closed_loop" && !run.spec.scene.empty()) looped.insert(run.spec.scene);
        if (run.spec.mode != "closed_loop" || run.settled || run.spec.truth_stride != 1) continue;
        const DetectorEntry& detector = registry().detector(parse_method(run.spec.detector).name);
        if (detector.claims_exact && !detector.control) {
            judged[parse_method(run.spec.response).name].insert(run.spec.scene);
        }
    }
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.name == "example") continue;  // the file to copy is no method
        EXPECT_EQ(judged[entry.name], looped) << entry.name;
    }
    // Nor has page 1 scenes of which its table of responses says nothing.
    EXPECT_FALSE(replayed.empty());
    EXPECT_TRUE(std::includes(looped.begin(), looped.end(), replayed.begin(), replayed.end()));
}

}  // namespace
}  // namespace trocar
