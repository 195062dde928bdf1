// Inputs of a study that are other groups' data sets, with answers that nobody here computed.
#include <algorithm>
#include <string>

#include "geometry/fnv_hash.hpp"
#include "geometry/whole_file.hpp"
#include "simulate/external_runs.hpp"
#include "simulate/hard_case.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

constexpr std::string_view external_prefix = "external:";

/// "external:FORMAT:PATH", with the path below the data folder.
struct ExternalInput {
    std::string format;
    std::filesystem::path path;
};

ExternalInput external_input(const RunSpec& spec) {
    const std::string text = spec.scene_file.substr(external_prefix.size());
    const std::size_t colon = text.find(':');
    return {text.substr(0, colon), text.substr(colon + 1)};
}

bool is_timed_format(const std::string& format) { return format == "scalable_ccd" || format == "fcl_scenario"; }

/// Over the bytes of the file, or of all files of the folder in the order of their names.
std::string hash_of_files(const std::filesystem::path& input) {
    std::vector<std::filesystem::path> files{input};
    if (std::filesystem::is_directory(input)) {
        files.clear();
        for (const auto& entry : std::filesystem::recursive_directory_iterator(input)) {
            if (entry.is_regular_file()) files.push_back(entry.path());
        }
        std::sort(files.begin(), files.end());
    }
    FnvHash hash;
    for (const std::filesystem::path& file : files) hash.add_text(read_whole(file, "a readable file"));
    return hash.text();
}

}  // namespace

std::string external_file(const std::string& format, const std::string& path) {
    return std::string(external_prefix) + format + ":" + path;
}

std::string external_name(const std::string& path) {
    const std::filesystem::path below(path);
    const std::filesystem::path stem = below.stem();
    // Files of queries are called alike in every folder.
    if (below.extension() != ".csv") return stem.string();
    return (below.parent_path().parent_path().filename() / below.parent_path().filename() / stem).generic_string();
}

bool is_external(const RunSpec& spec) { return spec.scene_file.starts_with(external_prefix); }

SceneFacts external_facts(const RunSpec& spec, const std::optional<std::filesystem::path>& data) {
    const ExternalInput input = external_input(spec);
    SceneFacts facts;
    facts.name = external_name(input.path.generic_string());
    facts.ticks = is_timed_format(input.format) ? external_rounds : 1;
    facts.lacks_data = !data || !std::filesystem::exists(*data / input.path);
    if (!facts.lacks_data) facts.hash = hash_of_files(*data / input.path);
    return facts;
}

std::vector<Record> make_external_runs(const std::vector<RunSpec>& specs,
                                       const std::optional<std::filesystem::path>& data,
                                       const std::function<void(std::size_t)>& turn) {
    const ExternalInput input = external_input(specs.front());
    const std::filesystem::path path = data.value_or("") / input.path;
    if (input.format == "scalable_ccd") return run_external(read_scalable_ccd(path), specs, turn);
    if (input.format == "fcl_scenario") return run_external(read_fcl_scenario(path), specs, turn);
    std::vector<Record> records;
    records.reserve(specs.size());
    for (const RunSpec& spec : specs) {
        if (turn) turn(records.size());
        records.push_back(input.format == "ccd_queries" ? run_ccd_queries(path, spec) : run_pair_family(path, spec));
    }
    return records;
}

}  // namespace trocar
