// `trocar study` from outside: killed in the middle and started again, rebuilt, published, refused.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "support/program.hpp"

namespace trocar::test {
namespace {

using Files = std::map<std::filesystem::path, std::string>;

class StudyCommand : public ::testing::Test {
protected:
    StudyCommand() {
        const std::filesystem::path scenes = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes";
        for (const char* name : {"i2t_poke.json", "i2i_cross.json", "i2t_stab.json"}) {
            std::filesystem::copy_file(scenes / name, folder_.path() / name);
        }
        write_study(40);
    }
    void write_study(int ticks) {
        nlohmann::json study{{"format", "trocar-study-2"},
                             {"name", "small"},
                             {"reference", "brute_force"},
                             {"replay",
                              {{"scenes", {"i2t_poke.json", "i2i_cross.json"}},
                               {"detectors", {"ohc", "brute_force"}},
                               {"ticks", ticks}}},
                             {"closed_loop",
                              {{"scenes", {"i2t_poke.json", "i2i_cross.json"}},
                               {"detectors", {"ohc", "brute_force"}},
                               {"responses", {"thesis:profile=faithful", "penalty"}},
                               {"contacts", {"intersection", "native"}},
                               {"ticks", ticks}}}};
        std::ofstream(file()) << study.dump(1);
    }
    [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "study.json"; }
    [[nodiscard]] std::filesystem::path output() const { return folder_.path() / "out"; }
    [[nodiscard]] std::string arguments() const {
        return "study " + file().string() + " --output " + output().string();
    }

    [[nodiscard]] Files finished_runs() const {
        Files files;
        if (!std::filesystem::exists(output() / "runs")) return files;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(output() / "runs")) {
            if (entry.path().extension() == ".json") files[entry.path()] = read_file(entry.path());
        }
        return files;
    }
    /// Starts the study, waits until `count` runs are finished, sends the signal; the exit status, or -signal.
    int start_and_kill(std::size_t count, int signal) const {
        const pid_t child = fork();
        if (child == 0) {
            if (std::freopen("/dev/null", "w", stdout) == nullptr ||
                std::freopen("/dev/null", "w", stderr) == nullptr) {
                _exit(126);
            }
            execl(TROCAR_PROGRAM, TROCAR_PROGRAM, "study", file().c_str(), "--output", output().c_str(), nullptr);
            _exit(127);
        }
        for (int i = 0; i < 6000 && finished_runs().size() < count; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        kill(child, signal);
        int status = 0;
        waitpid(child, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
    [[nodiscard]] nlohmann::json run_json() const {
        const ProgramResult result = run_program(arguments() + " --json");
        EXPECT_EQ(result.status, 0) << result.err;
        return nlohmann::json::parse(result.out);
    }
    void expect_resumed(const Files& before) const {
        ASSERT_GE(before.size(), 2U);
        EXPECT_FALSE(std::filesystem::exists(output() / "records.jsonl"));
        const nlohmann::json summary = run_json();
        EXPECT_GE(summary["found"].get<std::size_t>(), before.size());
        EXPECT_EQ(summary["made"].get<int>() + summary["found"].get<int>(), total_runs);
        const Files after = finished_runs();
        for (const auto& [path, content] : before)
            EXPECT_EQ(after.at(path), content) << "a finished run was made again";
    }

    // Replay 2 x 2, closed loop 2 scenes x 2 detectors x 2 responses; once each: two detectors without native contacts,
    // and a response that cannot read them.
    static constexpr int not_run = 2 + 1;
    static constexpr int total_runs = 4 + 8 + not_run;
    TemporaryFolder folder_;
};

TEST_F(StudyCommand, InterruptedItGoesOnWhereItStopped) {
    write_study(200);
    EXPECT_EQ(start_and_kill(2, SIGINT), 130);
    expect_resumed(finished_runs());
}

TEST_F(StudyCommand, KilledItGoesOnWhereItStopped) {
    write_study(200);
    EXPECT_EQ(start_and_kill(2, SIGKILL), -SIGKILL);
    expect_resumed(finished_runs());
}

TEST_F(StudyCommand, ReportsEveryRunAndRebuildsTheReportToTheByte) {
    const nlohmann::json first = run_json();
    EXPECT_EQ(first["runs"], total_runs);
    EXPECT_EQ(first["outcomes"]["ok"], total_runs - not_run) << first.dump();
    EXPECT_EQ(first["outcomes"]["unsupported"], not_run);
    Files files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(output())) {
        if (entry.is_regular_file() && entry.path().string().find("/runs/") == std::string::npos) {
            files[entry.path()] = read_file(entry.path());
        }
    }
    for (const char* name : {"report.md", "report.html", "results.csv", "records.jsonl"}) {
        EXPECT_TRUE(files.contains(output() / name)) << name;
    }
    const ProgramResult rebuilt = run_program("report " + output().string());
    EXPECT_EQ(rebuilt.status, 0) << rebuilt.err;
    for (const auto& [path, content] : files) EXPECT_EQ(read_file(path), content) << path;
    // Records carry where their numbers come from.
    const nlohmann::json record = nlohmann::json::parse(
        files.at(output() / "records.jsonl").substr(0, files.at(output() / "records.jsonl").find('\n')));
    for (const char* key : {"cpu", "compiler", "commit", "dirty", "binary", "study.reference"}) {
        EXPECT_TRUE(record["environment"].contains(key)) << key;
    }
}

TEST_F(StudyCommand, DetectorsThatMoveTissueAlikeStandInOneRow) {
    (void)run_json();
    EXPECT_NE(read_file(output() / "report.html").find(", moving alike: "), std::string::npos);
}

TEST_F(StudyCommand, ThePictureOfTheWorstTickIsOfTheRecordsAndMadeAgainToTheByte) {
    const nlohmann::json study{{"format", "trocar-study-2"},
                               {"name", "stabs"},
                               {"closed_loop",
                                {{"scenes", {"i2t_stab.json"}},
                                 {"detectors", {"ohc"}},
                                 {"responses", {"penalty", "impulse"}},
                                 {"contacts", {"intersection"}},
                                 {"ticks", 120}}}};
    std::ofstream(file()) << study.dump();
    (void)run_json();
    const std::filesystem::path picture = output() / "worst_tick.json";
    const std::string before = read_file(picture);
    const nlohmann::json seen = nlohmann::json::parse(before);
    std::set<std::string> hashes;  // of the records on that scene
    std::istringstream records(read_file(output() / "records.jsonl"));
    for (std::string line; std::getline(records, line);) {
        const nlohmann::json record = nlohmann::json::parse(line);
        if (record["spec"]["scene"] == seen["scene"]) hashes.insert(record["state_hash"].get<std::string>());
    }
    ASSERT_EQ(seen["states"].size(), 3U) << "two responses, and that there is no stored solution";
    for (const int state : {0, 1}) {
        EXPECT_TRUE(hashes.contains(seen["states"][state]["state_hash"].get<std::string>())) << state;
        EXPECT_FALSE(seen["states"][state]["bodies"].empty()) << state;
    }
    std::filesystem::remove(picture);
    EXPECT_EQ(run_program("report " + output().string()).status, 0);
    EXPECT_NE(read_file(output() / "report.md").find("--picture"), std::string::npos);
    const ProgramResult lost = run_program("report --picture " + output().string());
    EXPECT_EQ(lost.status, 2) << "records do not report where a study outside this folder lies";
    EXPECT_NE(lost.err.find("--study"), std::string::npos) << lost.err;
    const ProgramResult again = run_program("report --picture --study " + file().string() + " " + output().string());
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_EQ(read_file(picture), before);
    EXPECT_EQ(read_file(output() / "report.md").find("--picture"), std::string::npos);
}

TEST_F(StudyCommand, PlanRunsNothing) {
    const ProgramResult result = run_program(arguments() + " --plan --json");
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(nlohmann::json::parse(result.out)["runs"].size(), static_cast<std::size_t>(total_runs));
    EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(StudyCommand, PlanReportsTheStepperOfARun) {
    const ProgramResult text = run_program("study paced --plan");
    EXPECT_NE(text.out.find("ohc_clustered + unilateral, adaptive_multires  "), std::string::npos)
        << text.out << text.err;
    std::set<std::string> steppers;
    const auto plan = nlohmann::json::parse(run_program("study paced --plan --json").out);
    for (const auto& run : plan["runs"]) steppers.insert(run["stepper"].get<std::string>());
    EXPECT_EQ(steppers, (std::set<std::string>{"", "adaptive_multires"})) << "the default one has no name of its own";
}

TEST_F(StudyCommand, BadStudyIsOneLineAndLeavesNothing) {
    std::ofstream(file())
        << R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["i2t_poke.json"],"detectors":["nobody"]}})";
    const ProgramResult result = run_program(arguments());
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.err.find("/replay/detectors/0"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(StudyCommand, SceneWithoutItsDataIsARow) {
    std::ofstream(folder_.path() / "away.json")
        << R"({"format":"trocar-scene-2","name":"away","unit":"m","dt":0.001,"ticks":5,"seed":1,"bodies":[)"
           R"({"name":"liver","kind":"rigid","closed":true,"parts":[{"mesh":"data:no/such.stl","pose":[0,0,0,0,0,0]}]}]})";
    std::ofstream(file())
        << R"({"format":"trocar-study-2","name":"s","replay":{"scenes":["away.json"],"detectors":["ohc"]}})";
    const ProgramResult result = run_program(arguments() + " --json");
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(nlohmann::json::parse(result.out)["outcomes"]["unsupported"], 1);
    EXPECT_NE(read_file(output() / "report.html").find("unsupported (no data)"), std::string::npos);
}

}  // namespace
}  // namespace trocar::test
