// Exit status 1 where a comparison fails and 3 where the one method that was asked for does: on methods that break
// their promises, and on reports and references that do not fit.
#include <gtest/gtest.h>

#include <fstream>
#include <vector>

#include "report/synthetic.hpp"
#include "support/commands.hpp"
#include "support/recordings.hpp"
#include "support/scene_samples.hpp"
#include "support/text.hpp"
#include "support/unpacked.hpp"

namespace trocar {
namespace {

using nlohmann::json;
using test::ProgramResult;
using test::run_program;

ProgramResult with_liars(const std::string& arguments) { return run_program(arguments, TROCAR_WITH_LIARS); }

class ExitStatus : public testing::Test {
protected:
    [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
    std::string write(const std::string& name, const std::string& text) const {
        return folder_.write(name, text).string();
    }
    test::TemporaryFolder folder_;
};

/// `question` ends where the detector is named; what the oracle says of the one that loses pairs and of the one that
/// invents one.
void expect_liars_caught(const std::string& question, const std::string& losing, const std::string& inventing) {
    const ProgramResult loses = with_liars(question + "liar --truth");
    EXPECT_EQ(loses.status, 1);
    test::expect_holds(loses.err, {"liar claims exactness and differs from the oracle: " + losing});
    const ProgramResult invents = with_liars(question + "liar:invent=on --truth");
    EXPECT_EQ(invents.status, 1);
    test::expect_holds(invents.err, {inventing});
    EXPECT_EQ(with_liars(question + "all").status, 1) << "one among all";
    EXPECT_EQ(with_liars(question + "liar").status, 0) << "nothing was compared";
    EXPECT_EQ(with_liars(question + "brute_force --truth").status, 0);
}

TEST_F(ExitStatus, DetectIsOneForADetectorThatClaimsToBeExactAndIsNot) {
    // The second face of a goes through the three sides of the spike; the first one is far away.
    const std::string a =
        write("face.obj", "v 50 50 50\nv 51 50 50\nv 50 51 50\nv -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\nf 4 5 6\n");
    const std::string b =
        write("spike.off", "OFF\n4 4 0\n1 0 -1\n-1 1 -1\n-1 -1 -1\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
    expect_liars_caught("detect " + a + " " + b + " --detector ", "3 false negatives, 0 false positives",
                        "3 false negatives, 1 false positives");
}

TEST_F(ExitStatus, ReplayIsOneForADetectorThatClaimsToBeExactAndIsNot) {
    const test::RecordingText text = test::standing_at({1.0, -0.5});  // apart, then crossing
    const std::string question = "replay " + write("frames.trocrec", text.bytes()) + " --detector ";
    // The one that invents is right in the second frame.
    expect_liars_caught(question, "1 false negatives, 0 false positives", "0 false negatives, 1 false positives");
}

TEST_F(ExitStatus, ExplainIsThreeWhereTheResponseFailsBeforeTheTick) {
    const std::string question = "explain " + write("poke.json", test::poke_text()) + " --response quitter --tick ";
    EXPECT_EQ(with_liars(question + "5").status, 0) << "what happens in the tick comes after the frame examined";
    const ProgramResult later = with_liars(question + "6");
    EXPECT_EQ(later.status, 3);
    EXPECT_EQ(later.out, "");
    EXPECT_NE(later.err.find("ended as threw at tick 5: respond: had enough"), std::string::npos) << later.err;
    // What other detectors miss is what the table is for.
    const ProgramResult liar = with_liars("explain " + file("poke.json") + " --tick 38 --json");
    EXPECT_EQ(liar.status, 0);
    const json document = json::parse(liar.out);
    for (const json& detector : document["detectors"]) {
        if (detector["name"] != "liar") continue;
        EXPECT_EQ(detector["false_negatives"], document["truth"]["pairs"]);
        EXPECT_FALSE(detector["false_negatives"].empty());
    }
}

TEST_F(ExitStatus, AMetamorphicTestOfADetectorThatRefusesReportsTheRefusal) {
    write("poke.json", test::poke_text());
    const std::string study = write("study.json", R"({"format":"trocar-study-3","name":"refused",
        "experiments":[{"frames":"replay","perturbed":true,"scenes":["poke.json"],"detectors":["liar:refuse=on"],"ticks":3}]})");
    const ProgramResult result = with_liars("study " + study + " --output " + file("out"));
    std::istringstream lines(test::unpacked(file("out") + "/records.jsonl.gz"));
    int records = 0;
    for (std::string line; std::getline(lines, line); ++records) {
        EXPECT_NE(line.find("not this frame"), std::string::npos) << line;
    }
    EXPECT_EQ(records, 2) << "in two processes; " << result.out << result.err;
}

TEST_F(ExitStatus, ReportAgainstAnotherIsOneWhenAFigureOrARunHasChanged) {
    const auto folder_of = [this](const std::string& name, const std::vector<Record>& records) {
        test::store_records(folder_.path() / name, records);
        return file(name);
    };
    std::vector<Record> records{test::synthetic({.ticks = 30}), test::synthetic({.detector = "other", .ticks = 30})};
    const std::string before = folder_of("before", records);
    const std::string same = folder_of("same", records);
    const std::string fewer = folder_of("fewer", {records[0]});
    records[1].summary.at(Metric::residual_penetration_max_m) *= 1.01;
    const std::string changed = folder_of("changed", records);
    const auto against = [](const std::string& now, const std::string& then, const std::string& more = "") {
        return run_program("report " + now + " --against " + then + more);
    };
    EXPECT_EQ(against(same, before).status, 0);
    const ProgramResult reported = against(changed, before);
    EXPECT_EQ(reported.status, 1);
    EXPECT_NE(reported.out.find("changed"), std::string::npos) << reported.out;
    EXPECT_EQ(against(changed, before, " --json").status, 1);
    EXPECT_EQ(against(changed, before, " --tolerance 0.02").status, 0);
    EXPECT_EQ(against(fewer, before).status, 1) << "a run is missing";
    EXPECT_EQ(against(before, fewer).status, 1) << "a run is new";
    EXPECT_EQ(against(before, file("nowhere")).status, 2);
}

TEST_F(ExitStatus, RecordsAndPicturesNestedTooDeepAreBadInput) {
    const std::size_t levels = 100'000;  // more than the stack bears
    const std::string lists = std::string(levels, '[') + std::string(levels, ']');
    std::string objects;
    for (std::size_t i = 0; i < levels; ++i) objects += "{\"x\":";
    objects += "0" + std::string(levels, '}');
    const std::string refusal = "expected at most 100 levels of lists and objects";
    const std::filesystem::path report = folder_.path() / "report";
    std::filesystem::create_directories(report);
    const std::string good = to_json_line(test::synthetic({.ticks = 30})) + "\n";
    std::string inside = good;
    inside.insert(inside.rfind('}'), ",\"more\":" + lists);
    for (const std::string& records : {lists, objects, good + inside}) {
        std::ofstream(report / "records.jsonl") << records;
        for (const std::string command : {"report ", "table ", "view "})
            test::expect_refused(command + report.string(), refusal);
    }
    std::ofstream(report / "records.jsonl") << good;
    std::ofstream(report / "worst_tick.json") << R"({"format": "trocar-worst-tick-1", "scene": )" << lists << "}";
    test::expect_refused("report " + report.string(), refusal);
}

TEST_F(ExitStatus, ComplaintsHaveAtMost400BytesWithAllThatStandsAroundThem) {
    const std::string name(5000, 'x');
    const std::string mesh = write("scene.json", R"({"format": "trocar-scene-2", "bodies": [{"parts": [{"mesh": ")" +
                                                     name + R"("}], "name": ")" + name + R"("}]})");
    for (const std::string& arguments :
         {"run " + name, "report " + name, "table " + name, "mesh " + name + ".stl", name, "run --" + name,
          "run " + mesh, "scenes " + name, "schema " + name, "respond " + mesh}) {
        const ProgramResult result = run_program(arguments);
        EXPECT_EQ(result.status, 2) << arguments.substr(0, 20);
        EXPECT_LE(result.err.size(), 401U) << arguments.substr(0, 20) << ": " << result.err;
        EXPECT_TRUE(result.err.starts_with("trocar: ") && result.err.ends_with("\n")) << result.err;
    }
}

TEST_F(ExitStatus, ReferenceCheckIsOneWhenOneIsMissingOrStale) {
    const std::string scene = write("poke.json", test::poke_text());
    const ProgramResult missing = run_program("reference " + scene + " --check");
    EXPECT_EQ(missing.status, 1);
    EXPECT_NE(missing.out.find("missing"), std::string::npos) << missing.out;
    ASSERT_EQ(run_program("reference " + scene + " --without 'by hand'").status, 0);
    EXPECT_EQ(run_program("reference " + scene + " --check").status, 0);
    std::string other = test::poke_text();
    other.replace(other.find("0.008"), 5, "0.009");
    write("poke.json", other);
    const ProgramResult stale = run_program("reference " + scene + " --check --json");
    EXPECT_EQ(stale.status, 1);
    EXPECT_EQ(json::parse(stale.out)["references"][0]["state"], "stale");
    // One that fits does not make up for one that does not.
    const std::string second = write("second.json", test::poke_text());
    ASSERT_EQ(run_program("reference " + second + " --without 'by hand'").status, 0);
    EXPECT_EQ(run_program("reference " + scene + " " + second + " --check").status, 1);
    EXPECT_EQ(run_program("reference " + second + " --check").status, 0);
}

}  // namespace
}  // namespace trocar
