// shard.json of a folder that is merged.
#include "study/shard.hpp"

#include "fuzz_target.hpp"

void trocar::fuzz::shard(std::string_view input) {
    taken([&] {
        const std::filesystem::path file = as_file(input, shard_name);
        const MergedShards merged = merge_shards({file.parent_path()});
        expect(merged.records.empty() && static_cast<std::int64_t>(merged.missing.size()) == merged.runs,
               "without records every run is missing");
    });
}
