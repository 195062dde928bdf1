// `trocar run` as a user meets it: the document of DESIGN §10, the recording, and the exit status.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "support/commands.hpp"
#include "support/scene_samples.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;
using test::json_of;
using test::run_program;
using test::run_successfully;

class RunCommand : public testing::Test {
protected:
    test::TemporaryFolder folder_;
    const std::string scene_ = folder_.write("poke.json", test::poke_text()).string();
};

TEST_F(RunCommand, WithoutAnyContactReportsWhereTheBodiesCameNearest) {
    const std::string hover = std::string(TROCAR_SOURCE_DIR) + "/scenes/hover.json";
    const test::ProgramResult reported = run_successfully("run " + hover + " --ticks 5");
    test::expect_holds(reported.out, {"no contact tool and sheet came nearest in tick 0: 0.1 mm apart",
                                      "sheet within x -50 to 50, y -50 to 50, z 0 to 0 mm"});
    const Json nearest = json_of("run " + hover + " --ticks 5 --json").at("nearest");
    EXPECT_NEAR(nearest.at("distance_m").get<double>(), 1e-4, 1e-12);
    EXPECT_EQ(nearest.at("bodies"), (Json{"tool", "sheet"}));
    const Json met = json_of("run " + std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_deep_sheet.json --ticks 3 --json");
    EXPECT_TRUE(met.at("nearest").is_null()) << met;
}

TEST_F(RunCommand, SteppersAreNamedWhereTheyAreNotTheDefault) {
    const Json named = json_of("run " + scene_ + " --ticks 5 --json --stepper semi_implicit");
    EXPECT_FALSE(named.contains("stepper"));
    const Json unnamed = json_of("run " + scene_ + " --ticks 5 --json");
    EXPECT_EQ(named.at("summary").at("state_hash"), unnamed.at("summary").at("state_hash"));
    test::expect_refused("run " + scene_ + " --stepper sleepy", "sleepy");
    const Json list = json_of("list --json");
    ASSERT_EQ(list.at("steppers").size(), registry().steppers().size());
    EXPECT_EQ(list.at("contact_generators").size(), registry().contact_generators().size());
    const Json& first = list.at("steppers").at(0);
    for (const char* taken :
         {"takes_contact_force_laws", "takes_solved_contacts", "takes_position_corrections", "takes_held_forces"})
        EXPECT_TRUE(first.at(taken).is_boolean()) << taken;
    EXPECT_TRUE(first.at("default").get<bool>());
}

TEST_F(RunCommand, TheDeviceIsTheRunsWhateverTheResponse) {
    const std::string start = "run " + scene_ + " --ticks 60 --json --response ";
    for (const char* response : {"penalty", "thesis", "unilateral"}) {
        const Json json = json_of(start + response + " --device tip=sum,saturation=0.01,rate=1000");
        EXPECT_EQ(json.at("device"),
                  Json::parse(R"({"tip":"sum","saturation":0.01,"rate":1000.0,"filter":0.0,"ramp":0.0})"))
            << response;
        const Json& row = json.at("rows").back();
        EXPECT_EQ(row.at("tip_force"), row.at("tool_force")) << response;
        EXPECT_TRUE(row.at("saturated").get<bool>()) << response;
        const Json plain = json_of(start + response);
        EXPECT_EQ(plain.at("device").at("tip"), "fulcrum") << response;
        EXPECT_EQ(plain.at("device").at("saturation"), 8.5) << response;
        EXPECT_EQ(plain.at("summary").at("state_hash"), json.at("summary").at("state_hash"))
            << response << ": a device shows, it moves nothing";
    }
    EXPECT_EQ(json_of("list --json").at("device").at("parameters").size(), 5U);
    test::expect_refused(start + "thesis:tip_rate=500", "got 'tip_rate': give the run's device, --device rate=…\n");
}

TEST_F(RunCommand, JsonIsOneDocumentOfTheStatedShape) {
    const Json json = json_of("run " + scene_ + " --ticks 50 --json");
    EXPECT_EQ(json.at("scene"), "poke");
    EXPECT_EQ(json.at("contacts"), "tracked_proximity");
    EXPECT_EQ(json.at("outcome"), "ok");
    EXPECT_EQ(json.at("message"), "");
    EXPECT_TRUE(json.at("detector").is_string());
    EXPECT_TRUE(json.at("response").is_string());
    ASSERT_EQ(json.at("rows").size(), 50U);
    EXPECT_TRUE(json.at("summary").is_object());
    double deepest = 0.0;
    for (std::size_t i = 0; i < 50; ++i) {
        const Json& row = json.at("rows").at(i);
        EXPECT_EQ(row.at("tick"), i);
        EXPECT_DOUBLE_EQ(row.at("time").get<double>(), 0.001 * static_cast<double>(i));
        EXPECT_TRUE(row.at("pairs").is_number_integer());
        for (const char* count : {"contacts_offered", "contacts_used"}) {
            EXPECT_TRUE(row.at(count).is_number_integer()) << count;
        }
        EXPECT_LE(row.at("contacts_used"), row.at("contacts_offered"));
        EXPECT_EQ(row.at("tool_force").size(), 3U);
        EXPECT_TRUE(row.at("truncated").is_boolean());
        for (const char* stage : {"move", "update", "detect", "contacts", "respond", "advance"}) {
            EXPECT_GE(row.at("stage_ns").at(stage).get<std::int64_t>(), 0) << stage;
        }
        // What the format fixes, and beside it what a device shows, a grasp holds and truth leaves open.
        for (const char* more : {"tool_moment", "tip_force", "device_force"})
            EXPECT_EQ(row.at(more).size(), 3U) << more;
        for (const char* more : {"roll_torque", "saturated", "grasped", "detached", "side_undecided", "passed_through",
                                 "query_distance", "proximity_false_negatives"})
            EXPECT_TRUE(row.contains(more)) << more;
        EXPECT_EQ(row.size(), 9U + 11U);
        deepest = std::max(deepest, row.at("residual_penetration").get<double>());
    }
    EXPECT_GT(json.at("rows").at(49).at("contacts_used"), 0);
    EXPECT_GT(json.at("rows").at(49).at("tool_force").at(2).get<double>(), 0.0) << "tissue pushes the tool up";
    EXPECT_LT(deepest, 0.0021) << "the script goes 2 mm below the rest plane";
}

TEST_F(RunCommand, APacedRunDoesTheTicksOfAnUnpacedOneAndTakesNoRecording) {
    const std::string start = "run " + scene_ + " --ticks 200";
    const Json json = json_of(start + " --paced --json");
    const std::size_t done = json.at("rows").size();
    ASSERT_GE(done, 1U);
    EXPECT_LE(done, 200U) << "a tick in each period at most";
    const Json& summary = json.at("summary");
    for (const std::string loop : {"paced", "empty"}) {
        const double ticks = summary.at(loop + "_ticks").get<double>();
        EXPECT_GE(ticks, 1.0);
        EXPECT_EQ(ticks + summary.at(loop + "_skipped").get<double>(), 100.0) << "after 10 periods of each block";
        EXPECT_LE(summary.at(loop + "_overruns").get<double>(), ticks);
    }
    const Json plain = json_of("run " + scene_ + " --ticks " + std::to_string(done) + " --json").at("summary");
    EXPECT_EQ(plain.at("state_hash"), summary.at("state_hash"));
    EXPECT_FALSE(plain.contains("paced_overruns"));
    EXPECT_EQ(run_program(start + " --paced").status, 0) << "as text";
    EXPECT_EQ(run_program(start).err, "") << "progress belongs on a terminal";
    const std::string file = (folder_.path() / "paced.trocrec").string();
    test::expect_refused(start + " --paced --record " + file, "--record");
    EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(RunCommand, SaysWhereAResponseActsAsAnother) {
    const std::string bare = folder_.write("press.json", test::press_text(0.002)).string();
    for (const ResponseEntry& entry : registry().responses()) {
        const std::string method = " --ticks 2 --json --response " + entry.name;
        const test::ProgramResult without = run_program("run " + bare + method);
        EXPECT_EQ(without.err.empty(), entry.without_tissue.empty()) << entry.name << ": " << without.err;
        EXPECT_NE(without.err.find(entry.without_tissue), std::string::npos) << entry.name << ": " << without.err;
        EXPECT_EQ(run_program("run " + scene_ + method).err, "") << entry.name;
    }
}

TEST_F(RunCommand, AFailedRunIsOneLineEvenWhereTheResponseActsAsAnother) {
    const std::string bare = folder_.write("press.json", test::press_text(0.002)).string();
    const std::string words = "run " + bare + " --ticks 2 --response impulse --contacts native --detector ohc";
    const test::ProgramResult failed = run_program(words);  // ohc reports no contacts of its own
    EXPECT_EQ(failed.status, 3);
    EXPECT_EQ(std::count(failed.err.begin(), failed.err.end(), '\n'), 1) << failed.err;
    test::expect_holds(failed.err, {"ended as unsupported: ", "acts as penalty between bodies without tissue"});
}

TEST_F(RunCommand, ForcesAreNullInTheTickThatFailedAndTicksCountFromZero) {
    const test::ProgramResult result = run_program("run " + std::string(TROCAR_SOURCE_DIR) +
                                                   "/scenes/i2t_stab.json --json --response thesis:profile=printed");
    EXPECT_EQ(result.status, 3);
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json.at("outcome"), "unstable");
    const auto& rows = json.at("rows");
    ASSERT_GT(rows.size(), 1U);
    for (std::size_t k = 0; k < rows.size(); ++k) {
        EXPECT_EQ(rows[k].at("tick"), k);
        EXPECT_DOUBLE_EQ(rows[k].at("time").get<double>(), 0.001 * static_cast<double>(k));
        for (const char* key : {"tool_force", "tool_moment", "tip_force", "device_force"})
            EXPECT_EQ(rows[k].at(key).at(0).is_null(), k + 1 == rows.size()) << key << " in row " << k;
        EXPECT_EQ(rows[k].at("roll_torque").is_null(), k + 1 == rows.size()) << k;
    }
}

TEST_F(RunCommand, RecordingHoldsTheFramesThatDetectionSaw) {
    const std::string file = (folder_.path() / "frames.trocrec").string();
    run_successfully("run " + scene_ + " --ticks 45 --json --record " + file);
    RecordingReader reader(file);
    ASSERT_EQ(reader.frame_count(), 45);
    const Scene scene = read_scene(scene_, std::nullopt);
    Frame frame;
    reader.read(0, frame);
    EXPECT_EQ(frame.position, scene.first.position);
    // The tool's lowest point follows the script; the tissue is what it was one tick before.
    reader.read(40, frame);
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind != BodyKind::instrument) continue;
        const Index v = body.vertices.first;
        EXPECT_NEAR(frame.position(2, v), scene.first.position(2, v) - 0.005, 1e-15);
    }
}

TEST_F(RunCommand, BadRequestsEndWithTwoAndWriteNothing) {
    const std::string file = (folder_.path() / "never.trocrec").string();
    for (const std::string& arguments :
         {scene_ + " --detector no_such_method", scene_ + " --response no_such_method",
          scene_ + " --detector ohc:nonsense=1", scene_ + " --contacts magic", scene_ + " --device colour=red",
          scene_ + " --device tip=shaft", scene_ + " --device rate=-1", scene_ + " --device fulcrum",
          scene_ + " --ticks 0", scene_ + " --ticks -3", std::string("/no/such/scene.json")}) {
        test::expect_refused("run " + arguments + " --record " + file);
        EXPECT_FALSE(std::filesystem::exists(file)) << arguments;
    }
}

TEST_F(RunCommand, RecordingNeverReplacesAPipeOrDevice) {
    const std::filesystem::path pipe = folder_.path() / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    test::expect_refused("run " + scene_ + " --ticks 2 --record " + pipe.string(), "pipe");
    EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST_F(RunCommand, InterruptedRunEndsWithOneHundredAndThirty) {
    const std::string file = (folder_.path() / "half.trocrec").string();
    const std::string interrupted = "timeout --preserve-status --signal=INT 0.5 " + std::string(TROCAR_PROGRAM);
    EXPECT_EQ(run_program("run " + scene_ + " --ticks 100000000 --record " + file, interrupted).status, 130);
    EXPECT_FALSE(std::filesystem::exists(file)) << "nothing half-written";
}

}  // namespace
}  // namespace trocar
