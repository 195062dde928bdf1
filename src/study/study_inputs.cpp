// All kinds of input of a study: scenes, hard cases, generated scenes, and other groups' data sets with answers that
// nobody here computed. RunSpec::scene_file names the kind.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/fnv_hash.hpp"
#include "geometry/whole_file.hpp"
#include "simulate/external_runs.hpp"
#include "simulate/generated_scene.hpp"
#include "simulate/hard_case.hpp"
#include "simulate/interleaved.hpp"
#include "simulate/runs.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

using DataFolder = std::optional<std::filesystem::path>;

constexpr std::string_view data_prefix = "data:";
constexpr std::string_view external_prefix = "external:";
constexpr std::string_view generated_prefix = "generated:";

std::string generated_text(const RunSpec& spec) { return spec.scene_file.substr(generated_prefix.size()); }

SceneFacts generated_facts(const RunSpec& spec) {
    const GeneratedSceneFacts generated = generated_scene_facts(generated_text(spec));
    FnvHash hash;
    hash.add_text(generated.text);
    constexpr std::int64_t usual_ticks = 160;
    return {.name = generated.name,
            .hash = hash.text(),
            .pair_class = generated.pair_class,
            .ticks = usual_ticks,
            .dt = GeneratedScene::dt,
            .triangles = generated.triangles};
}

std::vector<Record> make_generated_runs(const std::vector<RunSpec>& specs,
                                        const std::function<void(std::size_t)>& turn) {
    const std::unique_ptr<GeneratedScene> scene =
        make_generated_scene(generated_text(specs.front()), specs.front().seed);
    std::vector<InterleavedRun> runs;
    runs.reserve(specs.size());
    for (const RunSpec& spec : specs) runs.push_back(interleaved_run(spec));
    std::vector<Record> records = run_interleaved(*scene, runs, turn);
    const GeneratedSceneFacts facts = generated_scene_facts(generated_text(specs.front()));
    for (Record& record : records) {
        record.environment["run.dt_s"] = fmt::format("{}", GeneratedScene::dt);
        record.environment["scene.family"] = facts.family;
        record.environment["scene.triangles"] = fmt::format("{}", scene->topology().triangle_count());
    }
    return records;
}

/// A family of triangle pairs, "data:PATH"; nothing for a case with meshes of its own.
std::optional<std::filesystem::path> family_file(const RunSpec& spec, const DataFolder& data) {
    if (!spec.scene_file.starts_with(data_prefix)) return std::nullopt;
    return data.value_or("") / spec.scene_file.substr(data_prefix.size());
}

SceneFacts case_facts(const std::filesystem::path& folder, const RunSpec& spec, const DataFolder& data) {
    SceneFacts facts;
    facts.name = spec.scene;
    facts.ticks = 1;
    if (const auto family = family_file(spec, data)) {
        facts.lacks_data = !data || !std::filesystem::is_regular_file(*family);
    } else {
        facts.hash = hash_of(read_hard_case(folder / spec.scene_file));
    }
    return facts;
}

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

SceneFacts external_facts(const RunSpec& spec, const DataFolder& data) {
    const ExternalInput input = external_input(spec);
    SceneFacts facts;
    facts.name = external_name(input.path.generic_string());
    facts.ticks = is_timed_format(input.format) ? external_rounds : 1;
    facts.lacks_data = !data || !std::filesystem::exists(*data / input.path);
    if (!facts.lacks_data) facts.hash = hash_of_files(*data / input.path);
    return facts;
}

std::vector<Record> make_external_runs(const std::vector<RunSpec>& specs, const DataFolder& data,
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

}  // namespace

bool is_mesh_case(const RunSpec& spec) { return spec.mode == "hard_case" && spec.response.empty(); }

bool is_generated(const RunSpec& spec) { return spec.scene_file.starts_with(generated_prefix); }

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

SceneFacts read_scene_facts(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data) {
    SceneFacts facts;
    facts.name = file.stem().string();
    if (lacks_data(file, data)) {
        facts.lacks_data = true;
        return facts;
    }
    return facts_of(read_scene(file, data));
}

SceneFacts input_facts(const std::filesystem::path& folder, const RunSpec& spec, const DataFolder& data) {
    if (is_generated(spec)) return generated_facts(spec);
    if (is_external(spec)) return external_facts(spec, data);
    if (is_mesh_case(spec)) return case_facts(folder, spec, data);
    return read_scene_facts(folder / spec.scene_file, data);
}

std::vector<Record> make_runs(const std::filesystem::path& folder, const std::vector<PlannedRun*>& runs,
                              const DataFolder& data, const std::function<void(std::size_t)>& turn) {
    PlannedRun& first = *runs.front();
    if (first.group.empty() && !is_mesh_case(first.spec)) {
        const Scene scene = read_scene(folder / first.spec.scene_file, data);
        complete_run(facts_of(scene), first);
        return {make_run(scene, first.spec)};
    }
    std::vector<RunSpec> specs;
    for (PlannedRun* run : runs) {
        complete_run(input_facts(folder, run->spec, data), *run);
        specs.push_back(run->spec);
    }
    if (is_external(first.spec)) return make_external_runs(specs, data, turn);
    if (is_generated(first.spec)) return make_generated_runs(specs, turn);
    if (const auto family = family_file(first.spec, data)) return {run_pair_family(*family, first.spec)};
    return {run_hard_case(read_hard_case(folder / first.spec.scene_file), first.spec)};
}

}  // namespace trocar
