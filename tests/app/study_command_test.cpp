// `trocar study` from outside: killed in the middle and started again, rebuilt, published, refused.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "support/commands.hpp"
#include "support/page_links.hpp"
#include "support/unpacked.hpp"
#include "web/web.hpp"

namespace trocar::test {
namespace {

using Files = std::map<std::string, std::string>;

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
        nlohmann::json study{{"format", "trocar-study-3"}, {"name", "small"}, {"reference", "brute_force"}};
        study["experiments"] = {{{"frames", "replay"},
                                 {"scenes", {"i2t_poke.json", "i2i_cross.json"}},
                                 {"detectors", {"ohc", "brute_force"}},
                                 {"ticks", ticks}},
                                {{"frames", "closed_loop"},
                                 {"scenes", {"i2t_poke.json", "i2i_cross.json"}},
                                 {"detectors", {"ohc", "brute_force"}},
                                 {"responses", {"thesis:profile=faithful", "penalty"}},
                                 {"contacts", {"intersection", "native"}},
                                 {"ticks", ticks}}};
        std::ofstream(file()) << study.dump(1);
    }
    [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "study.json"; }
    [[nodiscard]] std::filesystem::path output() const { return folder_.path() / "out"; }
    [[nodiscard]] std::string arguments() const {
        return "study " + file().string() + " --output " + output().string();
    }

    [[nodiscard]] Files finished_runs() const {
        if (!std::filesystem::exists(output() / "runs")) return {};
        Files files = files_below(output() / "runs");
        std::erase_if(files, [](const auto& file) { return !file.first.ends_with(".json"); });
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
    [[nodiscard]] nlohmann::json run_json() const { return json_of(arguments() + " --json"); }
    void expect_resumed(const Files& before) const {
        ASSERT_GE(before.size(), 2U);
        EXPECT_FALSE(std::filesystem::exists(output() / records));
        const nlohmann::json summary = run_json();
        EXPECT_GE(summary["found"].get<std::size_t>(), before.size());
        EXPECT_EQ(summary["made"].get<int>() + summary["found"].get<int>(), total_runs);
        const Files after = finished_runs();
        for (const auto& [path, content] : before)
            EXPECT_EQ(after.at(path), content) << "a finished run was made again";
    }

    // Replay 2 x 2, closed loop 2 scenes x 2 detectors x 2 responses; once each: two detectors
    // without native contacts, and a response that cannot read them.
    static constexpr const char* records = "records.jsonl.gz";
    static constexpr int not_run = 2 + 1;
    static constexpr int total_runs = 4 + 8 + not_run;
    TemporaryFolder folder_;
};

TEST_F(StudyCommand, InterruptedOrKilledItGoesOnWhereItStopped) {
    write_study(200);
    for (const auto& [signal, end] : {std::pair{SIGKILL, -SIGKILL}, {SIGINT, 130}}) {
        EXPECT_EQ(start_and_kill(2, signal), end);
        expect_resumed(finished_runs());
        std::filesystem::remove_all(output());
    }
}

TEST_F(StudyCommand, ReportsEveryRunAndRebuildsTheReportToTheByte) {
    const nlohmann::json first = run_json();
    EXPECT_EQ(first["runs"], total_runs);
    EXPECT_EQ(first["outcomes"]["ok"], total_runs - not_run) << first.dump();
    EXPECT_EQ(first["outcomes"]["unsupported"], not_run);
    const Files files = files_below(output());
    for (const char* name : {"report.md", "report.html", "results.csv", records}) {
        EXPECT_TRUE(files.contains(name)) << name;
    }
    run_successfully("report " + output().string());
    EXPECT_EQ(files_below(output()), files);
    // Records carry where their numbers come from.
    const std::string lines = unpacked(output() / records);
    const nlohmann::json record = nlohmann::json::parse(lines.substr(0, lines.find('\n')));
    for (const char* key : {"cpu", "compiler", "commit", "dirty", "binary", "study.reference"}) {
        EXPECT_TRUE(record["environment"].contains(key)) << key;
    }
}

TEST_F(StudyCommand, OtherScenesWantAFolderOfTheirOwnAndStandInTheReportsCommand) {
    const std::string other = " --scenes '" + (folder_.path() / "i2t_*ab.json").string() + "'";
    EXPECT_EQ(run_program("study " + file().string() + other).status, 2);
    EXPECT_EQ(run_program(arguments() + other + " --publish").status, 2);
    EXPECT_FALSE(std::filesystem::exists(output())) << "nothing half-written";
    run_successfully(arguments() + other);
    const std::string lines = unpacked(output() / records);
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);) {
        const nlohmann::json record = nlohmann::json::parse(line);
        // A combination that no input can settle has no scene.
        const std::string scene = record["spec"]["scene"];
        EXPECT_TRUE(scene == "i2t_stab" || (scene.empty() && record["outcome"] == "unsupported")) << line;
        EXPECT_EQ(record["environment"]["study.changes"],
                  "--scenes '" + (folder_.path() / "i2t_*ab.json").string() + "' --output DIR");
    }
    EXPECT_NE(read_file(output() / "report.md").find("study.json --scenes"), std::string::npos);
}

TEST_F(StudyCommand, PublishedReportsShareTheirScriptsAndAMovedOneHoldsItsOwn) {
    const std::string publish = "cd " + folder_.path().string() + " && " + TROCAR_PROGRAM;
    run_successfully("study study.json --output out --publish", publish);
    const auto script = [](const std::filesystem::path& page) { return links_of(read_file(page)).front(); };
    EXPECT_EQ(script(output() / "report.html"), "assets/charts-1.js");
    EXPECT_EQ(script(output() / "view/i2t_poke.html"), "../assets/viewer-1.js");
    EXPECT_EQ(broken_links(output()), std::vector<std::string>());
    const Files scripts{{"charts-1.js", std::string(web::charts_script())},
                        {"viewer-1.js", std::string(web::viewer_script())}};
    EXPECT_EQ(files_below(output() / "assets"), scripts);

    const std::filesystem::path reports = folder_.path() / "reports";
    EXPECT_EQ(files_below(reports / "assets"), scripts);
    EXPECT_FALSE(std::filesystem::exists(reports / "small/assets"));
    EXPECT_EQ(script(reports / "small/report.html"), "../assets/charts-1.js");
    EXPECT_EQ(script(reports / "small/view/i2t_poke.html"), "../../assets/viewer-1.js");
    EXPECT_EQ(broken_links(reports), std::vector<std::string>());
    const Files published = files_below(reports);
    run_successfully("report " + (reports / "small").string());
    EXPECT_EQ(files_below(reports), published);
    run_successfully("study study.json --output out --publish", publish);
    EXPECT_EQ(files_below(reports), published);

    // Rebuilt elsewhere it is the report that the study wrote; its folder can then be moved as it is.
    std::filesystem::copy(reports / "small", folder_.path() / "copy", std::filesystem::copy_options::recursive);
    run_successfully("report " + (folder_.path() / "copy").string());
    Files written = files_below(output());
    std::erase_if(written, [](const auto& file) { return file.first.starts_with("runs/") || file.first == "lock"; });
    EXPECT_EQ(files_below(folder_.path() / "copy"), written);
    // A script of another version is not this program's.
    std::ofstream(reports / "assets/viewer-1.js", std::ios::app) << "//";
    run_successfully("report " + (reports / "small").string());
    EXPECT_EQ(files_below(reports / "small"), written);
}

TEST_F(StudyCommand, ThePictureOfTheWorstTickIsOfTheRecordsAndMadeAgainToTheByte) {
    std::ofstream(file()) << R"({"format":"trocar-study-3","name":"stabs","experiments":[{"frames":"closed_loop",
        "scenes":["i2t_stab.json"],"detectors":["ohc"],"responses":["penalty","impulse"],
        "contacts":["intersection"],"ticks":120}]})";
    (void)run_json();
    const std::filesystem::path picture = output() / "worst_tick.json";
    const std::string before = read_file(picture);
    const nlohmann::json seen = nlohmann::json::parse(before);
    std::set<std::string> hashes;  // of the records on that scene
    std::istringstream lines(unpacked(output() / records));
    for (std::string line; std::getline(lines, line);) {
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
    run_successfully("report --picture --study " + file().string() + " " + output().string());
    EXPECT_EQ(read_file(picture), before);
    EXPECT_EQ(read_file(output() / "report.md").find("--picture"), std::string::npos);
}

TEST_F(StudyCommand, PlanRunsNothing) {
    EXPECT_EQ(json_of(arguments() + " --plan --json")["runs"].size(), static_cast<std::size_t>(total_runs));
    EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(StudyCommand, PlanReportsTheStepperOfARun) {
    std::set<std::string> steppers;
    const nlohmann::json plan = json_of("study paced --plan --json");
    for (const auto& run : plan["runs"]) steppers.insert(run["stepper"].get<std::string>());
    EXPECT_EQ(steppers, (std::set<std::string>{"", "adaptive_multires", "xpbd:substeps=20"}))
        << "the default one has no name of its own";
}

TEST_F(StudyCommand, BadStudyIsOneLineAndLeavesNothing) {
    std::ofstream(file())
        << R"({"format":"trocar-study-3","name":"s","experiments":[{"frames":"replay","scenes":["i2t_poke.json"],"detectors":["nobody"]}]})";
    expect_refused(arguments(), "/experiments/0/detectors/0");
    EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(StudyCommand, SceneWithoutItsDataIsARow) {
    std::ofstream(folder_.path() / "away.json")
        << R"({"format":"trocar-scene-2","name":"away","unit":"m","dt":0.001,"ticks":5,"seed":1,"bodies":[)"
           R"({"name":"liver","kind":"rigid","closed":true,"parts":[{"mesh":"data:no/such.stl","pose":[0,0,0,0,0,0]}]}]})";
    std::ofstream(file())
        << R"({"format":"trocar-study-3","name":"s","experiments":[{"frames":"replay","scenes":["away.json"],"detectors":["ohc"]}]})";
    EXPECT_EQ(run_json()["outcomes"]["unsupported"], 1);
    EXPECT_NE(read_file(output() / "report.html").find("unsupported (no data)"), std::string::npos);
}

}  // namespace
}  // namespace trocar::test
