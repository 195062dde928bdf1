// `trocar study --shard`, `trocar merge` and `trocar study --slurm` from outside, against the study in one piece.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "geometry/gzip.hpp"
#include "measure/metrics.hpp"
#include "measure/step_row.hpp"
#include "support/commands.hpp"
#include "support/unpacked.hpp"

namespace trocar::test {
namespace {

/// The record without what clock, memory and load gave.
nlohmann::ordered_json without_times_of(const std::string& line) {
    nlohmann::ordered_json record = nlohmann::ordered_json::parse(line);
    record["environment"].erase("load");
    for (const MetricInfo& info : metrics()) {
        if (is_timed(info.source)) record["summary"].erase(std::string(info.name));
    }
    if (record.contains("rows")) {
        for (const char* stage : stage_names) record["rows"].erase(std::string(stage) + "_ns");
    }
    return record;
}

class Shards : public ::testing::Test {
protected:
    Shards() {
        const std::filesystem::path scenes = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes";
        for (const char* name : {"i2t_poke.json", "i2i_cross.json"}) {
            std::filesystem::copy_file(scenes / name, folder_.path() / name);
        }
        write_study(40);
    }
    void write_study(int ticks, int repetitions = 2) const {
        nlohmann::json study{{"format", "trocar-study-3"}, {"name", "small"}, {"reference", "brute_force"}};
        study["experiments"] = {{{"frames", "replay"},
                                 {"scenes", {"i2t_poke.json", "i2i_cross.json"}},
                                 {"detectors", {"ohc", "brute_force"}},
                                 {"repetitions", repetitions},
                                 {"ticks", ticks}},
                                {{"frames", "closed_loop"},
                                 {"scenes", {"i2t_poke.json", "i2i_cross.json"}},
                                 {"detectors", {"ohc"}},
                                 {"responses", {"thesis:profile=faithful", "penalty"}},
                                 {"contacts", {"intersection", "native"}},
                                 {"ticks", ticks}}};
        std::ofstream(path("study.json")) << study.dump(1);
    }
    [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
    [[nodiscard]] std::string study(const std::string& options) const {
        return "study " + path("study.json") + " " + options;
    }
    /// The first `count` of three shards.
    void make_shards(int count = 3) const {
        for (int i = 1; i <= count; ++i) {
            const std::string number = std::to_string(i);
            run_successfully(study("--shard " + number + "/3 --output " + path("shard_" + number)));
        }
    }
    [[nodiscard]] std::string merge(const std::string& shards) const {
        std::string arguments = "merge " + path("merged");
        for (const char shard : shards) arguments += " " + path(std::string("shard_") + shard);
        return arguments;
    }
    [[nodiscard]] std::vector<std::string> lines_of(const std::string& name) const {
        std::vector<std::string> lines;
        std::istringstream stream(unpacked(folder_.path() / name / "records.jsonl.gz"));
        for (std::string line; std::getline(stream, line);) lines.push_back(line);
        return lines;
    }
    void expect_equals_the_whole_study(const std::string& merged) const {
        run_successfully(study("--output " + path("whole")));
        const std::vector<std::string> whole = lines_of("whole");
        const std::vector<std::string> parts = lines_of(merged);
        ASSERT_EQ(parts.size(), whole.size());
        for (std::size_t i = 0; i < whole.size(); ++i) {
            EXPECT_EQ(without_times_of(parts[i]).dump(), without_times_of(whole[i]).dump()) << "record " << i;
        }
        std::map<std::string, std::string> files = files_below(folder_.path() / "whole");
        std::erase_if(files, [](const auto& file) { return file.first.starts_with("runs/") || file.first == "lock"; });
        const std::map<std::string, std::string> other = files_below(folder_.path() / merged);
        for (const auto& [name, content] : files) {
            ASSERT_TRUE(other.contains(name)) << name;
            // Replays and the picture of the worst tick have no times.
            if (name.starts_with("view/") || name == "worst_tick.json") {
                EXPECT_EQ(other.at(name), content) << name;
            }
        }
        EXPECT_EQ(other.size(), files.size());
        run_successfully("report " + path("whole") + " --against " + path(merged));
    }
    void replace_in_shard(const std::string& shard, const std::string& from, const std::string& to) const {
        std::string text;
        for (std::string line : lines_of(shard)) {
            const std::size_t place = line.find(from);
            if (place != std::string::npos) line.replace(place, from.size(), to);
            text += line + "\n";
        }
        std::ofstream(path(shard + "/records.jsonl.gz"), std::ios::binary) << gzipped(text);
    }

    TemporaryFolder folder_;
};

TEST_F(Shards, AreTheWholeStudyOnceMerged) {
    make_shards();
    std::size_t runs = 0;
    for (const char* shard : {"shard_1", "shard_2", "shard_3"}) {
        EXPECT_FALSE(std::filesystem::exists(path(shard) + "/report.html")) << shard;
        runs += lines_of(shard).size();
    }
    EXPECT_EQ(json_of(study("--plan --json"))["runs"].size(), runs);
    EXPECT_EQ(json_of(study("--plan --json --shard 2/3"))["runs"].size(), lines_of("shard_2").size());
    const nlohmann::json merged = json_of(merge("312") + " --json");  // in any order
    EXPECT_EQ(merged["runs"], runs);
    EXPECT_EQ(merged["missing"], nlohmann::json::array());
    expect_equals_the_whole_study("merged");
}

TEST_F(Shards, WhatIsMissingIsListedAndNothingWritten) {
    make_shards(2);
    const std::size_t planned = json_of(study("--plan --json"))["runs"].size();
    const std::size_t absent = planned - lines_of("shard_1").size() - lines_of("shard_2").size();
    ASSERT_GT(absent, 0U);
    const ProgramResult result = run_program(merge("12") + " --json");
    EXPECT_EQ(result.status, 1);
    const nlohmann::json missing = nlohmann::json::parse(result.out)["missing"];
    EXPECT_EQ(missing.size(), absent);
    for (const nlohmann::json& run : missing) EXPECT_TRUE(run.get<std::string>().starts_with("shard 3/3: ")) << run;
    EXPECT_FALSE(std::filesystem::exists(path("merged")));

    // A shard that was killed has no records, but the runs that it has finished.
    std::filesystem::remove(path("shard_2/records.jsonl.gz"));
    EXPECT_EQ(nlohmann::json::parse(run_program(merge("12") + " --json").out)["missing"], missing);
    const auto runs = std::filesystem::recursive_directory_iterator(path("shard_2/runs"));
    for (const auto& entry : runs) {
        if (entry.path().extension() != ".json") continue;
        std::filesystem::resize_file(entry.path(), 100);  // half a file is no finished run
        break;
    }
    EXPECT_EQ(nlohmann::json::parse(run_program(merge("12") + " --json").out)["missing"].size(), absent + 1);
    // Started again it makes that run alone.
    EXPECT_EQ(json_of(study("--shard 2/3 --json --output " + path("shard_2")))["made"], 1);
}

TEST_F(Shards, AreRefusedTwiceAndOfAnotherStudyOrBinary) {
    make_shards();
    std::filesystem::copy(path("shard_1"), path("shard_c"), std::filesystem::copy_options::recursive);
    expect_refused(merge("1231"), "expected every shard once");
    expect_refused(merge("123c"), "shard_c/shard.json: /shard: expected every shard once, got 1, as in ");
    expect_refused(merge("12x"), "shard_x");
    std::filesystem::create_directory(path("shard_e"));
    expect_refused(merge("12e"), "no shard.json");

    const std::string record = lines_of("shard_c").front();
    const std::string binary = nlohmann::json::parse(record)["environment"]["binary"];
    replace_in_shard("shard_c", binary, "0123456789abcdef");
    expect_refused(merge("c23"), "line 1: expected a record of the binary " + binary + ", got 0123456789abcdef");
    std::filesystem::copy_file(path("shard_3/records.jsonl.gz"), path("shard_c/records.jsonl.gz"),
                               std::filesystem::copy_options::overwrite_existing);
    expect_refused(merge("c2"), "line 1: expected a run of shard 1/3, got one of shard 3");

    write_study(41);
    run_successfully(study("--shard 1/3 --output " + path("shard_o")));
    expect_refused(merge("23o"), "shard_o/shard.json: /study_digest");
    write_study(40);
    run_successfully(study("--shard 1/2 --output " + path("shard_h")));
    expect_refused(merge("23h"), "shard_h/shard.json: /shards: expected 3, as in ");
    EXPECT_FALSE(std::filesystem::exists(path("merged")));

    run_successfully(merge("123"));
    const std::map<std::string, std::string> before = files_below(path("merged"));
    expect_refused(merge("123"), "expected a new or empty folder");
    EXPECT_EQ(files_below(path("merged")), before);
}

TEST_F(Shards, NumbersOutOfRangeLeaveNothing) {
    for (const char* shard : {"0/3", "4/3", "-1/3", "1/0", "1", "1/", "/3", "a/b", "1/3/4", "1/3 ", "1/100001"}) {
        expect_refused(study("--shard '" + std::string(shard) + "' --output " + path("out")), "--shard: expected K/N");
    }
    expect_refused(study("--shard 1/3 --publish"), "--publish");
    expect_refused(study("--array 3"), "--slurm");
    expect_refused(study("--slurm --time soon --output " + path("out")), "--time: expected minutes");
    EXPECT_FALSE(std::filesystem::exists(path("out")));
    EXPECT_FALSE(std::filesystem::exists(path("out.shards")));
    run_successfully(study("--output " + path("out")));
    expect_refused(study("--shard 1/3 --output " + path("out")), "one with the records of a study");
}

/// A Slurm of one node, in a folder of its own.
class SlurmShards : public Shards {
protected:
    void SetUp() override {
        for (const char* program : {"sbatch", "slurmctld", "slurmd", "munged"}) {
            const std::string found = "PATH=$PATH:/usr/sbin command -v " + std::string(program) + " >/dev/null";
            if (std::system(found.c_str()) != 0) {
                GTEST_SKIP() << program << " is not installed (./test.sh full installs it)";
            }
        }
        if (geteuid() != 0) GTEST_SKIP() << "munged and slurmd need root";
        std::filesystem::create_directory(path("slurm"));
        // Every test has a process of its own, and so ports.
        const int port = 20000 + static_cast<int>(getpid() % 5000) * 2;
        ASSERT_EQ(node("start", std::to_string(port)), 0) << read_file(path("slurm/start.log"));
        setenv("SLURM_CONF", path("slurm/slurm.conf").c_str(), 1);
    }
    void TearDown() override {
        if (std::filesystem::exists(path("slurm"))) node("stop");
    }
    int node(const std::string& action, const std::string& port = "") const {
        const std::string script = std::string(TROCAR_SOURCE_DIR) + "/tests/app/slurm_one_node.sh ";
        return std::system(("PATH=$PATH:/usr/sbin " + script + action + " " + path("slurm") + " " + port).c_str());
    }
    nlohmann::json submit() const {
        return json_of(study("--slurm --array 4 --time 10 --json --output " + path("merged")));
    }
    [[nodiscard]] std::map<std::string, std::string> finished_runs() const {
        std::map<std::string, std::string> files = files_below(path("merged.shards"));
        std::erase_if(files, [](const auto& file) {
            return file.first.find("/runs/") == std::string::npos || !file.first.ends_with(".json");
        });
        return files;
    }
    /// Waits until `is_so`, at most two minutes.
    template <typename Condition>
    static bool wait_until(const Condition& is_so) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
        while (std::chrono::steady_clock::now() < end) {
            if (is_so()) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        return false;
    }
    [[nodiscard]] bool wait_for_jobs() const {
        return wait_until([this] {
            const int status = std::system(("squeue -h >" + path("queue")).c_str());
            return status == 0 && read_file(path("queue")).empty();
        });
    }
};

TEST_F(SlurmShards, AKilledTaskIsMissingAndTheStudySubmittedAgainIsWhole) {
    write_study(300, 6);
    // The task with most runs is killed when it has finished some and is at another one.
    const auto runs_of = [this](int shard) {
        return json_of(study("--plan --json --shard " + std::to_string(shard) + "/4"))["runs"].size();
    };
    const std::array<int, 4> numbers{1, 2, 3, 4};
    const int killed =
        *std::max_element(numbers.begin(), numbers.end(), [&](int a, int b) { return runs_of(a) < runs_of(b); });
    const std::string name = std::to_string(killed);
    const auto finished = [&] {
        const std::map<std::string, std::string> runs = finished_runs();
        return static_cast<std::size_t>(std::count_if(
            runs.begin(), runs.end(), [&](const auto& run) { return run.first.starts_with(name + "-of-4/"); }));
    };
    const std::string array = submit()["array_job"];
    EXPECT_NE(read_file(path("merged.shards/array.sh")).find("#SBATCH --exclusive"), std::string::npos);
    ASSERT_TRUE(wait_until([&] { return finished() > 0; }));
    EXPECT_EQ(std::system(("scancel --signal=KILL --full " + array + "_" + name).c_str()), 0);
    ASSERT_TRUE(wait_for_jobs());
    ASSERT_LT(finished(), runs_of(killed)) << "it was killed too late";
    EXPECT_FALSE(std::filesystem::exists(path("merged")));
    const std::string log = read_file(path("merged.shards/merge.log"));
    for (const int shard : numbers) {
        const bool is_listed = log.find("missing  shard " + std::to_string(shard) + "/4: ") != std::string::npos;
        EXPECT_EQ(is_listed, shard == killed) << log;
    }
    const std::map<std::string, std::string> before = finished_runs();

    submit();
    ASSERT_TRUE(wait_for_jobs());
    const std::map<std::string, std::string> after = finished_runs();
    for (const auto& [file, content] : before) EXPECT_EQ(after.at(file), content) << file << " was made again";
    EXPECT_GT(after.size(), before.size());
    expect_equals_the_whole_study("merged");
    expect_refused(study("--slurm --output " + path("merged")), "expected a new or empty folder");
}

TEST_F(SlurmShards, WhatSbatchRefusesIsOneLine) {
    const std::string options = "--slurm --output " + path("merged");
    expect_refused(study(options + " --time 5:"), "array.sh: expected a script that sbatch takes, got sbatch: error");
    const std::string program = "PATH=/nowhere " TROCAR_PROGRAM;
    const ProgramResult result = run_program(study(options), program);
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.err.find("--slurm: expected Slurm's sbatch in the path, got none"), std::string::npos)
        << result.err;
    EXPECT_EQ(std::system(("squeue -h >" + path("queue")).c_str()), 0);
    EXPECT_EQ(read_file(path("queue")), "");
}

}  // namespace
}  // namespace trocar::test
