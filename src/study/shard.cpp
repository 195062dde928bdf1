#include "study/shard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>

#include "geometry/fnv_hash.hpp"
#include "geometry/gzip.hpp"
#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "study/child_process.hpp"
#include "study/runner.hpp"
#include "study/study_items.hpp"

namespace trocar {
namespace {

constexpr const char* shard_format = "trocar-shard-1";

/// Content of shard.json.
struct ShardPlan {
    struct Run {
        std::string key;
        std::int64_t shard = 1;
        std::string name;
    };
    std::filesystem::path folder;
    Shard shard;
    std::string study;
    std::string study_file;
    std::string digest;
    std::string binary;
    double time_limit_s = 0.0;  ///< part of every run's key
    std::vector<Run> runs;      ///< of the whole study
};

/// Hash over the study's file and its plan, 16 hex digits.
std::string digest_of(const Study& study, const std::vector<PlannedRun>& plan) {
    FnvHash hash;
    hash.add_text(read_whole(study.file, "a study"));
    for (const PlannedRun& run : plan) hash.add_text(run_key(run.spec, run.facts, study.time_limit_s));
    return hash.text();
}

std::string run_in_words(const RunSpec& spec) {
    return fmt::format("{} {}: {}, process {}", spec.mode, spec.scene.empty() ? "all scenes" : spec.scene,
                       methods_in_words(spec), spec.repetition);
}

ShardPlan read_shard_plan(const std::filesystem::path& folder) {
    const std::filesystem::path path = folder / shard_name;
    if (!std::filesystem::is_regular_file(path)) {
        throw InputError(folder.string(), "", "the folder of a shard (trocar study --shard)",
                         fmt::format("none: it has no {}", shard_name));
    }
    const std::string file = path.string();
    const Json json = parse_json(read_whole(path, "a shard"), file);
    const JsonNode root(json, file);
    const std::vector<std::string> keys{"format", "study",  "study_file", "study_digest", "time_limit_s",
                                        "binary", "shards", "shard",      "runs"};
    expect_object(root, keys, keys);
    root.at("format").expect_word(shard_format);
    ShardPlan plan{.folder = folder,
                   .shard = {},
                   .study = root.at("study").text(),
                   .study_file = root.at("study_file").text(),
                   .digest = root.at("study_digest").text(),
                   .binary = root.at("binary").text(),
                   .time_limit_s = root.at("time_limit_s").positive(),
                   .runs = {}};
    plan.shard.count = root.at("shards").integer(1, most_shards);
    plan.shard.number = root.at("shard").integer(1, plan.shard.count);
    for (const JsonNode& run : root.at("runs").list()) {
        expect_object(run, {"key", "shard", "name"}, {"key", "shard", "name"});
        plan.runs.push_back(
            {run.at("key").text(), run.at("shard").integer(1, plan.shard.count), run.at("name").text()});
    }
    return plan;
}

void expect_same_study(const ShardPlan& first, const ShardPlan& other) {
    const auto expect = [&](const char* key, const std::string& wanted, const std::string& found) {
        if (wanted == found) return;
        throw InputError((other.folder / shard_name).string(), std::string("/") + key,
                         fmt::format("{}, as in {}", wanted, first.folder.string()), found);
    };
    expect("study", first.study, other.study);
    expect("binary", first.binary, other.binary);
    expect("study_digest", first.digest, other.digest);
    expect("shards", std::to_string(first.shard.count), std::to_string(other.shard.count));
}

struct FoundRecord {
    std::string key;
    std::string line;
    std::string place;  ///< file and line
};

/// The records of a file.
std::vector<FoundRecord> read_found(const std::filesystem::path& file, const ShardPlan& plan) {
    std::vector<FoundRecord> found;
    const std::unique_ptr<std::istream> stream = open_lines(file, "the records of a shard");
    std::string line;
    for (std::int64_t number = 1; read_line(*stream, line, file.string()); ++number) {
        const Record record = record_from_json_line(line, file.string(), number);
        const std::string place = fmt::format("{}: line {}", file.string(), number);
        const auto binary = record.environment.find("binary");
        const std::string made_by = binary == record.environment.end() ? "none" : binary->second;
        if (made_by != plan.binary) {
            throw InputError(place, "", fmt::format("a record of the binary {}", plan.binary), made_by);
        }
        found.push_back({run_key(record.spec, record.environment, plan.time_limit_s), line, place});
    }
    return found;
}

/// The records of a shard; where it did not end, those of its finished runs.
std::vector<FoundRecord> records_of(const ShardPlan& plan) {
    std::map<std::string, std::int64_t> shard_of_key;
    for (const ShardPlan::Run& run : plan.runs) shard_of_key[run.key] = run.shard;
    std::vector<FoundRecord> found;
    if (std::filesystem::exists(plan.folder / records_name)) {
        found = read_found(plan.folder / records_name, plan);
        for (const FoundRecord& record : found) {
            const auto planned = shard_of_key.find(record.key);
            if (planned != shard_of_key.end() && planned->second == plan.shard.number) continue;
            throw InputError(record.place, "", fmt::format("a run of shard {}/{}", plan.shard.number, plan.shard.count),
                             planned == shard_of_key.end() ? "one of another study"
                                                           : fmt::format("one of shard {}", planned->second));
        }
        return found;
    }
    for (const auto& [key, shard] : shard_of_key) {
        const std::filesystem::path file = plan.folder / "runs" / plan.binary / (key + ".json");
        if (shard != plan.shard.number || !std::filesystem::exists(file)) continue;
        try {
            for (FoundRecord& record : read_found(file, plan)) found.push_back(std::move(record));
        } catch (const InputError&) {  // half a file, which the shard makes again
        }
    }
    return found;
}

}  // namespace

Shard read_shard(const std::string& text) {
    Shard shard;
    const char* end = text.data() + text.size();
    const auto number = std::from_chars(text.data(), end, shard.number);
    auto count = number;
    if (number.ec == std::errc() && number.ptr != end && *number.ptr == '/') {
        count = std::from_chars(number.ptr + 1, end, shard.count);
    }
    if (count.ec != std::errc() || count.ptr == number.ptr || count.ptr != end || shard.number < 1 ||
        shard.number > shard.count || shard.count > most_shards) {
        throw InputError("command line", "--shard", fmt::format("K/N with 1 <= K <= N <= {}", most_shards), text);
    }
    return shard;
}

void assign_shards(std::int64_t count, double time_limit_s, std::vector<PlannedRun>& plan) {
    std::map<std::string, std::int64_t> by_group;
    for (PlannedRun& run : plan) {
        const std::uint64_t key = std::stoull(run_key(run.spec, run.facts, time_limit_s), nullptr, 16);
        run.shard = 1 + static_cast<std::int64_t>(key % static_cast<std::uint64_t>(count));
        if (!run.group.empty()) run.shard = by_group.emplace(run.group, run.shard).first->second;
    }
}

void start_shard(const std::filesystem::path& directory, const Shard& shard, const Study& study,
                 const std::vector<PlannedRun>& plan, const std::string& binary) {
    const std::filesystem::path records = directory / records_name;
    if (std::filesystem::exists(records) && !std::filesystem::exists(directory / shard_name)) {
        throw InputError(directory.string(), "", "a new folder or that of a shard", "one with the records of a study");
    }
    nlohmann::ordered_json document{{"format", shard_format},
                                    {"study", study.name},
                                    {"study_file", study.file.string()},
                                    {"study_digest", digest_of(study, plan)},
                                    {"time_limit_s", study.time_limit_s},
                                    {"binary", binary},
                                    {"shards", shard.count},
                                    {"shard", shard.number},
                                    {"runs", nlohmann::ordered_json::array()}};
    for (const PlannedRun& run : plan) {
        document["runs"].push_back({{"key", run_key(run.spec, run.facts, study.time_limit_s)},
                                    {"shard", run.shard},
                                    {"name", run_in_words(run.spec)}});
    }
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    if (error) throw InputError(directory.string(), "", "a folder that can be made", error.message());
    const DirectoryLock lock(directory);
    std::filesystem::remove(records);
    write_whole(directory / shard_name, document.dump() + "\n");
}

MergedShards merge_shards(const std::vector<std::filesystem::path>& folders) {
    std::vector<ShardPlan> shards;
    std::map<std::int64_t, std::filesystem::path> folder_of;
    for (const std::filesystem::path& folder : folders) {
        shards.push_back(read_shard_plan(folder));
        expect_same_study(shards.front(), shards.back());
        const std::int64_t number = shards.back().shard.number;
        const auto [known, is_new] = folder_of.emplace(number, folder);
        if (!is_new) {
            throw InputError((folder / shard_name).string(), "/shard", "every shard once",
                             fmt::format("{}, as in {}", number, known->second.string()));
        }
    }
    const ShardPlan& plan = shards.front();
    std::map<std::string, FoundRecord> found;
    for (const ShardPlan& shard : shards) {
        for (const FoundRecord& record : records_of(shard)) {
            const auto [known, is_new] = found.try_emplace(record.key, record);
            // Experiments may plan the same run; its record is then there twice.
            if (!is_new && known->second.line != record.line) {
                throw InputError(record.place, "", "every run once",
                                 "another record of the one at " + known->second.place);
            }
        }
    }
    MergedShards merged{.study_file = plan.study_file,
                        .records = {},
                        .runs = static_cast<std::int64_t>(plan.runs.size()),
                        .missing = {}};
    for (const ShardPlan::Run& run : plan.runs) {
        const auto record = found.find(run.key);
        if (record != found.end()) {
            merged.records += record->second.line + "\n";
        } else {
            merged.missing.push_back(fmt::format("shard {}/{}: {}", run.shard, plan.shard.count, run.name));
        }
    }
    return merged;
}

}  // namespace trocar
