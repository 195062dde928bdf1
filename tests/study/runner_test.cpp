// The runner with a shell script in place of the program, so that a child can crash, hang, lie or be interrupted at
// will. The script is handed the same arguments as the program.
#include "study/runner.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "geometry/input_error.hpp"
#include "support/program.hpp"
#include "support/unpacked.hpp"

namespace trocar {
namespace {

class RunnerTest : public ::testing::Test {
protected:
    RunnerTest() {
        std::filesystem::create_directories(prepared());
        for (int i = 0; i < 4; ++i) {
            PlannedRun run;
            run.spec.study = "s";
            run.spec.mode = "replay";
            run.spec.scene = "scene";
            run.spec.detector = "d" + std::to_string(i);
            plan_.push_back(run);
            prepare(plan_.size() - 1);
        }
    }
    /// Writes what the child of this run is to answer.
    void prepare(std::size_t i) const {
        Record record;
        record.spec = plan_[i].spec;
        record.environment = plan_[i].facts;
        record.summary[Metric::ticks] = static_cast<double>(i);
        std::ofstream(prepared() / (std::to_string(i) + ".json")) << to_json_line(record) << "\n";
    }
    [[nodiscard]] std::filesystem::path prepared() const { return folder_.path() / "prepared"; }
    [[nodiscard]] std::filesystem::path output() const { return folder_.path() / "out"; }

    /// `special`: lines of a shell `case` on the number of the run, before the record is written.
    RunnerOptions options(const std::string& special, double time_limit_s = 20.0) {
        const std::filesystem::path script = folder_.path() / "child.sh";
        std::ofstream(script) << "i=$2\nout=$4\nprepared=" << prepared().string()
                              << "\necho $i >>$prepared/log\ncase $i in\n"
                              << special << "\nesac\ncp $prepared/$i.json $out.part && mv $out.part $out\n";
        return {.directory = output(),
                .child_command = {"/bin/sh", script.string()},
                .binary = "binary_1",
                .time_limit_s = time_limit_s,
                .environment =
                    [](const PlannedRun&) {
                        return std::map<std::string, std::string>{{"cpu", "x"}};
                    },
                .progress = {}};
    }
    [[nodiscard]] std::string started() const {
        std::string text = test::read_file(prepared() / "log");
        std::replace(text.begin(), text.end(), '\n', ' ');
        return text;
    }
    /// One of every run of the plan.
    [[nodiscard]] std::vector<Record> records() const {
        std::istringstream lines(test::unpacked(output() / records_name));
        std::vector<Record> list;
        for (std::string line; std::getline(lines, line);) list.push_back(record_from_json_line(line, "records", 1));
        if (list.size() != plan_.size()) throw std::runtime_error("not one record of every run");
        return list;
    }

    test::TemporaryFolder folder_;
    std::vector<PlannedRun> plan_;
};

TEST_F(RunnerTest, RecordsComeInPlanOrder) {
    const RunnerResult result = run_plan(plan_, options(""));
    EXPECT_EQ(result.made, 4);
    EXPECT_EQ(result.found, 0);
    const std::vector<Record> all = records();
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(all[i].spec.detector, plan_[i].spec.detector);
        EXPECT_EQ(all[i].summary.at(Metric::ticks), static_cast<double>(i));
        EXPECT_EQ(all[i].environment.at("binary"), "binary_1");
    }
}

TEST_F(RunnerTest, ALongRunIsReportedWhileItRuns) {
    RunnerOptions long_run = options("1) sleep 2.5;;");
    std::map<const PlannedRun*, int> reported;
    std::map<const PlannedRun*, std::set<std::size_t>> done;
    long_run.progress = [&](std::size_t position, const PlannedRun* run) {
        ++reported[run];
        done[run].insert(position);
    };
    run_plan(plan_, long_run);
    EXPECT_GE(reported[&plan_[1]], 3) << "at its start and every second";
    EXPECT_EQ(done[&plan_[1]], std::set<std::size_t>{1});
    EXPECT_EQ(reported[nullptr], 1);
}

/// Every child reports when it begins and ends; `jobs` children may be between the two at once.
TEST_F(RunnerTest, SideBySideRunWhatNobodyTimesAndNothingElse) {
    for (std::size_t i = 1; i < plan_.size(); ++i) {
        plan_[i].spec.mode = i == 3 ? "metamorphic" : "hard_case";
        prepare(i);
    }
    RunnerOptions side_by_side = options("*) sleep 0.3; echo end $i >>$prepared/log;;");
    side_by_side.jobs = 2;
    std::vector<std::size_t> reported;  // how many are done or started
    side_by_side.progress = [&reported](std::size_t position, const PlannedRun*) { reported.push_back(position); };
    const RunnerResult result = run_plan(plan_, side_by_side);
    EXPECT_EQ(result.made, 4);
    EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end())) << testing::PrintToString(reported);
    EXPECT_EQ(reported.front(), 0U);
    EXPECT_EQ(reported.back(), 4U);
    std::istringstream log(test::read_file(prepared() / "log"));
    int running = 0;
    int most = 0;
    bool timed_runs = false;
    for (std::string line; std::getline(log, line);) {
        const bool ends = line.starts_with("end");
        running += ends ? -1 : 1;
        most = std::max(most, running);
        if (line.ends_with('0')) timed_runs = !ends;
        if (timed_runs) {
            EXPECT_EQ(running, 1) << line;
        }
    }
    EXPECT_EQ(most, 2);
    const std::vector<Record> all = records();
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(all[i].summary.at(Metric::ticks), static_cast<double>(i)) << i;
    EXPECT_EQ(run_plan(plan_, side_by_side).found, 4);
}

TEST_F(RunnerTest, AnInterruptionEndsAllThatRunSideBySide) {
    for (PlannedRun& run : plan_) run.spec.mode = "hard_case";
    RunnerOptions side_by_side = options("1) kill -INT $PPID; sleep 60;;\n*) sleep 60;;");
    side_by_side.jobs = 3;
    const auto start = std::chrono::steady_clock::now();
    EXPECT_TRUE(run_plan(plan_, side_by_side).interrupted);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    EXPECT_FALSE(std::filesystem::exists(output() / records_name));
    for (const auto& entry : std::filesystem::recursive_directory_iterator(output())) {
        EXPECT_NE(entry.path().extension(), ".child");
        EXPECT_NE(entry.path().extension(), ".log");
    }
}

TEST_F(RunnerTest, CrashIsARowWithItsSignal) {
    run_plan(plan_, options("1) kill -SEGV $$;;"));
    const std::vector<Record> all = records();
    EXPECT_EQ(all[1].outcome.kind, OutcomeKind::crashed);
    EXPECT_NE(all[1].outcome.message.find("signal 11"), std::string::npos) << all[1].outcome.message;
    EXPECT_EQ(all[1].environment.at("cpu"), "x");
    for (const std::size_t i : {0U, 2U, 3U}) EXPECT_TRUE(all[i].outcome.ok()) << i;
    EXPECT_EQ(run_plan(plan_, options("")).found, 4) << "a crash is an answer";
}

TEST_F(RunnerTest, ExitWithoutACompleteRecordIsACrashWithTheLastWords) {
    run_plan(plan_, options("0) echo 'what(): out of luck' >&2; echo later >&2; exit 3;;\n"
                            "1) exit 0;;\n"
                            "2) head -c 40 $prepared/2.json >$out; exit 0;;\n"
                            "3) cp $prepared/0.json $out; exit 0;;"));
    const std::vector<Record> all = records();
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(all[i].outcome.kind, OutcomeKind::crashed) << i;
    EXPECT_EQ(all[0].outcome.message, "exit status 3 without a complete record: what(): out of luck");
    EXPECT_EQ(all[3].spec.detector, "d3") << "another run's record is no answer";
}

TEST_F(RunnerTest, HangIsEndedAndIsARow) {
    const auto start = std::chrono::steady_clock::now();
    run_plan(plan_, options("2) sleep 60;;", 0.3));
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    const std::vector<Record> all = records();
    EXPECT_EQ(all[2].outcome.kind, OutcomeKind::timed_out);
    EXPECT_TRUE(all[3].outcome.ok());
}

TEST_F(RunnerTest, CrashAfterACompleteRecordKeepsTheRowsAndReportsTheFailure) {
    run_plan(plan_, options("0) cp $prepared/0.json $out; kill -ABRT $$;;"));
    const std::vector<Record> all = records();
    EXPECT_EQ(all[0].outcome.kind, OutcomeKind::crashed);
    EXPECT_EQ(all[0].summary.at(Metric::ticks), 0.0);
}

TEST_F(RunnerTest, InterruptedStudyGoesOnWhereItStopped) {
    // The child interrupts its parent, as Ctrl-C would, and then hangs.
    const RunnerResult first = run_plan(plan_, options("2) kill -INT $PPID; sleep 60;;"));
    EXPECT_TRUE(first.interrupted);
    EXPECT_EQ(first.made, 2);
    EXPECT_FALSE(std::filesystem::exists(output() / records_name));
    EXPECT_EQ(started(), "0 1 2 ");
    const RunnerResult second = run_plan(plan_, options(""));
    EXPECT_FALSE(second.interrupted);
    EXPECT_EQ(second.found, 2);
    EXPECT_EQ(second.made, 2);
    EXPECT_EQ(started(), "0 1 2 2 3 ");
    EXPECT_EQ(records().size(), 4U);
    const RunnerResult third = run_plan(plan_, options(""));
    EXPECT_EQ(third.made, 0);
    EXPECT_EQ(started(), "0 1 2 2 3 ");
}

/// Runs 1 to 3 are a group. The script has the records of all its runs ready, and notes whose turn it is.
class GroupTest : public RunnerTest {
protected:
    GroupTest() {
        for (std::size_t i = 1; i < plan_.size(); ++i) plan_[i].group = "g";
    }
    /// `special`: lines of a shell `case` on the number of a run, at its turn.
    RunnerOptions group_options(const std::string& special, double time_limit_s = 20.0) {
        RunnerOptions all = options("", time_limit_s);
        std::ofstream(all.child_command.back())
            << "ids=\nwhile [ $# -gt 0 ]; do case $1 in --child-run) ids=\"$ids$2 \";; --child-output) out=$2;; esac; "
               "shift 2; done\nprepared="
            << prepared().string()
            << "\necho \"[$ids]\" >>$prepared/log\nfor i in $ids; do echo $i >$out.turn\ncase $i in\n"
            << special
            << "\nesac\ndone\nfor i in $ids; do cat $prepared/$i.json; done >$out.part && mv $out.part $out\n";
        return all;
    }
};

TEST_F(GroupTest, RunsOfAGroupAreMadeInOneProcessAndComeInPlanOrder) {
    EXPECT_EQ(run_plan(plan_, group_options("")).made, 4);
    EXPECT_EQ(started(), "[0 ] [1 2 3 ] ");
    const std::vector<Record> all = records();
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(all[i].summary.at(Metric::ticks), static_cast<double>(i));
    EXPECT_EQ(run_plan(plan_, group_options("")).found, 4);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(output())) {
        EXPECT_NE(entry.path().extension(), ".turn");
        EXPECT_NE(entry.path().extension(), ".child");
    }
}

TEST_F(GroupTest, TheRunWhoseTurnItWasHasCrashedAndTheOthersAreMadeAgain) {
    const RunnerResult result = run_plan(plan_, group_options("2) kill -SEGV $$;;"));
    EXPECT_EQ(result.made, 4);
    EXPECT_EQ(started(), "[0 ] [1 2 3 ] [1 3 ] ");
    const std::vector<Record> all = records();
    EXPECT_EQ(all[2].outcome.kind, OutcomeKind::crashed);
    for (const std::size_t i : {0U, 1U, 3U}) EXPECT_TRUE(all[i].outcome.ok()) << i;
    EXPECT_EQ(run_plan(plan_, group_options("")).found, 4) << "a crash is an answer";
}

TEST_F(GroupTest, AGroupThatEndsBeforeAnyTurnFailsWhole) {
    RunnerOptions early = group_options("");
    std::ofstream(early.child_command.back()) << "exit 3\n";
    run_plan(plan_, early);
    for (const Record& record : records()) EXPECT_EQ(record.outcome.kind, OutcomeKind::crashed);
}

TEST_F(GroupTest, AHangIsThatOfTheRunWhoseTurnItWas) {
    run_plan(plan_, group_options("3) sleep 60;;", 0.5));
    const std::vector<Record> all = records();
    EXPECT_EQ(all[3].outcome.kind, OutcomeKind::timed_out);
    EXPECT_TRUE(all[1].outcome.ok());
    EXPECT_TRUE(all[2].outcome.ok());
}

TEST_F(GroupTest, AMissingRecordOfAGroupIsMadeAgainWithAllOthers) {
    plan_[1].settled = Outcome{OutcomeKind::absent, "not built"};
    run_plan(plan_, group_options(""));
    EXPECT_EQ(started(), "[0 ] [2 3 ] ");
    EXPECT_EQ(records()[1].outcome.kind, OutcomeKind::absent);
    const std::filesystem::path lost = output() / "runs" / "binary_1" / (run_key(plan_[3].spec, {}, 20.0) + ".json");
    ASSERT_TRUE(std::filesystem::remove(lost));
    run_plan(plan_, group_options(""));
    EXPECT_EQ(started(), "[0 ] [2 3 ] [2 3 ] ");
}

TEST_F(RunnerTest, AnotherBinaryStartsAnew) {
    run_plan(plan_, options(""));
    RunnerOptions other = options("");
    other.binary = "binary_2";
    const RunnerResult result = run_plan(plan_, other);
    EXPECT_EQ(result.made, 4);
    EXPECT_EQ(records()[0].environment.at("binary"), "binary_2");
}

TEST_F(RunnerTest, AnotherSpecificationIsRunAlone) {
    run_plan(plan_, options(""));
    plan_[3].spec.seed = 7;
    prepare(3);
    const RunnerResult result = run_plan(plan_, options(""));
    EXPECT_EQ(result.found, 3);
    EXPECT_EQ(result.made, 1);
}

TEST_F(RunnerTest, ARunBesideOtherReferencesIsMadeAgain) {
    run_plan(plan_, options(""));
    for (const char* references : {"0123456789abcdef", "0123456789abcdee"}) {
        plan_[3].facts["scene.references"] = references;
        prepare(3);
        EXPECT_EQ(run_plan(plan_, options("")).made, 1);
        EXPECT_EQ(run_plan(plan_, options("")).made, 0);
        EXPECT_EQ(records()[3].environment.at("scene.references"), references);
    }
    plan_[3].facts.clear();
    EXPECT_EQ(run_plan(plan_, options("")).made, 0) << "those of before";
}

TEST_F(RunnerTest, AnotherTimeLimitStartsAnewAndTheFirstOneIsStillKnown) {
    run_plan(plan_, options("2) sleep 60;;", 0.3));
    ASSERT_EQ(records()[2].outcome.kind, OutcomeKind::timed_out);
    // What a short limit cut off is no answer under a longer one.
    const RunnerResult longer = run_plan(plan_, options("", 20.0));
    EXPECT_EQ(longer.made, 4);
    EXPECT_EQ(longer.found, 0);
    EXPECT_TRUE(records()[2].outcome.ok());
    EXPECT_EQ(run_plan(plan_, options("", 0.3)).found, 4);
    EXPECT_EQ(records()[2].outcome.kind, OutcomeKind::timed_out);
}

TEST_F(RunnerTest, HalfAStoredRunIsNotFinished) {
    run_plan(plan_, options(""));
    const std::filesystem::path stored =
        output() / "runs" / "binary_1" / (run_key(plan_[1].spec, {}, options("").time_limit_s) + ".json");
    ASSERT_TRUE(std::filesystem::exists(stored));
    std::filesystem::resize_file(stored, std::filesystem::file_size(stored) / 2);
    const RunnerResult result = run_plan(plan_, options(""));
    EXPECT_EQ(result.found, 3);
    EXPECT_EQ(result.made, 1);
    EXPECT_EQ(records().size(), 4U);
}

TEST_F(RunnerTest, SettledRunsStartNoProcess) {
    plan_[0].settled = Outcome{OutcomeKind::absent, "library not found"};
    run_plan(plan_, options(""));
    EXPECT_EQ(started(), "1 2 3 ");
    EXPECT_EQ(records()[0].outcome.kind, OutcomeKind::absent);
    EXPECT_EQ(records()[0].outcome.message, "library not found");
}

TEST_F(RunnerTest, TwoRunnersInOneFolderAreRefused) {
    std::filesystem::create_directories(output());
    const int lock = open((output() / "lock").c_str(), O_RDWR | O_CREAT, 0644);
    ASSERT_EQ(flock(lock, LOCK_EX), 0);
    EXPECT_THROW(run_plan(plan_, options("")), InputError);
    EXPECT_EQ(started(), "");
    close(lock);
    EXPECT_EQ(run_plan(plan_, options("")).made, 4);
}

TEST_F(RunnerTest, ChildKeepsNoSignalBlocked) {
    // A child that inherits the runner's blocked signals could not be interrupted by anyone.
    run_plan(plan_, options("1) kill -TERM $$; sleep 5;;"));
    EXPECT_EQ(records()[1].outcome.kind, OutcomeKind::crashed);
    EXPECT_NE(records()[1].outcome.message.find("signal 15"), std::string::npos);
}

TEST(ShortenRows, KeepsFiveDigitsOfGeometryAndForce) {
    Record record;
    record.rows.resize(1);
    record.rows[0].residual_penetration = 0.00123456789;
    record.rows[0].tool_force = Vector3(-1234.56789, 0.0, 1.0 / 3.0);
    record.summary[Metric::residual_penetration_max_m] = 0.00123456789;
    shorten_rows(record);
    EXPECT_EQ(record.rows[0].residual_penetration, 0.0012346);
    EXPECT_EQ(record.rows[0].tool_force, Vector3(-1234.6, 0.0, 0.33333));
    EXPECT_TRUE(std::isnan(record.rows[0].depth_error)) << "n/a stays n/a";
    EXPECT_EQ(record.summary[Metric::residual_penetration_max_m], 0.00123456789);
}

TEST(ThinRows, KeepThePeaksOfEveryStretchAndWhatWentWrong) {
    Record record;
    record.spec.mode = "closed_loop";
    record.spec.detail_stride = 10;
    for (std::int64_t tick = 0; tick < 25; ++tick) {
        StepRow row;
        row.tick = tick;
        row.residual_penetration = tick == 4 ? 2e-3 : 1e-3;
        row.tool_force = Vector3(tick == 17 ? -3.0 : 1.0, 0.0, 0.0);
        row.truncated = tick == 21;
        record.rows.push_back(row);
    }
    Record whole = record;
    thin_rows(record);
    std::vector<std::int64_t> ticks;
    for (const StepRow& row : record.rows) ticks.push_back(row.tick);
    EXPECT_EQ(ticks, (std::vector<std::int64_t>{0, 4, 10, 17, 20, 21}));
    whole.spec.detail_stride = 1;
    thin_rows(whole);
    EXPECT_EQ(whole.rows.size(), 25U);
}

}  // namespace
}  // namespace trocar
